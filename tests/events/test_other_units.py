"""The same mechanism a million times smaller, lighter, faster, slower: the same events, and all in proportion."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import flyball as fb

G = 9.81
ALONG = {"at": (0, 0), "axis": (1, 0)}


def scaled(length, mass, time):
    """Units of what is built: lengths, masses, times, speeds, accelerations, forces, stiffness, damping, inertia."""
    L, M, T = length, mass, time
    return SimpleNamespace(L=L, M=M, T=T, v=L / T, g=L / T**2, F=M * L / T**2, k=M / T**2, c=M / T, I=M * L**2)


def begun(u, inertia, position=(0, 0), velocity=(0, 0), gravity=1.0, **more):
    m = fb.Mechanism("scaled", planar=True, gravity=(0, -G * gravity * u.g))
    at, v = (np.array(position) * u.L).tolist(), (np.array(velocity) * u.v).tolist()
    m.add(fb.Body("b", mass=u.M, inertia=inertia * u.I, position=at, velocity=v, **more))
    return m


def ball(u):
    """Bounces, and where it is highest."""
    m = begun(u, 0.1, position=(0, 1))
    m.add(fb.Prismatic("P", "ground", "b", at=(0, 0), axis=(0, 1), displacement=u.L))
    m.add(fb.Limit("stop", "P.displacement", lower=0, restitution=0.7), fb.Event("top", "P.rate"))
    return m


def belt(u):
    """Stick and slip."""
    m = begun(u, 1.0)
    m.add(fb.Body("belt", mass=u.M, inertia=u.I), fb.Prismatic("B", "ground", "belt", **ALONG))
    m.add(fb.Prismatic("P", "belt", "b", **ALONG), fb.Driver("D", "B.displacement", f"{0.1 * u.v!r}*t"))
    m.add(fb.CoordinateSpring("k", "b.x", stiffness=30 * u.k), fb.JointFriction("f", "P", static=0.3, kinetic=0.2))
    return m


def rope(u):
    """A pendulum on a rope that goes slack and taut; an event that its velocities solved anew are about zero at."""
    m = begun(u, 0.01, position=(0, -0.8), velocity=(np.sqrt(3.7 * G * 0.8), 0))
    at = ((0, 0), (0, -0.8 * u.L))
    m.add(fb.Rope("rope", ("ground", "b"), at=at), fb.Event("low", "b.vy", direction="either"))
    return m


def elastic(u):
    """An elastic rope with damping."""
    m, at = begun(u, 0.01, position=(0.3, 0.2), velocity=(1, 0)), ((0, 0), (0.3 * u.L, 0.2 * u.L))
    push = {"length": 0.8 * u.L, "stiffness": 400 * u.k, "damping": u.c}
    m.add(fb.Rope("rope", ("ground", "b"), at=at, **push))
    return m


def thrown(u):
    """A ball on a floor, to the end of its bounces, and rolling."""
    look = fb.Sphere(radius=0.1 * u.L)
    m = begun(u, 0.004, position=(0, 0.5), velocity=(1, 0), shape=look)
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1))), fb.Contact(friction=0.3, restitution=0.5))
    return m


def sign(u):
    """A user's law that holds."""
    m = begun(u, 1.0, gravity=0.0)
    m.add(fb.Prismatic("P", "ground", "b", **ALONG), fb.Initial("P.displacement", value=u.L))
    m.add(fb.Actuator("A", "P.displacement", force=f"-{4 * u.k!r}*value-{0.3 * u.F!r}*sign(rate)"))
    return m


def pushed(u):
    """To and fro with friction in a joint, in an elastic play."""
    m = begun(u, 1.0)
    m.add(fb.Prismatic("P", "ground", "b", **ALONG), fb.JointFriction("f", "P", static=0.3, kinetic=0.2))
    m.add(fb.Actuator("p", "P.displacement", force=f"{5 * u.F!r}*sin(2*t/{u.T!r})"))
    m.add(fb.Backlash("play", ["P.displacement"], gap=0.2 * u.L, stiffness=1e3 * u.k))
    return m


def turning(u):
    """Slides in space, across a slope: friction turns with its way."""
    m = fb.Mechanism("scaled", gravity=(0.3 * G * u.g, 0, -G * u.g))
    look = fb.Sphere(radius=0.1 * u.L)
    m.add(
        fb.Body("b", mass=u.M, inertia=[0.004 * u.I] * 3, position=(0, 0, 0.1 * u.L), velocity=(0, u.v, 0), shape=look)
    )
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 0, 1))), fb.Contact(friction=0.05, restitution=0.0))
    return m


def swing(u):
    """A pendulum falls on a stop, and bounces until it rests."""
    m = begun(u, 0.1, position=(0.5, 0))
    m.add(fb.Revolute("A", "ground", "b", at=(0, 0)), fb.Limit("stop", "A.angle", lower=-1.0, restitution=0.5))
    m.add(fb.Event("top", "A.rate"))
    return m


def struck(u):
    """To and fro between two stops without gravity, and at rest on them."""
    m = begun(u, 1.0, gravity=0.0)
    m.add(fb.Body("other", mass=u.M, inertia=u.I, position=(u.L, 0)), fb.Prismatic("P", "ground", "b", **ALONG))
    m.add(fb.Limit("stops", "P.displacement", lower=-0.3 * u.L, upper=0.2 * u.L, restitution=0.4))
    m.add(fb.Actuator("push", "P.displacement", force=f"{5 * u.F!r}*sin(2*t/{u.T!r}) - {0.1 * u.c!r}*rate"))
    m.add(fb.Event("turn", "P.rate", direction="either"))
    return m


SCALES = (
    (1e-6, 1, 1), (1e6, 1, 1), (1, 1e-6, 1), (1, 1, 1e-6), (1, 1, 1e-3), (1, 1, 1e3), (1, 1, 1e6), (1e-6, 1e-6, 1e-3),
)  # fmt: skip


@pytest.mark.parametrize("made", [ball, belt, rope, elastic, thrown, sign, pushed, turning, swing, struck])
def test_it_is_the_same(made):
    first = None
    for scale in ((1, 1, 1), *SCALES):
        u = scaled(*map(float, scale))
        fine = {"rtol": 1e-9, "atol": 1e-12}
        r = made(u).simulate(3 * u.T, outputs=4, **fine)
        told = [(e.name, e.kind) for e in r.events]
        found = np.concatenate([[e.t / u.T for e in r.events], r["b"].position[:, :2].ravel() / u.L])
        first = first or (told, found.tolist())
        assert told == first[0], (made.__name__, scale)
        assert found == pytest.approx(first[1], abs=1e-8), (made.__name__, scale)


@pytest.mark.parametrize("time", [1e-6, 1.0, 1e6])
def test_a_start_against_a_freewheel_is_told_at_any_pace(time):
    """A millionth of its own pace is beyond it, what is a millionth of that is rounding."""
    u = scaled(1.0, 1.0, time)
    m = begun(u, 0.1, position=(0.5, 0))
    m.parameters["rate"] = 0.0
    m.add(fb.Revolute("A", "ground", "b", at=(0, 0)), fb.OneWay("wheel", "A.angle"), fb.Initial("A.angle", rate="rate"))
    with pytest.raises(fb.ModelError, match=r"OneWay 'wheel': the motion starts beyond it"):
        m.simulate(u.T, parameters={"rate": -1e-6 / u.T})
    assert m.simulate(1e-3 * u.T, parameters={"rate": -1e-12 / u.T}).health.success


@pytest.mark.parametrize("rate", ["w", "2 rad/s"])
def test_a_first_rate_in_words_tells_the_pace(rate):
    """Without gravity; it was taken for a number."""
    m = fb.Mechanism("spun", planar=True, parameters={"w": 2.0})
    m.add(fb.Body("b", mass=1, inertia=0.1, position=(1, 0)), fb.Revolute("A", "ground", "b", at=(0, 0)))
    m.add(fb.Initial("A.angle", rate=rate))
    assert m.simulate(0.5, outputs=2)["A.angle"][-1] == pytest.approx(1.0, abs=1e-9)
