"""Given velocities are kept where the constraints allow it, and said where they do not; what is not given is free."""

import json

import numpy as np
import pytest

import flyball as fb
from flyball.assembly import positions_and_velocities
from flyball.model.model_files import dumps, loads
from flyball.results.health import InitialDeviation
from tests.layers import LAYERS, started, take


@pytest.fixture(params=LAYERS, autouse=True)
def layer(request, monkeypatch):
    take(request.param, monkeypatch)


def hinged(at=(1, 0), inertia=0.1, **given):
    m = fb.Mechanism("hinged", planar=True)
    m.add(fb.Body("b", mass=1, inertia=inertia, position=at, **given), fb.Revolute("h", "ground", "b", at=(0, 0)))
    return m


def disk(**given):
    """An upright wheel of 0.5 m on the ground, its axle along y."""
    m = fb.Mechanism("disk", gravity=(0, 0, -9.81))
    m.add(fb.Body("w", mass=2, inertia=(0.1, 0.2, 0.1), position=(0, 0, 0.5), **given))
    m.add(fb.RollingDisk("roll", "ground", "w", at=(0, 0, 0.5), axis=(0, 1, 0), radius=0.5))
    return m


@pytest.mark.parametrize("inertia", [0.0, 1e-12, 0.1, 1e3])
def test_a_velocity_that_a_hinge_allows_is_kept_whatever_the_inertia(inertia):
    """(0, 1) at (1, 0) is a turn at 1 rad/s: to the bit, not shared out with a stand-in or the body's own inertia."""
    m = hinged(inertia=inertia, velocity=(0, 1))
    r = m.simulate(0.01, outputs=2)
    assert r["b"].velocity[0].tolist() == pytest.approx([0, 1], abs=1e-15)
    assert r["h"].rate[0] == pytest.approx(1, rel=1e-15)
    assert r.health.departures == ()
    assert r.health.warnings == ()


def test_an_angular_velocity_alone_is_kept_and_the_rest_follows():
    assert hinged(angular_velocity=3).simulate(0.01, outputs=2)["b"].velocity[0] == pytest.approx([0, 3], abs=1e-14)
    r = disk(angular_velocity=(0, 6, 0)).simulate(0.01, outputs=2)
    assert r["w"].angular_velocity[0] == pytest.approx([0, 6, 0], abs=1e-14)
    assert r["w"].velocity[0] == pytest.approx([3, 0, 0], abs=1e-14)
    r = disk(velocity=(3, 0, 0)).simulate(0.01, outputs=2)
    assert r["w"].angular_velocity[0] == pytest.approx([0, 6, 0], abs=1e-13)


def test_what_is_nothing_beside_a_given_velocity_is_written_as_0():
    """An angle has one number, and a direction all of whose numbers are rounding none that is larger: both are 0."""
    d = InitialDeviation("b", "angular_velocity", (2.4392,), (-3.98711e-321,), "rad/s")
    assert d.text == "angular velocity of 'b': given 2.4392, got 0 rad/s"
    d = InitialDeviation("b", "velocity", (5.0, 0.0), (1e-16, -3e-17), "m/s")
    assert d.text == "velocity of 'b': given (5, 0), got (0, 0) m/s"


def test_what_cannot_be_kept_is_said(capsys):
    """By the result's health, by check, and as a warning; never by its name alone: what was given, what became of it."""
    m = hinged(velocity=(5, 0))
    with pytest.warns(fb.StartWarning, match=r"velocity of 'b': given \(5, 0\), got \(0, 0\) m/s"):
        r = m.simulate(0.01, outputs=2)
    (d,) = r.health.departures
    assert (d.element, d.what, d.given, d.unit) == ("b", "velocity", (5.0, 0.0), "m/s")
    assert d.got == pytest.approx((0, 0), abs=1e-14)
    assert d.text in r.health.warnings[0]
    assert d.text in dict(r.health.lines())["assembly"]
    assert json.loads(json.dumps(r.health.as_dict()))["departures"][0]["given"] == [5.0, 0.0]
    report = m.check()
    assert [x.text for x in report.departures] == [d.text]
    assert d.text in report.warnings[0]


def near_dead_centre(angle, **given):
    """A slider-crank, crank 0.1 m and rod 0.3 m, the crank ``angle`` from where it lies along the rod."""
    m = fb.Mechanism("press", planar=True)
    pin, slider = np.array([0.1 * np.cos(angle), 0.1 * np.sin(angle)]), 0.0
    slider = pin[0] + np.sqrt(0.09 - pin[1] ** 2)
    m.add(fb.Body("crank", mass=1, inertia=1e-3, position=tuple(pin / 2), angle=angle))
    m.add(fb.Body("rod", mass=1, inertia=1e-2, position=((pin[0] + slider) / 2, pin[1] / 2)))
    m.add(fb.Body("slider", mass=5, inertia=1, position=(slider, 0), **given))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "rod", at=tuple(pin)))
    m.add(fb.Revolute("C", "rod", "slider", at=(slider, 0)))
    m.add(fb.Prismatic("G", "ground", "slider", at=(slider, 0), axis=(1, 0)))
    return m


def test_a_velocity_that_nobody_gave_and_that_is_very_large_is_said():
    """A slider is told to move slantwise 1e-3 from the dead centre: what the guide lets through spins the crank.

    x' = -r w (sin a + cos a sin a r / (l cos b)), so w is some -0.5 / (0.1 * 1e-3 * 4/3) rad/s.
    """
    m = near_dead_centre(1e-3, velocity=(0.5, 0.3))
    with pytest.warns(fb.StartWarning, match="angular velocity of 'crank': not given, got"):
        r = m.simulate(1e-7, outputs=2)
    d = next(d for d in r.health.departures if d.element == "crank")
    assert (d.given, d.what, d.unit) == ((), "angular_velocity", "rad/s")
    assert d.got[0] == pytest.approx(-0.5 / (0.1 * 1e-3 * 4 / 3), rel=1e-5)
    assert "velocities far larger than those given: angular velocity of 'crank'" in dict(r.health.lines())["assembly"]
    assert any("not given" in w for w in m.check().warnings)
    assert not [d for d in near_dead_centre(0.5, velocity=(0.5, 0)).assemble().departures if d.what != "position"]


def test_departures_come_back_from_a_file(tmp_path):
    with pytest.warns(fb.StartWarning):
        r = hinged(velocity=(5, 0)).simulate(0.01, outputs=2)
    r.save(tmp_path / "r.nc")
    assert fb.load_result(tmp_path / "r.nc").health.departures == r.health.departures


def test_of_contradicting_velocities_the_nearest_in_kinetic_energy():
    """v = x w of a rod told (1, 1) and no turn: m x v / (m x^2 + J)."""
    m = hinged(at=(0.5, 0), inertia=0.3, velocity=(1, 1), angular_velocity=0)
    a = started(m)
    w = 0.5 / (0.25 + 0.3)
    assert a.compiled.moving(0.0, a.q, a.v)["b"].w[2] == pytest.approx(w, rel=1e-13)
    assert {d.what for d in a.departures} == {"velocity", "angular_velocity"}


def test_bodies_that_are_told_nothing_follow_and_what_nothing_determines_rests():
    """A double pendulum whose second rod is told how it moves: the first follows. A body that hangs on nothing rests."""
    m = fb.Mechanism("double", planar=True)
    m.add(fb.Body("one", mass=1, inertia=0.1, position=(0.5, 0)))
    m.add(fb.Body("two", mass=1, inertia=0.1, position=(1.5, 0), velocity=(0, 2), angular_velocity=1))
    m.add(fb.Body("free", mass=1, inertia=0.1, velocity=(1, 2)), fb.Body("idle", mass=1, inertia=1))
    m.add(fb.Revolute("A", "ground", "one", at=(0, 0)), fb.Revolute("B", "one", "two", at=(1, 0)))
    r = m.simulate(0.01, outputs=2)
    assert r["one"].omega[0] == pytest.approx(1.5, rel=1e-14)
    assert r["two"].velocity[0] == pytest.approx([0, 2], abs=1e-14)
    assert r["free"].velocity[0] == pytest.approx([1, 2], abs=1e-14)
    assert r["free"].omega[0] == 0.0
    assert np.abs(r["idle"].velocity[0]).max() == 0.0


def test_a_free_joint_moves_as_a_blow_would_move_it():
    """The first of two rods is told its turn: the second takes the least kinetic energy (Thomson's theorem)."""
    m = fb.Mechanism("double", planar=True)
    m.add(fb.Body("one", mass=1, inertia=0.1, position=(0.5, 0), angular_velocity=1))
    m.add(fb.Body("two", mass=2, inertia=0.3, position=(1.5, 0)))
    m.add(fb.Revolute("A", "ground", "one", at=(0, 0)), fb.Revolute("B", "one", "two", at=(1, 0)))
    a = started(m)
    state = a.compiled.moving(0.0, a.q, a.v)
    assert state["one"].w[2] == pytest.approx(1, rel=1e-14)
    assert state["two"].w[2] == pytest.approx(-2 * 0.5 / (2 * 0.25 + 0.3), rel=1e-13)  # d/dw of 2 (1 + w/2)^2 + 0.3 w^2


def rods(**given):
    """Two rods, mass centres off their origins, that hang on each other only."""
    m = fb.Mechanism("rods", planar=True, gravity=(0, 0))
    m.add(fb.Body("a", mass=1, inertia=0.1, com=(0.5, 0), **given))
    m.add(fb.Body("b", mass=3, inertia=0.2, com=(0.3, 0.4), position=(1, 0)), fb.Revolute("A", "a", "b", at=(1, 0)))
    return m


def kinetic(m):
    return m.simulate(1e-3, outputs=2).energy.kinetic[0]


@pytest.mark.parametrize("given", [{"angular_velocity": 2}, {"velocity": (0, 2)}])
def test_the_kinetic_energy_of_the_whole_is_the_least(given):
    """By the normal equations: rows u_x, u_y, w of the first (at its origin) and w of the second, those given known."""
    to_a = np.array([[1, 0, 0, 0], [0, 1, 0.5, 0]])
    to_b = np.array([[1, 0, 0, -0.4], [0, 1, 1, 0.3]])
    M = to_a.T @ to_a + 3 * to_b.T @ to_b + np.diag([0, 0, 0.1, 0.2])
    known, x = ([2], [2.0]) if "angular_velocity" in given else ([0, 1], [0.0, 2.0])
    free = [k for k in range(4) if k not in known]
    left = M[np.ix_(known, known)] - M[np.ix_(known, free)] @ np.linalg.solve(
        M[np.ix_(free, free)], M[np.ix_(free, known)]
    )
    assert kinetic(rods(**given)) == pytest.approx(0.5 * np.array(x) @ left @ x, rel=1e-12)


def test_a_rate_and_a_turn_that_say_the_same_start_the_same():
    m = rods()
    m.add(fb.Initial("a.angle", rate=2))
    assert kinetic(m) == pytest.approx(kinetic(rods(angular_velocity=2)), rel=1e-12)


def test_a_free_rod_turns_about_its_mass_centre_and_is_struck_at_its_origin():
    """1/12 w^2 / 2 of a rod told its turn; told the velocity of its end, w = 3 u / (2 l)."""

    def start(**given):
        m = fb.Mechanism("rod", planar=True, gravity=(0, 0))
        m.add(fb.Body("r", mass=1, inertia=1 / 12, com=(0.5, 0), angle=np.pi / 2, **given))
        return started(m).v

    assert start(angular_velocity=2) == pytest.approx([0, 0, 2], abs=1e-15)
    assert start(velocity=(-2, 0)) == pytest.approx([-0.5, 0, -3], rel=1e-14, abs=1e-15)
    assert start(velocity=(-2, 0), angular_velocity=0) == pytest.approx([-2, 0, 0], abs=1e-15)


@pytest.mark.parametrize("as_drawn", [False, True])
@pytest.mark.parametrize("given", [{"angular_velocity": (0.3, -1, 2)}, {"velocity": (1, 2, 3)}])
def test_in_space_too(given, as_drawn):
    """A skewed body with another on a ball joint: what is free has felt no blow, so has no momentum of its own."""
    J = {"a": np.diag([1, 2, 2.5]), "b": np.diag([0.2, 0.3, 0.4])}
    mass = {"a": 1, "b": 3}
    m = fb.Mechanism("space", gravity=(0, 0, 0))
    first = {"com": (0.5, 0.2, -0.1), "orientation": (0.3, -0.4, 0.5), "as_drawn": as_drawn, **given}
    m.add(fb.Body("a", mass=1, inertia=(1, 2, 2.5), **first))
    m.add(fb.Body("b", mass=3, inertia=(0.2, 0.3, 0.4), com=(0.3, 0.4, 0.1), position=(1, 0, 0)))
    m.add(fb.Spherical("S", "a", "b", at=(1, 0, 0)))
    a = started(m)
    x = a.compiled.moving(0.0, a.q, a.v)

    def spin(name, about):
        """Angular momentum about a point."""
        s = x[name]
        return s.R @ J[name] @ s.R.T @ s.w + mass[name] * np.cross(s.p - about, s.v)

    assert spin("b", np.array([1, 0, 0])) == pytest.approx(np.zeros(3), abs=1e-13)
    if "velocity" in given:
        assert x["a"].v - np.cross(x["a"].w, x["a"].p) == pytest.approx(given["velocity"], rel=1e-13)
        assert spin("a", np.zeros(3)) + spin("b", np.zeros(3)) == pytest.approx(np.zeros(3), abs=1e-13)
    else:
        assert x["a"].w == pytest.approx(given["angular_velocity"], rel=1e-13)
        assert x["a"].v + 3 * x["b"].v == pytest.approx(np.zeros(3), abs=1e-13)


def test_drivers_and_initial_rates_come_first():
    m = hinged(velocity=(0, 1))
    m.add(fb.Driver("motor", "h.angle", "2*t"))
    with pytest.warns(fb.StartWarning, match=r"given \(0, 1\), got \(0, 2\)"):
        assert m.simulate(0.01, outputs=2)["h"].rate[0] == pytest.approx(2, rel=1e-14)
    m = hinged(velocity=(0, 1))
    m.add(fb.Initial("h.angle", rate=3))
    with pytest.warns(fb.StartWarning, match=r"given \(0, 1\), got \(0, 3\)"):
        assert m.simulate(0.01, outputs=2)["h"].rate[0] == pytest.approx(3, rel=1e-14)


def test_velocities_are_along_world_axes_of_the_assembled_position():
    """A body that an initial angle turns is told its angular velocity in the world, not in the axes it was drawn with."""
    m = fb.Mechanism("turned")
    m.add(fb.Body("b", mass=1, inertia=(1, 2, 3), angular_velocity=(0, 0, 5)))
    m.add(fb.Universal("u", "ground", "b", at=(0, 0, 0), axes=((0, 0, 1), (1, 0, 0))))
    m.add(fb.Initial("u.angle_2", value=0.8))
    assert m.simulate(0.001, outputs=2)["b"].angular_velocity[0] == pytest.approx([0, 0, 5], abs=1e-12)


def test_positions_that_assembly_moved_are_said():
    m = hinged()
    m.add(fb.Initial("h.angle", value=0.5))
    r = m.simulate(0.01, outputs=2)
    moved = {d.what: d for d in r.health.departures}
    assert moved["angle"].got == pytest.approx((0.5,))
    assert moved["position"].got == pytest.approx((np.cos(0.5), np.sin(0.5)))
    assert "closed after moving 1 body, b farthest" in dict(r.health.lines())["assembly"]
    assert r.health.warnings == ()


def test_not_given_and_zero_are_told_apart_in_files():
    m = hinged()
    m.add(fb.Body("still", mass=1, inertia=1, velocity=(0, 0), angular_velocity=0))
    again = loads(dumps(m), fb.Mechanism)
    assert (again["b"].velocity, again["b"].angular_velocity) == (None, None)
    assert (again["still"].velocity, again["still"].angular_velocity) == ((0.0, 0.0), 0.0)
    assert again == m


def test_a_large_mechanism_keeps_and_shares_the_same(monkeypatch):
    """A chain of 200 rods: told rates of all are kept; told what cannot be, it does as the dense solution does."""

    def chain(n, **given):
        m = fb.Mechanism("chain", planar=True)
        for k in range(n):
            told = {key: law(k) for key, law in given.items()}
            m.add(fb.Body(f"b{k}", mass=1, inertia=0.1, position=(k + 0.5, 0), **told))
            m.add(fb.Revolute(f"J{k}", f"b{k - 1}" if k else "ground", f"b{k}", at=(k, 0)))
        return m

    n = 200
    a = chain(n, angular_velocity=lambda k: 0.01 * (k + 1)).assemble()
    v = a.v.reshape(n, 3)
    w = 0.01 * np.arange(1, n + 1)
    assert v[:, 2] == pytest.approx(w, rel=1e-9)
    assert v[:, 1] == pytest.approx(np.cumsum(w) - 0.5 * w, rel=1e-9)
    assert a.departures == ()
    contrary = chain(30, angular_velocity=lambda k: (-1) ** k, velocity=lambda k: (1, 0))
    dense = contrary.assemble()
    monkeypatch.setattr(positions_and_velocities, "DENSE_ROWS", 0)
    sparse = contrary.assemble()
    assert sparse.v == pytest.approx(dense.v, abs=1e-10)
    assert len(sparse.departures) == len(dense.departures) > 30


@pytest.mark.parametrize("angle", [1e-7, 10.0, 80.0, 179.0])
def test_how_far_a_body_was_turned(angle):
    """Moved by an initial condition in space: the angle of the turn itself, up to half a turn."""
    m = fb.Mechanism("door")
    m.add(fb.Body("leaf", mass=1.0, inertia=(1.0, 1.0, 1.0)))
    m.add(fb.Revolute("hinge", "ground", "leaf", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Initial("hinge.angle", value=f"{angle} deg"))
    turned = [d for d in m.simulate(0.01).health.departures if d.what == "orientation"]
    assert [d.distance for d in turned] == [pytest.approx(np.radians(angle), rel=1e-6)] if angle > 1e-6 else True


def test_rates_of_a_very_long_chain():
    """Link k turns k + 1 times as fast as the hinges do; multipliers of so many rows swing before they settle."""
    n, rate = 1500, 0.01
    m = fb.Mechanism("chain", planar=True)
    for k in range(n):
        m.add(fb.Body(f"b{k}", mass=1, inertia=1 / 12, position=(k + 0.5, 0)))
        m.add(fb.Revolute(f"J{k}", f"b{k - 1}" if k else "ground", f"b{k}", at=(k, 0)))
        m.add(fb.Initial(f"J{k}.angle", rate=rate))
    turning = m.assemble().v[2::3]
    assert turning == pytest.approx(rate * np.arange(1, n + 1), rel=1e-9)


@pytest.mark.parametrize("layer", LAYERS)
def test_the_warning_is_of_the_user_s_line(layer):
    m = hinged(velocity=(5, 0))
    for ask in (m, m.prepare(coordinates=layer)):
        with pytest.warns(fb.StartWarning) as seen:
            ask.simulate(0.01, outputs=2)
        assert [w.filename for w in seen] == [__file__]
