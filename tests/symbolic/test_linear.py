"""Linear equations with expressions in them: equal to the numeric ones, and to closed forms for all parameters."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from flyball.expression_graph.graph import evaluate
from flyball.symbolic.linear.linear_equations import linear_equations
from tests.analyses.classical import bicycle, column, stand
from tests.analyses.made import G, chain, conical_pendulum, parallelogram, rod, watt
from tests.symbolic.small import cart

LAYERS = ("joint", "absolute")


def same(L, N, rel=1e-10):
    """The same states, and matrices that agree."""
    assert L.states == N.states
    assert L.inputs == N.inputs
    assert L.outputs == N.outputs
    assert (L.matrices.state_units, L.matrices.input_units, L.matrices.output_units) == (
        N.state_units,
        N.input_units,
        N.output_units,
    )
    for k, X in L.values().items():
        assert pytest.approx(getattr(N, k), rel=rel, abs=rel * (1e-300 + np.abs(X).max(initial=0.0))) == X


@pytest.mark.parametrize("layer", LAYERS)
def test_matrices_are_those_of_linearize(layer):
    """Forces and parameters as inputs; coordinates, velocities, accelerations and reactions as outputs."""
    inputs, outputs = ["push.x", "g", "m"], ["pin.angle", "cart.vx", "pin.fy", "rod.ax", "energy.potential"]
    same(
        linear_equations(cart(), inputs, outputs, coordinates=layer),
        cart().linearize(inputs, outputs, coordinates=layer),
    )


@pytest.mark.parametrize("layer", LAYERS)
@pytest.mark.parametrize(
    "make", [rod, lambda: chain(4), parallelogram, lambda: parallelogram(0.0, 3), lambda: column(2, True, 0.1)]
)
def test_closed_chains_and_followers(make, layer):
    """Reactions that turn with the bodies, redundant rows, forces without a potential."""
    m = make()
    same(linear_equations(m, coordinates=layer), m.linearize(coordinates=layer))


def test_other_values_need_no_new_derivation():
    L = linear_equations(cart(), ["push.x"], ["pin.angle"])
    other = cart(M=1.0, m=0.3, l=0.8, J=0.1, g=1.62).linearize(["push.x"], ["pin.angle"], coordinates="joint")
    found = L.values(M=1.0, m=0.3, l=0.8, J=0.1, g=1.62)
    assert found["A"] == pytest.approx(other.A, rel=1e-12)
    assert found["B"] == pytest.approx(other.B, rel=1e-12)


def test_steady_motions_seen_by_their_joints():
    """A governor with its engine, a conical pendulum, a bicycle that rolls straight."""
    m = watt(3.0)[0]
    same(
        linear_equations(m, ["steam"], ["lift", "shaft.angle_rate"]),
        m.linearize(["steam"], ["lift", "shaft.angle_rate"], coordinates="joint"),
    )
    for m in (conical_pendulum(), bicycle()):
        same(linear_equations(m), m.linearize(coordinates="joint"))


@pytest.mark.parametrize("rate", ["w", "2 rad/s", 2.0])
def test_initial_conditions_in_words(rate):
    """A wheel that spins evenly, told by a parameter or with a unit."""
    m = fb.Mechanism("wheel", planar=True, parameters={"w": 2.0})
    m.add(fb.Body("b", mass=1, inertia=0.1), fb.Revolute("A", "ground", "b", at=(0, 0)))
    m.add(fb.Initial("A.angle", value="30 deg", rate=rate))
    same(linear_equations(m), m.linearize(coordinates="joint"))


def test_about_an_equilibrium_that_was_found():
    """The IFToMM governor: springs as stiff as rods, spinning at the speed that is kept."""
    m = fb.load(Path(__file__).parents[2] / "examples" / "governor.toml")
    found = m.equilibrium(turning=["bearing.angle"])
    L = linear_equations(m, outputs=["guide.displacement"], at=found)
    same(L, m.linearize(outputs=["guide.displacement"], about=found, coordinates="joint"))
    assert len(L.conditions) > 0  # other springs would rest elsewhere


def test_a_point_that_is_given_as_an_expression():
    """A rod on a spring: the stiffness that holds it at an angle is told by the equilibrium."""
    p = {"m": 2.0, "l": 0.4, "k": 1.0, "g": 9.81, "alpha": 0.5}
    m = fb.Mechanism("held rod", planar=True, gravity=(0, "-g"), parameters=p)
    m.add(fb.Body("rod", mass="m", inertia="m*l**2/3", position=(0, "l")))
    m.add(fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.CoordinateSpring("spring", "A.angle", stiffness="k", rest=0))
    L = linear_equations(m, at={"A.angle": "alpha"}, balanced_by=["k"])
    for alpha in (0.2, 0.5, 1.2):
        k = 2.0 * G * 0.4 * np.sin(alpha) / alpha
        assert L.balance(alpha=alpha)["k"] == pytest.approx(k, rel=1e-13)
        w2 = (k - 2.0 * G * 0.4 * np.cos(alpha)) / (4 / 3 * 2.0 * 0.4**2)
        assert L.values(alpha=alpha)["A"][1, 0] == pytest.approx(-w2, rel=1e-13)
    with pytest.raises(fb.ModelError, match="'k' has the value with which"):
        L.values(k=3.0)
    with pytest.raises(fb.ModelError, match=r"in no equilibrium there: .* left along A\.angle"):
        linear_equations(m, at={"A.angle": "alpha"})
    with pytest.raises(fb.ModelError, match="not linear in alpha"):
        linear_equations(m, at={"A.angle": "alpha"}, balanced_by=["alpha"])
    with pytest.raises(fb.ModelError, match=r"no coordinate 'B\.angle'"):
        linear_equations(m, at={"B.angle": 0.1})


def test_the_rate_of_spin_may_be_a_parameter():
    """A bead on a turning arm: x'' = (W^2 - k/m) x for every rate of spin."""
    m = fb.Mechanism("bead", parameters={"W": 2.0, "k": 30.0, "mass": 1.5})
    m.add(fb.Body("arm", mass=1, inertia=(1, 1, 1)), fb.Body("bead", mass="mass", inertia=(0.1, 0.1, 0.1)))
    m.add(fb.Revolute("hub", "ground", "arm", at=(0, 0, 0), axis=(0, 0, 1)))
    m.add(fb.Prismatic("slot", "arm", "bead", at=(0, 0, 0), axis=(1, 0, 0)))
    m.add(fb.CoordinateSpring("spring", "slot.displacement", stiffness="k"))
    m.add(fb.Driver("drive", "hub.angle", "W*t"))
    L = linear_equations(m)
    assert L.states == ("slot.displacement", "slot.displacement rate")
    for W in (1.0, 5.0):
        assert L.values(W=W)["A"] == pytest.approx(np.array([[0, 1], [W**2 - 20.0, 0]]), rel=1e-14)


def test_what_is_refused():
    with pytest.raises(fb.ModelError, match=r"singular position there: the constraints of .*B1"):
        linear_equations(parallelogram(np.pi / 2), coordinates="absolute")
    with pytest.raises(fb.ModelError, match=r"singular position there: the constraints of .*B"):
        linear_equations(parallelogram(np.pi / 2))
    with pytest.raises(fb.ModelError, match="no input 'pull'"):
        linear_equations(cart(), ["pull"])
    with pytest.raises(fb.ModelError, match=r"cart.*z"):
        linear_equations(cart(), outputs=["cart.z"])
    with pytest.raises(fb.ModelError, match="unknown coordinates 'minimal'"):
        linear_equations(cart(), coordinates="minimal")
    with pytest.raises(fb.ModelError, match="do not determine the other coordinates"):
        linear_equations(cart(), independent=["pin.angle"])
    m = cart()
    m.add(fb.Driver("drive", "rail.displacement", "0.0"))
    with pytest.raises(fb.AnalysisError, match="second rate of input 'drive'"):
        _ = linear_equations(m, ["drive"], ["cart.ax"]).D
    m = cart()
    m.forces.clear()
    m.add(fb.PointForce("pulse", "rod", at=(0, 0.6), force=("0", "sin(t)")))
    with pytest.raises(fb.AnalysisError, match="laws change with time"):
        linear_equations(m)


def test_drivers_as_inputs():
    """The cart is driven: the input acts through its second rate."""
    m = cart()
    m.add(fb.Driver("drive", "rail.displacement", "0.0"))
    for layer in LAYERS:
        same(
            linear_equations(m, ["drive"], ["pin.angle", "rod.x"], coordinates=layer),
            m.linearize(["drive"], ["pin.angle", "rod.x"], coordinates=layer),
        )


def test_conditions_are_told():
    """What rests where it is drawn for one stiffness only says so."""
    m = stand(0.2)
    assert linear_equations(m).conditions == []
    m.parameters["lean"] = 0.0
    m.add(fb.PointTorque("twist", "rod", torque="lean"))
    (condition,) = linear_equations(m).conditions
    assert evaluate([condition], {"lean": 2.5}) == [-2.5]


def test_matrices_are_shown():
    """As text, LaTeX and SymPy expressions, as those of the equations that they come from."""
    m = fb.Mechanism("hang", planar=True, gravity=(0, "-g"), parameters={"g": 10.0, "m": 2.0, "k": 100.0})
    m.add(fb.Body("b", mass="m", inertia=1.0, position=(0, -0.5)))
    m.add(fb.Prismatic("P", "ground", "b", at=(0, -0.5), axis=(0, 1)))
    m.add(fb.SpringDamper("s", "ground", "b", at=((0, 0), (0, -0.5)), stiffness="k", length="0.5 - m*g/k"))
    A = m.symbolic().linear(["b.y"]).A
    assert "k/m" in str(A) and r"\frac{k}{m}" in A.latex()
    assert "k/m" in str(A.sympy()) and A.simplified().shape == (2, 2)


def test_no_motion_is_mistaken_for_rest():
    """What is told of coordinates that the equations are not in, and what turns by velocities that do not stay."""
    m = fb.Mechanism("spin", gravity=(0, 0, -G))
    m.add(fb.Body("arm", mass=1, inertia=(1, 1, 1), position=(0.3, 0, 0)))
    m.add(fb.Revolute("hub", "ground", "arm", at=(0, 0, 0), axis=(0, 0, 1)), fb.Initial("hub.angle", rate=3.0))
    with pytest.raises(fb.ModelError, match=r"initial condition of 'hub\.angle' is for a coordinate"):
        linear_equations(m, coordinates="absolute")
    same(linear_equations(m), m.linearize(coordinates="joint"))
    with pytest.raises(fb.AnalysisError, match="is in no steady state there"):
        linear_equations(watt(3.0)[0], coordinates="absolute")
    slider = fb.Mechanism("driven", planar=True)
    slider.add(fb.Body("crank", mass=1, inertia=1, position=(0.5, 0)))
    slider.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Driver("drive", "A.angle", "2"))
    assert linear_equations(slider).states == ()


def test_rounding_is_no_force():
    """Posts that gravity leaves 1e-16 N m on, and a closed chain that nothing acts on."""
    from tests.examples.test_examples import mechanism

    for name, layer in (("n_four_bar.py", "absolute"), ("spatial_four_bar.toml", "joint")):
        m = mechanism(name)
        L = linear_equations(m, at=m.equilibrium(), coordinates=layer)
        assert L.conditions == []
        assert pytest.approx(m.linearize(about=m.equilibrium(), coordinates=layer).A, rel=1e-9, abs=1e-9) == L.A.at(
            {}
        ).astype(float)


def test_a_body_that_spins_about_a_principal_axis():
    """Euler's equations about it, and small turns in axes that turn with the body: x' = w_x + W y."""
    m = fb.Mechanism("top", parameters={"A": 0.2, "B": 0.3, "C": 0.4, "W": 5.0})
    m.add(fb.Body("b", mass=1.0, inertia=("A", "B", "C"), angular_velocity=(0, 0, "W")))
    L = linear_equations(m)
    for told in ({}, {"A": 0.5, "W": -2.0}):
        p = {**L.parameters, **told}
        found = L.A.at(told)
        x, y = (L.states.index(f"b.turn {k}") for k in "xy")
        wx, wy = (L.states.index(f"b.turn {k} rate") for k in "xy")
        assert found[x, y] == pytest.approx(p["W"], rel=1e-14)
        assert found[y, x] == pytest.approx(-p["W"], rel=1e-14)
        assert found[wx, wy] == pytest.approx((p["B"] - p["C"]) / p["A"] * p["W"], rel=1e-12)
        assert found[wy, wx] == pytest.approx((p["C"] - p["A"]) / p["B"] * p["W"], rel=1e-12)


def test_numbers_with_which_the_point_is_no_equilibrium_are_refused():
    """A mass on a spring that is as long as drawn for one mass only; a length with which a loop opens."""
    m = fb.Mechanism("hang", planar=True, gravity=(0, "-g"), parameters={"g": 10.0, "m": 1.0, "k": 100.0, "L0": 0.4})
    m.add(fb.Body("b", mass="m", inertia=1.0, position=(0, -0.5)))
    m.add(fb.Prismatic("P", "ground", "b", at=(0, -0.5), axis=(0, 1)))
    m.add(fb.SpringDamper("s", "ground", "b", at=((0, 0), (0, -0.5)), force="k*(length-L0) + 1e3*(length-0.5)**3"))
    for at in (None, m.equilibrium()):
        L = m.symbolic().linear(["b.y"], at=at)
        shown = str(L)
        assert "A =" in shown and "C =" in shown and "k/m" in shown
        for ask in (L.A.at, lambda x, L=L: L.values(**x), lambda x, L=L: L.routh().holds(**x)):
            ask({"m": 2.0, "L0": 0.3})
            ask({"m": 2.0, "g": 5.0})
            with pytest.raises(fb.ModelError, match="m = 2 'hang' is in no equilibrium"):
                ask({"m": 2.0})
    m = fb.load(Path(__file__).parents[2] / "examples" / "slider_crank.toml")
    m.drivers.clear()
    L = m.symbolic().linear(at=m.equilibrium())
    with pytest.raises(fb.ModelError, match="rod = 1 the loops of 'slider crank' do not close"):
        L.A.at({"rod": 1.0})
