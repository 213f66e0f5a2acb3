"""The search with shapes of every kind: against the narrow phase asked about every pair, and against small steps."""

import numpy as np
import pytest

from flyball.collision.broad_phase.workspace import PAIRS_IN_LIST
from flyball.collision.contact_finder import ContactFinder, no_movers
from flyball.collision.narrow_phase.primitives import SCRATCH_ROWS
from flyball.collision.shape_kinds import BOX, CAPSULE, CONE, CYLINDER, ELLIPSOID, FIELD, PLANE, SPHERE
from flyball.collision.tables import AXES, BEFORE, FOUND, GAP, KIND, MASK, MEMBER, MOVER, PAR, RADIUS, Geometry
from tests.contact.crowds import identities_hold, pairs_of
from tests.contact.scenes import meet, turned

MARGIN, STEP = 2e-3, 5e-3


def crowd(rng, n, kinds, side, ground=True):
    """Shapes of these kinds, slender ones among them, of mixed sizes, at random poses on movers of their own."""
    m = n + 2 * ground
    shape_i, shape_x = np.zeros((m, 9), np.int64), np.zeros((m, 24))
    shape_i[:, MEMBER], shape_i[:, MASK], shape_i[:n, MOVER] = 1, -1, np.arange(n)
    shape_x[:, [AXES, AXES + 4, AXES + 8]] = 1.0
    for i in range(n):
        kind, par = rng.choice(kinds), 0.25 * 10.0 ** -rng.random(3)
        if kind == CONE:
            par[1] *= 2.0
        shape_i[i, KIND], shape_x[i, PAR : PAR + 3], shape_x[i, RADIUS] = kind, par, 2.0 * np.linalg.norm(par)
        shape_x[i, :3] = rng.uniform(-0.1, 0.1, 3)
        shape_x[i, AXES : AXES + 9] = turned(rng.standard_normal(3), rng.uniform(0, 3)).ravel()
        if kind == SPHERE:
            shape_x[i, RADIUS] = par[0]
    if ground:  # a plane on the slope and a box, which stand still
        shape_i[n:, KIND], shape_i[n:, MOVER] = (PLANE, BOX), -1
        tilt = turned([1, 0.2, 0], 0.3)
        shape_x[n:, AXES : AXES + 9] = tilt.ravel()
        shape_x[n, RADIUS], shape_x[n, 2] = np.inf, -0.2 * side
        shape_x[n + 1, PAR : PAR + 3], shape_x[n + 1, RADIUS] = (side, 0.2 * side, 0.03), 1.1 * side
    G = Geometry(shape_i, shape_x, np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros((0, 2), np.int64))
    M = no_movers(n)
    M.pose[:, :3] = rng.uniform(-0.5, 0.5, (n, 3)) * side
    for i in range(n):
        M.pose[i, 3:] = turned(rng.standard_normal(3), rng.uniform(0, 3)).ravel()
    return G, M


def move(M, h):
    """All movers go on at their velocities for a time."""
    M.pose[:, :3] += h * M.twist[:, :3]
    for i in range(len(M.pose)):
        w = M.twist[i, 3:]
        speed = np.linalg.norm(w)
        if speed > 0:
            M.pose[i, 3:] = (turned(w, h * speed) @ M.pose[i, 3:].reshape(3, 3)).ravel()


def by_all_pairs(G, M, reach):
    """{pair: contacts of the narrow phase}."""
    room, out = np.zeros((SCRATCH_ROWS, 8)), {}
    still = G.shape_i[:, MOVER] < 0
    for i in range(len(still)):
        for j in range(i + 1, len(still)):
            if not (still[i] and still[j]):
                count = meet(G, M, i, j, reach, room)
                if count and (room[:count, 6] < reach).any():
                    out[i, j] = room[:count][room[:count, 6] < reach].copy()
    return out


@pytest.mark.parametrize("speed", [0.1, 3.0])
def test_contacts_are_those_of_the_narrow_phase_for_all_pairs(speed):
    kinds = [SPHERE, BOX, CAPSULE, CYLINDER, CONE, ELLIPSOID]
    rng = np.random.default_rng(11)
    G, M = crowd(rng, 60, kinds, 1.6)
    M.twist[:] = speed * rng.standard_normal((60, 6))
    M.twist[:, 2] -= 2.0
    F = ContactFinder(G, margin=MARGIN)
    for _ in range(12):
        C = F.find(M)
        want = by_all_pairs(G, M, MARGIN)
        assert set(pairs_of(C)) == set(want)
        for k, (row, x) in enumerate(zip(C.at[: C.count[FOUND]].tolist(), C.x)):
            rows = want[tuple(row[:2])]
            assert any(np.allclose(x[:7], r[:7], rtol=0, atol=1e-14) and row[2] == r[7] for r in rows), k
        assert C.count[FOUND] == sum(map(len, want.values()))
        move(M, STEP)
    assert len(want) > 40


def test_corners_of_a_box_that_slides_and_turns_stay_the_same_contacts():
    shape_i, shape_x = np.zeros((2, 9), np.int64), np.zeros((2, 24))
    shape_i[:, MEMBER], shape_i[:, MASK], shape_i[:, KIND], shape_i[:, MOVER] = 1, -1, (BOX, BOX), (0, -1)
    shape_x[:, [AXES, AXES + 4, AXES + 8]] = 1.0
    shape_x[0, PAR : PAR + 3], shape_x[1, PAR : PAR + 3] = 0.1, (2.0, 2.0, 0.5)
    shape_x[:, RADIUS] = np.linalg.norm(shape_x[:, PAR : PAR + 3], axis=1)
    F = ContactFinder(Geometry(shape_i, shape_x, np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros((0, 2), np.int64)))
    M = no_movers(1)
    M.pose[0, 2] = 0.6 - 1e-4
    M.twist[0] = 0.8, 0, 0, 0, 0, 2.0
    corner = {}
    for k in range(60):
        C = F.find(M)
        assert C.count[FOUND] == 4
        assert identities_hold(C, F.before)
        R = M.pose[0, 3:].reshape(3, 3)
        own = (C.x[:4, :3] - M.pose[0, :3]) @ R
        for c in range(4):
            if k:
                before = C.at[c, BEFORE]
                assert before >= 0
                assert own[c] == pytest.approx(corner[before], abs=1e-9)
        corner = dict(enumerate(own))
        move(M, STEP)


@pytest.mark.parametrize("kind", [BOX, CAPSULE, SPHERE])
def test_fast_small_bodies_meet_a_thin_plate_or_fly_past_it(kind):
    """Bullets at 100 to 600 m/s past a plate of 10 cm, 4 mm thick, that turns itself: held against 400 parts of a step."""
    rng = np.random.default_rng(17)
    G, M = crowd(rng, 2, [BOX], 0.1, ground=False)
    G.shape_x[:, :3], G.shape_x[:, AXES : AXES + 9] = 0.0, np.eye(3).ravel()
    G.shape_x[0, PAR : PAR + 3], G.shape_x[1, PAR : PAR + 3] = (0.05, 0.05, 0.002), (0.01, 0.006, 0.004)
    G.shape_i[1, KIND] = kind
    G.shape_x[:, RADIUS] = 0.0708, 0.0170 if kind != SPHERE else 0.01
    room, hits, misses = np.zeros((SCRATCH_ROWS, 8)), 0, 0
    for _ in range(60):
        way = rng.standard_normal(3)
        way /= np.linalg.norm(way)
        speed, where = rng.uniform(100, 600), rng.uniform(0.05, 1.0)
        M.pose[0, :3], M.pose[1, :3] = 0.0, rng.uniform(-0.06, 0.06, 3) - where * speed * STEP * way
        for k in (0, 1):
            M.pose[k, 3:] = turned(rng.standard_normal(3), rng.uniform(0, 3)).ravel()
        M.twist[0, 3:], M.twist[1, :3], M.twist[1, 3:] = rng.standard_normal(3), speed * way, rng.standard_normal(3)
        C = ContactFinder(G, margin=MARGIN, ahead=STEP).find(M)
        found, kept = C.count[FOUND], M.pose.copy()
        gaps = []
        for _ in range(401):
            gaps.append(room[: meet(G, M, 0, 1, np.inf, room), 6].min())
            move(M, STEP / 400)
        M.pose[:] = kept
        if min(gaps) < 0.0:
            hits += 1
            assert found, gaps[0]
            assert C.x[:found, GAP].min() > -1e-3
        elif min(gaps) > MARGIN + 0.01 * 0.0125 + 0.0015 * speed * STEP / 4:
            misses += 1
            assert not found
    assert hits > 10
    assert misses > 10


def test_shapes_over_a_height_field_are_asked_about_only_below_its_top():
    rng = np.random.default_rng(19)
    n = 40
    G, M = crowd(rng, n, [SPHERE, BOX, CAPSULE], 2.0)
    heights = 0.1 * rng.random((12, 10))
    for i in (n, n + 1):  # the plane and the box that stand still become one field and a plane far below
        G.shape_x[i, AXES : AXES + 9], G.shape_x[i, RADIUS], G.shape_x[i, PAR : PAR + 4] = (
            np.eye(3).ravel(),
            np.inf,
            0.0,
        )
        G.shape_i[i, KIND] = PLANE
    G.shape_x[n + 1, :3] = 0, 0, -50.0
    G.shape_i[n, KIND], G.shape_x[n, :3] = FIELD, (-1.1, -0.9, -0.2)
    G.shape_x[n, PAR : PAR + 4] = 12, 10, 0.2, 0.2
    G = G._replace(vertex=heights.reshape(-1, 3))
    M.twist[:] = rng.standard_normal((n, 6))
    F, touching = ContactFinder(G, margin=MARGIN), 0
    for _ in range(8):
        C = F.find(M)
        want = by_all_pairs(G, M, MARGIN)
        assert set(pairs_of(C)) == set(want)
        assert C.count[FOUND] == sum(map(len, want.values()))
        touching += sum(n in pair for pair in want)
        move(M, 4 * STEP)
    assert touching > 20
    M.pose[:, 2] += 10.0
    F.find(M)
    assert F.search.count[PAIRS_IN_LIST] < 1.5 * n  # pairs of shapes among themselves only
    assert not any(n in pair for pair in pairs_of(F.now))
