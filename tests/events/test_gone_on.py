"""A motion that is cut where something holds and goes on, from the result or from its file, is the whole motion."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

G = 9.81
TIGHT = {"method": "dop853", "rtol": 1e-10, "atol": 1e-12}


def slide(*forces, rate=0.5):
    m = fb.Mechanism("slide", planar=True, gravity=(0, -G))
    m.add(fb.Body("p", mass=1, inertia=0.1), fb.Prismatic("A", "ground", "p", at=(0, 0), axis=(1, 0)))
    m.add(*forces, fb.Initial("A.displacement", rate=rate))
    return m


def ball():
    """It bounces, slides, rolls."""
    m = fb.Mechanism("ball", gravity=(0, 0, -G))
    at = {"position": (0, 0, 0.6), "velocity": (1, 0.3, 0), "angular_velocity": (0, -20, 3)}
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 0, 1))))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=0.1), density=1000, **at), fb.Contact(friction=0.3, restitution=0.6))
    return m


def slab(push):
    """A box thrown against a push: it turns round, or stays."""
    m = fb.Mechanism("slab", planar=True, gravity=(push, -G))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1))), fb.Contact(friction=0.2))
    box = fb.Box(edges=(0.4, 0.2, 0.2))
    m.add(fb.Body("box", shape=box, density=500, position=(0, 0.1), velocity=(-1.0, 0)))
    return m


def rope():
    m = fb.Mechanism("rope", planar=True, gravity=(0, -G))
    m.add(fb.Body("p", mass=1, inertia=0.01, position=(0.6, -0.8), velocity=(2.0, 3.0)))
    m.add(fb.Rope("r", ("ground", "p"), at=((0, 0), (0.6, -0.8)), length=1.0))
    return m


def stop():
    m = fb.Mechanism("stop", planar=True, gravity=(0, -G))
    m.add(fb.Body("p", mass=1, inertia=0.1, position=(0.5, 0)), fb.Revolute("A", "ground", "p", at=(0, 0)))
    m.add(fb.Limit("L", "A.angle", lower=-1.2), fb.Motor("M", "A", torque="4*t"))
    return m


def ratchet():
    m = fb.Mechanism("ratchet", planar=True, gravity=(0, 0))
    m.add(fb.Body("p", mass=1, inertia=0.1), fb.Revolute("A", "ground", "p", at=(0, 0)))
    m.add(fb.Ratchet("R", "A.angle", teeth=24), fb.Motor("M", "A", torque="sin(5*t)-0.3"))
    return m


def stuck():
    friction = fb.JointFriction("F", "A", static=0.4, kinetic=0.3)
    return slide(friction, fb.Actuator("M", "A.displacement", force="5*sin(3*t)"))


def twisting():
    return slide(fb.Actuator("M", "A.displacement", force="-3*sign(value)-sign(rate)+max(0,t-2)"))


CASES = {
    "ball": (ball, 1.8, (0.35, 1.6), "ball.x ball.y ball.z ball.vx ball.omega_y"),
    "slides back": (lambda: slab(3.0), 1.0, (0.15, 0.25), "box.x box.vx"),
    "lies": (lambda: slab(1.5), 1.0, (0.25, 0.9), "box.x box.vx"),
    "taut": (rope, 0.6, (0.1, 0.5), "p.x p.vy r.tension r.taut"),
    "held by a stop": (stop, 1.5, (0.7, 1.1), "A.angle A.rate L.force L.closed"),
    "latched": (ratchet, 2.0, (0.8, 1.1), "A.angle A.rate R.force R.closed"),
    "stuck": (stuck, 3.0, (1.3, 2.3), "A.displacement A.rate F.friction"),
    "on corners": (twisting, 6.5, (0.45, 1.5), "A.displacement A.rate M.force"),
}


@pytest.mark.parametrize("case", list(CASES))
@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
def test_the_same_motion_goes_on(case, coordinates, tmp_path):
    made, end, cuts, names = CASES[case]
    how = {**TIGHT, "coordinates": coordinates}
    m = made()
    run = m.simulate(end, outputs=21, **how)
    for cut in cuts:
        first = m.simulate(cut, outputs=2, **how)
        starts = [first]
        if cut == cuts[-1]:
            first.save(tmp_path / "first.nc")
            starts = [first, fb.load_result(tmp_path / "first.nc")]
        for start in starts:
            second = m.simulate(end, start=start, outputs=run.t[run.t > cut], **how)
            for name in names.split():
                assert second[name][second.t > cut] == pytest.approx(run[name][run.t > cut], abs=1e-7), (cut, name)
            late = [(e.kind, e.name) for e in run.events if e.t > cut]
            assert [(e.kind, e.name) for e in second.events if e.t > cut] == late, cut
            assert second.health.energy_drift < 1e-8


@pytest.mark.parametrize("case", ["ball", "slides back"])
def test_a_file_keeps_places_of_contact(case, tmp_path):
    made, end, _, _ = CASES[case]
    run = made().simulate(end, outputs=21, **TIGHT)
    run.save(tmp_path / "run.nc")
    again = fb.load_result(tmp_path / "run.nc")
    assert [e.kind for e in again.events] == [e.kind for e in run.events]
    for name, (_, x) in run.channels().items():
        assert np.array_equal(again[name], x, equal_nan=True), name
    assert len(again.report()) > 10_000
    assert again.plot(*CASES[case][3].split()) is not None


@pytest.mark.parametrize("cut", [1.0, 1.9999999999999933, 2.0, 2.0000009999999935, 2.2, 2.5, 2.75, 2.75 + 1e-9])
def test_a_ball_cut_anywhere_bounces_on(cut):
    """Of 5 m height, g = 10 and e = 0.5 the bounces are at 1, 2, 2.5, 2.75, ... s: a step ends on one to rounding."""
    m = fb.Mechanism("drop", planar=True, gravity=(0, -10))
    m.add(fb.Body("b", mass=1, inertia=1, position=(0, 5)), fb.Limit("L", "b.y", lower=0, restitution=0.5))
    first = m.simulate(cut, rtol=1e-9)
    second = m.simulate(3.0, start=first, rtol=1e-9)  # what is left is halved: steps end on bounces
    hits = [e.t for run in (first, second) for e in run.events if e.kind == "impact"]
    assert hits[:8] == pytest.approx(3 - 2.0 ** (1 - np.arange(8.0)), abs=1e-9)
    assert second["b.y"].min() > -1e-9
    assert second["b.y"][-1] == pytest.approx(0.0, abs=1e-12)
