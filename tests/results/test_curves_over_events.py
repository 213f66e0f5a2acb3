"""Curves know nothing of where a motion was cut: by events that change nothing, or by going on from its result."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb

G = 10.0
HOW = {"method": "dop853", "rtol": 1e-10, "atol": 1e-12}


def slide(*forces: object) -> fb.Mechanism:
    """A body of 1 kg on a slide."""
    m = fb.Mechanism("slide", planar=True, gravity=(0, -G), parameters={"idle": 5.0})
    m.add(fb.Body("b", mass=1, inertia=0.01, position=(0.5, 0)))
    m.add(fb.Prismatic("P", "ground", "b", at=(0.5, 0), axis=(1, 0)))
    m.add(fb.Initial("P.displacement", value=0.2, rate=1), *forces)
    return m


def stores() -> fb.Mechanism:
    """Everything that stores energy, and what damps and drives."""
    ends = {"at": [(0, 0), (0.5, 0)]}
    return slide(
        fb.Rope("rope", ["ground", "b"], length=0.4, stiffness=30, **ends),
        fb.CoordinateSpring("spring", "P.displacement", stiffness=30),
        fb.CoordinateSpring("damped", "P.displacement", stiffness=30, damping=0.3),
        fb.SpringDamper("strut", "ground", "b", stiffness=30, **ends),
        fb.Detent("detent", "P.displacement", pitch=0.1, holding=5),
        fb.Limit("stop", "P.displacement", upper=0.3, stiffness=100),
        fb.Actuator("push", "P.displacement", force="sin(3*t)"),
        fb.Brake("brake", "P.displacement", capacity=0.2),
    )


def box() -> fb.Mechanism:
    """A box of 1 kg that slides to rest: at 2 m/s, with 0.2 g, in 1 s and 1 m."""
    m = fb.Mechanism("box", planar=True, gravity=(0, -G), parameters={"idle": 5.0})
    m.add(fb.Ground("f", shape=fb.Plane(normal=(0, 1))), fb.Contact(friction=0.2))
    shape = fb.Box(edges=(0.3, 0.2, 0.1), mass=1.0)
    m.add(fb.Body("b", shape=shape, position=(0.5, 0.1), velocity=(2, 0), angular_velocity=0))
    return m


def ball() -> fb.Mechanism:
    """In space: it bounces and spins."""
    m = fb.Mechanism("ball", gravity=(0, 0, -G), parameters={"idle": 5.0})
    at = {"position": (0, 0, 0.4), "velocity": (1, 0.3, 0), "angular_velocity": (0, -20, 3)}
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 0, 1))), fb.Contact(friction=0.3, restitution=0.6))
    m.add(fb.Body("ball", shape=fb.Sphere(radius=0.1), density=1000, **at))
    return m


def bouncing() -> fb.Mechanism:
    """On a stop, with a spring, and kicked once."""
    m = slide(fb.CoordinateSpring("s", "P.displacement", stiffness=9, damping=0.3))
    m.add(fb.Limit("L", "P.displacement", lower=0, restitution=0.6))
    m.add(fb.Event("kick", "t > 0.4", do=[fb.Impulse("b", (1, 0))]))
    return m


CASES = {"stores": stores, "box": box, "ball": ball, "bouncing": bouncing}


def compare(a: fb.Result, b: fb.Result, rows: np.ndarray, where: np.ndarray) -> None:
    """Every name, but for the sign of quaternions in space, which is free."""
    assert a.names() == b.names()
    for name in a.names():
        if "." not in name:
            continue
        x, y = np.asarray(a[name])[rows], np.asarray(b[name])[where]
        if name.endswith(".quaternion") and not a.planar:
            y = y * np.sign((x * y).sum(axis=1))[:, None]
        if name.endswith((".roll", ".yaw")):  # a motion that continues another counts their turns anew
            y = y + 2 * np.pi * np.round((x[0] - y[0]) / (2 * np.pi))
        scale = max(1.0, float(np.abs(np.nan_to_num(x)).max(initial=0.0)))
        np.testing.assert_allclose(y, x, rtol=0, atol=2e-6 * scale, err_msg=name)


@pytest.mark.parametrize("case", list(CASES))
def test_a_set_that_changes_nothing_changes_no_curve(case, tmp_path):
    plain, cut = CASES[case](), CASES[case]()
    cut.add(fb.Event("cut", "sin(20*t)", do=[fb.Set("idle", "idle*1.1")]))
    a, b = (m.simulate(1.0, outputs=8, **HOW) for m in (plain, cut))
    assert len(b.pieces) > 3
    every = np.arange(8)
    if not plain.snapshot().events:  # then the one has a name more: what events did
        assert set(b.names()) - set(a.names()) <= {"energy.event_work", "energy.impact_loss"}
    names = [n for n in a.names() if "." in n]
    for name in names:
        x, y = np.asarray(a[name]), np.asarray(b[name])
        scale = max(1.0, float(np.abs(np.nan_to_num(x)).max(initial=0.0)))
        np.testing.assert_allclose(y, x, rtol=0, atol=2e-6 * scale, err_msg=name)
    b.save(tmp_path / "cut.nc")
    compare(b, fb.load_result(tmp_path / "cut.nc"), every, every)


@pytest.mark.parametrize("case", list(CASES))
def test_what_goes_on_counts_on(case, tmp_path):
    m = CASES[case]()
    whole = m.simulate(1.0, outputs=11, **HOW)
    first = m.simulate(0.5, outputs=3, **HOW)
    first.save(tmp_path / "first.nc")
    for start in (first, fb.load_result(tmp_path / "first.nc")):
        second = m.simulate(1.0, start=start, outputs=whole.t[whole.t > 0.55], **HOW)
        late = np.flatnonzero(whole.t > 0.55)
        compare(whole, second, late, np.arange(len(late)))


def test_a_sliding_box_loses_its_energy_to_friction():
    """m v^2 / 2 = 2 J, evenly over 1 m; the floor carries m g and brakes with 0.2 m g."""
    for act in ([], [fb.Set("idle", 2)]):
        m = box()
        m.add(fb.Event("half", "t > 0.5", do=act))
        r = m.simulate(2.0, outputs=5, **HOW)
        v = np.maximum(2 - 0.2 * G * r.t, 0.0)
        assert r.energy.friction_loss == pytest.approx(2 - v**2 / 2, abs=1e-6)
        assert r["b.contact_fy"] == pytest.approx(G, abs=1e-6)
        assert r["b.contact_fx"][:2] == pytest.approx(-0.2 * G, abs=1e-6)
        assert r.energy.drift < 1e-6


def test_what_a_spring_gives_is_not_what_a_change_of_it_stores():
    """work of the spring is the sum of -k x dx; the change of k at x gives it (k' - k) x^2 / 2 for nothing."""
    m = slide(fb.CoordinateSpring("s", "P.displacement", stiffness="idle"))
    m.add(fb.Event("stiffer", "t > 0.3", do=[fb.Set("idle", 20.0)]))
    r = m.simulate(1.0, outputs=5, **HOW)
    assert r["s.work"] == pytest.approx(r.energy.kinetic - 0.5, abs=1e-7)  # no one else does any
    x = float(r.events[0].after["P.displacement"])
    assert r.energy.event_work[-1] == pytest.approx(7.5 * x**2, abs=1e-7)
    again = m.simulate(1.5, start=r, outputs=3, **HOW)
    assert again["s.work"] == pytest.approx(again.energy.kinetic - 0.5, abs=1e-7)
    assert again.energy.event_work[-1] == pytest.approx(7.5 * x**2, abs=1e-7)


def test_a_planar_body_has_a_quaternion():
    r = slide().simulate(0.1, outputs=2)
    assert r["b.quaternion"] == pytest.approx(np.array([[1, 0, 0, 0]] * 2))


def test_just_before_and_after_works_are_what_they_are():
    """A spring: work 1 - E before k is doubled and after it, at a half; event_work is what the change stored."""
    m = slide(fb.CoordinateSpring("s", "P.displacement", stiffness="idle"))
    m.add(
        fb.Event("half", "t > 0.3", do=[fb.Set("idle", 20.0)]), fb.Event("kick", "t > .6", do=[fb.Impulse("b", (1, 0))])
    )
    whole = m.simulate(1.0, outputs=3, **HOW)
    first = m.simulate(0.5, outputs=2, **HOW)
    later = m.simulate(1.0, start=first, outputs=2, **HOW)
    for r, e in ((whole, whole.events[0]), (whole, whole.events[1]), (later, later.events[0])):
        given = e.after["energy.kinetic"] - e.before["energy.kinetic"]  # by the blow
        stored = e.after["s.energy"] - e.before["s.energy"]  # by the change of k
        assert e.before["s.work"] == pytest.approx(e.before["energy.kinetic"] - 0.5, abs=1e-8)
        assert e.after["s.work"] == pytest.approx(e.before["s.work"], abs=1e-12)
        assert e.after["energy.event_work"] - e.before["energy.event_work"] == pytest.approx(given + stored, abs=1e-9)
        assert e.after["energy.total"] - e.after["energy.event_work"] == pytest.approx(
            r.energy.total[-1] - r.energy.event_work[-1], abs=1e-7
        )
