"""Every row and measured quantity on bodies in joint coordinates: their frames have bias accelerations there.

A body hangs on two hinges in a row, which are coordinates in one layer and rows in the other; the joint in question,
or a force or coupling, ties it to a second body. Both layers must give the same accelerations.
"""

import numpy as np
import pytest

import flyball as fb
from flyball import joints as room
from flyball.assembly.assemble import assemble
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.engine.entry_point import MOTION
from flyball.results.motion_record import RecordedMotion
from tests.contract.zoo import CASES, declared, two_bodies

HINGES = ["H0", "H1"]


def hung(where):
    """The zoo's two bodies, the first at the end of two hinges, all in motion."""
    m = two_bodies(where)
    plane = where == "plane"
    start, elbow = ((-0.5, 0.2, 0.1), (-0.1, -0.3, 0.2))
    if plane:
        m.add(fb.Body("arm", mass=0.8, inertia=0.05, position=(-0.3, 0.0), com=(0.02, 0.04), angular_velocity=-2.0))
        m.add(fb.Revolute("H0", "ground", "arm", at=start[:2]), fb.Revolute("H1", "arm", "a", at=elbow[:2]))
    else:
        m.add(
            fb.Body(
                "arm",
                mass=0.8,
                inertia=(0.03, 0.05, 0.06),
                position=(-0.3, 0, 0.1),
                com=(0.02, 0.04, -0.03),
                orientation=(0.5, 0.1, -0.3),
                angular_velocity=(1.0, -2.0, 0.7),
            )
        )
        m.add(fb.Revolute("H0", "ground", "arm", at=start, axis=(1, -1, 2)))
        m.add(fb.Revolute("H1", "arm", "a", at=elbow, axis=(0.3, 2, 1)))
    return m


def with_joint(where, name):
    m = hung(where)
    m.add(getattr(room, name)("J", "a", "b", **declared(where, name)))
    return m


def coupled(*parts):
    """With a third hinge from the end of the chain to the second body, and couplings or forces."""
    m = hung("space")
    m.add(
        fb.Cylindrical("J", "a", "b", at=(0.4, 0.1, 0.5), axis=(1, 2, -2)),
        fb.Frame("tip", "b", position=(0.1, 0.2, -0.1)),
    )
    m.add(*parts)
    return m


def sensed():
    return [
        fb.Sensor(k, of)
        for k, of in (("s", "H1.angle"), ("y", "tip.y"), ("v", "tip.vy"), ("w", "a.omega_x"), ("d", "J.angle_rate"))
    ]


PARTS = {
    "coupler": lambda: [
        fb.Coupler("k", coordinates=("H0.angle", "H1.angle", "J.displacement", "tip.x"), weights=(1, 2, 3, 4))
    ],
    "constraint": lambda: [fb.Constraint("c", "sin(H0.angle)*J.displacement - tip.x**2 + 0.1*cos(2*t)")],
    "gears": lambda: [fb.GearPair("g", joint_1="H1", joint_2="J", teeth=(3, 2))],
    "rack": lambda: [fb.RackAndPinion("r", rack="J", pinion="H0", radius=0.2)],
    "driver by sensors": lambda: [
        *sensed(),
        fb.Driver("d1", "J.displacement", "0.2*sin(s)*y + 0.1*sin(3*t + 1) + 0.3"),
    ],
    "spring along a coordinate": lambda: [
        fb.CoordinateSpring("f", coordinate="tip.z", stiffness=70.0, damping=3.0),
        fb.CoordinateSpring("h", coordinate="H1.angle", stiffness=5.0, damping=0.5, rest=0.3),
    ],
    "rope": lambda: [
        fb.Rope(
            "f",
            bodies=("arm", "ground", "b"),
            at=((0.1, 0.2, 0), (0, 1, 0), (0.5, 0.2, 0.1)),
            stiffness=90.0,
            length=0.9,
        )
    ],
    "bushing": lambda: [
        fb.Bushing(
            "f", "arm", "b", at=(0.2, 0.1, 0.3), stiffness=(50, 90, 70), torsional_stiffness=(3, 5, 4), damping=2.0
        )
    ],
    "laws of sensors": lambda: [
        *sensed(),
        fb.PointForce("f", "tip", force=("3*y*w", "-2*v", "s*d")),
        fb.Actuator("h", coordinate="J.displacement", force="v*y - 2*w"),
    ],
}


def both_layers(model):
    """Body -> its record in absolute and in joint coordinates, at the same state."""
    a = assemble(model)
    tree = compile_mechanism(model, tree=HINGES)
    Q, V = tree.take(a.compiled, 0.0, a.q, a.v)
    bodies = {}
    for c, q, v in ((a.compiled, a.q, a.v), (tree, Q, V)):
        status, dy = c.at(0.2, q, v)
        status, dy = c.at(0.2, q, v, MOTION)
        assert status == 0
        s = c.structure
        r = RecordedMotion(c.values, q[None], v[None], dy[None, s.nq : s.nq + s.nv])
        for name, b in s.place.items():
            if b >= 0:
                bodies.setdefault(name, []).append([np.ravel(part) for part in r.body(b)])
    assert tree.structure.nv < a.compiled.structure.nv
    return bodies


def agree(model):
    bodies = both_layers(model)
    largest = max(np.abs(one[5]).max() for one, _ in bodies.values())
    for name, (one, two) in bodies.items():
        for part, (x, y) in enumerate(zip(one, two, strict=True)):
            scale = largest if part >= 4 else 1.0
            assert y == pytest.approx(x, abs=1e-9 * scale), f"{name}, part {part} of its record"


@pytest.mark.parametrize(("where", "name"), CASES, ids=lambda x: x)
def test_every_joint(where, name):
    agree(with_joint(where, name))


@pytest.mark.parametrize("case", PARTS)
def test_couplings_and_forces(case):
    agree(coupled(*PARTS[case]()))
