"""Impulses of an event by element: their sum is the change of every body's momentum, and each is its closed form."""

import numpy as np
import pytest

import flyball as fb
from flyball.results.reactions import EventImpulses, sum_impulses
from tests.layers import both_layers

ROUND = {"looks": True, "contact": True}


def sliding_box():
    """3 m/s along a floor, onto which it falls with 2 m/s; two corners hit."""
    m = fb.Mechanism("box", planar=True)
    box = fb.Box(edges=(0.4, 0.2, 0.1), **ROUND)
    m.add(fb.Body("b", mass=1.5, inertia=0.03, position=(0, 0.1), velocity=(3, -2), shape=box))
    m.add(fb.Ground("f", shape=fb.Plane(normal=(0, 1))), fb.Contact(friction=0.3))
    return m


def tumbling_box():
    """It falls on one corner, turning, in space."""
    m = fb.Mechanism("box", gravity=None)
    box = fb.Box(edges=(0.4, 0.2, 0.1), **ROUND)
    about = {"velocity": (1, 0.5, -2), "angular_velocity": (1, -2, 0.5), "orientation": (0.3, 0.2, 0.5)}
    m.add(fb.Body("b", mass=1.5, inertia=(0.01, 0.02, 0.03), position=(0, 0, 0.3), shape=box, **about))
    m.add(fb.Ground("f", shape=fb.Plane()), fb.Contact(friction=0.3, restitution=0.5))
    return m


def driven_piston():
    """A piston that a driver moves with 2 m/s hits a ball of 1.2 kg, which leaves twice as fast: 4.8 N s."""
    m = fb.Mechanism("piston", planar=True, gravity=None)
    m.add(fb.Body("piston", mass=3, inertia=0.1, shape=fb.Sphere(radius=0.1, **ROUND)))
    m.add(fb.Body("ball", mass=1.2, inertia=0.01, position=(0.3, 0), shape=fb.Sphere(radius=0.1, **ROUND)))
    m.add(fb.Prismatic("P", "ground", "piston", at=(0, 0), axis=(1, 0)), fb.Driver("D", "P.displacement", "2*t"))
    m.add(fb.Contact(friction=0, restitution=1.0))
    return m


def geared():
    """A wheel stops dead at a limit, and with it the one that it meshes with: through the mesh."""
    m = fb.Mechanism("gears", planar=True, gravity=None)
    m.add(fb.Body("one", mass=1, inertia=0.2, position=(0, 0), angular_velocity=3))
    m.add(fb.Body("two", mass=1, inertia=0.8, position=(3, 0)))
    m.add(fb.Revolute("A", "ground", "one", at=(0, 0)), fb.Revolute("B", "ground", "two", at=(3, 0)))
    m.add(fb.GearPair("mesh", "A", "B", teeth=(20, 40)), fb.Limit("stop", "A.angle", upper=0.3))
    return m


def racked():
    """A blow on the rack, and the pinion's arm carries a body on a locked hinge."""
    m = fb.Mechanism("rack", planar=True, gravity=None)
    m.add(fb.Body("rack", mass=2, inertia=0.1), fb.Body("pinion", mass=1, inertia=0.05, position=(0, 0.2)))
    m.add(fb.Body("arm", mass=0.5, inertia=0.02, position=(0.3, 0.5), angular_velocity=1.0))
    m.add(
        fb.Prismatic("P", "ground", "rack", at=(0, 0), axis=(1, 0)), fb.Revolute("A", "ground", "pinion", at=(0, 0.2))
    )
    m.add(fb.Revolute("H", "pinion", "arm", at=(0.1, 0.3)), fb.RackAndPinion("mesh", "P", "A", radius=0.2))
    m.add(fb.Event("blow", "t - 0.1", do=[fb.Impulse("rack", (2, 1), at=(0.1, 0.1)), fb.Lock("H")]))
    return m


def following():
    """A driver whose law follows the other hinge: it acts on both."""
    m = fb.Mechanism("following", planar=True, gravity=None)
    m.add(fb.Body("one", mass=1, inertia=0.2, position=(0.5, 0)), fb.Body("two", mass=2, inertia=0.8, position=(3, 1)))
    m.add(fb.Revolute("A", "ground", "one", at=(0, 0)), fb.Revolute("B", "ground", "two", at=(3, 0)))
    m.add(fb.Sensor("a", "A.angle"), fb.Driver("D", "B.angle", "0.5*a"))
    m.add(fb.Event("blow", "t - 0.1", do=[fb.Impulse("one", (0, 2))]))
    return m


def rough():
    """A slide with friction hits its end, and a rope goes taut."""
    m = fb.Mechanism("rough", planar=True, gravity=(0, -9.81))
    m.add(
        fb.Body("cart", mass=2, inertia=0.1, velocity=(2, 0)), fb.Body("load", mass=1, inertia=0.05, position=(0, -1))
    )
    m.add(fb.Translational("P", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Revolute("H", "cart", "load", at=(0, 0)), fb.JointFriction("f", "P", static=0.2))
    m.add(fb.Limit("end", "P.displacement", upper=0.2, restitution=0.3))
    m.add(fb.Rope("rope", ("ground", "load"), at=((0, -0.5), (0, -1)), length=0.6))
    return m


def chained():
    """In space: a screw, a universal joint and a ball joint, struck in body axes while a coordinate is locked."""
    m = fb.Mechanism("chain", gravity=None)
    for k, x in enumerate((0.2, 0.7, 1.2)):
        about = {"angular_velocity": (0, 0, 0.4)} if k == 2 else {}
        m.add(fb.Body(f"b{k}", mass=1 + k, inertia=(0.02, 0.05, 0.04), position=(x, 0.1 * k, 0.05), **about))
    m.add(fb.Screw("S", "ground", "b0", at=(0, 0, 0), axis=(1, 0, 0), lead=0.1))
    m.add(fb.Universal("U", "b0", "b1", at=(0.45, 0, 0), axes=((0, 1, 0), (0, 0, 1))))
    m.add(fb.Spherical("B", "b2", "b1", at=(0.95, 0.1, 0.1)))
    blow = fb.Impulse("b2", (1, 2, 3), at=(1.3, 0.2, 0.1), torque=(0.3, 0, 1), axes="body")
    m.add(fb.Event("blow", "t - 0.1", do=[blow, fb.Impulse("U.angle_1", 0.1), fb.Lock("U.angle_2")]))
    return m


def clutched():
    """A clutch brings a wheel up to speed, and play behind it closes with a blow."""
    m = fb.Mechanism("clutched", planar=True, gravity=None)
    for k, x in enumerate("ABC"):
        m.add(fb.Body(f"w{k}", mass=1, inertia=0.1 + 0.1 * k, position=(k, 0), angular_velocity=4.0 * (k == 0)))
        m.add(fb.Revolute(x, "ground", f"w{k}", at=(k, 0)))
    m.add(fb.Clutch("clutch", "A.angle", "B.angle", capacity=5.0))
    m.add(fb.Backlash("play", ("B.angle", "C.angle"), gap=0.2, restitution=0.2))
    return m


def heavier():
    """Mass comes at the very instant of the blow."""
    m = fb.Mechanism("heavier", planar=True, gravity=None, parameters={"m": 1.0})
    m.add(fb.Body("a", mass="m", inertia="m/12", position=(0.5, 0), angular_velocity=2, velocity=(0, 1)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)))
    m.add(fb.Event("blow", "t - 0.1", do=[fb.Set("m", 3), fb.Impulse("a", (0, 1))]))
    return m


def parting():
    """A weld that held since the start was let go, and a body is struck."""
    m = fb.Mechanism("parting", planar=True, gravity=None)
    m.add(fb.Body("a", mass=1, inertia=0.1), fb.Body("b", mass=2, inertia=0.2, position=(1, 0)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0.5)), fb.Fixed("W", "a", "b", at=(0.5, 0)))
    m.add(fb.Event("blow", "t - 0.1", do=[fb.Impulse("b", (1, 2))]))
    m.add(fb.Event("later", "t - 0.2", do=[fb.Release("W")]))
    return m


MADE = [sliding_box, tumbling_box, driven_piston, geared, racked, following, rough, chained, clutched, heavier, parting]


def momentum(moment, body, tables):
    """Of a body, about its centre of mass, world axes, (6,)."""
    S, b = tables.system, tables.structure.place[body]
    _, R, w, v, _, _ = (
        np.array([float(np.ravel(x)[0]) for x in part]) for part in moment.single_time_result.records.body(b)
    )
    R = R.reshape(3, 3)
    return np.r_[S.bodies.mass[b] * v, R @ S.bodies.inertia[b].reshape(3, 3) @ R.T @ w]


@both_layers
@pytest.mark.parametrize("make", MADE)
def test_impulses_are_the_change_of_momentum(make, tmp_path):
    """Of every body, linear and angular, at every event; from a file too."""
    m = make()
    run = m.simulate(0.5, outputs=3, method="dop853", rtol=1e-10)
    run.save(tmp_path / "run.nc")
    jumps = 0
    for r in (run, fb.load_result(tmp_path / "run.nc")):
        for h in r.events:
            if h.kind not in ("impact", "event") or not h.impulses:
                continue
            for body in (x.name for x in m.bodies):
                before, after = (momentum(x, body, h.after.values) for x in (h.before, h.after))
                on = h.impulses.on(body)
                assert set(on) <= set(h.impulses)
                np.testing.assert_allclose(sum(on.values(), np.zeros(6)), after - before, rtol=1e-8, atol=1e-9)
                jumps += bool(np.abs(after - before).max() > 1e-3)
    assert jumps > 1


@both_layers
def test_both_corners_of_a_sliding_box():
    """N = m v / 2 -+ mu m v h / (2 w), and 0.3 of each against the sliding."""
    (hit,) = sliding_box().simulate(0.01).events[:1]
    left, right = (hit.impulses[f"f-b-{k}"] for k in (1, 2))
    assert (left["normal"], right["normal"]) == pytest.approx((1.275, 1.725))
    for x in (left, right):
        known = {"friction": 0.3 * x["normal"], "fx": -0.3 * x["normal"], "fy": x["normal"]}
        assert x == pytest.approx({"normal": x["normal"]} | known)
    table = run_table(sliding_box())
    assert table["impulse f-b-2 normal"].iloc[0] == pytest.approx(1.725)
    assert table["impulse f-b-2 fx"].iloc[0] == pytest.approx(-0.5175)


def run_table(m):
    pytest.importorskip("pandas")
    return m.simulate(0.01).events.to_dataframe()


def test_jumps_that_follow_one_another_are_one():
    """Of elements, of rows and of what was given."""
    blows = [("along", 0, 1.0, "blow")], [("along", 1, 4.0, "other")]
    first = EventImpulses({"stop": 1.0}, np.array([1.0, 2.0]), blows[0])
    second = EventImpulses({"stop": 0.5, "rope": 2.0}, np.array([0.5, -1.0]), blows[1])
    both = sum_impulses([first, second]).as_plain_data()
    assert both == {"own": {"stop": 1.5, "rope": 2.0}, "rows": [1.5, 1.0], "blows": (*blows[0], *blows[1])}


@both_layers
def test_a_driver_that_hits():
    """2 m v of the ball: to the ball, and from the driver."""
    (hit, *_) = driven_piston().simulate(0.5).events.of("impact")
    assert hit.impulses["D"] == pytest.approx(4.8)
    assert hit.impulses["piston-ball"]["normal"] == pytest.approx(4.8)
    assert hit.impulses["piston-ball"]["fx"] == pytest.approx(4.8)
    np.testing.assert_allclose(hit.impulses["P"], 0.0, atol=1e-12)
    np.testing.assert_allclose(hit.impulses.on("piston")["D"], (4.8, 0, 0, 0, 0, 0), atol=1e-12)


@both_layers
def test_a_mesh_that_stops_a_wheel():
    """The second turns with -1.5 rad/s and 0.8 kg m^2: 1.2 N m s on it, 0.6 on the first, and 0.6 of its own."""
    (hit, *_) = geared().simulate(0.5).events.of("impact")
    assert hit.impulses["mesh"] == pytest.approx({"A.angle": 0.6, "B.angle": 1.2})
    assert hit.impulses["stop"] == pytest.approx(-1.2)
