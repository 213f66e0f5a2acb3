"""Tables of complex parameters: their imaginary parts are the derivatives of the real tables, all of them."""

from __future__ import annotations

import numpy as np
import pytest

import flyball as fb
from flyball import forces, joints
from flyball.assembly.compiled_mechanism import compile_mechanism
from flyball.derivatives.equation_derivatives import EquationDerivatives, MechanismState
from flyball.engine.entry_point import allocate_work
from flyball.engine.kinematics import least_squares
from flyball.errors import ExpressionError, ModelError
from flyball.model.expression_parser import FUNCTIONS
from flyball.model.expressions import Expression, number
from flyball.model.geometry import triad
from flyball.model.joint import Coupling
from flyball.model.shapes import SHAPES
from flyball.tables.coordinate_choice import spanning_joints
from flyball.tables.mass_properties import inverse_inertia
from flyball.tables.structure import Choices, structure
from flyball.tables.values import values
from tests import mechanisms
from tests.complex_steps import STEP, errors_of, tables, with_parameters
from tests.contract import zoo
from tests.examples.test_examples import FILES
from tests.model.test_shapes import SAMPLES

AXES = ("axis", "axes", "normal")  # which axes go with one along a world axis jumps with a change: tested apart
RIGHT_ANGLES = {"FlatFacedCam": {"axis", "normal"}, "Universal": {"axes"}, "WheelOnLine": {"at", "axis", "centre"}}
"""Fields that allow no change of one number."""


def structures(m):
    """In absolute coordinates, and in joint coordinates if it has any."""
    tree = spanning_joints(m)
    return [structure(m), *([structure(m, Choices(tree=tree))] if tree else [])]


def check_all(m, skipped=(), refused=()):
    """Every number of a mechanism, and every parameter it has."""
    given = m.environment()
    m, names = with_parameters(m)
    for s in structures(m):
        for name, value in given.items():
            assert errors_of(s, name, abs(value) or 0.1) == [], name
        for field, name in names.items():
            if field.partition(".")[2] in skipped:
                continue
            try:
                assert errors_of(s, name, 1.0) == [], field
            except ModelError:
                assert field.partition(".")[2] in refused, field


@pytest.mark.parametrize(("where", "name"), zoo.CASES)
def test_every_joint(where, name):
    # differences by a point move the places of contact over knots of the profile
    skipped = ("points",) if name == "FlatFacedCam" else ()
    check_all(zoo.joined(where, name), skipped, RIGHT_ANGLES.get(name, ()))


@pytest.mark.parametrize("name", FILES)
def test_every_parameter_of_the_examples(name):
    m = mechanisms.example(name)
    for s in structures(m):
        for k, value in m.environment().items():
            assert errors_of(s, k, abs(value) or 0.1) == [], k


@pytest.mark.parametrize("name", ["governor.toml", "spatial_slider_crank.toml", "rolling_race.toml", "n_four_bar.py"])
def test_every_number_of_an_example(name):
    """Some numbers allow no change: thin bodies are at the limit of what inertias can be."""
    check_all(mechanisms.example(name), skipped=AXES, refused=("inertia", "inertia_about", "com"))


@pytest.mark.parametrize("made", ["four_bar", "bricard", "door", "hanging_bodies", "free_body"])
def test_every_number_of_a_mechanism(made):
    check_all(getattr(mechanisms, made)(), skipped=AXES, refused=("inertia",))


@pytest.mark.parametrize("shape", SAMPLES, ids=lambda s: type(s).__name__)
def test_every_shape(shape):
    m = fb.Mechanism("shape")
    m.add(fb.Body("b", density=7850.0, shape=shape, orientation=(0.2, -0.4, 0.9)))
    check_all(
        m, refused=("outline",) if len(getattr(shape, "outline", ())) == 7 else ()
    )  # its first corner comes again


def test_every_shape_is_here():
    assert {type(s) for s in SAMPLES} == set(SHAPES)


def with_forces(where):
    """Two bodies with every force element that there is."""
    m = zoo.joined(where, "Prismatic")
    p, q = (zoo.P, zoo.Q) if where == "space" else (zoo.P[:2], zoo.Q[:2])
    r = tuple(x + 0.1 for x in p)
    m.add(fb.Revolute("H", "ground", "a", at=r, **({"axis": zoo.SKEW} if where == "space" else {})))
    m.add(fb.SpringDamper("spring", "a", "b", at=(p, q), stiffness=30.0, damping=2.0))
    m.add(fb.SpringDamper("told", "a", "b", at=(p, q), stiffness=30.0, length=0.2, force="length + rate + 3.0"))
    m.add(fb.CoordinateSpring("along", "J.displacement", stiffness="2 N/mm", damping=3.0, rest=0.1))
    m.add(fb.Actuator("act", "J.displacement", force="2.0 - rate"))
    m.add(fb.TorsionalSpringDamper("twist", "H", stiffness=4.0, damping=0.3, angle="20 deg"))
    m.add(fb.Motor("motor", "H", torque="3.0 - 0.1*rate"))
    m.add(fb.JointFriction("rub", "J", static=0.3, kinetic=0.2, bending_length=0.1, twist_length=0.2, preload=1.0))
    m.add(fb.JointFriction("creep", "H", static=0.3, kinetic=0.2, stribeck_speed=0.3, stick_speed=0.2, radius="3 cm"))
    m.add(fb.Brake("hold", "H.angle", capacity="2.0 + rate**2", static=1.2))
    m.add(fb.Clutch("grip", "J.displacement", "a.x", capacity="3 N"))
    m.add(fb.Rope("rope", ("a", "b", "ground"), at=(p, q, r), stiffness=80.0, damping=1.0))
    m.add(fb.PathSpring("tendon", ("a", "b", "ground"), at=(p, q, r), stiffness=80.0, damping=1.0, force="length*rate"))
    m.add(fb.CoordinateSpring("pair", ("H.angle", "a.x"), weights=(1, 3), stiffness=3.0, damping=0.4, rest=0.1))
    m.add(fb.Detent("notches", "H.angle", pitch="40 deg", holding="0.4 N*m", notch=0.1, damping=0.02))
    m.add(fb.Detent("dimples", "J.displacement", pitch="4 cm", barrier="2 J"))
    m.add(fb.Limit("soft", "H.angle", lower=-0.1, upper=0.1, stiffness=30.0, damping=0.3))
    m.add(fb.Limit("buffer", "J.displacement", lower="1 cm", stiffness=30.0))
    m.add(fb.Backlash("loose", ("H.angle", "a.x"), weights=(2, 3), gap="1 deg", stiffness=20.0, damping=0.1))
    m.add(fb.Rope("cut", ("a", "b"), at=(p, q), stiffness=80.0, length="30 cm"))
    if where == "space":
        m.add(fb.Bushing("mount", "ground", "b", at=q, stiffness=(1.0, 2.0, 3.0), orientation=(0.1, 0.2, 0.3)))
        m.add(fb.PointForce("push", "b", force=(1.0, "t", 2.0), at=q, axes="body"))
        m.add(fb.PointTorque("turn", "b", torque=(1.0, "t", 2.0)))
        m.add(
            fb.WheelOnRail(
                "roll",
                "a",
                "b",
                at=q,
                axis=(0, 1, 0),
                radius=0.4,
                conicity=0.1,
                roller_radius=0.5,
                rail_arcs=[(0.3, 0.2)],
            )
        )
        cone, head = ([(0.01 * k, z * k * abs(k)) for k in range(-4, 5)] for z in (0.001, -0.002))
        profiles = {"wheel_profile": cone, "rail_profile": head, "curve_radius": 80.0, "inclination": 0.02}
        m.add(
            fb.WheelOnRail(
                "run", "a", "b", at=q, axis=(0, 1, 0), radius=0.4, dissipation=0.2, vertical="1e-3*t", **profiles
            )
        )
        tyre = fb.FialaTyre(
            radius=0.9, stiffness=30.0, nominal_load=3.0, slip_stiffness=20.0, cornering_stiffness=15.0, trail=0.02
        )
        m.add(fb.Tyre("tyre", "ground", "b", at=(*q[:2], 0.7), model=tyre))
    else:
        m.add(fb.Bushing("mount", "ground", "b", at=q, stiffness=(1.0, 2.0), torsional_damping=0.4, angle=0.3))
        m.add(fb.PointForce("push", "b", force=(1.0, "t"), at=q))
        m.add(fb.PointTorque("turn", "b", torque="t"))
    return m


@pytest.mark.parametrize("where", ["space", "plane"])
def test_every_force(where):
    m = with_forces(where)
    plane = [] if where == "space" else [fb.WheelOnRail, fb.Tyre]
    assert {*plane, *(type(f) for f in m.forces)} == {c for c in forces.ALL if not getattr(c, "adds_inertia", False)}
    # the bushing has an orientation in space; the wheel's axis and direction stay perpendicular to each other
    check_all(m, skipped=("axis", "direction"), refused=("angle",) if where == "space" else ())


def with_couplings():
    """Every coupling of joints that there is."""
    m = zoo.two_bodies("plane")
    m.add(fb.Body("c", mass=1.0, inertia=0.1, position=(1.0, 0.2)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "ground", "b", at=(0.5, 0), angle=0.2))
    m.add(fb.Translational("C", "ground", "c", at=(1, 0), axis=(1, 2), displacement=0.1))
    m.add(fb.GearPair("gears", "A", "B", teeth=(20, 31)))
    m.add(fb.RackAndPinion("rack", "C", "A", radius=0.05))
    m.add(fb.Coupler("sum", ("A.angle", "B.angle", "c.x"), weights=(2.0, -1.0, 3.0), value=0.7))
    m.add(fb.Coupler("kept", ("B.angle", "C.displacement", "b.y"), weights=(2.0, -1.0, 3.0)))
    m.add(fb.Constraint("bent", "A.angle*B.angle - 0.3*c.x + C.displacement**2"))
    return m


def test_every_coupling():
    m = with_couplings()
    assert {type(c) for c in m.couplings} == {
        c for c in Coupling.registry.values() if issubclass(c, Coupling) and c.__module__.startswith(joints.__name__)
    }
    check_all(m)


BY_FRAMES = {"Screw": {"lead": 0.05}, "RollingDisk": {"radius": 0.1}, "RollingBall": {"radius": 0.1}}
IN_THE_WORLD = (*zoo.SPLINED, "WheelOnLine")  # cannot be told by frames alone


@pytest.mark.parametrize(("where", "name"), [c for c in zoo.CASES if c[1] not in IN_THE_WORLD])
def test_joints_between_frames(where, name):
    """The coordinates of tree joints are then those of frames that are drawn apart and askew."""
    m = zoo.two_bodies(where)
    if where == "space":
        m.add(fb.Frame("F", "a", position=(0.1, 0.3, -0.2), orientation=(0.5, -0.3, 0.2)))
        m.add(fb.Frame("M", "b", position=(-0.2, 0.1, 0.3), orientation=(0.9, 0.3, -0.1, 0.4)))
    else:
        m.add(fb.Frame("F", "a", position=(0.1, 0.3), angle=0.5), fb.Frame("M", "b", position=(-0.2, 0.1), angle=2.9))
    m.add(getattr(joints, name)("J", "F", "M", **BY_FRAMES.get(name, {})))
    check_all(m)


@pytest.mark.parametrize("closed", [False, True])
def test_cams_of_few_points(closed):
    """Each point of a profile by itself: splines through points at complex places."""
    m = fb.Mechanism("cam", planar=True, parameters={f"{a}{k}": 0.0 for a in "xy" for k in range(5)})
    points = [(0.3, 0.0), (0.1, 0.25), (-0.2, 0.2), (-0.25, -0.1), (0.1, -0.3)]
    written = tuple((f"{x} + x{k}", f"{y} + y{k}") for k, (x, y) in enumerate(points))
    m.add(fb.Body("a", mass=1.0, inertia=0.1), fb.Body("b", mass=1.0, inertia=0.1, position=(0.5, 0.1)))
    m.add(fb.Cam("J", "a", "b", points=written, at=(0.35, 0.1), closed=closed, radius=0.01))
    s = structure(m)
    for name in m.parameters:
        assert errors_of(s, name, 0.1) == [], name


TURNED = {
    "Universal": {"at": (0.1, 0.2, 0.3), "axes": (("cos(a)", "sin(a)", 0.0), ("-sin(a)", "cos(a)", "0.0*a"))},
    "GeneralUniversal": {
        "at": ((0.1, 0.2, 0.3), (0.2, "a", 0.4)),
        "axes": (("cos(a)", "sin(a)", 0.0), (0.0, 1.0, "a")),
    },
    "WheelOnLine": {"at": (0.1, 0.2), "axis": ("cos(a)", "sin(a)"), "centre": ("0.1 - 0.3*sin(a)", "0.2 + 0.3*cos(a)")},
}


@pytest.mark.parametrize("name", sorted(TURNED))
def test_axes_that_turn_together(name):
    planar = name == "WheelOnLine"
    m = fb.Mechanism("turned", planar=planar, parameters={"a": 0.4})
    for k, body in enumerate("ab"):
        m.add(
            fb.Body(
                body, mass=1.0, inertia=0.1 if planar else (0.1, 0.2, 0.15), position=(k, 0.1) if planar else (k, 0, 1)
            )
        )
    m.add(getattr(joints, name)("J", "a", "b", **TURNED[name]))
    for s in structures(m):
        assert errors_of(s, "a", 1.0) == []


def test_mass_properties_that_turn():
    """A thin rod and a point mass: their stand-ins turn and grow with the body too."""
    m = fb.Mechanism("thin", parameters={"a": 0.3, "l": 1.2})
    moment = "l**2/12"
    m.add(fb.Body("rod", mass=1.0, inertia=(0, moment, moment), inertia_axes=("a", "2*a", 0.3)))
    m.add(fb.Body("same", mass=1.0, inertia=((moment, "a*0.01", 0), ("a*0.01", moment, 0), (0, 0, 0.1))))
    m.add(fb.Body("point", mass="l", inertia=0, position=("l", "a", 0)))
    m.add(fb.Spherical("A", "rod", "same", at=("l/2", 0, 0)), fb.Spherical("B", "same", "point", at=("l", "a", 0)))
    for s in structures(m):
        assert errors_of(s, "a", 1.0) == []
        assert errors_of(s, "l", 1.0) == []


def test_inverse_of_a_thin_body_has_the_derivative_of_its_stand_in():
    """Two of three principal directions without inertia, turned and scaled along a path."""

    def at(x):
        c, s = np.cos(x), np.sin(x)
        R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])
        return R @ np.diag([0.0, 1e-13 * (1 + x), 2.0 + x]) @ R.T, 3.0 + x * x

    found = inverse_inertia(*at(0.3 + 1j * STEP), False)
    h = 1e-3
    up, down, upper, lower = (inverse_inertia(*at(0.3 + k * h), False) for k in (1, -1, 2, -2))
    for k, x in enumerate(found):
        difference = (8.0 * (up[k] - down[k]) - (upper[k] - lower[k])) / (12.0 * h)
        assert x.imag / STEP == pytest.approx(difference, rel=1e-6, abs=1e-6 * np.abs(difference).max())
    J, size = at(0.3)
    assert found[0].real @ (J + found[1].real) == pytest.approx(np.eye(3), abs=1e-9)


@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -1), (0, 1, 0), (1, 0, 0)])
@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 1, 0), (0, 0, 1)])
def test_axes_along_those_of_the_world_tilt(axis, direction):
    """Which axes are chosen about it may jump there, by a rotation about the axis itself. What it carries does not."""
    m = fb.Mechanism("tilted", parameters={"tilt": 0.0})
    m.add(fb.Body("b", mass=1.0, inertia=(0.1, 0.2, 0.15), position=(0.3, 0.2, 0.1)))
    m.add(fb.Revolute("J", "ground", "b", at=(0, 0, 0), axis=tuple(f"{a} + {d}*tilt" for a, d in zip(axis, direction))))
    s = structure(m, Choices(tree=("J",)))

    def pose(e):
        x = tables(values(s, {"tilt": e}))["tree joint 0"]
        return x[3 + 12 :]  # at an angle of 0.7 rad

    h = 1e-3
    difference = (8.0 * (pose(h) - pose(-h)) - (pose(2 * h) - pose(-2 * h))) / (12.0 * h)
    assert pose(1j * STEP).imag / STEP == pytest.approx(difference, abs=1e-9)
    R = triad(np.array(axis) + 1j * STEP * np.array(direction) * (np.abs(axis) == 0))
    assert R.T @ R - np.eye(3) == pytest.approx(np.zeros((3, 3)), abs=1e-45)
    assert np.linalg.det(R.real) == 1.0


def test_least_squares_carry_the_derivative():
    g = np.random.default_rng(1)
    A, dA, b, db = (g.standard_normal(n) for n in ((6, 3), (6, 3), 6, 6))

    def at(e):
        return least_squares(A + e * dA, b + e * db)

    h = 1e-3
    difference = (8.0 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12.0 * h)
    assert at(1j * STEP).imag / STEP == pytest.approx(difference, rel=1e-8)


def equations(m, tree, parameters=None):
    """The equations in the drawn state, at some accelerations and multipliers."""
    c = compile_mechanism(m, parameters=parameters, tree=tree)
    g = np.random.default_rng(2)
    nv, nr = c.structure.nv, len(c.structure.rows)
    v, vdot, lam = (g.standard_normal(n) for n in (nv, nv, nr))
    q = compile_mechanism(m, tree=tree).values.q
    return EquationDerivatives(MechanismState(c, 0.3, q, v, c.z.copy(), vdot, lam, np.zeros(nv)))


@pytest.mark.parametrize(("where", "name"), zoo.CASES)
def test_equations_of_complex_tables(where, name):
    """The compiled formulas read them: residuals have the derivatives by every field's parameter."""
    if name == "Cam":  # beside a point of its profile, where the third derivative jumps
        m = zoo.two_bodies(where)
        at = zoo.P + zoo.NORMAL @ (0.32, 0.05, 0.05) if where == "space" else (zoo.P[0] + 0.32, zoo.P[1] + 0.05)
        m.add(fb.Cam("J", "a", "b", **zoo.declared(where, name) | {"at": tuple(at)}))
    else:
        m = zoo.joined(where, name)
    m, names = with_parameters(m)
    tree = spanning_joints(m)
    for layer in ((), tree) if tree else ((),):
        x = equations(m, layer)
        for field, parameter in names.items():
            if field.partition(".")[2] in RIGHT_ANGLES.get(name, ()) or field == "FlatFacedCam.points":
                continue
            h = 1e-4
            near = {k: equations(m, layer, {parameter: k * h}).residual for k in (-2, -1, 1, 2)}
            difference = (8.0 * (near[1] - near[-1]) - (near[2] - near[-2])) / (12.0 * h)
            size = 1e-8 * np.abs(difference).max() + 1e-14 * np.abs(x.residual).max() / h
            assert x.by_parameter(parameter) == pytest.approx(difference, rel=1e-7, abs=size), field


def test_real_parameters_give_floats():
    m = mechanisms.example("slider_crank.toml")
    s = structure(m)
    x = values(s, {"crank": 0.21})
    floats = {k: a.dtype for k, a in x.system._asdict().items() if isinstance(a, np.ndarray) and a.dtype.kind != "i"}
    assert set(floats.values()) == {np.dtype(float)}
    assert x.q.dtype == x.v.dtype == allocate_work(s, x.system).G.dtype == float


def test_one_complex_parameter_makes_all_complex():
    s = structure(mechanisms.example("slider_crank.toml"))
    x = values(s, {"speed": 10.0 + 1j * STEP})
    floats = {k: a.dtype for k, a in x.system._asdict().items() if isinstance(a, np.ndarray) and a.dtype.kind != "i"}
    del floats["surfaces"]  # no parameter changes them
    assert set(floats.values()) == {np.dtype(complex)}
    assert x.q.dtype == x.v.dtype == allocate_work(s, x.system).G.dtype == complex
    assert not x.system.frames.position.imag.any() and not x.system.frames.rotation.imag.any()


def test_held_coordinates_may_be_complex():
    m = mechanisms.four_bar()
    hold = fb.Initial("A.angle", value=0.1)
    m.add(hold)
    s = structure(m, Choices(holds=(hold,)))
    terms = values(s, None, {"A.angle": 0.1 + 1j * STEP}).system.term_parameters
    k = next(k for k, t in enumerate(s.terms) if t.element is hold)
    assert terms[k, 6] == pytest.approx(0.1 + 1j * STEP, rel=1e-12)
    assert terms[k, 6].imag == STEP


DOMAIN = {"asin": 0.4, "acos": -0.3, "atan2": 0.7, "where": 0.2, "step": 0.3, "step5": 0.6, "log": 2.0, "sqrt": 0.3}


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_functions_of_expressions(name):
    rest = {
        "atan2": ", -0.6",
        "min": ", 0.9, 1.2",
        "max": ", 0.9, 0.2",
        "step": ", 0.1, 1, 0.8, 3",
        "step5": ", 0, 1, 1, 3",
        "trapezoid": ", 0.1, 1, 0.8, 3, 0.3",
    }
    text = "where(x < 0.5, x**2, x**3)" if name == "where" else f"{name}(2*x{rest.get(name, '')})/3 - x**1.5"
    x = 0.31

    def at(value):
        return number(Expression.parse(text), {"x": value}, "1", "test")

    h = 1e-3
    difference = (8.0 * (at(x + h) - at(x - h)) - (at(x + 2 * h) - at(x - 2 * h))) / (12.0 * h)
    found = at(complex(x, STEP))
    assert found.real == at(x)
    assert found.imag / STEP == pytest.approx(difference, rel=1e-8)


@pytest.mark.parametrize("text", ["log(x - 1)", "sqrt(x - 1)", "asin(1 + x)", "(x - 1)**0.5", "1/(x - 0.5)"])
def test_what_has_no_real_value_is_refused(text):
    """Complex numbers have a root of -0.5, the parameter has not."""
    with pytest.raises((ModelError, ExpressionError), match=r"mass of Body 'b'.*finite number is wanted"):
        number(text, {"x": 0.5 + 1j * STEP}, "kg", "mass of Body 'b'")


def test_a_joint_of_the_plane_is_not_tilted():
    m = fb.Mechanism("plane", planar=True, parameters={"tilt": 0.0})
    m.add(fb.Body("b", mass=1.0, inertia=0.1))
    m.add(fb.Revolute("J", "ground", "b", at=(0, 0), axis=("tilt", 0, 1)))
    with pytest.raises(ModelError, match=r"Revolute 'J'.*axis is the normal"):
        values(structure(m), {"tilt": 1j * STEP})


def test_an_inertia_must_stay_symmetric():
    m = fb.Mechanism("space", parameters={"tilt": 0.0})
    m.add(fb.Body("b", mass=1.0, inertia=((1, "tilt", 0), (0, 1, 0), (0, 0, 1))))
    with pytest.raises(ModelError, match=r"Body 'b'.*not symmetric"):
        values(structure(m), {"tilt": 1j * STEP})
