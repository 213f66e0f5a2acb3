"""Equations as Python, Numba and CasADi code: values and derivatives are the engine's, files work without flyball."""

import json
import subprocess
import sys

import numpy as np
import pytest

import flyball as fb
from flyball.expression_graph.graph import evaluate, jacobian
from flyball.symbolic.export import LANGUAGES
from tests.symbolic.exported import Library, close, example, given_at, rubbing, states


def call(code, name, given):
    """Results of a function as a tuple of arrays."""
    r = next(r for r in code.routines if r.name == name)
    found = code[name](*[given[a.name] for a in r.arguments])
    return found if isinstance(found, tuple) else (found,)


@pytest.mark.parametrize(
    ("name", "coordinates"),
    [
        ("andrews.toml", "joint"),
        ("double_wishbone.toml", "joint"),
        ("cam.py", "absolute"),
        ("heavy_top.toml", "absolute"),
    ],
)
def test_every_function_in_python_is_the_engines(name, coordinates):
    m = example(name)
    eq, p = m.symbolic(coordinates=coordinates), m.prepare(coordinates=coordinates)
    code = eq.export(language="python")
    rows = len(p.rows)
    for t, q, v in states(p, 3):
        given = given_at(eq, code, (t, q, v))
        one = {k: call(code, k, given)[0] for k in ("T", "M", "f", "g", "nu", "G", "gamma")}
        close(one["T"] @ v, p.rates(q, v))
        close(one["M"], p.mass_matrix(q))
        close(one["f"], p.forces(t, q, v))
        close(one["G"][:rows], p.jacobian(t, q))
        np.testing.assert_allclose(one["g"][:rows], p.constraint(t, q), atol=1e-13)
        qdot, vdot = call(code, "right_hand_side", given)[:2]
        close(vdot, p.acceleration(t, q, v), 2e-12)
        left = np.abs(one["G"] @ vdot - one["gamma"]).max(initial=0.0)
        assert left <= 1e-9 * (np.abs(one["G"]) @ np.abs(vdot)).max(initial=1e-300)
        at, turned = call(code, "kinematics", given)
        for k, body in enumerate(m.bodies):
            np.testing.assert_allclose(at[k], p.pose(body.name, q)[0], rtol=0, atol=1e-13)
            close(turned[k], p.pose(body.name, q)[1])
        moved, turning = call(code, "velocities", given)
        J = [p.frame_jacobian(b.name, q) @ v for b in m.bodies]
        close(moved[: len(J)], [j[:3] for j in J])
        close(turning[: len(J)], [j[3:] for j in J])


def test_energies_and_outputs_are_those_of_results():
    m = example("slider_crank.toml")
    p = m.prepare(coordinates="joint")
    r = p.simulate(0.1)
    wanted = ["slider.x", "slider.vx", "A.fx", "slider.ax"]
    eq = m.symbolic(coordinates="joint")
    code = eq.export(language="python", functions=["energies", "outputs"], outputs=wanted)
    k = len(r.t) // 2
    given = given_at(eq, code, (float(r.t[k]), r.q[k], r.v[k]))
    kinetic, potential = call(code, "energies", given)
    assert kinetic == pytest.approx(r.energy.kinetic[k], rel=1e-12)
    assert potential == pytest.approx(r.energy.potential[k], rel=1e-12)
    close(call(code, "outputs", given)[0], [r[name][k] for name in wanted], 1e-9)


def test_arrays_of_states_at_once():
    m = example("spatial_four_bar.toml")
    p = m.prepare(coordinates="joint")
    code = m.symbolic(coordinates="joint").export(language="python", functions=["right_hand_side", "M"])
    r = p.simulate(0.1)
    qdot, vdot, lam = code["right_hand_side"](r.t, r.q, r.v)
    close(vdot, r.vdot, 1e-9)
    assert lam.shape == (len(r.t), len(code.names["lam"])) and code["M"](r.q).shape == (len(r.t), 4, 4)


def test_a_parameter_is_an_argument():
    m = example("andrews.toml")
    code = m.export(language="python", functions=["right_hand_side"])
    at = code.names["p"].index("torque")
    changed = code.start["p"] * np.where(np.arange(len(code.start["p"])) == at, 1.3, 1.0)
    q, v = code.start["q"], code.start["v"]
    other = m.prepare(coordinates="joint", parameters={"torque": 1.3 * code.start["p"][at]})
    close(code["right_hand_side"](0.0, q, v, changed)[1], other.acceleration(0.0, other.q, v), 2e-12)
    assert not np.allclose(code["right_hand_side"](0.0, q, v)[1], other.acceleration(0.0, other.q, v))


def test_the_python_module_runs_without_flyball(tmp_path):
    code = example("slider_crank.toml").export(tmp_path, language="python")
    program = (
        "import slider_crank as m, numpy as np, sys\n"
        "print(*m.right_hand_side(0.0, np.array(m.Q_START), np.array(m.V_START))[1], m.Q_NAMES[0])\n"
        "assert not [k for k in sys.modules if k.split('.')[0] in ('flyball', 'scipy', 'numba', 'sympy')]"
    )
    out = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
    *numbers, name = out.stdout.split()
    close([float(x) for x in numbers], code["right_hand_side"](0.0, code.start["q"], code.start["v"])[1])
    assert name == code.names["q"][0]


def pendulum_in(code, folder, state):
    """Acceleration by the exported code of any language."""
    if code.language == "c":
        return Library(code, folder)("right_hand_side", **state)["vdot"]
    found = call(code, "right_hand_side", state)[1]
    return found.full() if code.language == "casadi" else found


@pytest.mark.parametrize("language", [x for x in LANGUAGES if "fmu" not in x])  # see test_fmu
def test_every_language_computes_a_pendulum(language, tmp_path):
    """theta'' = -3/2 g/l sin(theta), theta from below, here the angle from the horizontal."""
    if language == "casadi":
        pytest.importorskip("casadi")
    m = fb.Mechanism("pendulum", planar=True, gravity=(0, -10))
    m.add(fb.Body("rod", mass=3, inertia=0.25, position=(0.5, 0)), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    code = m.export(tmp_path, language=language, functions=["right_hand_side"], coordinates="joint")
    state = {"t": 0.0, "q": np.array([0.3]), "v": np.array([0.7]), "p": np.array([])}
    found = pendulum_in(code, tmp_path, {a.name: state[a.name] for a in code.routines[0].arguments})
    assert np.ravel(found) == pytest.approx([-15 * np.cos(0.3)], rel=1e-12)


def test_numba(tmp_path):
    m = rubbing()
    eq, p = m.symbolic(coordinates="absolute"), m.prepare(coordinates="absolute")
    code = eq.export(tmp_path, language="numba", functions=["f", "G"])
    for state in states(p, 2):
        given = {k: np.array(x, float) if k != "t" else x for k, x in given_at(eq, code, state).items()}
        lam = dict(zip(eq.lam.rows, p.multipliers(*state), strict=True))
        given["loads"] = eq.load_values.at(eq.state(*state) | lam)
        close(call(code, "f", given)[0], p.forces(*state), 2e-12)
        close(call(code, "G", given)[0], p.jacobian(state[0], state[1]))


def test_casadi_has_the_engines_values_and_exact_derivatives(tmp_path):
    ca = pytest.importorskip("casadi")
    m = rubbing()
    eq, p = m.symbolic(coordinates="absolute", inputs=["motor"]), m.prepare(coordinates="absolute")
    code = eq.export(tmp_path, language="casadi", functions=["right_hand_side", "f", "M"], name="made")
    f = code["right_hand_side"]
    assert f.name_in() == ["t", "q", "v", "u", "p"] and f.name_out() == ["qdot", "vdot", "lam", "loads"]
    state = states(p, 1)[0]
    given = given_at(eq, code, state)
    found = call(code, "right_hand_side", given)
    close(found[1].full()[:, 0], p.acceleration(*state), 2e-12)
    symbols = f.sx_in()
    slopes = ca.Function("J", symbols, [ca.jacobian(f(*symbols)[1], ca.vertcat(*symbols[1:]))])
    nodes = [n for a in code.routines[0].arguments[1:] for n in a.nodes]
    values = {n.data.name: x for a in code.routines[0].arguments for n, x in zip(a.nodes, np.ravel(given[a.name]))}
    own = jacobian(list(code.routines[0].results["vdot"]), nodes)
    exact = np.array(evaluate(list(own.ravel()), values), float).reshape(own.shape)
    found = slopes(*[given[a.name] for a in code.routines[0].arguments]).full()
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-10 * np.abs(exact).max(axis=0, initial=1e-300).max())
    program = "import made; print(made.M.n_out(), made.right_hand_side.size_in(1)[0], made.P_NAMES)"
    out = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert out.stdout.split(None, 2)[:2] == ["1", "9"]


def pushed(**more):
    m = fb.Mechanism("cart", planar=True, parameters={"c": 2.0})
    m.add(
        fb.Body("cart", mass=2.0, inertia=1.0),
        fb.Prismatic("rail", "ground", "cart", at=(0, 0), axis=(1, 0)),
        fb.PointForce("push", "cart", force=(0.0, 0.0), **more),
    )
    return m


def test_inputs_are_an_argument():
    code = pushed().export(language="python", inputs=["push.x"], functions=["right_hand_side"])
    assert code.names["u"] == ("push.x",)
    close(code["right_hand_side"](0.0, [0.0], [0.0], [3.0])[1], [1.5])
    close(code["right_hand_side"](0.0, [[0.0], [0.0]], [0.0], [[3.0], [1.0]])[1], [[1.5], [0.5]])


def wind(t, rate):
    return -0.5 * rate


def blown():
    m = pushed()
    m.add(fb.Actuator("wind", "rail.displacement", force=wind))
    return m


@pytest.mark.parametrize("language", ["c", "casadi", "numba"])
def test_python_functions_are_refused_by_the_name_of_the_law(language):
    if language == "casadi":
        pytest.importorskip("casadi")
    with pytest.raises(fb.ModelError, match=r"^force of Actuator 'wind': 'wind' is a Python function, and .* calls it"):
        blown().export(language=language)


def test_python_functions_are_called_from_python(tmp_path):
    m = blown()
    code = m.export(tmp_path, language="python", functions=["right_hand_side"])
    close(code["right_hand_side"](0.0, [0.0], [4.0])[1], [-1.0])
    space = {}
    exec((tmp_path / "cart.py").read_text(), space)
    with pytest.raises(ValueError, match="first say what the function wind is"):
        space["right_hand_side"](0.0, [0.0], [4.0])
    space["use"](wind=lambda t, rate: -rate)
    close(space["right_hand_side"](0.0, [0.0], [4.0])[1], [-2.0])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"language": "C"}, r"language='C': must be c, python, casadi, numba, fmu, fmu2 \(did you mean 'c'\?\)"),
        ({"functions": ["m"]}, "there is no function 'm' to export; known: kinematics"),
        ({"functions": ["outputs"]}, "there is no function 'outputs'"),
        ({"functions": "M"}, "functions is a list of names"),
        (
            {"outputs": ["cart.position"]},
            "output 'cart.position' is no single number: take its components, cart.x, cart.y",
        ),
        ({"inputs": ["pull"]}, "has no input 'pull'"),
        ({"folder": 3}, "folder is a path"),
    ],
)
def test_wrong_requests_are_refused(given, message):
    with pytest.raises(fb.ModelError, match=message):
        pushed().export(**given)
    with pytest.raises(fb.ModelError, match="functions in C are called when they are compiled"):
        pushed().export()["M"]


def test_the_command_writes_and_tells(tmp_path):
    from typer.testing import CliRunner

    from flyball.cli import app

    pushed().save(tmp_path / "cart.toml")
    out = CliRunner().invoke(
        app,
        [
            "export",
            str(tmp_path / "cart.toml"),
            "--language",
            "python",
            "--out",
            str(tmp_path / "made"),
            "--input",
            "push.x",
            "--json",
        ],
    )
    assert out.exit_code == 0, out.output
    told = json.loads(out.stdout)
    assert told["names"]["u"] == ["push.x"] and told["operations"]["M"] == 0
    assert (tmp_path / "made" / "cart.py").is_file() and told["files"] == [str(tmp_path / "made" / "cart.py")]


def test_what_is_too_large_is_refused_before_it_is_made():
    m = fb.Mechanism("chain", planar=True, gravity=(0, -9.81))
    for k in range(75):
        m.add(fb.Body(f"b{k}", mass=1.0, inertia=0.1, position=(k + 0.5, 0.0)))
        m.add(fb.Revolute(f"J{k}", f"b{k - 1}" if k else "ground", f"b{k}", at=(k, 0)))
    with pytest.raises(
        fb.ModelError, match=r"^the solution takes \d{6} operations, and .* up to 200000: try the other"
    ):
        m.export(coordinates="joint", functions=["right_hand_side"])
    assert m.export(coordinates="absolute", functions=["right_hand_side"]).operations["right_hand_side"] < 50_000


def test_places_on_curves_move_as_the_follower_does():
    """The rate that is exported is how fast the foot of the follower goes along the profile."""
    m = example("cam.py")
    p = m.prepare(coordinates="joint")
    eq = m.symbolic(coordinates="joint")
    code = eq.export(language="python", functions=["right_hand_side"])
    (name,) = eq.places
    r, h = p.simulate(0.02, outputs=3), 1e-4
    t, q, v = float(r.t[1]), r.q[1], r.v[1]
    found = call(code, "right_hand_side", given_at(eq, code, (t, q, v)))
    names = list(next(x for x in code.routines if x.name == "right_hand_side").results)
    a, b = (eq.checked(eq.state(t, p.step(q, s * v), v), {name: eq.places[name].symbol})[name] for s in (-h, h))
    assert float(np.ravel(found[names.index("placesdot")])[0]) == pytest.approx((b - a) / (2 * h), rel=1e-6)
