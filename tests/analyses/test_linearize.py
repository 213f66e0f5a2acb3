"""Linear equations against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball.assembly.assemble import assemble
from flyball.derivatives.equation_derivatives import EquationDerivatives, MechanismState
from flyball.derivatives.linearized_equations import free_coordinates
from flyball.errors import ModelError
from flyball.symbolic.linear.linear_equations import linear_equations
from tests.analyses.made import G, conical_pendulum, parallelogram, rod, watt

LAYERS = ("absolute", "joint")


def squares(L) -> float:
    return float((L.stiffness / L.mass)[0, 0])


@pytest.mark.parametrize("layer", LAYERS)
def test_stiffness_of_joints_that_turn_with_bodies(layer):
    """omega^2 = 1.5 g for a uniform rod of 1 m; the same upside down with the sign reversed."""
    assert squares(rod().linearize(coordinates=layer)) == pytest.approx(14.715, rel=1e-10)
    assert squares(rod(np.pi).linearize(coordinates=layer)) == pytest.approx(-14.715, rel=1e-10)


@pytest.mark.parametrize("layer", LAYERS)
def test_hanging_parallelogram(layer):
    """Two rods and a bar that goes round without turning: omega^2 = (1/2 + 1 + 1/2) g / (1/3 + 1 + 1/3)."""
    assert squares(parallelogram().linearize(coordinates=layer)) == pytest.approx(11.772, rel=1e-10)


@pytest.mark.parametrize(
    ("name", "instead"),
    [("push.work", "push.power"), ("spring.work", "spring.power"), ("energy.balance", "energy.total"), ("W", "push.p")],
)
def test_what_counts_from_the_start_is_no_output(name, instead):
    """The work of a constant torque is no function of a state: it was told as one that nothing changes."""
    m = rod()
    joint = m.joints[0].name
    m.add(fb.TorsionalSpringDamper("spring", joint, stiffness=5), fb.Motor("push", joint, torque=0))
    m.add(fb.Sensor("W", "push.work"))
    with pytest.raises(ModelError, match=f"output {name!r} accumulates from the start of a motion.*{instead}"):
        m.linearize(["push"], [name])
    assert m.linearize(["push"], ["push.power", "energy.total"]).C.shape == (2, 2)


def test_self_stress_changes_nothing():
    """A third crank makes the reactions undetermined; whatever they are, the linear equations are the same."""
    a = assemble(parallelogram(0.0, 3))
    x = MechanismState.moving(a.compiled, 0.0, a.q, a.v)
    U, d, _ = np.linalg.svd(a.compiled.jacobian())
    own = U[:, (d > 1e-9 * d[0]).sum() :]
    assert own.shape[1] == 1
    found = []
    for stress in (0.0, 100.0):
        e = EquationDerivatives(MechanismState(x.c, x.t, x.q, x.v, x.z, x.vdot, x.lam + stress * own[:, 0], x.effort))
        Z = free_coordinates(e).Z
        found.append(Z.T @ e.by_position[e.at["r"]] @ Z)
    assert found[1] == pytest.approx(found[0], rel=1e-11)


@pytest.mark.parametrize("layer", LAYERS)
def test_conical_pendulum(layer):
    """From the turning frame: omega^2 = (g / cos) (1 + 3 cos^2) at 1 rad (Routh, Advanced Rigid Dynamics, 1905)."""
    L = conical_pendulum().linearize(coordinates=layer)
    assert L.turning == pytest.approx([0, 0, np.sqrt(G / np.cos(1.0))], abs=1e-9)
    w = L.eigenvalues
    assert np.sort(w[2:].imag) == pytest.approx([-5.83588888, 5.83588888], abs=1e-7)
    assert np.abs(w[2:].real).max() < 1e-7
    assert abs(w[2].imag) == pytest.approx(np.sqrt(G / np.cos(1) * (1 + 3 * np.cos(1) ** 2)), rel=1e-10)
    assert np.abs(w[:2]).max() < 1e-6  # a double zero: rounding shows by its square root


def sleeping_top(spin: float) -> fb.Mechanism:
    m = fb.Mechanism("top", gravity=(0, 0, -G))
    m.add(fb.Body("top", mass=2, inertia=(0.02, 0.02, 0.005), position=(0, 0, 0.1), angular_velocity=(0, 0, spin)))
    m.add(fb.Spherical("tip", "ground", "top", at=(0, 0, 0)))
    return m


@pytest.mark.parametrize("spin", [40.0, 80.0])
@pytest.mark.parametrize("layer", LAYERS)
def test_sleeping_top(layer, spin):
    """A z'' - i C n z' - m g l z = 0 in the tilt z seen from the ground; asleep from C n > 2 sqrt(A m g l) on."""
    A, C, mgl = 0.02 + 2 * 0.01, 0.005, 2 * G * 0.1
    roots = np.roots([A, -1j * C * spin, -mgl])
    L = sleeping_top(spin).linearize(coordinates=layer)
    turned = 1j * L.turning[2]
    wanted = np.concatenate([roots - turned, np.conj(roots - turned)])
    for w in wanted:
        assert np.abs(L.eigenvalues - w).min() < 1e-7 * abs(w)
    assert (L.eigenvalues.real.max() < 1e-6) == (C * spin > 2 * np.sqrt(A * mgl))


@pytest.mark.parametrize("part", [0.9, 1.1])
def test_rolling_disk_upright(part):
    """A thin uniform disk rolls stably from v^2 = g r / 3 on (Routh 1905; Neimark and Fufaev 1972)."""
    r = 0.5
    v = part * np.sqrt(G * r / 3)
    m = fb.Mechanism("disk", gravity=(0, 0, -G))
    I = r * r / 4
    moving = {"velocity": (v, 0, 0), "angular_velocity": (0, v / r, 0)}
    m.add(fb.Body("disk", mass=1, inertia=(I, I, 2 * I), position=(0, 0, r), orientation=(np.pi / 2, 0, 0), **moving))
    m.add(fb.RollingDisk("road", "ground", "disk", at=(0, 0, r), axis=(0, 1, 0), radius=r))
    L = m.linearize()
    # 5/4 lean'' = g/r lean - 3 (v/r)^2 lean, in units of r (Neimark and Fufaev 1972, chapter 3)
    square = (G / r - 3 * (v / r) ** 2) / 1.25
    assert np.abs(L.eigenvalues - np.sqrt(complex(square))).min() < 1e-6
    assert (L.eigenvalues.real.max() > 1e-3) == (part < 1)
    assert len(L.states) == 8
    assert L.mass is None


@pytest.mark.parametrize("layer", LAYERS)
@pytest.mark.parametrize("damping", [0.05, 0.3, 2.0])
def test_watt_governor_on_an_engine(layer, damping):
    """The symmetric mode's cubic, by hand; stable where Vyshnegradskii's (1876) criterion (Routh's for it) says so.

    ball length^2 lift'' = ball length^2 w^2 sin cos - ball g length sin - damping lift', and
    (engine + 2 ball length^2 sin^2) w' = torque (cos lift - cos set) - 4 ball length^2 sin cos w lift'.
    """
    m, p = watt(damping, 0.05)
    steady = m.equilibrium(turning=["shaft.angle"])
    assert steady.speeds["shaft.angle"] == pytest.approx(p["speed"], rel=1e-9)
    assert steady["left hinge.angle"] == pytest.approx(p["set"], rel=1e-9)
    s, c, w = np.sin(p["set"]), np.cos(p["set"]), p["speed"]
    I = p["ball"] * p["length"] ** 2
    J = p["engine"] + 2 * I * s * s
    A = np.array(
        [[0, 1, 0], [-(w**2) * s * s, -damping / I, 2 * w * s * c], [-p["torque"] * s / J, -4 * I * s * c * w / J, 0]]
    )
    L = m.linearize(about=steady, coordinates=layer)
    for root in np.linalg.eigvals(A):
        assert np.abs(L.eigenvalues - root).min() < 1e-6 * abs(root)
    a1, a2, a3 = np.poly(A)[1:]
    assert (steady.stability == "stable") == (a1 * a2 > a3)


def cart(upright: bool = True) -> fb.Mechanism:
    m = fb.Mechanism("cart", planar=True, gravity=(0, -G))
    m.add(fb.Body("cart", mass=2, inertia=1))
    m.add(fb.Body("rod", mass=1, inertia=1 / 12, position=(0, 0.5 if upright else -0.5)))
    m.add(fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(fb.Revolute("pin", "cart", "rod", at=(0, 0)))
    m.add(fb.Sensor("tilt", "pin.angle"))
    return m


@pytest.mark.parametrize("layer", LAYERS)
def test_cart_and_rod_pushed(layer):
    """[3, -1/2; -1/2, 1/3] [x''; tilt''] + [0, 0; 0, -g/2] [x; tilt] = [push; 0]; the reaction carries the rod."""
    m = cart()
    m.add(fb.PointForce("push", "cart", force=("0", "0")))
    L = m.linearize(["push.x"], ["tilt", "cart.x", "pin.fx", "rod.ax"], coordinates=layer)
    M, K = np.array([[3, -0.5], [-0.5, 1 / 3]]), np.diag([0, -G / 2])
    for s in (2.0, 0.3 + 1.7j):
        x, tilt = np.linalg.solve(s * s * M + K, [1, 0])
        rod_ax = s * s * (x - 0.5 * tilt)
        got = (L.C @ np.linalg.solve(s * np.eye(4) - L.A, L.B) + L.D)[:, 0]
        assert got == pytest.approx([tilt, x, rod_ax, rod_ax], rel=1e-9)
    zeros, poles, gain = L.transfer("push.x", "tilt")
    assert np.sort(poles.real)[[0, -1]] == pytest.approx([-np.sqrt(19.62), np.sqrt(19.62)], rel=1e-7)
    assert gain == pytest.approx(2 / 3, rel=1e-6)
    assert len(zeros) == 2
    assert L.response([1.3], "push.x", "tilt")[0] == pytest.approx(np.linalg.solve(-1.69 * M + K, [1, 0])[1], rel=1e-9)


@pytest.mark.parametrize("layer", LAYERS)
def test_a_driver_as_input(layer):
    """A rod whose pin is moved: tilt / x = (s^2 / 2) / (s^2 / 3 + g / 2) up to sign; positions follow, rates cannot."""
    m = cart(upright=False)
    m.add(fb.Driver("shaker", "rail.displacement", "0"))
    L = m.linearize(["shaker"], ["tilt", "cart.x"], coordinates=layer)
    s = 1.7
    got = (L.C @ np.linalg.solve(s * np.eye(2) - L.A, L.B) + L.D)[:, 0]
    assert got == pytest.approx([-0.5 * s * s / (s * s / 3 + G / 2), 1.0], rel=1e-9)
    with pytest.raises(fb.ModelError, match=r"'cart\.vx' follows the rate of input 'shaker'"):
        m.linearize(["shaker"], ["cart.vx"], coordinates=layer)


def test_efforts_of_drivers_in_any_order():
    """Each driver's effort is its own, whichever driver was added first; numeric and symbolic."""
    found = []
    for order in (1, -1):
        m = fb.Mechanism("arm", planar=True, gravity=(0, -9.81))
        m.add(*(fb.Body(name, mass=1, inertia=0.05, position=(x, 0)) for name, x in (("a", 0.5), ("b", 1.4), ("c", 2))))
        m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(1, 0)))
        m.add(fb.Revolute("C", "b", "c", at=(1.8, 0)), fb.CoordinateSpring("s", "C.angle", stiffness=50, rest=0.04))
        m.add(*[fb.Driver("move A", "A.angle", "0.2"), fb.Driver("move B", "B.angle", "0.1")][::order])
        outputs, about = ["move A.effort", "move B.effort"], m.equilibrium()
        N = m.linearize(outputs=outputs, about=about, coordinates="joint")
        found += [N.C, linear_equations(m, outputs=outputs, at=about).values()["C"]]
    for C in found[1:]:
        assert pytest.approx(found[0], rel=1e-6) == C
    assert abs(found[0][0, 0]) > 1.5 * abs(found[0][1, 0])  # about A the link has the longer arm


@pytest.mark.parametrize("layer", LAYERS)
def test_a_parameter_as_input(layer):
    """A mass on a spring whose free length changes: m x'' + k x = k u."""
    m = fb.Mechanism("mass", planar=True, parameters={"free": 0.5})
    m.add(fb.Body("mass", mass=2, inertia=1, position=(0.5, 0)))
    m.add(fb.Prismatic("rail", "ground", "mass", at=(0.5, 0), axis=(1, 0)))
    m.add(fb.SpringDamper("spring", "ground", "mass", at=((0, 0), (0.5, 0)), stiffness=50, length="free", damping=3))
    L = m.linearize(["free"], ["mass.x", "spring.force"], coordinates=layer)
    s = 1 + 2j
    x = 50 / (2 * s * s + 3 * s + 50)
    got = (L.C @ np.linalg.solve(s * np.eye(2) - L.A, L.B) + L.D)[:, 0]
    assert got == pytest.approx([x, 50 * (x - 1) + 3 * s * x], rel=1e-9)
    found = L.to_control()
    assert found(s)[0, 0] == pytest.approx(x, rel=1e-9)


def test_root_locus_of_a_feedback():
    """Position feedback u = -k y on a unit mass: s^2 + k = 0."""
    m = fb.Mechanism("mass", planar=True)
    m.add(fb.Body("mass", mass=1, inertia=1))
    m.add(fb.Prismatic("rail", "ground", "mass", at=(0, 0), axis=(1, 0)))
    m.add(fb.PointForce("push", "mass", force=("0", "0")))
    L = m.linearize(["push.x"], ["mass.x"])
    roots = L.root_locus([1.0, 4.0, 9.0])
    assert np.sort(roots.imag, axis=1) == pytest.approx(np.array([[-1, 1], [-2, 2], [-3, 3]]), abs=1e-9)


def test_an_instant_of_any_motion():
    """Frozen: the coefficients of this very instant, a falling rod at 1 rad: theta'' = -1.5 g sin."""
    m = rod(1.0)
    with pytest.raises(fb.AnalysisError, match=r"not in equilibrium where it is: .* is accelerated"):
        m.linearize()
    m.add(fb.Initial("A.angle", rate=2.0))
    with pytest.raises(fb.AnalysisError, match="is not steady"):
        m.linearize()
    L = m.linearize(frozen=True, coordinates="joint")
    assert pytest.approx(np.array([[0, 1], [-1.5 * G * np.cos(1.0), 0]]), abs=1e-9) == L.A


def test_what_does_not_exist_is_named():
    m = cart()
    with pytest.raises(fb.ModelError, match=r"no input 'pusch'.*"):
        m.linearize(["pusch"])
    with pytest.raises(fb.ModelError, match="'tild'"):
        m.linearize(outputs=["tild"])
    with pytest.raises(fb.ModelError, match="Revolute 'pin' has no curve 'angel'"):
        m.linearize(outputs=["pin.angel"])
    with pytest.raises(fb.ModelError, match="no parameter 'mass'"):
        m.linearize(parameters={"mass": 2.0})
    with pytest.raises(fb.ModelError, match="inputs is a list of names"):
        m.linearize("push")
    with pytest.raises(fb.ModelError, match="about must be"):
        m.linearize(about="here")


def test_singular_positions_are_refused():
    """A flat parallelogram can go on in two ways."""
    m = fb.Mechanism("flat", planar=True)
    for name, x in (("left", 0.0), ("right", 2.0)):
        m.add(fb.Body(name, mass=1, inertia=0.1, position=(x + 0.5, 0)))
        m.add(fb.Revolute(f"{name} foot", "ground", name, at=(x, 0)))
    m.add(fb.Body("coupler", mass=1, inertia=0.1, position=(2.0, 0)))
    m.add(fb.Revolute("left end", "left", "coupler", at=(1, 0)))
    m.add(fb.Revolute("right end", "right", "coupler", at=(3, 0)))
    with pytest.raises(fb.SingularityError, match="singular position") as found:
        m.linearize()
    assert set(found.value.elements) & {"left foot", "left end", "right end", "right foot"}


def test_laws_without_derivatives_are_refused():
    m = rod()
    m.add(fb.Motor("motor", joint="A", torque=lambda t: 0.0))
    with pytest.raises(fb.ModelError, match="Python function, which has no derivatives"):
        m.linearize()


@pytest.mark.parametrize("layer", LAYERS)
def test_a_parameter_of_a_law_that_drives(layer):
    """A cart driven by amp sin(w t) carries a rod: tilt'' / 3 + g tilt / 2 = x'' / 2 with x = amp at this instant."""
    m = cart(upright=False)
    m.parameters["amp"] = 0.0
    m.add(fb.Driver("shaker", "rail.displacement", "amp*cos(2*t)"))
    L = m.linearize(["amp"], ["tilt", "cart.x"], coordinates=layer)
    s = 1.7
    got = (L.C @ np.linalg.solve(s * np.eye(2) - L.A, L.B) + L.D)[:, 0]
    assert got == pytest.approx([-0.5 * s * s / (s * s / 3 + G / 2), 1.0], rel=1e-9)


def test_about_an_equilibrium_of_other_numbers():
    """Where it was found, the mechanism as it is now: a stiffer spring counts, another mechanism is refused."""
    m = rod(k=1.0)
    m.add(fb.TorsionalSpringDamper("spring", joint="A", stiffness="k"))
    found = m.equilibrium()
    assert m.linearize(about=found).stiffness[0, 0] == pytest.approx(1 + G / 2)
    assert m.linearize(about=found, parameters={"k": 100.0}).stiffness[0, 0] == pytest.approx(100 + G / 2)
    m.add(fb.TorsionalSpringDamper("more", joint="A", stiffness=10))
    assert m.linearize(about=found).stiffness[0, 0] == pytest.approx(11 + G / 2)
    with pytest.raises(fb.ModelError, match="which has other bodies"):
        cart().linearize(about=found)


def test_nothing_can_move():
    m = fb.Mechanism("block", planar=True, gravity=(0, -G))
    m.add(fb.Body("block", mass=1, inertia=1))
    m.add(fb.Fixed("weld", "ground", "block", at=(0, 0)))
    for layer in LAYERS:
        L = m.linearize(outputs=["weld.fy"], coordinates=layer)
        assert L.A.shape == (0, 0)
        assert L.output_values == pytest.approx([G])
        assert len(m.modes(coordinates=layer)) == 0


def test_what_changes_with_time_is_refused():
    """Laws of time while it rests, and outputs that do not turn with a steady motion."""
    m = rod(a=1.0)
    m.add(fb.Motor("motor", joint="A", torque="-(5 + 4*cos(3*t))*angle"))
    with pytest.raises(fb.AnalysisError, match="depend on time"):
        m.modes()
    assert m.modes(frozen=True).omega == pytest.approx([np.sqrt((G / 2 + 9) * 3)], rel=1e-9)
    turning = conical_pendulum()
    with pytest.raises(fb.ModelError, match=r"output 'bob\.x' does not turn with the mechanism"):
        turning.linearize(outputs=["bob.x"])
    assert turning.linearize(outputs=["hinge.angle", "bob.z"]).C.shape == (2, 4)


def test_a_preloaded_motor_is_an_input_too():
    m = rod(np.pi / 2)
    m.add(fb.Motor("motor", joint="A", torque="0"))
    held = m.equilibrium(preload=["motor", "motor"])
    assert held.preload["motor"] == pytest.approx(G / 2)
    L = m.linearize(["motor"], ["A.angle"], about=held)
    assert L.B[1, 0] == pytest.approx(3.0)


def test_states_of_a_universal_joint_are_its_angles():
    """Both count as results do: the one about the axis on ``body_j`` had the other sign in joint coordinates."""
    m = fb.Mechanism("hook", gravity=(0, 0, -9.81))
    m.add(fb.Body("bob", mass=1.0, inertia=(0.1, 0.2, 0.3), position=(0, 0, -1)))
    m.add(fb.Universal("U", "ground", "bob", at=(0, 0, 0), axes=((1, 0, 0), (0, 1, 0))))
    model = m.linearize(outputs=["U.angle_1", "U.angle_2"], coordinates="joint")
    assert model.states[:2] == ("U.angle_1", "U.angle_2")
    np.testing.assert_allclose(model.C, np.eye(2, 4), atol=1e-12)


@pytest.mark.parametrize("time", [1e-5, 1e5])
def test_what_changes_with_time_is_refused_in_any_unit_of_time(time):
    m = fb.Mechanism("rod", planar=True)
    m.add(fb.Body("rod", mass=1.0, inertia=1.0), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    m.add(fb.Motor("motor", joint="A", torque=f"-(5 + 4*cos(3*t/{time!r}))*angle/{time!r}**2"))
    with pytest.raises(fb.AnalysisError, match="depend on time"):
        m.modes()


@pytest.mark.parametrize(("time", "length"), [(1e-9, 1.0), (1.0, 1.0), (1e10, 1.0), (1.0, 1e-10), (1.0, 1e10)])
def test_what_is_still_is_told_by_the_mechanisms_own_pace(time, length):
    """A pendulum swings through its lowest place at a hundredth of its pace, or at a part of 1e-12 of that."""
    m = fb.Mechanism("slow", planar=True, gravity=(0, -G * length / time**2), parameters={"rate": 0.0})
    m.add(fb.Body("bob", mass=1.0, inertia=0.1 * length**2, position=(0, -length)))
    m.add(fb.Revolute("A", "ground", "bob", at=(0, 0)))
    m.add(fb.Initial("A.angle", rate="rate"))
    with pytest.raises(fb.AnalysisError, match="is not steady"):
        m.linearize(parameters={"rate": 0.01 / time})
    w = m.linearize(parameters={"rate": 1e-14 / time}).eigenvalues
    np.testing.assert_allclose(np.abs(w) * time, np.sqrt(G / 1.1), rtol=1e-9)
