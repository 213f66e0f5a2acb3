"""Constraint rows with a formula of a user's own, called by address, in joints of a user's own."""

from __future__ import annotations

import pickle
from typing import ClassVar

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flyball as fb
from flyball.constraints import distance, knife_edge
from flyball.elements import (
    ConstraintRow,
    Coordinate,
    Joint,
    Length,
    blocks,
    element,
    point_row,
    positive,
    seen_from,
)
from flyball.math.vec import neg
from flyball.testing import CHECKS, ContractError, check_element
from tests.layers import both_layers

SCALE = 1.0  # a number that a formula takes from outside
G = 9.81


def ellipse(par, F, M):
    """g = a/2 (x^2/a^2 + y^2/b^2 - 1)."""
    a, b = SCALE * par[0], SCALE * par[1]
    r, v = seen_from(F, M)
    x, y = r[0] / a, r[1] / b
    value = 0.5 * a * (x * x + y * y - 1.0)
    return point_row(F, M, value, (x, a * y / b, 0.0 * x), v[0] * v[0] / a + a * v[1] * v[1] / (b * b))


class OnEllipse(ConstraintRow):
    """The origin of M is on the ellipse x^2/a^2 + y^2/b^2 = 1 of F."""

    points: ClassVar[str] = "M"
    row: ClassVar = staticmethod(ellipse)


@element
class EllipticTrack(Joint):
    """The origin of the second frame stays on an ellipse in the x-y plane of the first."""

    a: Length = 1.0
    b: Length = 1.0

    blocks: ClassVar = (OnEllipse("xy"), blocks.IN_PLANE)

    def check(self, n):
        """Both half axes are greater than zero."""
        positive(self, n, "a", "b")

    def constants(self, n, row, F, M):
        """Parameters of the rows."""
        return (n.a, n.b) if isinstance(row, OnEllipse) else super().constants(n, row, F, M)


A, B, START = 2.0, 1.0, 0.4


def bead(joint=EllipticTrack, planar=True, inertia=0.1, **more):
    """A bead on an ellipse in a vertical plane, let go at the parameter START."""
    third = () if planar else (0.0,)
    m = fb.Mechanism("bead", gravity=(0, -G, *third), planar=planar, parameters={"a": A})
    m.add(fb.Frame("rail", "ground"))
    m.add(fb.Body("bead", mass=2, inertia=inertia, position=(A * np.cos(START), B * np.sin(START), *third)))
    m.add(joint("guide", "rail", "bead", **({"a": "a", "b": B} | more)))
    return m


def on_ellipse(t, a=A, b=B, spin=0.0, g=G, speed=0.0):
    """Position (x, y) and parameter rate of a bead on an ellipse that turns about its centre, seen from the ellipse."""

    def rate(_, y):
        s, c = np.sin(y[0]), np.cos(y[0])
        return y[1], (-(a * a - b * b) * s * c * (y[1] ** 2 + spin**2) - g * b * c) / (a * a * s * s + b * b * c * c)

    y = solve_ivp(rate, (0, max(t)), (START, speed), t_eval=t, rtol=1e-12, atol=1e-13, method="DOP853").y
    return np.column_stack([a * np.cos(y[0]), b * np.sin(y[0])]), y[1]


WAYS = [
    {},
    {"method": "radau"},
    {"method": "generalised-alpha", "step": 2e-4},
    {"specialize": True},
    {"stabilization": "velocities"},
]


@pytest.mark.parametrize("way", WAYS, ids=str)
def test_a_bead_on_an_ellipse(way):
    given = {"outputs": 11} | ({} if "step" in way else {"rtol": 1e-9, "atol": 1e-11})
    r = bead().simulate(1.0, **given, **way)
    there, _ = on_ellipse(r.t)
    np.testing.assert_allclose(r["bead"].position, there, atol=2e-6)
    assert np.ptp(r.energy.kinetic) > 10.0
    assert r.energy.drift < 1e-4 * np.ptp(r.energy.kinetic)


def test_the_reaction_is_along_the_normal():
    """m a = m g + force; along the normal n = grad(g), n . a = -v . (second derivatives of g) v."""
    r = bead().simulate(1.0, outputs=6, rtol=1e-10, atol=1e-12)
    k = 4
    x, y = r["bead"].position[k]
    v = np.array([r["bead.vx"][k], r["bead.vy"][k]])
    n = np.array([x / A**2, y / B**2])
    curved = (v[0] ** 2 / A**2 + v[1] ** 2 / B**2) / (n @ n)
    force = 2.0 * (-curved * n + n * G * n[1] / (n @ n))
    np.testing.assert_allclose(r["guide"].force[k][:2], force, atol=1e-5)


@both_layers
def test_an_ellipse_that_turns():
    """Its frame is on a driven turntable: the row's terms of a moving frame F count."""
    spin = 3.0
    m = fb.Mechanism("turntable", planar=True)
    m.add(fb.Body("table", mass=5, inertia=2), fb.Frame("rail", "table"))
    m.add(fb.Revolute("axle", "ground", "table", at=(0, 0)), fb.Driver("drive", coordinate="axle.angle", law="3*t"))
    x, y = A * np.cos(START), B * np.sin(START)
    m.add(fb.Body("bead", mass=2, inertia=0.1, position=(x, y), velocity=(-spin * y, spin * x)))
    m.add(EllipticTrack("guide", "rail", "bead", a=A, b=B))
    r = m.simulate(1.5, outputs=16, rtol=1e-10, atol=1e-12)
    there, _ = on_ellipse(r.t, spin=spin, g=0.0)
    c, s = np.cos(spin * r.t), np.sin(spin * r.t)
    x, y = there.T
    np.testing.assert_allclose(r["bead"].position, np.column_stack([c * x - s * y, s * x + c * y]), atol=1e-7)


@both_layers
def test_an_ellipse_that_turns_freely_keeps_energy_and_angular_momentum():
    m = fb.Mechanism("turntable", planar=True)
    m.add(fb.Body("table", mass=5, inertia=2, angular_velocity=1), fb.Frame("rail", "table"))
    m.add(fb.Body("bead", mass=2, inertia=0.1, position=(A * np.cos(START), B * np.sin(START))))
    m.add(fb.Revolute("axle", "ground", "table", at=(0, 0)), EllipticTrack("guide", "rail", "bead", a=A, b=B))
    r = m.simulate(3.0, outputs=31, rtol=1e-10, atol=1e-12)
    (x, y), (vx, vy) = r["bead"].position.T, r["bead"].velocity.T
    momentum = 2 * r["table"].angular_velocity + 2 * (x * vy - y * vx) + 0.1 * r["bead"].angular_velocity
    assert np.ptp(r["table"].angular_velocity) > 0.2
    np.testing.assert_allclose(momentum, momentum[0], rtol=1e-8)
    assert r.energy.drift < 1e-8


def test_a_point_mass_on_an_ellipse_in_space():
    """Its row reads M's origin only (`points`), so the bead needs no inertia."""
    m = bead(planar=False, inertia=(0, 0, 0))
    assert m.check().freedoms == 1
    r = m.simulate(1.0, outputs=6, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(r["bead"].position[:, :2], on_ellipse(r.t)[0], atol=1e-6)


def test_statics_and_derivatives():
    """About the lowest point: w^2 = g b / a^2."""
    m = bead()
    rest = m.equilibrium()
    found = np.sort_complex(m.linearize(about=rest).eigenvalues)
    found = found[np.abs(found) > 1e-3]
    np.testing.assert_allclose(np.abs(found.imag), np.sqrt(G * B) / A, rtol=1e-6)
    s = m.sensitivity(["bead.y"], ["a"], analysis="motion", t_end=1.0, rtol=1e-10, atol=1e-12)
    study = m.study({"a": [A - 1e-4, A + 1e-4]}, ["bead.y"], t_end=1.0, outputs=2, rtol=1e-11, atol=1e-12)
    low, high = np.ravel(study["bead.y"][:, -1])
    assert np.ravel(s["bead.y", "a"])[-1] == pytest.approx((high - low) / 2e-4, rel=1e-5)


def test_symbols():
    text = str(bead().symbolic()).replace(" ", "")
    assert "g[1]=(a*bead.y^2-a+bead.x^2/a)/2" in text
    assert "-a*bead.y'^2-bead.x'^2/a" in text


def own(name, formula, **more):
    """A class of rows with this formula."""
    row = {"row": staticmethod(formula)} if formula is not None else {}
    return type(name, (ConstraintRow,), {"__module__": __name__, **row, **more})


def joint(row, **more):
    """A class of joints with this row."""
    return element(type("Guide", (Joint,), {"__module__": __name__, "__annotations__": {}, "blocks": (row,), **more}))


def apart(par, F, M):
    """The distance of two points, less par[0]."""
    found = distance.row((0.0,) * 8, F, M, 0.0, None)
    return found[0] - par[0], found[1], found[2], found[3], found[4]


def edge(par, F, M):
    """No velocity along an axis of M."""
    return knife_edge.row(par, F, M, 0.0, None)


def test_the_formula_of_a_built_in_row_gives_its_bits():
    """The same formulas inside the engine and by address."""
    more = {"__module__": __name__, "__annotations__": {}}
    link = {"blocks": (own("Apart", apart)(),), "constants": lambda self, n, row, F, M: (n.length,)}
    skate = {"blocks": (own("Edge", edge)("x", holonomic=False),), "constants": lambda self, n, row, F, M: (1, 0, 0)}
    kinds = [
        (fb.Distance, fb.KnifeEdge),
        (element(type("Bar", (fb.Distance,), more | link)), element(type("Skate", (fb.KnifeEdge,), more | skate))),
    ]
    found = []
    for rod, knife in kinds:
        m = fb.Mechanism("sleigh", gravity=(0.3, -1.0), planar=True)
        m.add(fb.Body("a", mass=1, inertia=0.2, velocity=(1, 0), angular_velocity=0.5))
        m.add(fb.Body("b", mass=1, inertia=0.3, position=(1, 1)))
        m.add(
            rod("rod", "a", "b", at=((0.2, 0.1), (0.9, 1.3)), length=1.4),
            knife("k", "ground", "a", at=(0, 0), axis=(1, 0)),
        )
        found.append(m.simulate(1.0, outputs=5, specialize=False))
    for name in ("a", "b"):
        assert found[1][name].position.tobytes() == found[0][name].position.tobytes()
    assert np.ptp(found[0]["a.y"]) > 0.1


def test_a_coordinate_that_a_driver_moves():
    """The value of a row of a user's own as a coordinate: what it is compared with is the driver's."""
    far = own("Far", apart)
    rod = joint(blocks.IN_PLANE, coordinates={"distance": Coordinate(far())})
    m = fb.Mechanism("hoist", gravity=(0, -G, 0))
    m.add(fb.Body("load", mass=1, inertia=(0.1, 0.1, 0.1), position=(0, -1, 0)), fb.Frame("hook", "ground"))
    m.add(rod("rope", "hook", "load"), fb.Driver("winch", coordinate="rope.distance", law="1 + 0.2*t**2"))
    r = m.simulate(1.0, outputs=5, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(r["rope"].distance, 1 + 0.2 * r.t**2, atol=1e-9)
    np.testing.assert_allclose(r["winch"].effort, -(G - 0.4), atol=1e-6)


def test_files_and_processes(tmp_path):
    m = bead()
    m.save(tmp_path / "bead.toml")
    assert fb.load(tmp_path / "bead.toml") == m
    p = m.prepare()
    again = pickle.loads(pickle.dumps(p))
    assert again.acceleration(0.0, p.q, p.v).tolist() == p.acceleration(0.0, p.q, p.v).tolist()


def test_a_number_from_outside_that_changes_changes_the_code(monkeypatch):
    m = bead()
    m.simulate(0.1)
    monkeypatch.setattr(f"{__name__}.SCALE", 0.5)
    x, y = m.simulate(0.1, outputs=2)["bead"].position[-1]
    assert (x / A) ** 2 + (y / B) ** 2 == pytest.approx(0.25, abs=1e-9)


WRONG = {
    "no formula": (None, r"Own has no formula row\(par, F, M\); define it as a static method. It returns \(value, fo"),
    "arguments": (lambda par, F, M, hint: None, "Own.row takes par, F, M, hint; it must take par, F, M"),
    "result": (lambda par, F, M: M[0], r"Own.row cannot be compiled for floats: .*It must return \(value, force on M"),
    "not compiled": (lambda par, F, M: print(par), "Own.row cannot be compiled for floats"),
    "value": (
        lambda par, F, M: point_row(F, M, 0.0 * par[0] + float("nan"), F[0], 0.0 * par[0]),
        "Own.row of Guide 'guide' is not finite for par = .* value nan",
    ),
    "bias": (
        lambda par, F, M: point_row(F, M, 0.0 * par[0], (par[0], par[0], par[0]), par[0] + float("nan")),
        "Own.row of Guide 'guide' is not finite .* bias nan",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_said_by_name(case):
    formula, message = WRONG[case]
    kind = joint(own("Own", formula)("xy"), constants=lambda self, n, row, F, M: (1.0,))
    m = fb.Mechanism("m", gravity=(0, -G), planar=True)
    m.add(
        fb.Body("bead", mass=1, inertia=1, position=(1, 0)), fb.Frame("rail", "ground"), kind("guide", "rail", "bead")
    )
    with pytest.raises(fb.FlyballError, match=message):
        m.simulate(0.1)


def test_too_many_parameters():
    kind = joint(own("Own", apart)(), constants=lambda self, n, row, F, M: (1.0,) * 7)
    m = fb.Mechanism("m")
    m.add(fb.Body("b", mass=1, inertia=(1, 1, 1)))
    m.add(fb.Frame("rail", "ground"), kind("guide", "rail", "b"))
    with pytest.raises(
        fb.ModelError, match=r"Guide 'guide': constants\(\) gives 7 numbers for its Own, which has up to 6"
    ):
        m.simulate(0.1)


RIGHT = [
    EllipticTrack("guide", "rail", "bead", a=2, b=1),
    fb.Revolute("hinge", "a", "b", at=(0.3, 0.2, 0.1), axis=(1, 2, 2)),
]


@pytest.mark.parametrize("e", RIGHT, ids=lambda e: type(e).__name__)
def test_right_joints_keep_the_contract(e):
    assert check_element(e) == list(CHECKS["joints"])


def wrong_bias(par, F, M):
    value, force, torque, arm, bias = ellipse(par, F, M)
    return value, force, torque, arm, bias + par[0] * (M[3][0] - F[3][0]) ** 2


def wrong_force(par, F, M):
    value, force, torque, arm, bias = ellipse(par, F, M)
    return value, neg(force), torque, arm, bias


def no_torque(par, F, M):
    value, force, torque, arm, bias = ellipse(par, F, M)
    return value, force, torque, torque, bias


BROKEN = {
    "bias": wrong_bias,
    "gradient": wrong_force,
    "units": lambda par, F, M: ellipse((par[0] + 0.1, par[1]), F, M),
}


@pytest.mark.parametrize("part", BROKEN)
def test_a_wrong_row_is_caught_by_the_part_that_it_breaks(part):
    kind = element(
        type("Guide", (EllipticTrack,), {"__module__": __name__, "__annotations__": {}, "blocks": (own("Own", BROKEN[part])(),),
             "constants": lambda self, n, row, F, M: (n.a, n.b)})
    )  # fmt: skip
    with pytest.raises(ContractError, match=rf"Guide 'guide' fails the check '{part}': "):
        check_element(kind("guide", "rail", "bead", a=2, b=1))


def test_a_row_that_turns_a_point_mass_is_refused():
    """The row of an ellipse exerts a torque on the body that carries the ellipse, whatever it declares."""
    kind = joint(own("Own", ellipse, points="FM")("xy"), constants=lambda self, n, row, F, M: (2.0, 1.0))
    with pytest.raises(
        ContractError, match=r"fails the check 'points': row.*exerts a torque about the origin of frame F"
    ):
        check_element(kind("guide", "rail", "bead"))
    m = fb.Mechanism("ring", planar=True)
    m.add(fb.Body("ring", mass=1, inertia=0, position=(2, 0)), fb.Frame("pin", "ground"), kind("guide", "ring", "pin"))
    with pytest.raises(
        fb.ModelError, match=r"Guide 'guide': row Own exerts a torque .*frame F, but Body 'ring' has no in"
    ):
        m.simulate(0.1)


def test_a_torque_that_is_forgotten_is_found():
    kind = joint(own("Own", no_torque)("xy"), constants=lambda self, n, row, F, M: (2.0, 1.0))
    with pytest.raises(ContractError, match="fails the check 'gradient'"):
        check_element(kind("guide", "rail", "bead"))
