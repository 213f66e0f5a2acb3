"""Motions by code made for the mechanism are the motions of the engine for all mechanisms, within the tolerance."""

from __future__ import annotations

import ctypes
import re

import numpy as np
import pytest

import flyball as fb
from flyball.codegen import machine_code
from flyball.compiler.object_code import object_code_of_text
from flyball.expression_graph.graph import Graph
from flyball.expression_graph.printers.llvm import Module, Procedure
from flyball.math.scalar import choose
from tests.mechanisms import example, four_bar

SOME = {  # seconds of motion in which something happens, and not so many that differences grow
    "andrews.toml": 0.01,
    "double_wishbone.toml": 0.5,
    "heavy_top.toml": 0.5,
    "point_mass_pendulum.toml": 0.5,
    "rolling_disk.toml": 0.5,
}
TIGHT = {"rtol": 1e-10, "outputs": 11}


def differ(a: np.ndarray, b: np.ndarray) -> float:
    """The largest difference, by the largest value."""
    return float(np.abs(a - b).max() / (np.abs(b).max() or 1.0)) if b.size else 0.0


def same(m: fb.Mechanism, t_end: float, tolerance: float = 1e-7, **options) -> None:
    a, b = (m.simulate(t_end, specialize=x, **(TIGHT | options)) for x in (True, False))
    assert a.health.engine.startswith("made for this mechanism: ")
    assert "general engine" not in a.health.engine
    assert b.health.engine == "general engine: as requested"
    assert a.health.coordinates == b.health.coordinates
    assert differ(a.q, b.q) < tolerance
    assert differ(a.v, b.v) < tolerance
    assert differ(a.vdot, b.vdot) < 100 * tolerance
    assert differ(a.states, b.states) < tolerance
    assert a.health.violation <= 10 * b.health.violation + 1e-12
    assert abs(a.health.steps - b.health.steps) <= 2 + b.health.steps // 20


@pytest.mark.parametrize("name", SOME)
def test_examples(name):
    same(example(name), SOME[name])


STABILIZED = ["projection", "projection-steps", "positions", "velocities", "baumgarte", "none"]


@pytest.mark.parametrize("stabilization", STABILIZED)
def test_stabilizations(stabilization):
    same(four_bar(), 0.5, coordinates="absolute", stabilization=stabilization)


def test_integrators_and_coordinates():
    same(four_bar(), 0.3, coordinates="absolute", method="rk45", rtol=1e-8, tolerance=1e-5)
    same(four_bar(), 0.3, coordinates="joint")


def test_a_spring_beside_a_bushing():
    """Lengths that a trial evaluation assumes not to be zero belong to no procedure of the code."""
    m = fb.Mechanism("spring and bushing", planar=True)
    m.add(fb.Body("b", mass=1.0, inertia=0.1, position=(0.2, 0.3), velocity=(0.5, 0.2), angular_velocity=1.0))
    m.add(fb.SpringDamper("spring", "ground", "b", at=((0.0, 0.0), (0.2, 0.3)), stiffness=200.0, damping=1.0))
    m.add(fb.Bushing("bushing", "ground", "b", at=(0.2, 0.3), stiffness=300.0, torsional_stiffness=1.0))
    same(m, 0.3, coordinates="absolute")


def test_friction_in_joints():
    m = four_bar()
    m.add(fb.JointFriction("dry", joint="D", static=0.2, radius=0.02, stick_speed=1e-3))
    same(m, 0.3, tolerance=1e-6)


def test_driven_mechanisms_and_what_they_take():
    """Positions are followed; works and efforts come along."""
    m = four_bar()
    m.add(fb.Driver("motor", "A.angle", "6*t + 0.3*sin(5*t)"))
    a, b = (m.kinematics(21, t_end=1.0, specialize=x) for x in (True, False))
    assert a.health.engine.startswith("made for this mechanism")
    np.testing.assert_allclose(a.q, b.q, atol=1e-10)
    np.testing.assert_allclose(a["motor"].effort, b["motor"].effort, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(a["motor"].work, b["motor"].work, rtol=1e-7, atol=1e-9)


def oscillator() -> fb.Mechanism:
    m = fb.Mechanism("oscillator", planar=True, parameters={"k": "100 N/m", "x": 0.1})
    m.add(fb.Body("b", mass=1.0, inertia=1.0, position=("x", 0)))
    m.add(fb.Prismatic("slide", "ground", "b", at=("x", 0), axis=(1, 0), displacement="x"))
    m.add(fb.CoordinateSpring("spring", coordinate="slide.displacement", stiffness="k"))
    return m


def test_closed_form_at_several_values_of_the_parameters():
    """x = x0 cos(sqrt(k/m) t); the code that is made once serves all of them."""
    m = oscillator()
    for n, (k, x) in enumerate([(100.0, 0.1), (225.0, 0.1), (64.0, -0.2)]):
        r = m.simulate(2.0, parameters={"k": k, "x": x}, specialize=True, rtol=1e-9)
        np.testing.assert_allclose(r["b.x"], x * np.cos(np.sqrt(k) * r.t), atol=1e-7)
        assert n == 0 or r.health.engine == "made for this mechanism: kept in this process"


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize("windows", [1, 4])
def test_singular_positions_are_passed_and_energy_is_kept(windows, coordinates):
    """The parallelograms pass the positions in which they are a line, with their energy (IFToMM A02)."""
    m = example("n_four_bar.py", windows=windows)
    options = {"coordinates": coordinates, "rtol": 1e-9, "outputs": 401}
    made, tables = (m.simulate(4.0, specialize=wish, **options) for wish in (True, False))
    assert made.health.engine.startswith("made")
    assert "general engine" not in made.health.engine
    for r in (made, tables):
        angle = np.unwrap(r["A0"].angle)
        turned = angle.max() - angle.min()
        assert turned > 2.0 * np.pi, "flat on both sides"
        assert r.energy.drift < 1e-6 * np.ptp(r.energy.kinetic)
        assert r.health.violation < 1e-8
    assert differ(made.q, tables.q) < 1e-5
    for k in range(1, windows + 1):  # no window has left the others
        np.testing.assert_allclose(np.sin(made[f"A{k}"].angle), np.sin(made["A0"].angle), atol=1e-5)


def test_it_goes_on_from_where_it_ended():
    m = four_bar()
    whole = m.simulate(1.0, outputs=3, specialize=True, rtol=1e-10)
    first = m.simulate(0.5, outputs=2, specialize=True, rtol=1e-10)
    for wish in (True, False):
        rest = m.simulate(1.0, start=first, outputs=2, specialize=wish, rtol=1e-10)
        np.testing.assert_allclose(rest.q[-1], whole.q[-1], atol=1e-8)


def bead_that_reaches_the_end():
    """A bead on a curve that ends after a quarter of a circle."""
    u = np.linspace(-np.pi, 0, 41)
    m = fb.Mechanism("bead", planar=True)
    m.add(fb.Body("bead", mass=0.3, inertia=1e-3, position=(0, -1), velocity=(2, 0)))
    m.add(fb.Cam("wire", "ground", "bead", points=np.column_stack([np.cos(u), np.sin(u)]), at=(0, -1), closed=False))
    return m


def mount_turned_by_half_a_turn():
    m = fb.Mechanism("mount")
    m.add(fb.Body("b", mass=1.0, inertia=(1, 1.1, 1.2), angular_velocity=(0, 0, 2.0)))
    m.add(fb.Bushing("mount", "ground", "b", at=(0, 0, 0), torsional_stiffness=0.01))
    return m


def force_out_of_its_domain():
    m = fb.Mechanism("slide")
    m.add(fb.Body("b", mass=1.0, inertia=(1, 1, 1), velocity=(1.0, 0, 0)))
    m.add(fb.Prismatic("P", "ground", "b", axis=(1, 0, 0), at=(0, 0, 0)), fb.Sensor("x", "P.displacement"))
    m.add(fb.PointForce("push", "b", at=(0, 0, 0), force=("sqrt(0.5 - x)", 0, 0)))
    return m


def driver_out_of_its_domain():
    m = fb.Mechanism("driven")
    m.add(fb.Body("b", mass=1.0, inertia=(1, 1, 1)), fb.Body("c", mass=1.0, inertia=(1, 1, 1), position=(0, 1, 0)))
    m.add(fb.Prismatic("P", "ground", "b", axis=(1, 0, 0), at=(0, 0, 0)))
    m.add(fb.Revolute("R", "b", "c", axis=(0, 0, 1), at=(0, 0, 0)))
    m.add(fb.Driver("drive", "P.displacement", "0.1*asin(2*t)"))
    return m


@pytest.mark.parametrize("coordinates", ["joint", "absolute"])
@pytest.mark.parametrize(
    "make",
    [bead_that_reaches_the_end, mount_turned_by_half_a_turn, force_out_of_its_domain, driver_out_of_its_domain],
)
def test_what_is_not_defined_ends_the_motion_in_made_code_too(make, coordinates):
    """The same words at the same time: a curve that ends, a rotation without an axis, laws out of their domains."""
    ends = []
    for specialize in (True, False):
        with pytest.raises(fb.SimulationError) as e:
            make().simulate(4.0, specialize=specialize, coordinates=coordinates)
        ends.append(e.value)
    assert ends[0].t == pytest.approx(ends[1].t, rel=1e-6)
    words = [re.sub(r" = -\d\.\d+e-\d\d,", " = rounding,", str(e)).split(": ")[2:] for e in ends]
    assert words[0] == words[1]


def test_a_branch_that_is_nan_is_a_value_like_any_other():
    """``choose(x, nan, b)`` is nan where x > 0, in made code and in equations with symbols: an error stays one."""
    graph = Graph()
    x = graph.symbol("x")
    stores = [(("b", k), f) for k, f in enumerate((choose(x, np.nan + 0.0 * x, x), choose(x, 2.0 * x, np.nan)))]
    module = Module(machine_code.ARGUMENTS, lambda base: [])
    module.add(Procedure("A", {x.index: ("a", 0)}, stores))
    loaded = machine_code.LoadedProcedures(object_code_of_text(str(module)), ["A"])
    pointer, number = ctypes.c_void_p, ctypes.c_double
    call = ctypes.CFUNCTYPE(number, pointer, pointer, number, *[pointer] * 4)(loaded.addresses["A"])
    for value in (-1.0, 1.0):
        given, out = np.array([value]), np.zeros(2)
        call(None, None, 0.0, given.ctypes.data, out.ctypes.data, None, None)
        assert out == pytest.approx([np.nan, 2.0] if value > 0.0 else [-1.0, np.nan], nan_ok=True)
    m = fb.Mechanism("braked", planar=True, gravity=(0, 0))
    m.add(fb.Body("b", mass=1.0, inertia=1), fb.Prismatic("P", "ground", "b", axis=(1, 0), at=(0, 0)))
    m.add(fb.Brake("B", coordinate="P.displacement", capacity="0.1 - t"))
    assert "nan if t - 1/10 > 0" in str(m.symbolic())


UNDEFINED = [  # from t = 0.5 s on
    "0*sqrt(0.5 - value)", "none*log(0.5 - value)", "0*asin(2*value)", "0*(0.5 - value)**1.5", "value*0*sqrt(0.5 - value)",
    "0/log(0.5 - value)", "value/sqrt(0.5 - value)*sqrt(0.5 - value)", "log(0.5 - value)/log(0.5 - value)",
    "(sqrt(0.5 - value) - sqrt(0.5 - value))", "0*exp(2000*value)", "0*sqrt(0.5 - t)", "min(0*sqrt(0.5 - t), 1)",
    "max(1, sqrt(0.5 - t))",
]  # fmt: skip
DEFINED = [
    "sqrt(0.5 - value)**0", "sqrt(0.5 - value)**none", "0*tan(value)", "where(t < 0.5, 0*sqrt(0.5 - t), 0)",
    "where(t < 0.5, 1, 1)*0",
]  # fmt: skip


def pushed_block(*laws: str) -> fb.Mechanism:
    """A block on a slide at 1 m/s, pushed by laws of where it is and of time."""
    m = fb.Mechanism("block", planar=True, parameters={"none": 0.0})
    m.add(fb.Body("b", mass=1, inertia=1, velocity=(1, 0)))
    m.add(fb.Prismatic("slide", "ground", "b", at=(0, 0), axis=(1, 0)))
    m.add(*(fb.Actuator(f"F{k}", "slide.displacement", force=law) for k, law in enumerate(laws)))
    return m


@pytest.mark.parametrize("law", UNDEFINED)
def test_a_law_has_no_value_in_made_code_where_it_has_none_in_the_tables(law):
    """What multiplies it by zero, or takes it away again, does not give it one."""
    ends = []
    for specialize in (True, False):
        with pytest.raises(fb.SimulationError, match="the law of Actuator 'F0'") as e:
            pushed_block(f"0.2*value + {law}").simulate(1.0, outputs=8, specialize=specialize)
        ends.append(e.value.t)
    assert ends[0] == pytest.approx(ends[1], rel=1e-6)


@pytest.mark.parametrize("law", DEFINED)
def test_a_law_has_a_value_in_made_code_where_it_has_one_in_the_tables(law):
    same(pushed_block(f"0.2*value + {law}"), 1.0)


def test_forces_that_cancel_have_no_value_where_each_has_none():
    m = pushed_block("sqrt(0.5 - value)", "-sqrt(0.5 - value)")
    for specialize in (True, False):
        with pytest.raises(fb.SimulationError, match="the law of Actuator 'F0'"):
            m.simulate(1.0, outputs=8, specialize=specialize)
