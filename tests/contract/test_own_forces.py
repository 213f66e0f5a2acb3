"""Force elements that are defined outside of the package: they work as the built-in ones do, called by address."""

from __future__ import annotations

import pickle
import runpy
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Annotated, ClassVar

import numpy as np
import pytest

import flyball as fb
from flyball.elements import (
    BodyForce,
    CoordinateForce,
    Damping,
    Joint,
    Law,
    LawOf,
    Length,
    Number,
    PointPair,
    TwoFrameForce,
    TwoPointForce,
    Unit,
    blocks,
    element,
    formula,
)
from flyball.forces import spring_damper
from flyball.math.scalar import divide
from flyball.math.vec import col, cross, dot, norm, scale, sub
from flyball.testing import ContractError, check_element
from tests.layers import both_layers

FACTOR = 1.0  # a number that a formula takes from outside


@formula
def against(par, v):
    """A formula of the user's that the wrench calls."""
    return scale(-FACTOR * par[0], v)


@element
class LinearDrag(BodyForce):
    """A force against the velocity."""

    coefficient: Damping = 0.0

    @staticmethod
    def wrench(par, F, M, laws, values):
        """-c v at M's origin."""
        o = 0.0 * par[0]
        return against(par, M[3]), (o, o, o)

    def parameters(self, n, separation):
        """Numbers that the formula sees."""
        return (n.coefficient,)


@element
class CubicSpring(TwoPointForce):
    """A tension k stretch^3 along the line between two points."""

    stiffness: Annotated[Number, Unit("N/m^3")] = 0.0
    rest: Length = 0.0

    @staticmethod
    def wrench(par, F, M, laws, values):
        """Towards F."""
        d = sub(M[0], F[0])
        length = norm(d)
        stretch = length - par[1]
        o = 0.0 * par[0]
        return scale(divide(-par[0] * stretch * stretch * stretch, length), d), (o, o, o)

    @staticmethod
    def energy(par, F, M):
        """Potential energy k stretch^4 / 4."""
        stretch = norm(sub(M[0], F[0])) - par[1]
        return 0.25 * par[0] * stretch**4

    def parameters(self, n, separation):
        """Numbers that the formula sees."""
        return (n.stiffness, n.rest)

    def conservative(self):
        """It is only a spring."""
        return True


@element
class Pusher(CoordinateForce):
    """A force k x by a law, less c rate, along a coordinate."""

    coordinate: str = ""
    damping: Damping = 0.0
    push: Annotated[Law, LawOf("N", ("value", "rate"))] = 0.0

    @staticmethod
    def effort(par, x, rate, laws, load):
        """Along x."""
        return laws[0] - par[0] * rate

    def coordinate_text(self):
        """As given."""
        return self.coordinate

    def parameters(self, n, separation):
        """Numbers that the formula sees."""
        return (n.damping,)

    def laws(self):
        """Of which there is one."""
        return (self.push,)


MASS, C = 2.0, 0.8


def thrown(drag=LinearDrag, c="c"):
    """A puck in linear drag without gravity: dv/dt = -c v / m."""
    m = fb.Mechanism("thrown", parameters={"c": C})
    m.add(fb.Body("puck", mass=MASS, inertia=(1, 1, 1), velocity=(3, 0, 0)), drag("air", "puck", coefficient=c))
    return m


def way(t, c=C):
    return 3 * MASS / c * (1 - np.exp(-c / MASS * t))


@pytest.mark.parametrize("choice", [{}, {"specialize": True}, {"specialize": False}, {"method": "radau"}], ids=str)
def test_a_motion_is_that_of_the_closed_form(choice):
    r = thrown().simulate(1.0, outputs=5, rtol=1e-9, atol=1e-10, **choice)
    np.testing.assert_allclose(r["puck.x"], way(r.t), atol=1e-7)
    np.testing.assert_allclose(r["air"].fx, -C * 3 * np.exp(-C / MASS * r.t), atol=1e-6)
    lost = 0.5 * MASS * 9 * (1 - np.exp(-2 * C / MASS * r.t))
    np.testing.assert_allclose(r.energy.work["air"], -lost, atol=1e-6)
    assert r.energy.drift < 1e-6


@both_layers
def test_a_spring_of_ones_own_in_a_linkage_keeps_the_energy():
    m = fb.Mechanism("pendulum", gravity=(0, 0, -9.81))
    m.add(fb.Body("bob", mass=1, inertia=(0.01, 0.01, 0.01), position=(1, 0, 0)))
    m.add(fb.Revolute("A", "ground", "bob", at=(0, 0, 0), axis=(0, 1, 0)))
    m.add(CubicSpring("k", "ground", "bob", at=((0, 0, 2), (1, 0, 0)), stiffness=50, rest="1 m"))
    r = m.simulate(1.0, rtol=1e-10, atol=1e-12)
    assert np.ptp(r.energy.kinetic) > 1.0
    assert r.energy.drift < 1e-7
    assert r.energy.work == {}


def test_a_force_along_a_coordinate_with_a_law():
    """M x'' = -k x - c x': a damped oscillation."""
    m = fb.Mechanism("slide", planar=True)
    m.add(fb.Body("cart", mass=1, inertia=1), fb.Translational("S", "ground", "cart", at=(0, 0), axis=(1, 0)))
    m.add(
        fb.Initial("S.displacement", value=0.1), Pusher("p", coordinate="S.displacement", damping=0.4, push="-9*value")
    )
    r = m.simulate(2.0, outputs=11, rtol=1e-10, atol=1e-12)
    d, w = 0.2, np.sqrt(9 - 0.04)
    np.testing.assert_allclose(
        r["S.displacement"], 0.1 * np.exp(-d * r.t) * (np.cos(w * r.t) + d / w * np.sin(w * r.t)), atol=1e-8
    )
    found = np.sort_complex(m.linearize(about=m.equilibrium()).eigenvalues)
    np.testing.assert_allclose(found, [-d - 1j * w, -d + 1j * w], atol=1e-9)


def test_derivatives():
    m = thrown()
    values = np.sort(m.linearize(frozen=True).eigenvalues.real)
    np.testing.assert_allclose(values[:3], -C / MASS, atol=1e-12)
    s = m.sensitivity(["puck.x"], ["c"], analysis="motion", t_end=1.0, rtol=1e-10, atol=1e-12)
    h = 1e-5
    exact = (way(1.0, C + h) - way(1.0, C - h)) / (2 * h)
    assert np.ravel(s["puck.x", "c"])[-1] == pytest.approx(exact, rel=1e-6)


def test_symbols_and_studies():
    m = thrown()
    assert "c*puck.x'" in str(m.symbolic().f).replace(" ", "")
    study = m.study({"c": [0.4, 0.8]}, ["puck.x"], t_end=1.0, outputs=2)
    np.testing.assert_allclose(study["puck.x"][:, -1], [way(1.0, 0.4), way(1.0, 0.8)], atol=1e-6)


def test_the_formula_of_a_built_in_element_gives_its_bits():
    """The same formula inside the engine and by address."""

    def wrench(par, F, M, laws, values):
        return spring_damper.wrench(par, F, M, laws, values)

    made = element(type("Twin", (fb.SpringDamper,), {"__module__": __name__, "wrench": staticmethod(wrench)}))
    class_of = {"built-in": fb.SpringDamper, "own": made}
    found = {}
    for name, kind in class_of.items():
        m = fb.Mechanism("hanging", gravity=(0, 0, -9.81))
        m.add(fb.Body("b", mass=1, inertia=(0.1, 0.1, 0.1), position=(1, 0, 0)))
        m.add(kind("s", "ground", "b", at=((0, 0, 0), (0.9, 0.1, 0)), stiffness=100, damping=1))
        found[name] = m.simulate(1.0, outputs=11, specialize=False)["b"].position
    assert found["own"].tobytes() == found["built-in"].tobytes()


def test_two_classes_do_not_clash():
    """Nobody numbers them; a number that is given means nothing."""

    @element
    class Twice(LinearDrag):
        """Another formula."""

        kind: ClassVar[int] = fb.SpringDamper.kind
        wrench: ClassVar = staticmethod(lambda par, F, M, laws, values: (scale(-2.0 * par[0], M[3]), (0.0, 0.0, 0.0)))

    m = thrown()
    m.add(Twice("more", "puck", coefficient="c"))
    r = m.simulate(1.0, outputs=3, rtol=1e-9)
    np.testing.assert_allclose(r["puck.x"], way(r.t, 3 * C), atol=1e-6)


def test_a_number_from_outside_that_changes_changes_the_code(monkeypatch):
    m = thrown()
    first = m.simulate(1.0, outputs=2)["puck.x"][-1]
    monkeypatch.setattr(f"{__name__}.FACTOR", 2.0)
    second = m.simulate(1.0, outputs=2)["puck.x"][-1]
    assert (first, second) == (pytest.approx(way(1.0), abs=1e-5), pytest.approx(way(1.0, 2 * C), abs=1e-5))


def test_so_does_one_in_a_module_that_the_formula_calls(monkeypatch):
    helpers = ModuleType("helpers")
    exec("K = 1.0\ndef share(x):\n    return K * x", vars(helpers))
    scope = {"helpers": helpers, "scale": scale}
    exec("def wrench(par, F, M, laws, values):\n    return scale(-helpers.share(par[0]), M[3]), (0.0, 0.0, 0.0)", scope)
    m = thrown(variant(wrench=staticmethod(scope["wrench"])))
    for k in (1.0, 3.0):
        helpers.K = k
        assert m.simulate(1.0, outputs=2)["puck.x"][-1] == pytest.approx(way(1.0, k * C), abs=1e-5)


def test_prepared_and_sent_it_computes_the_same():
    p = thrown().prepare()
    again = pickle.loads(pickle.dumps(p))
    found = again.acceleration(0.0, p.q, p.v)
    assert found.tolist() == p.acceleration(0.0, p.q, p.v).tolist()
    assert found[0] == pytest.approx(-C / MASS * 3)


def test_a_file_holds_it(tmp_path):
    m = thrown()
    m.save(tmp_path / "thrown.toml")
    assert fb.load(tmp_path / "thrown.toml") == m
    text = (tmp_path / "thrown.toml").read_text().replace("LinearDrag", "LinearDrug")
    (tmp_path / "wrong.toml").write_text(text)
    with pytest.raises(fb.ModelError, match=r"unknown type 'LinearDrug' .*LinearDrag.*is known once the Python file"):
        fb.load(tmp_path / "wrong.toml")


def test_a_type_that_two_modules_define_is_no_type_of_a_file(tmp_path):
    """Which of them was meant, nobody knows; in Python both work."""
    for module in ("one", "two"):
        element(type("Breeze", (LinearDrag,), {"__module__": module, "__annotations__": {}}))
    m = thrown(LinearDrag.registry["Breeze"])
    m.save(tmp_path / "breeze.toml")
    with pytest.raises(
        fb.ModelError, match=r"type 'Breeze' is defined by several modules, one, two; a file identifies"
    ):
        fb.load(tmp_path / "breeze.toml")


TAKEN = """
import pytest
from flyball.elements import BodyForce, element
from flyball.errors import ModelError

for name in ("Rope", "Latch", "PID", "Sensor", "Controller"):
    with pytest.raises(ModelError, match=f"the class {name} of .*give your own class another name"):
        type(name, (BodyForce,), {})
Rolling = element(type("Rolling", (BodyForce,), {"__annotations__": {}}))
from flyball.statics import replacement_joints
"""


def test_a_name_of_flyballs_own_is_refused():
    """In a new process, which has not imported most of them; names that model files cannot have are free."""
    done = subprocess.run([sys.executable, "-c", TAKEN], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def variant(**formulas):
    """A class that differs from LinearDrag in its formulas."""
    return element(type("Variant", (LinearDrag,), {"__module__": __name__, "__annotations__": {}, **formulas}))


WRONG = {
    "no static method": ({"wrench": lambda par, F, M, laws, values: None}, "Variant.wrench must be a static method"),
    "arguments": ({"wrench": staticmethod(lambda par, M: None)}, "wrench takes par, M; it must take par, F, M, laws"),
    "result": ({"wrench": staticmethod(lambda par, F, M, laws, values: M[3])}, "the lengths of its result are 3, not"),
    "not compiled": (
        {"wrench": staticmethod(lambda par, F, M, laws, values: print(par))},
        "Variant.wrench cannot be compiled for floats",
    ),
    "a field that means something": ({"__annotations__": {"load": float}, "load": 1.0}, "load is reserved for every"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_said_by_name(case):
    formulas, message = WRONG[case]
    with pytest.raises(fb.ModelError, match=message):
        thrown(variant(**formulas)).simulate(0.1)


def test_no_formula_at_all():
    @element
    class Empty(BodyForce):
        """Nothing."""

    m = fb.Mechanism("empty")
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1)), Empty("e", "b"))
    with pytest.raises(fb.ModelError, match=r"Empty has no formula wrench\(par, F, M, laws, values\)"):
        m.simulate(0.1)


def test_a_ball_in_the_air_comes_to_rest_on_a_floor():
    """In impulse time stepping; before it touches by the closed form, at rest its floor carries its weight."""
    m = fb.Mechanism("fall", gravity=(0, 0, -10), parameters={"c": C})
    m.add(
        fb.Body("ball", shape=fb.Sphere(radius=0.1), mass=1, position=(0, 0, 2)), fb.Ground("floor", shape=fb.Plane())
    )
    m.add(LinearDrag("air", "ball", coefficient="c"), fb.Contact(friction=0.3))
    r = m.simulate(4.0, outputs=81, method=fb.Stepping(step="2 ms"))
    t = r.t[:10]
    fallen = 10 / C * (t - (1 - np.exp(-C * t)) / C)
    np.testing.assert_allclose(r["ball.z"][:10], 2 - fallen, atol=5e-3)
    assert r["ball.z"][-1] == pytest.approx(0.1, abs=1e-3)


SHOWN = {
    "Air": lambda run: run["ball.y"][-1] > 1.0 and run.energy.work["air"][-1] < 0.0,
    "Sheet": None,
    "OnEllipse": lambda run: abs(run["bead.x"][-1] ** 2 / 4 + run["bead.y"][-1] ** 2 - 1.0) < 1e-9,
    "Lens": lambda run: abs(run["lens.z"] - 0.5).max() < 2e-3 and abs(run["lens"].quaternion[:, 2]).max() < 0.04,
    "Catch": lambda run: [(x.kind, round(x.t, 9)) for x in run.events] == [("impact", 2.0), ("escape", 3.5)],
    "runge_kutta": lambda run: run.energy.drift < 1e-3,
}


def test_what_the_documentation_shows_runs(tmp_path):
    text = (Path(__file__).parents[2] / "docs" / "own_elements.md").read_text(encoding="utf-8")
    shown = [block.split("```")[0] for block in text.split("```python\n")[1:]]
    assert len(shown) == len(SHOWN)
    for (name, holds), block in zip(SHOWN.items(), shown, strict=True):
        file = tmp_path / "shown.py"
        file.write_text(block)
        names = runpy.run_path(str(file))
        assert name in names
        assert holds is None or holds(names["run"])


# -- the contract

RIGHT = [
    LinearDrag("air", "puck", coefficient=0.8),
    CubicSpring("k", "ground", "b", at=((0, 0, 2), (1, 0, 0)), stiffness=50, rest=1),
    Pusher("p", coordinate="S.displacement", damping=0.4, push="3*sin(t) - value"),
    fb.SpringDamper("s", "a", "b", stiffness=30, damping=2, length=0.4, force="0.1*length*rate"),
    fb.Bushing("m", "a", "b", stiffness=(30, 40, 50), damping=1, torsional_stiffness=(2, 3, 4), at=(0, 0, 0)),
    fb.PointForce("f", "a", force=(1, 2, 3), axes="body"),
    fb.Rope("r", bodies=("a", "b"), at=((0, 0, 0), (1, 0, 0)), stiffness=30, length=0.1, damping=1),
    fb.Detent("n", "J.angle", pitch=0.3, holding=0.2),
    fb.TorsionalSpringDamper("w", joint="J", stiffness=3, damping=0.2),
]


@pytest.mark.parametrize("e", RIGHT, ids=lambda e: type(e).__name__)
def test_right_elements_keep_the_contract(e):
    assert check_element(e) == list(fb.testing.CHECKS["forces"])


def test_what_is_skipped_is_not_checked():
    wind = fb.PointForce("f", "a", force=(1, 2, 3))
    with pytest.raises(ContractError, match=r"PointForce 'f' fails the check 'axes': wrench.* the axes or the origin"):
        check_element(wind)
    assert not {"axes", "turned"} & set(check_element(wind, skip=("axes", "turned")))
    with pytest.raises(fb.ModelError, match=r"'axis'.* is no part of the contract; its parts are numbers, compiled"):
        check_element(wind, skip=("axis",))


def breaking(**formulas):
    return variant(**{k: staticmethod(f) if callable(f) and k != "conservative" else f for k, f in formulas.items()})


def north(par, F, M, laws, values):
    o = 0.0 * par[0]
    return (-par[0] * M[3][0], o, o), (o, o, o)


def half_a_derivative(par, F, M, laws, values):
    o = 0.0 * par[0]
    return scale(-par[0] * (M[3][0].real ** 2 + dot(M[3], M[3])) ** 0.0 * M[3][0].real, F[2]), (o, o, o)


def by_branches(par, F, M, laws, values):
    o = 0.0 * par[0]
    k = par[0] if dot(M[3], M[3]).real > 0.5 else 2.0 * par[0]
    return scale(-k, M[3]), (o, o, o)


def with_a_constant(par, F, M, laws, values):
    o = 0.0 * par[0]
    return scale(-par[0] - 0.1, M[3]), (o, o, o)


def nowhere(par, F, M, laws, values):
    return (float("nan"), 0.0, 0.0), (0.0, 0.0, 0.0)


BROKEN = {
    "axes": {"wrench": north},
    "derivatives": {"wrench": half_a_derivative},
    "symbols": {"wrench": by_branches},
    "units": {"wrench": with_a_constant},
    "numbers": {"wrench": nowhere},
    "inputs": {"inputs": lambda par, F, M: (norm(sub(M[0], F[0])), norm(sub(M[3], F[3])))},
    "energy": {"conservative": lambda self: True},
}


@pytest.mark.parametrize("part", BROKEN)
def test_a_wrong_class_is_caught_by_the_part_that_it_breaks(part):
    with pytest.raises(ContractError, match=rf"Variant 'air' fails the check '{part}': "):
        check_element(breaking(**BROKEN[part])("air", "puck", coefficient=0.8))


def with_a_torque(par, F, M, laws, values):
    d = sub(M[0], F[0])
    return scale(-par[0], d), scale(par[0], d)


def off_the_line(par, F, M, laws, values):
    o = 0.0 * par[0]
    return scale(-par[0], sub(M[3], F[3])), (o, o, o)


def along_an_axis_of_the_body(par, F, M, laws, values):
    o = 0.0 * par[0]
    return scale(par[0], (M[1][0], M[1][3], M[1][6])), (o, o, o)


@pytest.mark.parametrize(
    ("wrench", "role", "why"),
    [
        (with_a_torque, "M", "exerts a torque about the origin of frame M"),
        (with_a_torque, "F", "exerts a torque about the origin of frame F"),
        (off_the_line, "M", ""),
        (off_the_line, "F", "exerts a torque about the origin of frame F"),
        (along_an_axis_of_the_body, "M", "depends on the orientation or angular velocity of frame M"),
    ],
)
def test_a_force_between_two_points_makes_no_torque_on_a_point_mass(wrench, role, why):
    """A point mass would not turn; a body with inertia does."""
    members = {"__module__": __name__, "__annotations__": {}, "wrench": staticmethod(wrench)}
    cls = element(type("Between", (CubicSpring,), members | {"conservative": lambda self: False}))
    with pytest.raises(
        ContractError, match=r"Between 's' fails the check 'points': wrench.* derive the class from Two"
    ):
        check_element(cls("s", "a", "b", stiffness=1))
    for inertia in (0, (1, 1, 1)):
        m = fb.Mechanism("pair")
        m.add(fb.Body("p", mass=1, inertia=inertia, position=(1, 0, 0)))
        m.add(cls("s", *(("ground", "p") if role == "M" else ("p", "ground")), stiffness=1))
        if why and inertia == 0:
            with pytest.raises(fb.ModelError, match=rf"Between 's': its wrench {why}, but Body 'p' has no inertia"):
                m.simulate(0.1)
        else:
            m.simulate(0.1, outputs=2)


@element
class Aligner(TwoFrameForce):
    """A torque k x_M x x_F that turns the x axes of two frames towards each other, and a force k (F - M)."""

    torsional_stiffness: Annotated[Number, Unit("N*m")] = 0.0

    @staticmethod
    def wrench(par, F, M, laws, values):
        return scale(par[0], sub(F[0], M[0])), scale(par[0], cross(col(M[1], 0), col(F[1], 0)))

    def parameters(self, n, separation):
        return (n.torsional_stiffness,)


@both_layers
def test_a_force_between_two_frames_at_a_point():
    """About a hinge through the point it is a torsional spring: an angular frequency sqrt(k / J)."""
    m = fb.Mechanism("needle", planar=True)
    m.add(fb.Body("needle", mass=1, inertia=0.2, position=(1, 2)))
    m.add(fb.Revolute("A", "ground", "needle", at=(1, 2)))
    m.add(Aligner("e", "ground", "needle", at=(1, 2), torsional_stiffness=5))
    found = m.linearize(about=m.equilibrium()).eigenvalues
    np.testing.assert_allclose(np.sort(found.imag), [-5, 5], rtol=1e-9)
    check_element(Aligner("e", "a", "b", at=(0, 0, 0), torsional_stiffness=5), skip=("turned", "units"))


def test_points_without_frames_are_refused():
    @element
    class Sling(CoordinateForce):
        """A force along the distance of two points, whose class does not place them."""

        at: PointPair | None = None

        def ends(self):
            return {"F": "ground", "M": "b"}

        def path(self):
            return (("F", "M", blocks.DISTANCE),)

    m = fb.Mechanism("sling")
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1)))
    with pytest.raises(fb.ModelError, match=r"Sling 's': 'at' is given, and Sling has no placed\(n, planar\)"):
        m.add(Sling("s", at=((0, 0, 1), (0, 0, 0))))


# -- joints


@element
class Layer(Joint):
    """A point of ``body_j`` stays in the plane of ``body_i`` through ``at`` whose normal is ``axis``."""

    blocks: ClassVar = (blocks.SLIDE,)
    needs_axis: ClassVar[bool] = True
    planar_normal: ClassVar[str] = ""


@both_layers
def test_a_joint_of_ones_own_needs_no_formula(tmp_path):
    """A puck slides down a plane: an acceleration of g sin(angle) along it, m g cos(angle) on it."""
    m = fb.Mechanism("slope", gravity=(0, 0, -10))
    m.add(fb.Body("puck", mass=2, inertia=(1, 1, 1), position=(1, 0, 0)))
    m.add(Layer("table", "ground", "puck", at=(1, 0, 0), axis=(0, 3, 4)))
    n, g = np.array([0, 0.6, 0.8]), np.array([0, 0, -10.0])
    assert m.check().freedoms == 5
    r = m.simulate(1.0, outputs=3)
    np.testing.assert_allclose(r["puck"].position[-1], [1, 0, 0] + 0.5 * (g - n * (g @ n)), atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(r["table"].force, axis=1), 2 * 8.0, atol=1e-8)
    m.save(tmp_path / "slope.toml")
    assert fb.load(tmp_path / "slope.toml") == m
