"""The search with shapes of every kind: against the narrow phase asked about every pair, and against small steps."""

import numpy as np
import pytest

from flyball.collision.contact_finder import ContactFinder, no_movers
from flyball.collision.narrow_phase.primitives import SCRATCH_ROWS
from flyball.collision.shape_kinds import BOX, CAPSULE, CONE, CYLINDER, ELLIPSOID, FIELD, PLANE, SPHERE
from flyball.collision.tables import Dimensions, Geometry, Shapes
from tests.contact.crowds import identities_hold, pairs_of
from tests.contact.scenes import meet, turned

MARGIN, STEP = 2e-3, 5e-3


def crowd(rng, n, kinds, side, ground=True):
    """Shapes of these kinds, slender ones among them, of mixed sizes, at random poses on movers of their own."""
    m = n + 2 * ground
    shape, dimensions = Shapes.blank(m), Dimensions.blank(m)
    shape.member[:], shape.mask[:], shape.mover[:n] = 1, -1, np.arange(n)
    dimensions.axes[:, [0, 4, 8]] = 1.0
    for i in range(n):
        kind, par = rng.choice(kinds), 0.25 * 10.0 ** -rng.random(3)
        if kind == CONE:
            par[1] *= 2.0
        shape.kind[i], dimensions.par[i, :3], dimensions.radius[i] = kind, par, 2.0 * np.linalg.norm(par)
        dimensions.place[i] = rng.uniform(-0.1, 0.1, 3)
        dimensions.axes[i] = turned(rng.standard_normal(3), rng.uniform(0, 3)).ravel()
        if kind == SPHERE:
            dimensions.radius[i] = par[0]
    if ground:  # a plane on the slope and a box, which stand still
        shape.kind[n:], shape.mover[n:] = (PLANE, BOX), -1
        tilt = turned([1, 0.2, 0], 0.3)
        dimensions.axes[n:] = tilt.ravel()
        dimensions.radius[n], dimensions[n, 2] = np.inf, -0.2 * side
        dimensions.par[n + 1, :3], dimensions.radius[n + 1] = (side, 0.2 * side, 0.03), 1.1 * side
    G = Geometry(shape, dimensions, np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros((0, 2), np.int64))
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
    still = G.shape.mover[:] < 0
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
        for k, (row, x) in enumerate(zip(C.at[: C.count.found].tolist(), C.x)):
            rows = want[tuple(row[:2])]
            assert any(np.allclose(x[:7], r[:7], rtol=0, atol=1e-14) and row[2] == r[7] for r in rows), k
        assert C.count.found == sum(map(len, want.values()))
        move(M, STEP)
    assert len(want) > 40


def test_corners_of_a_box_that_slides_and_turns_stay_the_same_contacts():
    shape, dimensions = Shapes.blank(2), Dimensions.blank(2)
    shape.member[:], shape.mask[:], shape.kind[:], shape.mover[:] = 1, -1, (BOX, BOX), (0, -1)
    dimensions.axes[:, [0, 4, 8]] = 1.0
    dimensions.par[0, :3], dimensions.par[1, :3] = 0.1, (2.0, 2.0, 0.5)
    dimensions.radius[:] = np.linalg.norm(dimensions.par[:, :3], axis=1)
    F = ContactFinder(Geometry(shape, dimensions, np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros((0, 2), np.int64)))
    M = no_movers(1)
    M.pose[0, 2] = 0.6 - 1e-4
    M.twist[0] = 0.8, 0, 0, 0, 0, 2.0
    corner = {}
    for k in range(60):
        C = F.find(M)
        assert C.count.found == 4
        assert identities_hold(C, F.before)
        R = M.pose[0, 3:].reshape(3, 3)
        own = (C.x[:4, :3] - M.pose[0, :3]) @ R
        for c in range(4):
            if k:
                before = C.at.before[c]
                assert before >= 0
                assert own[c] == pytest.approx(corner[before], abs=1e-9)
        corner = dict(enumerate(own))
        move(M, STEP)


@pytest.mark.parametrize("kind", [BOX, CAPSULE, SPHERE])
def test_fast_small_bodies_meet_a_thin_plate_or_fly_past_it(kind):
    """Bullets at 100 to 600 m/s past a plate of 10 cm, 4 mm thick, that turns itself: held against 400 parts of a step."""
    rng = np.random.default_rng(17)
    G, M = crowd(rng, 2, [BOX], 0.1, ground=False)
    G.dimensions.place[:], G.dimensions.axes = 0.0, np.eye(3).ravel()
    G.dimensions.par[0, :3], G.dimensions.par[1, :3] = (0.05, 0.05, 0.002), (0.01, 0.006, 0.004)
    G.shape.kind[1] = kind
    G.dimensions.radius[:] = 0.0708, 0.0170 if kind != SPHERE else 0.01
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
        found, kept = C.count.found, M.pose.copy()
        gaps = []
        for _ in range(401):
            gaps.append(room[: meet(G, M, 0, 1, np.inf, room), 6].min())
            move(M, STEP / 400)
        M.pose[:] = kept
        if min(gaps) < 0.0:
            hits += 1
            assert found, gaps[0]
            assert C.x.gap[:found].min() > -1e-3
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
        G.dimensions.axes[i], G.dimensions.radius[i], G.dimensions.par[i, :4] = (
            np.eye(3).ravel(),
            np.inf,
            0.0,
        )
        G.shape.kind[i] = PLANE
    G.dimensions.place[n + 1] = 0, 0, -50.0
    G.shape.kind[n], G.dimensions.place[n] = FIELD, (-1.1, -0.9, -0.2)
    G.dimensions.par[n, :4] = 12, 10, 0.2, 0.2
    G = G._replace(vertex=heights.reshape(-1, 3))
    M.twist[:] = rng.standard_normal((n, 6))
    F, touching = ContactFinder(G, margin=MARGIN), 0
    for _ in range(8):
        C = F.find(M)
        want = by_all_pairs(G, M, MARGIN)
        assert set(pairs_of(C)) == set(want)
        assert C.count.found == sum(map(len, want.values()))
        touching += sum(n in pair for pair in want)
        move(M, 4 * STEP)
    assert touching > 20
    M.pose[:, 2] += 10.0
    F.find(M)
    assert F.search.count.pairs < 1.5 * n  # pairs of shapes among themselves only
    assert not any(n in pair for pair in pairs_of(F.now))
