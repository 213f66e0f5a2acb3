"""Explicit equations as printed: short lines, the textbook's slider-crank, and formulas that give the numbers."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

import flyball as fb
from flyball.expression_graph.graph import Graph, evaluate, nodes_in_order
from flyball.expression_graph.simplification.simplify import simplified

AT = {"A.angle": 0.3, "A.angle'": 0.7}


def slider_crank() -> fb.Mechanism:
    m = fb.Mechanism("slider-crank", planar=True, gravity=(0, "-g"), parameters={"g": 9.81, "r": 0.2, "l": 0.6})
    x = "sqrt(l**2 - r**2)"
    m.add(fb.Body("crank", mass=1, inertia=0.01, position=(0, "r/2")))
    m.add(fb.Body("rod", mass=2, inertia=0.03, position=(f"{x}/2", "r/2")))
    m.add(fb.Body("piston", mass=3, inertia=0.01, position=(x, 0)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "rod", at=(0, "r")))
    m.add(fb.Revolute("C", "rod", "piston", at=(x, 0)), fb.Prismatic("D", "ground", "piston", at=(0, 0), axis=(1, 0)))
    return m


def four_bar() -> fb.Mechanism:
    lengths = {"g": 9.81, "a": 0.2, "d": 0.6, "m2": 2.0, "J2": 0.02}
    m = fb.Mechanism("four-bar", planar=True, gravity=(0, "-g"), parameters=lengths)
    m.add(fb.Body("crank", mass=1, inertia=0.01, position=("a/2", 0)))
    m.add(fb.Body("coupler", mass="m2", inertia="J2", position=(0.35, 0.2)))
    m.add(fb.Body("rocker", mass=3, inertia=0.05, position=(0.55, 0.2)))
    m.add(fb.Revolute("A", "ground", "crank", at=(0, 0)), fb.Revolute("B", "crank", "coupler", at=("a", 0)))
    m.add(fb.Revolute("C", "coupler", "rocker", at=(0.45, 0.42)), fb.Revolute("D", "ground", "rocker", at=("d", 0)))
    return m


def numbers(told: str, known: dict[str, float]) -> dict[str, float]:
    """What printed formulas give, in whichever order these stand."""
    formulas = dict(re.findall(r"^(\S.*?) = (.*(?:\n    .*)*)", told, re.M))
    names = sorted({*formulas, *known}, key=len, reverse=True)
    code = {}
    for name, x in formulas.items():
        for k, n in enumerate(names):
            x = re.sub(rf"(?<![\w.]){re.escape(n)}(?![\w.'])", f"\x00{k}\x00", x)
        code[name] = re.sub(r"\x00(\d+)\x00", r"V(\1)", x.replace("\n", " ")).replace("^", "**")

    def value(k: int) -> float:
        name = names[k]
        if name not in known:
            scope = {n: getattr(math, n) for n in ("sin", "cos", "sqrt", "atan2")} | {"V": value, "abs": abs}
            known[name] = eval(code[name], scope)
        return known[name]

    return {name: value(names.index(name)) for name in formulas}


@pytest.mark.parametrize("made", [slider_crank, four_bar])
def test_printed(made):
    eq = made().symbolic()
    x = eq.explicit(["A.angle"])
    told = str(x)
    assert len(told) < 5000 and max(map(len, told.split("\n"))) < 160 and "round(" not in told
    found = numbers(told.partition("\n\n")[2], AT | dict(eq.parameters))
    assert found["M[A.angle, A.angle]"] == pytest.approx(float(x.M.at(AT)[0, 0]), rel=1e-11)
    assert found["f[A.angle]"] == pytest.approx(float(x.f.at(AT)[0]), rel=1e-11)
    for d in x.solution.positions:
        for symbol, inlined in zip(d.names, x.solution.inlined(d.symbols), strict=True):
            turns = (found[symbol] - float(evaluate([inlined], AT)[0])) / (2.0 * math.pi)
            assert turns == pytest.approx(round(turns), abs=1e-12)
    for part in (x.M, x.f, x.Z, x.accelerations):
        text = str(part)
        assert max(map(len, text.split("\n"))) < 200 and len(text) < 6100
    assert len(repr(x.solution)) < 100 and len(repr(eq.graph)) < 100


def test_textbook_slider_crank():
    x = slider_crank().symbolic().explicit(["A.angle"])
    assert str(x["D.displacement"]) == "sqrt(l^2 - r^2*cos(A.angle)^2) - sqrt(l^2 - r^2) - r*sin(A.angle)"
    s = slider_crank().symbolic().state_space(["D.displacement"], independent=["A.angle"])
    assert "h[D.displacement] = sqrt(l^2 - r^2*cos(A.angle)^2) - sqrt(l^2 - r^2) - r*sin(A.angle)" in str(s)


def test_squares_of_roots():
    g = Graph()
    x, y = g.symbol("x"), g.symbol("y")
    root = (2.0 - x * x).sqrt()
    for e in (root * root + y, y / root / root, x / (1.0 + x * x / root / root)):
        (made,) = simplified([e])
        assert sum(n.op == "sqrt" for n in nodes_in_order([made])) == 0
        at = {"x": np.float64(0.7), "y": np.float64(-1.3)}
        assert evaluate([made], at)[0] == pytest.approx(evaluate([e], at)[0], rel=1e-14)
