"""Order of the integrators on a mechanism with a loop whose motion and reactions are known exactly.

A parallelogram of three equal uniform rods hangs and swings: with the angle phi of its posts from the vertical,
phi'' = -(6/5) (g/l) sin phi, a pendulum (Jacobi). It is closed by four hinges, nine velocities for one freedom. The
tolerance is varied and the error held against the number of steps taken: of a method of order p it falls as n^-p.
"""

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

import flyball as fb
from tests.layers import both_layers, cached
from tests.mechanisms import G

pytestmark = both_layers

START = 1.2  # rad from the vertical; the singular position is at pi/2
END = 1.7  # s; not a multiple of the quarter period, 0.5 s
W2 = 1.2 * G


def parallelogram():
    c, s = np.cos(START), np.sin(START)
    m = fb.Mechanism("parallelogram", planar=True, gravity=(0, -G))
    posts = {"left": 0.0, "right": 1.0}
    for name, x in posts.items():
        m.add(fb.Body(name, mass=1, inertia=1 / 12, position=(x + s / 2, -c / 2), angle=START - np.pi / 2))
    m.add(fb.Body("bar", mass=1, inertia=1 / 12, position=(0.5 + s, -c)))
    m.add(fb.Revolute("A", "ground", "left", at=(0, 0)), fb.Revolute("B", "left", "bar", at=(s, -c)))
    m.add(fb.Revolute("C", "bar", "right", at=(1 + s, -c)), fb.Revolute("D", "ground", "right", at=(1, 0)))
    return m


def exact(t):
    """Angle from the vertical and its rate: sin(phi/2) = k sn(K - w t), phi' = -2 k w cn(K - w t)."""
    k, w = np.sin(START / 2), np.sqrt(W2)
    sn, cn, _, _ = ellipj(ellipk(k * k) - w * np.asarray(t), k * k)
    return 2 * np.arcsin(k * sn), -2 * k * w * cn


def exact_reactions(t):
    """The forces on ``body_j`` of A, B, C and D, from Newton and Euler's laws of the three rods (nine equations)."""
    out = []
    for phi, w in zip(*exact(t), strict=True):
        c, s, al = np.cos(phi), np.sin(phi), -W2 * np.sin(phi)
        tip = al * np.array([c, s]) + w * w * np.array([-s, c])  # acceleration of B and C
        e = np.array([s, -c])
        E, b = np.zeros((9, 8)), np.zeros(9)
        signs = {0: {0: 1, 1: -1}, 1: {3: 1, 2: 1}, 2: {1: 1, 2: -1}}  # rod: hinge: force on the rod or its reverse
        arms = {(0, 0): -e / 2, (0, 1): e / 2, (1, 3): -e / 2, (1, 2): e / 2, (2, 1): (-0.5, 0), (2, 2): (0.5, 0)}
        for rod, hinges in signs.items():
            for hinge, sign in hinges.items():
                x, y = arms[rod, hinge]
                E[3 * rod : 3 * rod + 2, 2 * hinge : 2 * hinge + 2] = sign * np.eye(2)
                E[3 * rod + 2, 2 * hinge : 2 * hinge + 2] = sign * np.array([-y, x])
            b[3 * rod : 3 * rod + 2] = (tip if rod == 2 else tip / 2) - (0, -G)
            b[3 * rod + 2] = 0.0 if rod == 2 else al / 12
        out.append(np.linalg.lstsq(E, b, rcond=None)[0])
        assert E @ out[-1] == pytest.approx(b, abs=1e-12)
    return np.array(out)


@cached
def run(method, rtol):
    return parallelogram().simulate(END, rtol=rtol, atol=rtol, outputs=69, method=method)


def errors(r):
    """Largest errors: at the end, which is on a step, and over all output times, most of which are between steps."""
    phi, rate = exact(r.t)
    angle = np.abs([r["A"].angle + START - phi, r["D"].angle + START - phi]).max(axis=0)
    speed = np.abs([r["A"].rate - rate, r["D"].rate - rate]).max(axis=0)
    force = np.abs(np.hstack([r[k].force for k in "ABCD"]) - exact_reactions(r.t)).max(axis=1)
    return {
        "state": max(np.sqrt(W2) * angle[-1], speed[-1]),  # one of the two may happen to pass through zero
        "reactions": force[-1],
        "position between steps": angle.max(),
        "velocity between steps": speed.max(),
        "reactions between steps": force.max(),
    }


def test_swings_as_a_pendulum():
    """Angles, rates and all eight reaction components, at every output time."""
    r = run("dop853", 1e-13)
    assert max(errors(r).values()) < 1e-10
    assert r.health.freedoms == 1


@pytest.mark.parametrize(
    ("method", "order", "tolerances"),
    [("rk45", 5, np.logspace(-5, -9.5, 10)), ("dop853", 8, np.logspace(-7, -11.5, 10))],
)
def test_order(method, order, tolerances):
    """The slope of error against number of steps is the order, between steps too.

    The interpolants are one order lower than the methods, but their error is made once, not added up over the steps.
    """
    runs = [run(method, float(x)) for x in tolerances]
    steps = np.log([r.health.steps for r in runs])
    assert np.ptp(steps) > 1.0
    found = [errors(r) for r in runs]
    for what in found[0]:
        slope = -np.polyfit(steps, np.log([e[what] for e in found]), 1)[0]
        assert slope > order - 0.6, (what, slope)
