"""Contact tables: sums over pairs, names of members, and what a static block and a pile weigh."""

from __future__ import annotations

import matplotlib.figure
import numpy as np
import pytest

import flyball as fb
from flyball.results.contacts import OPEN, SLIP, STICK, ContactBodies, Contacts
from flyball.results.convergence import Convergence

SIDES = ContactBodies(("box", "balls", "ground"), (-1, 3, -1))  # 0; 1, 2, 3; 4
G = 9.81


def block_on_four_points(mass: float = 2.0, n: int = 5) -> Contacts:
    """A box at rest on four corners, pulled with a force that friction holds; balls[1] on it, balls[2] beside it."""
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    rows = {k: [] for k in ("pair", "point", "normal", "gap", "force", "state", "friction")}
    begin = [0]
    for i in range(n):
        for p in corners:  # the box is the first side: the force in the table is that on ground
            for name, x in (("pair", (0, 4)), ("point", p), ("normal", (0, 0, -1)), ("gap", -1e-6 * i)):
                rows[name].append(x)
            rows["force"].append((0.25 * i, 0.0, -0.25 * mass * G))
            rows["state"].append(STICK)
        if i:
            rows["pair"].append((0, 2))
            rows["point"].append((0.0, 0, 1))
            rows["normal"].append((0.0, 0, 1))
            rows["gap"].append(1e-7)
            rows["force"].append((0.0, 0.3, 1.0))
            rows["state"].append(SLIP)
        begin.append(len(rows["gap"]))
    rows["friction"] = [0.3] * len(rows["gap"])
    arrays = {k: np.array(v, int if k in ("pair", "state") else float) for k, v in rows.items()}
    return Contacts(t=np.arange(float(n)), sides=SIDES, begin=np.array(begin), **arrays)


def test_forces_between_two_are_summed_and_opposite():
    c = block_on_four_points()
    held = c.between("ground", "box")
    np.testing.assert_allclose(held.force[:, 2], 2.0 * G, rtol=1e-14)  # ground carries the weight
    np.testing.assert_allclose(held.force[:, 0], -np.arange(5.0))  # and holds against the pull
    np.testing.assert_allclose(c.between("box", "ground").force, -held.force)
    np.testing.assert_allclose(held.normal_force, 2.0 * G)
    np.testing.assert_allclose(held.tangential_force, np.arange(5.0), atol=1e-14)
    np.testing.assert_allclose(held.center, 0.0, atol=1e-15)
    assert held.states == ["stick"] * 5
    assert held.count.tolist() == [4] * 5
    np.testing.assert_allclose(held.gap, -1e-6 * np.arange(5))
    assert c.between("ground", "box") is held
    assert "ground on box" in repr(held)


def test_what_never_touches_has_no_force_and_no_gap():
    apart = block_on_four_points().between("box", "balls[2]")
    assert not apart.force.any()
    assert np.isnan(apart.gap).all()
    assert np.isnan(apart.center).all()
    assert (apart.state == OPEN).all()


def test_members_sets_and_all_others():
    c = block_on_four_points()
    one, whole, every = c.on("balls[1]"), c.on("balls"), c.between("box", "balls")
    np.testing.assert_array_equal(one.force, whole.force)
    np.testing.assert_array_equal(one.force, every.force)
    np.testing.assert_allclose(one.force[1:], [(0.0, 0.3, 1.0)] * 4)
    assert one.states == ["open", *["slip"] * 4]
    np.testing.assert_allclose(one.tangential_force[1:], 0.3)
    np.testing.assert_allclose(one.impulse(), (0.0, 1.2, 4.0))
    np.testing.assert_allclose(c.on("box").force[2], (-2.0, -0.3, 2 * G - 1.0))
    np.testing.assert_allclose(c.force_on(*SIDES.span("balls"))[2], [(0, 0, 0), (0, 0.3, 1), (0, 0, 0)])
    total = c.force_on(0, len(SIDES)).sum(axis=1)
    np.testing.assert_allclose(total, 0.0, atol=1e-14)  # what acts on one acts back on the other


def test_contacts_between_members_of_a_set_are_forces_on_members():
    row = {"point": [(0.0, 0, 0)], "normal": [(1.0, 0, 0)], "force": [(5.0, 1.0, 0)]}
    arrays = {k: np.array(v) for k, v in row.items()}
    c = Contacts(np.zeros(1), SIDES, np.array([0, 1]), np.array([(1, 3)]), gap=np.zeros(1), state=np.zeros(1, int),
                 friction=np.ones(1), **arrays)  # fmt: skip
    np.testing.assert_array_equal(c.between("balls[0]", "balls[2]").force, [(5.0, 1.0, 0)])
    np.testing.assert_array_equal(c.between("balls[2]", "balls[0]").force, [(-5.0, -1.0, 0)])
    assert not c.on("balls").force.any()
    with pytest.raises(fb.ModelError, match="cancel in their sum"):
        c.between("balls", "balls")


def test_at_a_time_and_as_a_table():
    c = block_on_four_points()
    now = c.at(2.3)
    assert (len(now), now.t.tolist(), now.begin.tolist()) == (5, [2.0], [0, 5])
    assert now.names()[-1] == ("box", "balls[1]")
    assert now.worst_overlap == pytest.approx(2e-6)
    assert c.worst_overlap == pytest.approx(4e-6)
    assert c.count.tolist() == [4, 5, 5, 5, 5]
    assert c.pairs() == [("box", "balls[1]"), ("box", "ground")]
    frame = c.to_dataframe()
    assert len(frame) == 24
    assert frame.attrs["units"]["fz"] == "N"
    assert frame[(frame.side_2 == "ground") & (frame.t == 0.0)].fz.sum() == pytest.approx(-2 * G)
    assert set(frame.state) == {"stick", "slip"}
    few = c.at_times(np.array([0, 3]))
    assert few.t.tolist() == [0.0, 3.0]
    np.testing.assert_array_equal(few.on("balls").force[1], c.on("balls").force[3])
    assert dict(c.lines())["contacts"] == "24 at 5 times, 5 at most at once: 20 stick, 4 slip"


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda c: c.between("box", "bals"), "did you mean 'balls'"),
        (lambda c: c.on("balls[3]"), "has the members 0 to 2"),
        (lambda c: c.on("box[0]"), "is a single body"),
        (lambda c: c.between("balls", "balls[0]"), "share a body"),
        (lambda c: c.at(17.0), "from 0 to 4"),
        (lambda c: c.at("now"), "must be a time"),
        (lambda c: c.plot("box"), "pairs of two names"),
    ],
)
def test_wrong_questions_are_answered_in_words(ask, said):
    with pytest.raises(fb.ModelError, match=said):
        ask(block_on_four_points())


def test_tables_that_do_not_fit_are_refused():
    c = block_on_four_points()
    own = {k: getattr(c, k) for k in ("pair", "point", "normal", "gap", "force", "state", "friction")}
    for wrong in ({"gap": c.gap[:-1]}, {"pair": c.pair + 4}):
        with pytest.raises(ValueError, match="contacts"):
            Contacts(t=c.t, sides=SIDES, begin=c.begin, **(own | wrong))
    with pytest.raises(ValueError, match="begin"):
        Contacts(t=c.t, sides=SIDES, begin=c.begin[1:], **own)


def test_pictures_of_forces_and_residuals(tmp_path):
    c = block_on_four_points()
    drawing = c.plot(("box", "ground"))
    assert isinstance(drawing, matplotlib.figure.Figure)
    np.testing.assert_allclose(drawing.axes[0].lines[0].get_ydata(), 2.0 * G)
    c.plot(path=tmp_path / "all.png")
    assert (tmp_path / "all.png").stat().st_size > 1000
    k = np.arange(1, 20)
    h = Convergence(np.array([0.1]), np.array([0, 19]), k, 1.0 / k**2, *[1.0 / k] * 3, -1.0 * k, solver="APGD")
    np.testing.assert_allclose(h.plot().axes[0].lines[0].get_ydata(), 1.0 / k**2)
    with pytest.raises(ValueError, match="convergence"):
        Convergence(np.array([0.1]), np.array([0, 18]), *[k] * 6)


def tumbling(seed: int) -> fb.Mechanism:
    """Three bodies, whose origins are not their mass centres, that fall on each other and on the ground."""
    rng = np.random.default_rng(seed)
    m = fb.Mechanism("tumbling", planar=True, gravity=(0.3, -G))
    m.add(fb.Ground("floor", shape=fb.Plane(normal=(0, 1))))
    for k in range(3):
        r = rng.uniform(0.1, 0.2)
        shapes = fb.Sphere(radius=r), fb.Box(edges=(2 * r, 1.3 * r, 0.1)), fb.Capsule(radius=0.5 * r, length=2 * r)
        m.add(
            fb.Body(
                f"b{k}", mass=rng.uniform(0.5, 2), inertia=rng.uniform(0.01, 0.03), shape=shapes[rng.integers(3)],
                com=tuple(rng.uniform(-0.03, 0.03, 2)), position=(rng.uniform(-0.1, 0.1), 0.4 + 0.5 * k),
                angle=rng.uniform(0, 6), velocity=tuple(rng.uniform(-1, 1, 2)), angular_velocity=rng.uniform(-4, 4),
            )
        )  # fmt: skip
    m.add(fb.Contact(friction=rng.uniform(0.1, 0.6)))
    return m


def torques(r: fb.Result, body: fb.Body, before: int) -> np.ndarray:
    """About the mass centre, by the table of contacts; arms from where it was ``before`` outputs earlier."""
    x, out = r[body.name], np.zeros(len(r.t))
    c, s = np.cos(x.angle), np.sin(x.angle)
    centre = x.position + np.stack([c * body.com[0] - s * body.com[1], s * body.com[0] + c * body.com[1]], axis=1)
    for i, names in enumerate(r.contacts.names()):
        if body.name in names:
            k, way = r.contacts.when[i], 1.0 if names[1] == body.name else -1.0
            arm = r.contacts.point[i, :2] - centre[max(k - before, 0)]
            out[k] += way * (arm[0] * r.contacts.force[i, 1] - arm[1] * r.contacts.force[i, 0])
    return out


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_torques_of_the_table_turn_the_bodies(seed):
    """J alpha = sum of arm x force to rounding where motions go on between events.

    A corner on a corner is two contacts at one point: how they share a force is known to fewer digits than their sum.
    """
    m = tumbling(seed)
    r = m.simulate(0.8, outputs=401, rtol=1e-9)
    assert r.health.success and "impulse" not in str(r.health.coordinates)
    touched = 0.0
    for b in m.bodies:
        turning = b.inertia * r[b.name].angular_acceleration.ravel()
        touched = max(touched, np.abs(turning).max())
        np.testing.assert_allclose(torques(r, b, 0), turning, atol=2e-10)
    assert touched > 0.05


@pytest.mark.parametrize("seed", range(4))
def test_torques_of_the_table_are_those_of_steps(seed):
    """J (w+ - w-) = h sum of arm x force, arms from where the step began: to rounding for a body on ground alone."""
    m, h = tumbling(seed), 1e-3
    for one in (True, False):
        r = (alone(m) if one else m).simulate(0.8, outputs=801, method=fb.Stepping(step=h))
        for b in (x for x in m.bodies if not one or x.name == "b0"):
            turning = b.inertia * np.diff(r[b.name].angular_velocity.ravel()) / h
            missed = np.abs(torques(r, b, 1)[1:] - turning).max() / np.abs(turning).max()
            assert missed < (1e-9 if one else 0.02)  # of two: 3 m/s in half a step, over 0.1 m


def alone(m: fb.Mechanism) -> fb.Mechanism:
    """The first of its bodies, on the ground."""
    out = fb.Mechanism("alone", planar=True, gravity=m.gravity)
    out.add(m["floor"], m["b0"], *m.contacts)
    return out
