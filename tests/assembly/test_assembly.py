"""Assembly: what is closed stays as it is, what is open closes, what is fixed stays fixed, what cannot be is said."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import flyball as fb
from flyball.assembly.assemble import assemble
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.engine.kinematics import load_record
from tests.assembly.rough import framed, rough_four_bar
from tests.mechanisms import bricard, door, example, four_bar, spatial_four_bar
from tests.verification.test_reactions import actuated

# -------------------------------------------------------------------------------------------------- drawn closed


@pytest.mark.parametrize(
    "make",
    [
        four_bar,
        bricard,
        door,
        actuated,
        spatial_four_bar,
        lambda: example("governor.toml"),
        lambda: example("slider_crank.toml"),
    ],
)
def test_drawn_joints_need_no_movement(make):
    """Joints given by points of the drawn configuration are closed by construction: the start is bit-equal."""
    model = make()
    drawn = compile_mechanism(model)
    a = assemble(model)
    assert np.array_equal(a.q, drawn.values.q)
    assert a.moved == {}
    assert a.iterations == 0


# ------------------------------------------------------------------------------------------ joints given by frames


def closed(model, a):
    """Violation, rates, and the cosines between the z axes of all joints that align them."""
    c = a.compiled
    c.at(a.t, a.q, a.v)
    s = c.structure
    parallel = {}
    for j in model.joints:
        kinds = {r.axes for r in j.rows(model.planar)}
        if {"zx", "zy"} <= kinds:
            F, M = (load_record(c.work.frames, s.frame_at[j.name, role, ""])[1] for role in "FM")
            parallel[j.name] = F[2] * M[2] + F[5] * M[5] + F[8] * M[8]
    rates = c.jacobian() @ a.v - c.work.rows.nu
    return np.abs(c.work.rows.value).max(), np.abs(rates).max(), parallel


def assert_closed(model, a):
    gap, rate, parallel = closed(model, a)
    assert gap < 1e-10
    assert rate < 1e-9
    for name, cosine in parallel.items():
        assert cosine == pytest.approx(1.0, abs=1e-9), f"{name} is not parallel"


def rough_spatial_four_bar(seed=0, spread=0.3, angle=1.0, unit=1.0):
    """Revolute, spherical, universal, revolute, by frames; every body thrown and turned; lengths in parts of a unit."""
    m = fb.Mechanism("rough spatial four-bar")
    random = np.random.default_rng(seed)
    for name in ("crank", "coupler", "rocker"):
        axis = random.normal(size=3)
        turn = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
        m.add(
            fb.Body(
                name,
                mass=1,
                inertia=(0.01 * unit**2,) * 3,
                position=unit * spread * random.normal(size=3),
                orientation=turn,
                velocity=tuple(unit * np.array([0.3, -0.2, 0.5])),
                angular_velocity=(1, 2, -1),
            )
        )
    length = unit * np.sqrt(0.05**2 + 0.5**2 + 0.35**2)
    along_x, along_y = (0, "90 deg", 0), ("90 deg", 0, 0)
    framed(m, fb.Revolute, "A", "ground", (0, 0, 0), "crank", (0, 0, 0))
    framed(m, fb.Spherical, "B", "crank", (0.15 * unit, 0, 0), "coupler", (0, 0, 0))
    framed(m, fb.Universal, "C", "coupler", (0, 0, length), "rocker", (0, 0, 0.35 * unit), along_y, along_x)
    framed(m, fb.Revolute, "D", "ground", (0.2 * unit, 0.5 * unit, 0), "rocker", (0, 0, 0), along_x, along_x)
    return m


@pytest.mark.parametrize("unit", [1e-4, 1e4])
@pytest.mark.parametrize("seed", [16, 19, 24, 46, 55, 58])
def test_a_start_does_not_depend_on_the_unit_of_length(seed, unit):
    """Positions and velocities of a mechanism that is a ten thousandth or ten thousand times as large."""
    one, other = (rough_spatial_four_bar(seed, unit=u).assemble() for u in (1.0, unit))
    for before, after in zip((one.q, one.v), (other.q, other.v), strict=True):
        a, b = before.reshape(3, -1).copy(), after.reshape(3, -1).copy()
        b[:, :3] /= unit
        assert b == pytest.approx(a, abs=1e-9)


def chain(links, offset, angle, seed):
    """Revolutes one after another about different axes; every link starts ``offset`` away and turned by ``angle``."""
    m = fb.Mechanism("chain")
    random = np.random.default_rng(seed)
    before = "ground"
    for i in range(links):
        way, axis = random.normal(size=(2, 3))
        m.add(
            fb.Body(
                f"link {i}",
                mass=1,
                inertia=(0.01, 0.02, 0.02),
                position=offset * way / np.linalg.norm(way),
                orientation=Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)),
            )
        )
        framed(m, fb.Revolute, f"J{i}", before, (0.3, 0, 0), f"link {i}", (-0.3, 0, 0), turn_i=("70 deg", 0, 0))
        before = f"link {i}"
    return m


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("make", [rough_four_bar, rough_spatial_four_bar])
def test_rough_guesses_close(make, seed):
    model = make(seed=seed)
    a = assemble(model)
    assert_closed(model, a)
    assert len(a.moved) == 3


@pytest.mark.parametrize("seed", range(4))
def test_a_chain_closes_from_two_metres_and_170_degrees(seed):
    model = chain(4, 2.0, np.radians(170), seed)
    assert_closed(model, assemble(model))


@pytest.mark.parametrize("kind", [fb.Revolute, fb.Cylindrical, fb.Prismatic, fb.Fixed])
@pytest.mark.parametrize("turn", [(np.pi, 0, 0), (0, np.pi, 0), (np.pi, 1e-7, 0), ("179.99 deg", 0, "20 deg")])
def test_an_antiparallel_start_comes_out_parallel(kind, turn):
    """Perpendicular rows alone would be content with the axes pointing against each other."""
    m = fb.Mechanism("upside down")
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1), position=(0.1, 0.2, 0.3), orientation=turn))
    framed(m, kind, "J", "ground", (0, 0, 0), "b", (0, 0, 0.1))
    a = assemble(m)
    assert_closed(m, a)
    if kind in (fb.Prismatic, fb.Fixed):
        c = a.compiled
        F, M = (load_record(c.work.frames, c.structure.frame_at["J", role, ""])[1] for role in "FM")
        assert pytest.approx(F, abs=1e-9) == M


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True)
@given(st.integers(0, 10**6), st.floats(0, 1.0), st.floats(0, np.pi))
def test_a_spatial_four_bar_closes_from_anywhere(seed, spread, angle):
    model = rough_spatial_four_bar(seed, spread, angle)
    assert_closed(model, assemble(model))


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True)
@given(st.integers(0, 10**6), st.floats(0, 2.0))
def test_a_planar_four_bar_closes_from_anywhere(seed, spread):
    model = rough_four_bar(spread, seed)
    assert_closed(model, assemble(model))


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True)
@given(st.integers(0, 10**6), st.integers(1, 6), st.floats(0, 3.0), st.floats(0, np.pi))
def test_a_chain_closes_from_anywhere(seed, links, offset, angle):
    model = chain(links, offset, angle, seed)
    assert_closed(model, assemble(model))


def test_a_small_gap_is_closed_by_a_small_step():
    """A guess 1e-3 off moves by that order, not to another branch."""
    model = four_bar()
    exact = assemble(model).q
    rough = fb.Mechanism("nearly", planar=True)
    for b, dx in zip(model.bodies, (1e-3, -5e-4, 8e-4), strict=True):
        p = (b.position[0] + dx, b.position[1] - dx)
        rough.add(fb.Body(b.name, mass=b.mass, inertia=b.inertia, position=p, angle=b.angle + dx))
    half = {b.name: float(np.sqrt(12 * b.inertia / b.mass)) / 2 for b in model.bodies}
    framed(rough, fb.Revolute, "A", "ground", (0, 0), "crank", (-half["crank"], 0))
    framed(rough, fb.Revolute, "B", "crank", (half["crank"], 0), "coupler", (-half["coupler"], 0))
    framed(rough, fb.Revolute, "C", "coupler", (half["coupler"], 0), "rocker", (half["rocker"], 0))
    framed(rough, fb.Revolute, "D", "ground", (0.5, 0), "rocker", (-half["rocker"], 0))
    a = assemble(rough)
    assert_closed(rough, a)
    assert np.abs(a.q - exact).max() < 1e-2


# ---------------------------------------------------------------------------------------------- what is asked for


def test_fixed_bodies_stay_where_they_are():
    """Everything else comes to the body that is fixed, bit for bit unmoved, velocities included."""
    m = fb.Mechanism("fixed", planar=True)
    m.add(
        fb.Body(
            "held",
            mass=1,
            inertia=1,
            position=(1.0, 2.0),
            angle=0.3,
            velocity=(0.5, 0),
            angular_velocity=2.0,
            as_drawn=True,
        )
    )
    m.add(fb.Body("other", mass=1, inertia=1, position=(-1, 0)))
    framed(m, fb.Revolute, "J", "held", (0.5, 0), "other", (-0.5, 0))
    a = assemble(m)
    assert_closed(m, a)
    assert a.q[:3].tolist() == [1.0, 2.0, 0.3]
    assert a.v[:3].tolist() == [0.5, 0.0, 2.0]
    assert set(a.moved) == {"other"}


@pytest.mark.parametrize("value", [0.3, -1.2, 2.8])
def test_initial_values_and_rates_are_met(value):
    """The crank angle and its rate are those asked for; the rest of the loop follows."""
    m = four_bar()
    m.add(fb.Initial("A.angle", value=value, rate=-3.0))
    r = m.simulate(0.01, outputs=2)
    assert r["A"].angle[0] == pytest.approx(value, abs=1e-9)
    assert r["A"].rate[0] == pytest.approx(-3.0, abs=1e-10)
    assert r.health.violation < 1e-10
    assert r.health.velocity_violation < 1e-9


@pytest.mark.parametrize("value", [2e3, -1e6])
def test_a_slide_starts_far_from_where_it_is_drawn(value):
    """Drawn at the origin, told to begin a thousand times its size away."""
    m = fb.Mechanism("far", planar=True)
    m.add(fb.Body("b", mass=1, inertia=0.1), fb.Prismatic("J", "ground", "b", at=(0, 0), axis=(3, 4)))
    m.add(fb.Initial("J.displacement", value=value))
    assert m.assemble().q[:3] == pytest.approx([0.6 * value, 0.8 * value, 0.0], rel=1e-12, abs=1e-9)


def test_initial_values_of_points_slides_and_spatial_angles():
    m = actuated()
    for name, value in (("slide.displacement", 0.12), ("shoulder.angle", 0.4), ("load.x", 0.8), ("waist.angle", 0.7)):
        m.add(fb.Initial(name, value=value, rate=0.5))
    r = m.simulate(0.01, outputs=2)
    assert r["slide"].displacement[0] == pytest.approx(0.12, abs=1e-9)
    assert r["slide"].rate[0] == pytest.approx(0.5, abs=1e-9)
    assert r["shoulder"].angle[0] == pytest.approx(0.4, abs=1e-9)
    assert r["waist"].angle_rate[0] == pytest.approx(0.5, abs=1e-9)
    assert r["load.x"][0] == pytest.approx(0.8, abs=1e-9)
    assert r["load.vx"][0] == pytest.approx(0.5, abs=1e-9)


def test_a_driver_sets_the_start():
    """A driven crank starts where its law is at t_start, at the law's rate."""
    m = four_bar()
    m.add(fb.Driver("motor", "A.angle", "0.4 + 2*t"))
    a = assemble(m, t=0.5)
    assert_closed(m, a)
    r = m.simulate(0.51, t_start=0.5, outputs=2)
    assert r["A"].angle[0] == pytest.approx(1.4, abs=1e-10)
    assert r["A"].rate[0] == pytest.approx(2.0, abs=1e-10)


def test_velocities_change_as_little_as_they_can():
    """Of all consistent velocities those nearest in kinetic energy: the change is M-orthogonal to every free motion."""
    m = four_bar()
    random = np.random.default_rng(3)
    guess = fb.Mechanism("guess", planar=True)
    for b in m.bodies:
        v, w = random.normal(size=2), float(random.normal())
        guess.add(
            fb.Body(
                b.name,
                mass=b.mass,
                inertia=b.inertia,
                position=b.position,
                angle=b.angle,
                velocity=v,
                angular_velocity=w,
            )
        )
    for j in m.joints:
        guess.add(j)
    before = compile_mechanism(guess).values.v
    a = assemble(guess)
    assert_closed(guess, a)
    G, M = a.compiled.jacobian(), a.compiled.mass().toarray()
    _, _, Vt = np.linalg.svd(G)
    free = Vt[len(G) :].T
    assert free.shape[1] == 1
    assert np.abs(a.v).max() > 0.1
    assert free.T @ M @ (a.v - before) == pytest.approx([0.0], abs=1e-10)


@pytest.mark.parametrize("target", [1.0, 2.0, 3.0])
def test_large_turns_do_not_depend_on_the_axes_of_the_world(target):
    """A is driven to its target, B is free and follows by the nearest steps: the same however the world is turned."""
    angles = []
    for turn in ((0.0, 0.0, 0.0), (0.3, -1.2, 0.7), (1.0, 1.0, 1.0), (0.0, 0.0, 2.0)):
        R = Rotation.from_euler("xyz", turn)
        m = fb.Mechanism("axes")
        own = {"orientation": tuple(map(tuple, R.as_matrix().tolist()))}
        m.add(
            fb.Body("b1", mass=2.85, inertia=(0.109, 0.0885, 0.179), **own),
            fb.Body(
                "b2", mass=0.32, inertia=(0.01, 0.01, 0.01), position=tuple(R.apply((0.3, 0.4, 0))),
                com=(-0.19, 0.127, -0.1), **own,
            ),
            fb.Revolute("A", "ground", "b1", at=tuple(R.apply((0, 0, 0.1))), axis=tuple(R.apply((0, 0.22, -0.975)))),
            fb.Revolute("B", "b1", "b2", at=tuple(R.apply((0.3, 0.3, 0.1))), axis=tuple(R.apply((0.7, 0.31, 0.63)))),
            fb.Driver("D", "A.angle", str(target)),
        )  # fmt: skip
        angles.append(m.simulate(1e-9, outputs=2)["B"].angle[0])
    np.testing.assert_allclose(angles, angles[0], atol=1e-8)


@pytest.mark.parametrize("angle", [np.pi, -np.pi, np.pi + 1e-9, 3 * np.pi, -3 * np.pi, 5 * np.pi, 3.2, 2 * np.pi])
def test_an_initial_angle_of_any_number_of_half_turns_is_kept(angle):
    """At half a turn from the drawn position both ways round lead there; the turns are those that are given."""
    free, hinged = (fb.Mechanism("wheel", gravity=(0, 0, 0)) for _ in range(2))
    for m in (free, hinged):
        m.add(fb.Body("b", mass=1, inertia=(1, 1, 1)))
    free.add(fb.Initial("b.yaw", value=angle))
    hinged.add(fb.Revolute("R", "ground", "b", at=(0, 0, 0), axis=(0, 0, 1)), fb.Initial("R.angle", value=angle))
    assert free.simulate(0.01)["b.yaw"][0] == pytest.approx(angle, abs=1e-12)
    for coordinates in ("joint", "absolute"):
        run = hinged.simulate(0.01, coordinates=coordinates)
        assert run["R.angle"][0] == pytest.approx(angle, abs=1e-12)
