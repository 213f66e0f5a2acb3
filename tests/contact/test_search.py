"""The search for contacts: no pair missed and none too many, against all pairs one by one."""

import numpy as np
import pytest

from flyball.collision.contact_finder import ContactFinder, no_contacts
from flyball.collision.contact_matching import matching_contact
from flyball.errors import ModelError
from tests.contact.crowds import gaps_of, geometry, identities_hold, moving, on_planes, pairs_of, spheres_that_touch

MARGIN, STEP = 2e-3, 5e-3
BOX = (
    ((0, 0, 0), (0, 0, 1)),
    ((1, 0, 0), (-1, 0, 0.1)),
    ((-1, 0, 0), (1, 0, 0)),
    ((0, 1, 0), (0, -1, 0)),
    ((0, -1, 0), (0, 1, 0)),
)


def crowd(rng, n, ratio, speed):
    """Spheres of mixed sizes (logarithmically) in a box of 2 m, as dense as spheres that are strewn."""
    r = 0.2 * ratio ** -rng.random(n)
    x = rng.uniform(-1, 1, (n, 3)) + [0, 0, 1]
    return r, x, speed * rng.standard_normal((n, 3))


@pytest.mark.parametrize("ratio", [1.0, 30.0, 1000.0])
@pytest.mark.parametrize("speed", [0.02, 2.0, 60.0])
def test_the_contacts_are_those_of_all_pairs_step_by_step(ratio, speed):
    rng = np.random.default_rng(int(ratio + speed))
    r, x, v = crowd(rng, 150, ratio, speed)
    r *= 0.5
    G = geometry(r, planes=BOX)
    F = ContactFinder(G, margin=MARGIN, ahead=STEP)
    for k in range(60):
        C = F.find(moving(x, v))
        want = spheres_that_touch(x, v, r, MARGIN, STEP) | on_planes(G, x, v, r, MARGIN, STEP)
        found = pairs_of(C)
        assert len(found) == len(set(found))
        assert set(found) == want
        assert identities_hold(C, F.before)
        x = x + STEP * v
        v = v - [0, 0, 0.01 * speed]
        if k % 10 == 9:
            v[rng.integers(150, size=20)] *= -1.0


def test_gap_normal_and_point_of_spheres_and_planes():
    G = geometry([0.5, 0.25], planes=[((0, 0, 0), (0, 0, 1))])
    C = ContactFinder(G, margin=0.01).find(moving([[0.3, 0, 0.49], [0.3, 0.6, 0.49 + 0.45]]))
    rows = {pair: C.x[k] for k, pair in enumerate(pairs_of(C))}
    assert set(rows) == {(0, 1), (0, 2)}
    assert rows[0, 1].gap == pytest.approx(0.75 - 0.75, abs=1e-15)
    assert rows[0, 1].normal == pytest.approx([0, 0.8, 0.6])
    assert rows[0, 1].point == pytest.approx([0.3, 0.4, 0.49 + 0.3])
    assert rows[0, 2].gap == pytest.approx(-0.01)
    assert rows[0, 2].normal == pytest.approx([0, 0, -1])  # from the sphere to the plane
    assert rows[0, 2].point == pytest.approx([0.3, 0, -0.005])


def test_spheres_at_one_place_have_a_normal():
    C = ContactFinder(geometry([0.5, 0.5])).find(moving(np.zeros((2, 3))))
    assert C.x[0, :7] == pytest.approx([0, 0, 0, 1, 0, 0, -1.0])


def test_a_bullet_meets_what_is_in_its_way_and_nothing_else():
    """1000 m/s through a lattice of spheres: 5 m a step, and one sphere of radius 1 cm in its way."""
    grid = np.stack(np.meshgrid(*[np.arange(-5, 5)] * 3, indexing="ij"), -1).reshape(-1, 3) * 0.5
    x = np.concatenate([[[-10.0, 0.25, 0.25]], grid, [[1.0, 0.25 + 0.01, 0.25]]])
    r = np.concatenate([[0.01], np.full(1000, 0.2), [0.01]])
    v = np.zeros_like(x)
    v[0, 0] = 1000.0
    F = ContactFinder(geometry(r), margin=MARGIN, ahead=STEP)
    met = []
    for _ in range(4):
        C = F.find(moving(x, v))
        met += [gaps_of(C)]
        x = x + STEP * v
    assert [set(m) for m in met] == [set(), set(), {(0, 1001)}, set()]
    # it moves 1 m - 2 r along x to where they meet, off the line of centres by half a radius sum: sin 30
    assert met[2][0, 1001] == pytest.approx(1.0 * np.sqrt(0.75) + 0.01 * 0.5 - 0.02, rel=1e-12)


def test_what_meets_nothing_is_left_out():
    """Spheres all in one place: of one mover, of movers held apart, of groups that do not meet."""
    x = np.zeros((6, 3))
    movers = [0, 0, 1, 2, 3, 4]
    member = [1, 1, 1, 1, 2, 4]
    mask = [1 + 2, 1 + 2, 1 + 2, 1 + 2, 1, 1 + 2]  # the last meets those that do not meet it
    G = geometry(np.full(6, 0.1), movers=movers, apart=[(0, 1), (2, 0)], member=member, mask=mask)
    C = ContactFinder(G).find(moving(x[:5]))
    assert sorted(pairs_of(C)) == [(0, 4), (1, 4), (2, 3), (2, 4), (3, 4)]


def test_many_groups_are_the_same_as_few():
    """More combinations of groups than there are classes of shapes."""
    rng = np.random.default_rng(1)
    n = 200
    member, mask = 1 << rng.integers(0, 20, n), rng.integers(0, 1 << 20, n)
    r, x, _ = crowd(rng, n, 5.0, 0.0)
    G = geometry(r, member=member, mask=mask)
    want = {(i, j) for i, j in spheres_that_touch(x, 0 * x, r, 0.0, 0.0) if member[i] & mask[j] and member[j] & mask[i]}
    assert set(pairs_of(ContactFinder(G).find(moving(x)))) == want
    assert len(want) > 10


def test_shapes_that_stand_still_do_not_meet_and_planes_may_move():
    movers = [-1, -1, 0]
    places = [[0, 0, 0], [0.1, 0, 0], [0, 0, 0]]
    G = geometry([0.2, 0.2, 0.2], movers=movers, places=places, planes=[((0, 0, 0), (0, 0, 1))])
    G.shape[3, 1] = 1  # on a mover
    F = ContactFinder(G)
    for height, want in ((-2.0, []), (-0.1, [(0, 3), (1, 3)]), (1.0, [(0, 3), (1, 3), (2, 3)])):
        C = F.find(moving([[0.3, 0, 0.5], [0, 0, height]]))
        assert sorted(p for p in pairs_of(C) if p[1] == 3) == want
    assert (0, 1) not in pairs_of(C)


def test_what_falls_together_is_looked_at_as_if_at_rest():
    """A pile that falls and one bullet through it: neither makes all pairs be looked for again, nor lists more."""
    rng = np.random.default_rng(3)
    r, x, _ = crowd(rng, 400, 3.0, 0.0)
    n = len(r)
    rest, fall = (ContactFinder(geometry(r), margin=MARGIN, ahead=STEP) for _ in range(2))
    rest.find(moving(x))
    v, listed = np.zeros((n, 3)), []
    v[:, 2] = -8.0
    x, last = x.copy(), 0
    for k in range(200):
        M = moving(x, v)
        M.twist[0, :3] += [40.0, 0, 0]
        C = fall.find(M)
        listed.append(C.count.pairs)
        v[:, 2] -= 9.81 * STEP
        x = x + STEP * v
        x[0, 0] += STEP * 40.0
        if k == 20:
            last = fall.search.count.rebuilds
    assert fall.search.count.rebuilds == last <= 2
    assert max(listed[1:]) < 1.2 * rest.now.count.pairs + 100
    assert x[1, 2] < -11.0


def test_contacts_stay_themselves_while_pairs_are_looked_for_anew():
    rng = np.random.default_rng(5)
    r, x, _ = crowd(rng, 300, 4.0, 0.0)
    F = ContactFinder(geometry(r, planes=BOX), margin=MARGIN, ahead=STEP)
    first = F.find(moving(x))
    names = first.at[: first.count.found, :3].copy()
    again = F.find(moving(x), rebuild=True)
    assert again.count.found == len(names)
    assert np.array_equal(names[again.at[: len(names), 3]], again.at[: len(names), :3])
    # one goes to the other side and back: only its own are new
    one = np.bincount(names[:, :2].ravel())[:300].argmax()
    y = x.copy()
    y[one] += [0, 0, 9.0]
    F.find(moving(y))
    C = F.find(moving(x))
    new = C.at[: C.count.found][C.at[: C.count.found, 3] < 0]
    assert len(new) == (names[:, :2] == one).any(1).sum() > 3
    assert np.all((new[:, :2] == one).any(1))


def test_the_same_every_time():
    rng = np.random.default_rng(8)
    r, x, v = crowd(rng, 200, 10.0, 1.0)
    one, other = (ContactFinder(geometry(r, planes=BOX), margin=MARGIN, ahead=STEP) for _ in range(2))
    for k in range(20):
        M = moving(x + k * STEP * v, v)
        a, b = one.find(M), other.find(M)
        n = a.count.found
        assert np.array_equal(a.at[:n], b.at[:n]) and np.array_equal(a.x[:n], b.x[:n])


@pytest.mark.parametrize("ratio", [1.0, 1000.0])
def test_work_is_linear(ratio):
    """Envelopes compared when all pairs are looked for, and pairs looked at in a step, for each sphere."""
    each = []
    for n in (1000, 8000):
        rng = np.random.default_rng(n)
        r = 0.2 * ratio ** -rng.random(n)
        side = (4 * (r**3).sum() / 0.3) ** (1 / 3)  # a third of the space filled
        F = ContactFinder(geometry(r), margin=1e-4)
        C = F.find(moving(rng.uniform(0, side, (n, 3))))
        each.append((F.search.count.pairs_compared / n, F.search.count.pairs_examined / n, C.count.found / n))
    assert each[1] == pytest.approx(each[0], rel=0.3)
    assert each[1][0] < 300


def test_a_flat_crowd_and_one_far_away_cost_no_more():
    rng = np.random.default_rng(2)
    n = 1500
    x = np.zeros((n, 3))
    x[:, :2] = rng.uniform(0, 11, (n, 2))
    x[0] = [1e9, -1e7, 3e8]
    F = ContactFinder(geometry(np.full(n, 0.1)))
    C = F.find(moving(x))
    assert F.search.count.pairs_compared < 10 * n
    assert C.count.found == len(spheres_that_touch(x, 0 * x, np.full(n, 0.1), 0.0, 0.0))


def test_one_that_moves_is_looked_for_alone():
    rng = np.random.default_rng(4)
    r, x, _ = crowd(rng, 500, 2.0, 0.0)
    F = ContactFinder(geometry(r), margin=MARGIN, ahead=STEP)
    F.find(moving(x))
    made = F.search.count.envelopes_renewed
    v = np.zeros_like(x)
    v[3] = [0, 3.0, 0]
    for _ in range(20):
        x = x + STEP * v
        C = F.find(moving(x, v))
        assert set(pairs_of(C)) == spheres_that_touch(x, v, r, MARGIN, STEP)
    assert F.search.count.rebuilds == 1
    assert F.search.count.envelopes_renewed - made <= 20


def test_a_pose_that_is_no_number_is_named():
    F = ContactFinder(geometry([0.1, 0.1, 0.1]))
    x = np.zeros((3, 3))
    x[1, 2] = np.nan
    with pytest.raises(ModelError, match="mover 1 has a position, orientation or velocity that is not a finite number"):
        F.find(moving(x))
    with pytest.raises(ModelError, match="mover 2"):
        F.find(moving(np.zeros((3, 3)), [[0, 0, 0], [0, 0, 0], [np.inf, 0, 0]]))


def test_too_many_in_one_place_are_refused():
    n = 60_000
    F = ContactFinder(geometry(np.full(n, 0.1)))
    with pytest.raises(ModelError, match=r"too many shapes are close together: .* shape \d+ alone; move bodies"):
        F.find(moving(np.zeros((n, 3))))


def test_what_asks_for_more_room_goes_on_as_if_it_had_it():
    """A thin crowd that shrinks: contacts and pairs outgrow their tables and stay themselves."""
    rng = np.random.default_rng(6)
    n = 400
    x = rng.uniform(-1, 1, (n, 3))
    F = ContactFinder(geometry(np.full(n, 0.05)), margin=MARGIN)
    for size in np.linspace(4.0, 0.22, 30):
        C = F.find(moving(size * x))
        assert set(pairs_of(C)) == spheres_that_touch(size * x, 0 * x, np.full(n, 0.05), MARGIN, 0.0)
        assert identities_hold(C, F.before)
    assert C.count.found > 4 * n + 64


def test_crowds_of_none_of_one_and_of_points():
    none = ContactFinder(geometry([])).find(moving(np.zeros((0, 3))))
    assert none.count.found == 0
    ground = ContactFinder(geometry([], planes=BOX)).find(moving(np.zeros((2, 3))))
    assert ground.count.found == 0
    one = ContactFinder(geometry([0.5], planes=BOX), margin=1e-9).find(moving([[0, 0, 0.5]]))
    assert pairs_of(one) == [(0, 1)]
    rng = np.random.default_rng(0)
    x = rng.integers(0, 8, (400, 3)) * 0.25
    points = ContactFinder(geometry(np.zeros(400)), margin=1e-6).find(moving(x))
    assert set(pairs_of(points)) == spheres_that_touch(x, 0 * x, np.zeros(400), 1e-6, 0.0)


def test_a_contact_without_a_namesake_is_the_nearest_one():
    O = no_contacts(8)
    O.count.found = 5
    O.at[:5, :3] = [[0, 1, 7], [2, 3, 5], [2, 3, 6], [2, 3, 8], [2, 4, 5]]
    O.x[1:4, 0] = 0.0, 1.0, 1.1
    assert matching_contact(O, (2, 3), 1, 8, (0.0, 0, 0), 1.0, 0) == (3, 4)  # by its name, wherever it is
    assert matching_contact(O, (2, 3), 1, 9, (1.02, 0, 0), 1.0, 0) == (2, 2)  # the nearest
    assert matching_contact(O, (2, 3), 1, 9, (1.02, 0, 0), 1.0, 2) == (3, 4)  # of those that are left
    assert matching_contact(O, (2, 3), 1, 9, (0.5, 0, 0), 1.0, 0) == (-1, 0)  # if it is near
    assert matching_contact(O, (2, 3), -1, 8, (0.0, 0, 0), 1.0, 0) == (-1, 0)
