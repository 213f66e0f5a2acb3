"""Joints as in textbooks: the rows of two free frames are the engine's, and their vector forms."""

import numpy as np
import pytest

from flyball.engine.kinematics import load_record
from flyball.errors import ModelError
from flyball.expression_graph.graph import evaluate
from tests import mechanisms
from tests.contract import zoo
from tests.symbolic.states import random_state

PARTS = (("", 3), ("e", 4), ("w", 3), ("v", 3), ("alpha", 3), ("a", 3))


def engine(where, name):
    """The joint in absolute coordinates at a random state: values of both frames' symbols; g, G v, G vdot - gamma."""
    eq, _, values = random_state(zoo.joined(where, name), "absolute")
    f, s = eq.named_equations, eq.named_equations.values.structure
    given = {k: v for k, v in values.items() if k in eq.named}
    out, frames = {}, {}
    vdot = [values[n] for n in eq.vdot.rows]
    for role in "FM":
        at = s.frame_at["J", role, ""]
        p, R, w, v, _, _ = (np.array(evaluate(list(x), given), float) for x in load_record(f.traced.work.frames, at))
        frames[role] = p, R.reshape(3, 3), w, v
        end = {"F": s.model["J"].body_i, "M": s.model["J"].body_j}[role]
        body = {k: eq[f"{end}.{k}"].at(given | dict(zip(eq.vdot.rows, vdot, strict=True))) for k in MOTION}
        alpha, a0 = (three(body[k]) for k in ("angular_acceleration", "acceleration"))
        w0, p0 = three(body["angular_velocity"]), three(body["position"])
        r = p - p0
        a = a0 + np.cross(alpha, r) + np.cross(w0, np.cross(w0, r))
        for what, x in (("", p), ("v", v), ("w", w), ("alpha", alpha), ("a", a)):
            out |= {f"{role}.{what}{k}": c for k, c in zip("xyz", x, strict=True)}
    lines = eq.g.at(values), (eq.G @ eq.v).at(values), (eq.G @ eq.vdot - eq.gamma).at(values)
    return eq, values, frames, out, lines


MOTION = ("position", "acceleration", "angular_velocity", "angular_acceleration")


def three(x):
    """In the plane: two components, or one about the normal, as three."""
    x = np.atleast_1d(x)
    return {1: np.r_[0.0, 0.0, x], 2: np.r_[x, 0.0], 3: x}[len(x)]


def bryant(R):
    return {"b1": np.arctan2(-R[1, 2], R[2, 2]), "b2": np.arcsin(R[0, 2]), "b3": np.arctan2(-R[0, 1], R[0, 0])}


@pytest.mark.parametrize("orientation", ["quaternion", "bryant"])
@pytest.mark.parametrize(("where", "name"), zoo.CASES)
def test_rows_are_the_engines(where, name, orientation):
    from flyball.rotations.arrays import quaternion_of

    eq, values, frames, at, (g, rate, second) = engine(where, name)
    book = eq.joint("J", orientation=orientation)
    for role, (_, R, _, _) in frames.items():
        told = (
            bryant(R) if orientation == "bryant" else dict(zip(("e0", "e1", "e2", "e3"), quaternion_of(R), strict=True))
        )
        at |= {f"{role}.{k}": x for k, x in told.items()}
    if "J.place" in values:
        at["place"] = values["J.place"]
    at = {k: x for k, x in at.items() if k in book.named}
    for made, exact in ((book.position, g), (book.velocity, rate), (book.acceleration, second)):
        np.testing.assert_allclose(
            made.at(at), exact, rtol=1e-10, atol=1e-10 * max(1.0, np.abs(exact).max(initial=0.0))
        )


@pytest.mark.parametrize(("where", "name"), zoo.CASES)
def test_vector_forms_are_the_rows(where, name):
    eq, _, frames, at, (g, rate, _) = engine(where, name)
    book = eq.joint("J", orientation="bryant")
    told = {}
    for role, (p, R, w, v) in frames.items():
        told |= {f"p_{role}": p, f"w_{role}": w, f"v_{role}": v}
        told |= {f"{axis}_{role}": R[:, k] for k, axis in enumerate("xyz")}
    for k, (vector, terms) in enumerate(zip(book.vectors, book.terms, strict=True)):
        if vector is None or len(terms) > 1:
            continue
        par = terms[0].par
        n, m = np.array(par[:3]), np.array(par[3:6])
        own = {"n": n, "c": par[6], "n_F": frames["F"][1] @ n, "n_M": frames["M"][1] @ n, "m_M": frames["M"][1] @ m}
        own |= {"s_1": par[3], "s_2": par[4], "k": par[5], "cross": np.cross, "sqrt": np.sqrt}
        exact = rate[k] if vector.of_velocity else g[k]
        assert eval(vector.text, {}, told | own) == pytest.approx(exact, abs=1e-12)


def test_a_hinge_is_told_with_its_building_blocks():
    book = mechanisms.example("governor.toml").symbolic().joint("bearing", orientation="bryant")
    text = book.text()
    assert "(BB1)" in text and "(BB2, BB4)" in text and "n @ (p_M - p_F) - c = 0" in text and "F.b1" in text
    assert "r^R_{MO}" in book.text(notation="hahn")
    with pytest.raises(ModelError, match="orientation is 'euler'"):
        mechanisms.example("governor.toml").symbolic().joint("bearing", orientation="euler")
