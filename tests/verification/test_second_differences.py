"""Every mechanism's constraints: G v - nu and G vdot - gamma are the first and second time derivatives of g.

By central differences along an arbitrary motion, off the constraints and moving, drivers running, in absolute and in
joint coordinates. That is the whole way from the formulas of the rows to the numbers that the solve sees.
"""

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.engine.kinematics import coordinate_rates, retract
from tests.mechanisms import bricard, example, four_bar, spatial_four_bar
from tests.verification.test_linkages import hooke
from tests.verification.test_moving_bases import gyroscope, shaken_pendulum, turntable
from tests.verification.test_reactions import actuated, cantilever


def arm(turned_round=False):
    """A chain of hinges with a slide and rods to ground at its end, all driven, every axis askew.

    Turned round, the slide and one rod have the chain's last link as their ``body_j`` instead of ``body_i``.
    """
    m = fb.Mechanism("arm", gravity=(0, 0, -9.81))
    points = np.array([[0, 0, 0], [0.5, 0.1, 0.2], [1, -0.3, 0.1], [1.2, 0.2, 0.7]])
    axes = [(0, 0, 1), (1, 2, 0), (0.3, -1, 0.5)]
    before = "ground"
    for i in range(3):
        turn = (0.1 * i, -0.3, 0.2)
        m.add(fb.Body(f"link {i}", mass=1 + i, inertia=(0.1, 0.2, 0.25), position=points[i], com=(0.1, 0, -0.05),
                      orientation=turn))  # fmt: skip
        m.add(fb.Revolute(f"J{i}", before, f"link {i}", at=points[i], axis=axes[i]))
        before = f"link {i}"
    m.add(fb.Body("slider", mass=1, inertia=(0.1, 0.1, 0.15), position=(1.3, 0.3, 0.8)))
    ends = ("slider", "link 2") if turned_round else ("link 2", "slider")
    m.add(fb.Prismatic("slide", *ends, at=points[3], axis=(1, 1, -1)))
    m.add(fb.Distance("rod", "ground", "slider", at=((2, 0, 0), (1.4, 0.4, 0.8))))
    between = (tuple(points[3]), (0.3, -1.0, 1.0))
    ends, between = (("ground", "link 2"), between[::-1]) if turned_round else (("link 2", "ground"), between)
    m.add(fb.Distance("stay", *ends, at=between))
    m.add(fb.Frame("tip", "slider", position=(0.1, 0.05, -0.02)))
    m.add(fb.Driver("wave", "J1.angle", "0.3*sin(4*t)"), fb.Driver("lift", "tip.z", "0.8 + 0.1*t**3"))
    m.add(fb.Driver("push", "slide.displacement", "0.1*exp(-t)"))
    return m


CASES = {
    "actuated": (actuated, ()),
    "actuated, waist a coordinate": (actuated, ("waist",)),
    "arm": (arm, ()),
    "arm, all hinges coordinates": (arm, ("J0", "J1", "J2")),
    "arm, middle hinge a row": (arm, ("J0", "J2")),
    "arm turned round, all hinges coordinates": (lambda: arm(turned_round=True), ("J0", "J1", "J2")),
    "bricard, all but one coordinates": (bricard, ("R1", "R2", "R3", "R4", "R5")),
    "cantilever": (cantilever, ()),
    "four-bar": (four_bar, ()),
    "four-bar, two coordinates": (four_bar, ("A", "B")),
    "governor": (lambda: example("governor.toml"), ("bearing", "left hinge", "right hinge")),
    "gyroscope": (gyroscope, ()),
    "gyroscope, one a coordinate": (gyroscope, ("bearing",)),
    "Hooke's joint": (lambda: hooke(0.6), ()),
    "Hooke's joint, shafts coordinates": (lambda: hooke(0.6), ("A", "B")),
    "shaken pendulum": (lambda: shaken_pendulum("point"), ()),
    "shaken pendulum, pivot a coordinate": (lambda: shaken_pendulum("joint"), ("pivot",)),
    "slider-crank": (lambda: example("slider_crank.toml"), ()),
    "spatial four-bar": (lambda: spatial_four_bar(driven=True), ("A", "D")),
    "turntable": (lambda: turntable("2*sin(3*t)"), ()),
    "turntable, a coordinate": (lambda: turntable("2*sin(3*t)", planar=False), ("bearing",)),
}


def carried_on(S, q, v, vdot, s, pieces=4):
    """Coordinates and velocities after a time s with v growing at vdot (Runge and Kutta, order 4)."""
    h = s / pieces
    q = q.copy()
    k = np.zeros((4, len(q)))
    for i in range(pieces):
        at = i * h
        coordinate_rates(S, q, v + at * vdot, k[0])
        coordinate_rates(S, q + h / 2 * k[0], v + (at + h / 2) * vdot, k[1])
        coordinate_rates(S, q + h / 2 * k[1], v + (at + h / 2) * vdot, k[2])
        coordinate_rates(S, q + h * k[2], v + (at + h) * vdot, k[3])
        q += h / 6 * (k[0] + 2 * k[1] + 2 * k[2] + k[3])
    return q, v + s * vdot


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("seed", range(2))
def test_derivatives_of_the_constraints(name, seed):
    make, tree = CASES[name]
    c = compile_mechanism(make(), tree=tree)
    S, s, W = c.values.system, c.structure, c.work
    random = np.random.default_rng(seed)
    q, t, h = c.values.q.copy(), 0.3, 1e-4
    retract(S, q, 0.2 * random.normal(size=s.nv))
    v, vdot = random.normal(size=(2, s.nv))
    values, speeds = [], []
    for step in (-h, h):
        c.at(t + step, *carried_on(S, q, v, vdot, step))
        values.append(W.rows.value.copy())
        speeds.append(c.jacobian() @ (v + step * vdot) - W.rows.nu)
    c.at(t, q, v)
    assert np.abs(W.rows.value).max() > 1e-2, "off the constraints"
    first = c.jacobian() @ v - W.rows.nu
    second = c.jacobian() @ vdot - W.rows.gamma
    for row, what in enumerate(s.rows):
        title = (what.element.title, what.label)
        assert (values[1] - values[0])[row] / (2 * h) == pytest.approx(first[row], rel=1e-6, abs=1e-6), title
        assert (speeds[1] - speeds[0])[row] / (2 * h) == pytest.approx(second[row], rel=1e-6, abs=1e-5), title
