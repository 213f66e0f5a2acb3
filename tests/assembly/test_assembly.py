"""Assembly: what is closed stays as it is, what is open closes, what is fixed stays fixed, what cannot be is said."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import flyball as fb
from flyball.analysis.assemble import assemble
from flyball.analysis.compiled import compiled
from flyball.equations.records import load
from flyball.tables.system import G_VALUE, NU
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
    drawn = compiled(model)
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
            F, M = (load(c.work.FK, s.frame_at[j.name, role, ""])[1] for role in "FM")
            parallel[j.name] = F[2] * M[2] + F[5] * M[5] + F[8] * M[8]
    rates = c.jacobian() @ a.v - c.work.row[NU]
    return np.abs(c.work.row[G_VALUE]).max(), np.abs(rates).max(), parallel


def assert_closed(model, a):
    gap, rate, parallel = closed(model, a)
    assert gap < 1e-10
    assert rate < 1e-9
    for name, cosine in parallel.items():
        assert cosine == pytest.approx(1.0, abs=1e-9), f"{name} is not parallel"


def framed(model, kind, name, i, p, j, q, turn_i=None, turn_j=None):
    """A joint between a frame at p on body i and a frame at q on body j."""
    for role, body, at, turn in (("F", i, p, turn_i), ("M", j, q, turn_j)):
        more = {} if turn is None else {"orientation": turn}
        model.add(fb.Frame(f"{name} {role}", body, position=at, **more))
    model.add(kind(name, f"{name} F", f"{name} M"))


def rough_four_bar(spread=0.3, seed=0):
    """The planar four-bar by lengths only, every body thrown somewhere."""
    m = fb.Mechanism("rough four-bar", planar=True)
    random = np.random.default_rng(seed)
    for name, length in (("crank", 0.2), ("coupler", 0.5), ("rocker", 0.4)):
        p = random.normal(size=2) * spread
        m.add(fb.Body(name, mass=1, inertia=length**2 / 12, position=p, angle=random.uniform(-np.pi, np.pi)))
    framed(m, fb.Revolute, "A", "ground", (0, 0), "crank", (-0.1, 0))
    framed(m, fb.Revolute, "B", "crank", (0.1, 0), "coupler", (-0.25, 0))
    framed(m, fb.Revolute, "C", "coupler", (0.25, 0), "rocker", (0.2, 0))
    framed(m, fb.Revolute, "D", "ground", (0.5, 0), "rocker", (-0.2, 0))
    return m


def rough_spatial_four_bar(seed=0, spread=0.3, angle=1.0):
    """Revolute, spherical, universal, revolute, by frames; every body thrown and turned."""
    m = fb.Mechanism("rough spatial four-bar")
    random = np.random.default_rng(seed)
    for name in ("crank", "coupler", "rocker"):
        axis = random.normal(size=3)
        turn = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis))
        m.add(
            fb.Body(name, mass=1, inertia=(0.01, 0.01, 0.01), position=spread * random.normal(size=3), orientation=turn)
        )
    length = np.sqrt(0.05**2 + 0.5**2 + 0.35**2)
    along_x, along_y = (0, "90 deg", 0), ("90 deg", 0, 0)
    framed(m, fb.Revolute, "A", "ground", (0, 0, 0), "crank", (0, 0, 0))
    framed(m, fb.Spherical, "B", "crank", (0.15, 0, 0), "coupler", (0, 0, 0))
    framed(m, fb.Universal, "C", "coupler", (0, 0, length), "rocker", (0, 0, 0.35), along_y, along_x)
    framed(m, fb.Revolute, "D", "ground", (0.2, 0.5, 0), "rocker", (0, 0, 0), along_x, along_x)
    return m


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
        F, M = (load(c.work.FK, c.structure.frame_at["J", role, ""])[1] for role in "FM")
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
    before = compiled(guess).values.v
    a = assemble(guess)
    assert_closed(guess, a)
    G, M = a.compiled.jacobian(), a.compiled.mass().toarray()
    _, _, Vt = np.linalg.svd(G)
    free = Vt[len(G) :].T
    assert free.shape[1] == 1
    assert np.abs(a.v).max() > 0.1
    assert free.T @ M @ (a.v - before) == pytest.approx([0.0], abs=1e-10)


# --------------------------------------------------------------------------------------------- what cannot be


def test_an_impossible_assembly_names_joints_and_gaps():
    """Links too short to meet: 3 m between the pivots, 0.2 + 0.5 + 0.4 m of links."""
    m = rough_four_bar()
    far = fb.Mechanism("too short", planar=True)
    for e in m.elements():
        if e.name != "D F":
            far.add(e) if e.name != "D" else far.add(fb.Frame("D F", "ground", position=(3.0, 0)), e)
    with pytest.raises(fb.AssemblyError, match="'too short' cannot be assembled at t = 0 s") as caught:
        assemble(far)
    error = caught.value
    assert set(error.gaps) <= set("ABCD")
    assert len(error.gaps) > 0
    total = sum(metres for metres, _ in error.gaps.values())
    assert total == pytest.approx(1.9, abs=0.01)
    assert "from closed" in str(error)
    assert all(name in str(error) for name in error.gaps)


def test_axes_that_cannot_be_parallel_are_told_in_degrees():
    """A body on two hinges whose axes are 10 degrees apart on it and parallel on ground."""
    m = fb.Mechanism("twisted")
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1)))
    framed(m, fb.Revolute, "left", "ground", (0, 0, 0), "b", (0, 0, 0))
    framed(m, fb.Revolute, "right", "ground", (0, 0, 1), "b", (0, 0, 1), turn_j=("10 deg", 0, 0))
    with pytest.raises(fb.AssemblyError, match=r"deg from closed") as caught:
        assemble(m)
    assert set(caught.value.gaps) == {"left", "right"}


def test_contradictory_drivers():
    """Two drivers want different angles of the same loop; then the same angle at different rates."""
    m = four_bar()
    m.add(fb.Driver("one", "A.angle", "0.5"), fb.Driver("two", "D.angle", "2.0"))
    with pytest.raises(fb.AssemblyError) as caught:
        assemble(m)
    assert {"one", "two"} & set(caught.value.gaps)
    m = four_bar()
    m.add(fb.Driver("one", "A.angle", "t"), fb.Driver("two", "A.angle", "2*t"))
    with pytest.raises(fb.AssemblyError, match="no velocities fulfil all constraints") as caught:
        assemble(m)
    assert {"one", "two"} <= set(caught.value.gaps)


def test_fixed_bodies_that_cannot_meet():
    m = fb.Mechanism("apart", planar=True)
    m.add(
        fb.Body("a", mass=1, inertia=1, as_drawn=True), fb.Body("b", mass=1, inertia=1, position=(1, 0), as_drawn=True)
    )
    framed(m, fb.Revolute, "J", "a", (0, 0), "b", (0, 0))
    with pytest.raises(fb.AssemblyError, match="J is 1 m from closed"):
        assemble(m)


@pytest.mark.parametrize("off", [1e-5, 1e-7, 1e-9])
@pytest.mark.parametrize("resting", [True, False])
def test_velocities_all_but_at_a_singular_position(off, resting):
    """A parallelogram a hair from flat: its cranks can only turn at the same rate, and rest is always allowed."""
    m = fb.Mechanism("flat", planar=True)
    tip = (0.3 * np.cos(off), 0.3 * np.sin(off))
    given = {"velocity": (0, 0), "angular_velocity": 0} if resting else {}
    m.add(fb.Body("bar", mass=1, inertia=0.01, position=(tip[0] + 0.25, tip[1]), **given))
    for name, x in (("left", 0.0), ("right", 0.5)):
        m.add(fb.Body(name, mass=1, inertia=0.01, position=(x, 0), angular_velocity=4.0))
        m.add(fb.Revolute(f"A {name}", "ground", name, at=(x, 0)))
        m.add(fb.Revolute(f"B {name}", name, "bar", at=(x + tip[0], tip[1])))
    a = assemble(m)
    c = a.compiled
    c.at(0.0, a.q, a.v)
    assert np.abs(c.jacobian() @ a.v).max() < 1e-11
    turn = a.v.reshape(3, 3)[:, 2]  # of the bar and both cranks
    # the momentum of the two cranks, 2 x 0.01 x 4, is shared with the bar of 1 kg that they carry at 0.3 m
    # where it is said to rest; else it follows them
    w = 2 * 0.01 * 4.0 / (2 * 0.01 + 1.0 * 0.3**2) if resting else 4.0
    assert turn == pytest.approx([0.0, w, w], abs=1e-4)


def test_a_rate_at_every_hinge_of_a_long_chain():
    """Relative rates w add up along the chain: body k turns at (k + 1) w, its middle follows the hinges before it."""
    n, w = 800, 0.01
    m = fb.Mechanism("chain", planar=True)
    for k in range(n):
        m.add(fb.Body(f"b{k}", mass=1, inertia=0.1, position=(k + 0.5, 0)))
        m.add(
            fb.Revolute(f"J{k}", f"b{k - 1}" if k else "ground", f"b{k}", at=(k, 0)), fb.Initial(f"J{k}.angle", rate=w)
        )
    v = assemble(m).v.reshape(n, 3)
    turning = w * np.arange(1, n + 1)
    assert v[:, 2] == pytest.approx(turning, rel=1e-7)
    assert v[:, 1] == pytest.approx(np.cumsum(turning) - 0.5 * turning, rel=1e-7)
    assert np.abs(v[:, 0]).max() < 1e-7 * v[:, 1].max()


def test_a_law_without_a_value_at_the_start_is_named():
    m = fb.Mechanism("p", planar=True)
    m.add(fb.Body("rod", mass=1, inertia=1, position=(0, -0.5)))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Driver("motor", "A.angle", "sqrt(t - 0.5)"))
    with pytest.raises(fb.AssemblyError, match="the law of Driver 'motor' has no finite value there"):
        m.assemble()
    assert m.assemble(t=0.75).q[2] == pytest.approx(0.5)


@pytest.mark.parametrize("away", [1e4, 1e8, 1e11])
def test_far_from_the_origin_closed_is_what_rounding_allows(away):
    """The planar four-bar by lengths only, its pivots that far away: coordinates there have eps times as much left."""
    near = rough_four_bar()
    m = fb.Mechanism("far", planar=True)
    for e in near.elements():
        if isinstance(e, fb.Body) or (isinstance(e, fb.Frame) and e.body == "ground"):
            e = replace(e, position=(e.position[0] + away, e.position[1]))
        m.add(e)
    a = m.assemble()
    a.compiled.at(0.0, a.q, a.v)
    assert np.abs(a.compiled.work.row[G_VALUE]).max() < 1e-10 + 16 * np.finfo(float).eps * away


@pytest.mark.parametrize("size", [1e-6, 1e3])
def test_closed_is_relative_to_the_size(size):
    """The same a million times smaller, or larger: closed to the same part of its length."""
    near = rough_four_bar()
    m = fb.Mechanism("scaled", planar=True)
    for e in near.elements():
        m.add(replace(e, position=tuple(size * x for x in e.position)) if isinstance(e, (fb.Body, fb.Frame)) else e)
    a = m.assemble()
    a.compiled.at(0.0, a.q, a.v)
    assert np.abs(a.compiled.work.row[G_VALUE]).max() < 1e-10 * size
