"""Exported C compiles without a warning and is the engine's right-hand side."""

import ctypes

import numpy as np
import pytest

import flyball as fb
from tests.symbolic.exported import Library, close, example, given_at, rubbing, states

CASES = {
    "andrews.toml": ("joint", "absolute"),
    "bricard.toml": ("joint", "absolute"),
    "stewart.py": ("joint",),
    "slider_crank.toml": ("joint", "absolute"),
    "cam.py": ("joint", "absolute"),
    "double_wishbone.toml": ("absolute",),
    "heavy_top.toml": ("joint",),
    "thin_rod.toml": ("absolute",),
    "rubbing": ("joint", "absolute"),
}
UNDETERMINED = {"bricard.toml", "planetary.py"}  # multipliers that redundancy leaves open


@pytest.mark.parametrize(("name", "coordinates"), [(n, c) for n, cs in CASES.items() for c in cs])
def test_the_right_hand_side_is_the_engines(name, coordinates, tmp_path):
    m = rubbing() if name == "rubbing" else example(name)
    eq = m.symbolic(coordinates=coordinates)
    code = eq.export(functions=["right_hand_side", "M", "f", "residual"], name="made")
    library, p = Library(code, tmp_path), m.prepare(coordinates=coordinates)
    rows = len(p.rows)
    for t, q, v in states(p):
        given = given_at(eq, code, (t, q, v))
        found = library("right_hand_side", **given)
        close(found["vdot"], p.acceleration(t, q, v), 2e-12)
        close(found["qdot"], p.rates(q, v))
        if name not in UNDETERMINED:
            close(found["lam"][:rows], p.multipliers(t, q, v), 2e-12)
        close(library("M", **given)["M"], p.mass_matrix(q))
        given |= {"vdot": found["vdot"], "lam": found["lam"], "loads": found.get("loads", [])}
        close(library("f", **given)["f"], p.forces(t, q, v), 2e-12)
        terms = np.abs(library("M", **given)["M"] @ found["vdot"]).max() + np.abs(p.forces(t, q, v)).max()
        assert np.abs(library("residual", **given)["residual"]).max() < 1e-11 * terms


def test_loads_return_themselves():
    """Seven of Newton's steps lead to the loads that the engine iterates to, where friction feeds on itself too."""
    m = rubbing()
    m.parameters["mu"] = 0.6
    p = m.prepare(coordinates="absolute")
    eq = m.symbolic(coordinates="absolute")
    code = eq.export(language="python", functions=["right_hand_side"])
    for t, q, v in states(p, 6):
        given = given_at(eq, code, (t, q, v))
        found = code["right_hand_side"](t, given["q"], given["v"])
        close(found[1], p.acceleration(t, q, v), 1e-11)
        assert (found[3] > 0.0).all()


def test_what_drivers_prescribe_is_a_row(tmp_path):
    m = fb.Mechanism("arm", planar=True, gravity=(0, -9.81), parameters={"rate": 2.0})
    m.add(
        fb.Body("a", mass=1.0, inertia=0.1, position=(0.5, 0.0)),
        fb.Body("b", mass=2.0, inertia=0.2, position=(1.5, 0.0)),
        fb.Revolute("A", "ground", "a", at=(0, 0)),
        fb.Revolute("B", "a", "b", at=(1, 0)),
        fb.Driver("drive", "A.angle", law="rate*t + 0.1*sin(t)"),
    )
    p, eq = m.prepare(coordinates="joint"), m.symbolic(coordinates="joint")
    code = eq.export(tmp_path, functions=["right_hand_side", "g"])
    library = Library(code, tmp_path)
    t, v = 0.7, np.array([2.0 + 0.1 * np.cos(0.7), -0.4])
    q = np.array([1.4 + 0.1 * np.sin(0.7), 0.3])
    found = library("right_hand_side", t=t, q=q, v=v, p=[2.0])
    close(found["vdot"], p.acceleration(t, q, v))
    close(found["lam"], p.efforts(t, q, v)[:1])
    close(library("g", t=t, q=q + [0.01, 0.0], p=[2.0])["g"], [0.01], 1e-12)


def test_the_header_says_names_units_and_order(tmp_path):
    code = example("slider_crank.toml").export(tmp_path, name="slider crank", outputs=["slider.x"])
    assert [f.name for f in code.files] == ["slider_crank.c", "slider_crank.h"]
    header = (tmp_path / "slider_crank.h").read_text()
    for text in ("slider crank", "SI units", "qdot = T v,  M vdot = f + G^T lam", "q (", "y[1]: slider.x [m]"):
        assert text in header
    for name in ("q_names", "q_start", "v_start", "right_hand_side(double t, const double *q"):
        assert f"slider_crank_{name}" in header
    assert not [line for line in header.splitlines() if line != line.rstrip()]
    library = Library(code, tmp_path).library
    n = len(code.names["q"])
    told = (ctypes.c_char_p * n).in_dll(library, "slider_crank_q_names")
    assert [x.decode() for x in told] == list(code.names["q"])
    start = (ctypes.c_double * n).in_dll(library, "slider_crank_q_start")
    np.testing.assert_array_equal(list(start), code.start["q"])
