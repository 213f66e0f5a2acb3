"""The document of a mechanism's equations: what it says is what the engine computes with, and it is short."""

import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from flyball.errors import ModelError
from flyball.expression_graph.graph import Node, evaluate, symbols_of
from flyball.symbolic.document_formats import Formulas, Matrix
from tests.mechanisms import example


def arm(n=2):
    """Planar arm of n links, every number a parameter."""
    told = {"g": 9.81}
    for k in range(1, n + 1):
        told |= {f"m{k}": 1.0 + 0.1 * k, f"l{k}": 0.5, f"lc{k}": 0.25, f"I{k}": 0.02}
    m = fb.Mechanism("arm", planar=True, gravity=[0, "-g"], parameters=told)
    at, before = "0", "ground"
    for k in range(1, n + 1):
        m.add(fb.Body(f"link{k}", mass=f"m{k}", inertia=f"I{k}", position=[f"{at}+lc{k}", 0]))
        m.add(fb.Revolute(f"J{k}", before, f"link{k}", at=[at, 0]))
        at, before = f"{at}+l{k}", f"link{k}"
    return m


def cart():
    told = {"g": 9.81, "M": 2.0, "m": 0.3, "l": 0.6, "J": 0.01}
    m = fb.Mechanism("cart", planar=True, gravity=[0, "-g"], parameters=told)
    m.add(fb.Body("cart", mass="M", inertia=1.0), fb.Body("bob", mass="m", inertia="J", position=[0, "-l"]))
    m.add(fb.Translational("rail", "ground", "cart", at=[0, 0], axis=[1, 0]))
    m.add(fb.Revolute("pivot", "cart", "bob", at=[0, 0]))
    return m


def spherical_pendulum():
    told = {"g": 9.81, "m": 0.3, "l": 0.6, "A": 0.01, "C": 0.02}
    m = fb.Mechanism("spherical pendulum", gravity=[0, 0, "-g"], parameters=told)
    m.add(fb.Body("yoke", mass=0, inertia=(0, 0, 0)))
    m.add(fb.Body("bob", mass="m", inertia=("A", "A", "C"), position=[0, 0, "-l"]))
    m.add(fb.Revolute("azimuth", "ground", "yoke", at=[0, 0, 0], axis=[0, 0, 1]))
    m.add(fb.Revolute("polar", "yoke", "bob", at=[0, 0, 0], axis=[0, 1, 0]))
    return m


def written(x):
    return np.array(x.texts())


def test_two_links_are_those_of_the_textbook():
    """Spong and Vidyasagar, Robot Dynamics and Control, section 6.4, with angles from link to link."""
    eq = arm().symbolic(coordinates="joint")
    assert written(eq.M).tolist() == [
        [
            "I1 + I2 + m1*lc1^2 + m2*(l1^2 + lc2^2 + 2*l1*lc2*cos(J2.angle))",
            "I2 + m2*lc2^2 + m2*l1*lc2*cos(J2.angle)",
        ],
        ["I2 + m2*lc2^2 + m2*l1*lc2*cos(J2.angle)", "I2 + m2*lc2^2"],
    ]
    assert written(eq.f).tolist() == [
        "m2*l1*lc2*J2.angle'*(2*J1.angle' + J2.angle')*sin(J2.angle)"
        " - g*(m2*lc2*cos(J1.angle + J2.angle) + (m1*lc1 + m2*l1)*cos(J1.angle))",
        "-m2*lc2*(g*cos(J1.angle + J2.angle) + l1*J1.angle'^2*sin(J2.angle))",
    ]


def test_three_links_have_the_angles_of_the_chain():
    M = written(arm(3).symbolic(coordinates="joint").M)
    assert M[0, 0] == (
        "I1 + I2 + I3 + m1*lc1^2 + m2*(l1^2 + lc2^2 + 2*l1*lc2*cos(J2.angle)) + m3*(l1^2 + l2^2 + lc3^2"
        " + 2*l1*l2*cos(J2.angle) + 2*l2*lc3*cos(J3.angle) + 2*l1*lc3*cos(J2.angle + J3.angle))"
    )
    assert M[0, 2] == "I3 + m3*lc3*(lc3 + l2*cos(J3.angle) + l1*cos(J2.angle + J3.angle))"


def test_a_pendulum_on_a_cart():
    eq = cart().symbolic(coordinates="joint")
    assert written(eq.M).tolist() == [["M + m", "m*l*cos(pivot.angle)"], ["m*l*cos(pivot.angle)", "J + m*l^2"]]
    assert written(eq.f).tolist() == ["m*l*pivot.angle'^2*sin(pivot.angle)", "-m*g*l*sin(pivot.angle)"]


def test_a_spherical_pendulum():
    """(A + m l^2) theta'' = (A + m l^2 - C) phi'^2 sin theta cos theta - m g l sin theta."""
    eq = spherical_pendulum().symbolic(coordinates="joint")
    assert written(eq.M).tolist() == [["C + (A - C + m*l^2)*sin(polar.angle)^2", "0"], ["0", "A + m*l^2"]]
    assert str(eq.f[1]) == "(azimuth.angle'^2*(A - C + m*l^2)*cos(polar.angle) - m*g*l)*sin(polar.angle)"


def test_a_governor():
    """Two balls of inertia A, A, C at a distance r + l cos phi; the balls' weights pull the arms down."""
    eq = example("governor.toml").symbolic(coordinates="joint")
    assert str(eq.M[1, 1]) == "3"
    assert str(eq.M[2, 2]) == "0.333341666667*arm + ball"
    assert "left hinge.angle" in str(eq.M[0, 0])
    assert len(str(eq.M[0, 0])) < 260


def test_a_slider_crank_has_no_root_of_a_square():
    f = str(example("slider_crank.toml").symbolic(coordinates="joint").f[2])
    assert "sqrt" not in f
    assert "abs(crank + rod + D.displacement - 6/5)" in f


CASES = [
    ("slider_crank.toml", "joint"),
    ("andrews.toml", "joint"),
    ("bricard.toml", "absolute"),
    ("heavy_top.toml", "auto"),
]


@pytest.fixture(scope="module", params=CASES, ids=lambda c: f"{c[0]}-{c[1]}")
def equations(request):
    name, coordinates = request.param
    return example(name).symbolic(coordinates=coordinates)


def values(document, at):
    """Every expression of the document, abbreviations put in, at values of the symbols."""
    known = dict(at)
    defined = [
        f for s in document.sections if s.name in ("kinematics", "abbreviations") for b in s.blocks for f in b.formulas
    ]
    while defined:
        ready = [f for f in defined if all(x.data.name in known or not x.moving for x in symbols_of([f.right]))]
        assert ready, "abbreviations that stand for one another"
        for f in ready:
            known[f.left.text] = evaluate([f.right], known)[0]
        defined = [f for f in defined if f not in ready]
    return known


def test_the_document_tells_what_the_engine_computes_with(equations):
    """Mass matrix, constraints, Jacobian, forces and every row of M vdot = f + G^T lam, abbreviations put in."""
    eq, document = equations, equations.document
    rng = np.random.default_rng(3)
    at = {x.data.name: rng.uniform(-1.0, 1.0) for x in eq.named.values() if x.moving}
    for q in (q for q in eq.q.rows if q.endswith(".e0")):
        names = [q[:-1] + str(k) for k in range(4)]
        norm = np.linalg.norm([at[n] for n in names])
        at |= {n: at[n] / norm for n in names}
    known = values(document, at)
    raw = {k: v for k, v in at.items()}
    for section in document.sections:
        for block in section.blocks:
            if isinstance(block, Matrix):
                letter = block.left.text
                made = np.array(evaluate(block.entries.ravel().tolist(), known), float).reshape(block.entries.shape)
                np.testing.assert_allclose(made, getattr(eq, letter).at(raw), rtol=1e-10, atol=1e-10)
            elif isinstance(block, Formulas) and section.name == "constraints":
                for f in block.formulas:
                    letter, k = re.fullmatch(r"(\w+)\[(\d+)\]", f.left.text).groups()
                    exact = getattr(eq, letter).at(raw)[int(k) - 1]
                    assert evaluate([f.right], known)[0] == pytest.approx(exact, rel=1e-10, abs=1e-10)
    total = np.zeros(len(eq.v))
    for block in next(s for s in document.sections if s.name == "forces").blocks:
        for f in getattr(block, "formulas", ()):
            total[int(re.match(r"f\[(\d+)\]", f.left.text)[1]) - 1] += evaluate([f.right], known)[0]
    np.testing.assert_allclose(total, eq.f.at(raw), rtol=1e-10, atol=1e-9)
    rows = [f for s in document.sections if s.name == "motion" for b in s.blocks for f in getattr(b, "formulas", ())]
    residual = eq.residual.at(raw)
    for f in rows:
        left = sum(c * x for c, x in f.before)
        right = f.right + sum(c * x for c, x in f.after)
        found = evaluate([eq.graph.node(left) - right], known)[0]
        assert np.min(np.abs(residual - found)) <= 1e-9 * (1.0 + np.max(np.abs(residual)))


def test_the_page_is_well_formed_and_asks_for_nothing(equations, tmp_path):
    equations.to_html(tmp_path / "equations.html")
    text = (tmp_path / "equations.html").read_text(encoding="utf-8")
    assert not re.findall(r"https?://|src=|@import|url\(", text)
    for math in re.findall(r"<math.*?</math>", text, re.S):
        ET.fromstring(math)
        assert "\\" not in math and "\x1f" not in math
    assert text.count("<section") == text.count("</section>") >= 6
    assert "NaN" not in text and "nan" not in re.sub(r"<style>.*?</style>", "", text, flags=re.S)


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_the_latex_file_compiles(equations, tmp_path):
    equations.to_latex(tmp_path / "equations.tex")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "equations.tex"]
    made = subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=120, check=False)
    assert made.returncode == 0, made.stdout.decode("latin-1")[-1500:]
    assert (tmp_path / "equations.pdf").stat().st_size > 20_000


def test_odd_names_compile(tmp_path):
    """Names may hold whatever LaTeX takes for something else."""
    m = fb.Mechanism("50 % of #1 & more_~^\\ ü", planar=True, parameters={"a_b": 1.0})
    m.add(fb.Body("a & b_1", mass="a_b", inertia=1.0), fb.Revolute("50 %#", "ground", "a & b_1", at=(0, 1)))
    eq = m.symbolic()
    eq.to_latex(tmp_path / "equations.tex")
    eq.to_html(tmp_path / "equations.html")
    for math in re.findall(r"<math.*?</math>", (tmp_path / "equations.html").read_text(encoding="utf-8"), re.S):
        ET.fromstring(math)
    if shutil.which("pdflatex"):
        command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "equations.tex"]
        made = subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=120, check=False)
        assert made.returncode == 0, made.stdout.decode("latin-1")[-1500:]


def test_text_and_notebook():
    eq = cart().symbolic(coordinates="joint")
    told = str(eq)
    assert "(M + m)*rail.displacement'' + m*l*pivot.angle''*cos(pivot.angle)\n" in told or (
        "(M + m)*rail.displacement'' + m*l*pivot.angle''*cos(pivot.angle) = m*l*pivot.angle'^2*sin(pivot.angle)" in told
    )
    assert max(map(len, told.splitlines())) <= 110
    assert "<iframe" in eq._repr_html_()
    assert eq.M._repr_latex_().startswith("$")
    assert "\\dot{\\varphi}_{\\text{pivot}}^{2}" in eq.f[0].latex()
    assert isinstance(eq.M.simplified().nodes[0, 0], Node)


def test_the_page_of_the_documentation_runs(capsys):
    text = (Path(__file__).parents[2] / "docs" / "equations.md").read_text(encoding="utf-8")
    exec(re.search(r"```python\n(.*?)```", text, re.S)[1], {})
    told = re.search(r"```text\n(.*?)```", text, re.S)[1]
    assert re.sub(" +", " ", told) in re.sub(" +", " ", capsys.readouterr().out)


def test_a_body_on_a_ball_joint_has_a_constant_mass_matrix():
    """Products of rotations that are the identity are seen to be: polynomials of the eighth degree in Euler parameters."""
    m = fb.Mechanism("ball joint", gravity=(0, 0, 0), parameters={"I": 0.1, "m": 2.0, "l": 0.5})
    m.add(fb.Body("bob", mass="m", inertia=("I", "I", "I"), position=(0, 0, "-l")))
    m.add(fb.Spherical("O", "ground", "bob", at=(0, 0, 0)))
    eq = m.symbolic(coordinates="joint")
    assert eq.M.texts() == [["I + m*l^2", "0", "0"], ["0", "I + m*l^2", "0"], ["0", "0", "I"]]
    assert eq.f.texts() == ["m*l^2*O.w_y*O.w_z", "-m*l^2*O.w_x*O.w_z", "0"]
    assert [eq.symbol(name).data.unit for name in ("O.w_x", "O.w_x'")] == ["rad/s", "rad/s^2"]


def test_matrices_stand_in_brackets_and_have_a_head():
    made = example("slider_crank.toml").symbolic(coordinates="absolute").html()
    body = made[made.index('id="mass"') :]
    body = body[: body.index("</section>")]
    assert body.count('class="bracket opens"') == body.count('class="bracket closes"') == body.count("<tr>") - 1 > 0
    assert "<th></th>" not in body  # tables with empty heads have none


def chain(links):
    m = fb.Mechanism("chain", planar=True, gravity=(0, -9.81))
    for k in range(links):
        m.add(fb.Body(f"b{k}", mass=1, inertia=0.1, position=(0, -k - 0.5)))
        m.add(fb.Revolute(f"j{k}", f"b{k - 1}" if k else "ground", f"b{k}", at=(0, -k)))
    return m.symbolic(coordinates="joint")


def test_what_is_too_large_to_be_read_says_so(tmp_path):
    assert "Equations of motion" in str(chain(3)) or "equations of motion" in str(chain(3)).lower()
    told = str(chain(12))
    assert len(told) < 5000 and "too large for the screen" in told and "eq.export" in told
    with pytest.raises(ModelError, match="'chain' are too large for a page"):
        chain(40).to_html(tmp_path / "chain.html")
