"""Singular positions of linkages: closed forms, independent formulations, and what is refused."""

import math

import numpy as np
import pytest

import flyball as fb
from tests.mechanisms import bricard, circles, example, planar_rod


def four_bar(ground, crank, coupler, rocker, psi, parallel=False):
    """A four-bar on the x axis; its motor drives the crank's angle psi."""
    A, D = np.zeros(2), np.array([ground, 0.0])
    B = crank * np.array([math.cos(psi), math.sin(psi)])
    C = B + D if parallel else circles(B, coupler, D, rocker)
    m = fb.Mechanism("four-bar", planar=True, gravity=(0, 0))
    m.add(planar_rod("crank", A, B), planar_rod("coupler", B, C), planar_rod("rocker", D, C))
    m.add(fb.Revolute("A", "ground", "crank", at=A), fb.Revolute("B", "crank", "coupler", at=B))
    m.add(fb.Revolute("C", "coupler", "rocker", at=C), fb.Revolute("D", "ground", "rocker", at=D))
    m.add(fb.Driver("motor", "crank.angle", psi))
    return m


def kinds(result):
    return [p.kind for p in result]


def test_limits_of_a_double_rocker():
    """The crank stops where coupler and rocker are in line: law of cosines with their sum and their difference."""
    g, a, b, c = 1.0, 1.2, 0.5, 1.0
    r = four_bar(g, a, b, c, 0.9).singularities("motor", (-4.0, 4.0))
    limits = [math.acos((a * a + g * g - e * e) / (2 * a * g)) for e in (b + c, c - b)]
    assert sorted(p.a for p in r) == pytest.approx(sorted(limits), abs=1e-12)
    assert kinds(r) == ["lock-up", "lock-up"]
    assert r.ends == ("closed", "closed")
    assert r.reached == pytest.approx(tuple(sorted(limits)), abs=1e-12)
    upper = max(r, key=lambda p: p.a)
    assert [b.side for b in upper.branches] == [-1]
    assert upper.count(rate=1.0) == upper.count(acceleration=1.0) == 0
    assert upper.count(acceleration=-1.0) == 2
    assert upper.null_vectors[0]["crank.angle"] == pytest.approx(0.0, abs=1e-12)
    # coupler and rocker in line: with the crank held C moves at right angles to them
    assert b * upper.null_vectors[0]["coupler.angle"] == pytest.approx(-c * upper.null_vectors[0]["rocker.angle"])


def test_velocities_at_a_dead_point_are_those_nearby():
    """s'^2 a2 = a'': from rest at the limit the rocker's rate is that of positions near the limit, by their energy.

    Near a fold psi(a) = psi0 +- k sqrt(a0 - a), so that with a'' = -1 from rest psi' = +- k / sqrt(2).
    """
    m = four_bar(1.0, 1.2, 0.5, 1.0, 0.9)
    r = m.singularities("motor", (-4.0, 4.0))
    top = max(r, key=lambda p: p.a)
    rates = sorted(x.velocities["rocker.angle"] for x in top.motions)
    psi0 = top.coordinates["rocker.angle"]
    near = np.abs(r.a - top.a) < 2e-3
    near &= np.abs(r.a - top.a) > 1e-6
    k = np.median(np.abs(r.values["rocker.angle"][near] - psi0) / np.sqrt(top.a - r.a[near]))
    assert rates == pytest.approx([-k / math.sqrt(2), k / math.sqrt(2)], rel=0.02)


def test_parallelogram_branches_at_both_dead_points():
    """At 0 and pi rocker and crank turn alike (parallelogram) or by tan(phi/2) = -(g + a)/(g - a) tan(psi/2)."""
    g, a = 1.0, 0.4
    m = four_bar(g, a, g, a, 0.5, parallel=True)
    r = m.singularities("motor", ("0 deg", "360 deg"))
    assert [p.a for p in r] == pytest.approx([0.0, math.pi, 2 * math.pi], abs=1e-11)
    assert kinds(r) == ["bifurcation"] * 3
    assert all(p.branch_point and p.lost == 1 and p.decided for p in r)
    ratio = -(g + a) / (g - a)
    for p, anti in zip(r, (ratio, 1 / ratio, ratio), strict=True):
        assert p.count(rate=1.0) == p.count(acceleration=1.0) == p.count(acceleration=-1.0) == 2
        assert sorted(b.tangent["rocker.angle"] for b in p.branches) == pytest.approx(sorted([1.0, anti]), rel=1e-10)
    assert np.abs(r.values["coupler.angle"]).max() < 1e-10  # it is the parallelogram that is followed

    other = next(b for b in r[0].branches if b.tangent["rocker.angle"] < 0.0)
    anti = m.singularities("motor", (0.0, 3.0), branch=other)
    inside = anti.a > 0.1
    phi = anti.values["rocker.angle"][inside]
    assert np.tan(phi / 2) == pytest.approx(ratio * np.tan(anti.a[inside] / 2), rel=1e-8)


def test_start_in_a_branch_point():
    """Drawn flat, a number says which branch to follow."""
    m = four_bar(1.0, 0.4, 1.0, 0.4, 0.0, parallel=True)
    ways = [m.singularities("motor", (0.0, 1.0), branch=k) for k in (0, 1)]
    for k, r in enumerate(ways):
        assert kinds(r) == ["bifurcation"]
        slope = r.values["rocker.angle"][-1] - r.values["rocker.angle"][0]
        assert np.sign(slope) == np.sign(r[0].branches[k].tangent["rocker.angle"])
    with pytest.raises(fb.ModelError, match="2 branches, none of number 2"):
        m.singularities("motor", (0.0, 1.0), branch=2)


def test_an_isolated_position_locks():
    """A four-bar as long as its other three bars together cannot move at all."""
    r = four_bar(1.5, 0.5, 0.5, 0.5, 0.0).singularities("motor", (-1.0, 1.0))
    assert kinds(r) == ["lock-up"]
    assert r[0].isolated
    assert not r[0].branches
    assert not r[0].motions


def test_no_singular_position():
    """A crank-rocker's crank turns."""
    r = four_bar(0.5, 0.2, 0.5, 0.4, 1.0).singularities("motor", ("0 deg", "360 deg"))
    assert len(r) == 0
    assert r.reached == pytest.approx((0.0, 2 * math.pi), abs=1e-10)
    assert r.distance.min() > 0.05
    assert ("singular positions", "none") in r.lines()


@pytest.mark.parametrize("gap", [1e-2, 1e-4])
def test_near_misses_are_no_branch_points(gap):
    """A slider-crank whose rod is a little shorter than the crank: two lock-ups close together, no bifurcation."""
    li, lj = 1.0, 1.0 - gap
    m = fb.Mechanism("slider-crank", planar=True)
    psi = 0.3
    psi_j = -math.asin(li / lj * math.sin(psi))
    B, x = np.array([math.cos(psi), math.sin(psi)]), math.cos(psi) + lj * math.cos(psi_j)
    m.add(planar_rod("crank", (0, 0), B), planar_rod("rod", B, (x, 0)))
    m.add(fb.Body("slider", mass=1, inertia=1, position=(x, 0)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "rod", at=B))
    m.add(fb.Revolute("C", "rod", "slider", at=(x, 0)))
    m.add(fb.Translational("D", "ground", "slider", at=(x, 0), axis=(1, 0)), fb.Driver("drive", "crank.angle", psi))
    r = m.singularities("drive", (-3.0, 3.0))
    assert kinds(r) == ["lock-up", "lock-up"]
    assert sorted(p.a for p in r) == pytest.approx([-math.asin(lj), math.asin(lj)], abs=1e-9)


def test_redundant_rows_are_no_singularity():
    """Bricard's mechanism: 30 rows of rank 29 everywhere; its hinge R1 turns back at one angle only."""
    m = bricard()
    m.add(fb.Driver("motor", "R1.angle", 0.0))
    r = m.singularities("motor", (-3.2, 3.2))
    assert kinds(r) == ["lock-up"]
    assert r[0].lost == 1
    assert not r[0].branch_point


def test_flat_peaucellier():
    """The cell is flat where OP is long - short; A and B may then coincide, and Q is free to turn about them."""
    m = example("peaucellier.toml")
    r = m.singularities("motor", (-2.0, 2.0))
    flat = 2 * math.acos((0.5 - 0.2) / (2 * 0.2))
    assert sorted(p.a for p in r) == pytest.approx([-flat, flat], abs=1e-7)
    assert [p.lost for p in r] == [3, 3]
    top = max(r, key=lambda p: p.a)
    assert top.count(rate=1.0) == top.count(acceleration=1.0) == 0
    assert top.count(acceleration=-1.0) == math.inf
    assert np.ptp(r.values["QA.x"]) > 0.0


def test_windows_of_rhombi():
    """Two windows of equal bars, flat: each window goes on as a parallelogram, or its posts turn alone."""
    m = example("n_four_bar.py", windows=2)
    m.initial.clear()
    m.add(fb.Driver("motor", "A0.angle", 0.0))
    r = m.singularities("motor", ("-120 deg", "120 deg"))
    assert [p.a for p in r] == pytest.approx([-math.pi / 2, math.pi / 2], abs=1e-9)
    assert [p.lost for p in r] == [2, 2]
    # left open by second order, such directions are found to 1e-5
    posts = [sorted(tuple(round(b.tangent[f"A{k}.angle"], 5) for k in range(3)) for b in p.branches) for p in r]
    assert posts == [[(0, 0, 1), (0, 1, 1), (1, 1, 1)], [(1, 0, 0), (1, 1, 0), (1, 1, 1)]]
    assert kinds(r) == ["regular passage", "bifurcation"]


def test_stewart_platform_against_its_legs_lines():
    """Where one leg locks up the six legs' lines are dependent: their Pluecker coordinates have no determinant."""
    m = example("stewart.py")
    r = m.singularities("cylinder 1", (-0.8, 1.5))
    assert len(r) == 5
    points = {}
    for p in r:
        for body, joint, at in p.outline:
            if body == "platform" or (body == "ground" and joint.startswith("foot")):
                points[joint] = at
        d = np.array([points[f"ball {k}"] - points[f"foot {k}"] for k in range(1, 7)])
        d /= np.linalg.norm(d, axis=1)[:, None]
        lines = np.hstack([d, np.cross([points[f"foot {k}"] for k in range(1, 7)], d)])
        assert np.linalg.svd(lines, compute_uv=False)[-1] < 1e-9
        assert p.kind == "lock-up"


def test_other_drivers_stay():
    """A driver that moves with time stands still while another one is varied."""
    m = fb.Mechanism("two arms", planar=True)
    m.add(planar_rod("one", (0, 0), (1, 0)), planar_rod("two", (1, 0), (2, 0)))
    m.add(fb.Revolute("A", "ground", "one", at=(0, 0)), fb.Revolute("B", "one", "two", at=(1, 0)))
    m.add(fb.Driver("first", "A.angle", "0.5*t"), fb.Driver("second", "B.angle", "2*t"))
    r = m.singularities("first", (0.0, 3.0), t=0.25)
    assert r.a[0] == pytest.approx(0.0, abs=1e-9)
    assert r.values["B.angle"] == pytest.approx(0.5, abs=1e-12)
    assert len(r) == 0


def test_what_is_refused():
    m = four_bar(1.0, 1.2, 0.5, 1.0, 0.9)
    with pytest.raises(fb.ModelError, match=r"no driver 'moter' \(did you mean 'motor'\?\); known: motor"):
        m.singularities("moter", (0, 1))
    with pytest.raises(fb.ModelError, match="give two values"):
        m.singularities("motor", (0,))
    with pytest.raises(fb.ModelError, match="is no range"):
        m.singularities("motor", (1, 1))
    with pytest.raises(fb.ModelError, match=r"range of Driver 'motor'.*expected"):
        m.singularities("motor", ("0 mm", "5 mm"))
    with pytest.raises(fb.ModelError, match="does not start in a singular position"):
        m.singularities("motor", (0, 1), branch=1)
    limit = math.acos((1.44 + 1 - 2.25) / 2.4)
    with pytest.raises(fb.SingularityError, match=r"it locks up at 1\.49") as e:
        m.singularities("motor", (2.0, 4.0))
    assert e.value.where == pytest.approx(limit, abs=1e-9)
    assert {"B", "C", "D"} <= set(e.value.elements)


def test_freedoms_that_are_left_or_missing():
    m = four_bar(1.0, 0.5, 0.8, 0.9, 0.5)
    m.add(fb.Body("pendulum", mass=1, inertia=1, position=(0, -1)), fb.Revolute("P", "ground", "pendulum", at=(0, 0)))
    with pytest.raises(fb.MobilityError, match=r"1 freedom left besides driver 'motor'.*pendulum can still move") as e:
        m.singularities("motor", (0, 1))
    assert e.value.free == ("P.angle",)
    m = four_bar(1.0, 0.5, 0.8, 0.9, 0.5)
    m.add(fb.Driver("second", "rocker.angle", float(m["rocker"].angle)))
    with pytest.raises(fb.MobilityError, match="no freedom is left; the other drivers") as e:
        m.singularities("motor", (0, 1))
    assert e.value.redundant == ("second",)


def test_rolling_is_refused():
    m = example("chaplygin_sleigh.toml")
    m.initial.clear()
    m.add(fb.Driver("push", f"{m.bodies[0].name}.x", "t"))
    with pytest.raises(fb.ModelError, match="constrain velocities only"):
        m.singularities("push", (0, 1))


def test_turns_are_counted_on():
    """A crank that turns all the way comes to any angle; a parallelogram is flat twice in every turn."""
    m = fb.Mechanism("parallelogram", planar=True)
    at = {"left": (0.0, 0.0), "right": (2.0, 0.0)}
    for name, foot in at.items():
        m.add(fb.Body(name, mass=1, inertia=0.1, position=(foot[0], 0.5)))
        m.add(fb.Revolute(f"{name} foot", "ground", name, at=foot))
    m.add(fb.Body("bar", mass=1, inertia=0.1, position=(1, 1)))
    m.add(fb.Revolute("B", "left", "bar", at=(0, 1)), fb.Revolute("C", "right", "bar", at=(2, 1)))
    m.add(fb.Driver("motor", "left foot.angle", "t"))
    found = m.singularities("motor", ("600 deg", "1000 deg"))
    flat = np.degrees([p.a for p in found])
    assert sorted(flat) == pytest.approx([630, 810, 990], abs=1e-4)
