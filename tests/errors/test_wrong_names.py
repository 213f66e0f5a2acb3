"""Wherever a name is taken, a wrong one is told with what comes near and what there is."""

from __future__ import annotations

import functools
from pathlib import Path

import pytest

import flyball as fb

EXAMPLES = Path(__file__).parents[2] / "examples"


@functools.cache
def crank() -> fb.Mechanism:
    return fb.load(EXAMPLES / "slider_crank.toml")


@functools.cache
def governor() -> fb.Mechanism:
    return fb.load(EXAMPLES / "governor.toml")


@functools.cache
def run() -> fb.Result:
    return crank().simulate(0.02, outputs=3)


ROD = r"no parameter 'rodd' \(did you mean 'rod'\?\); known: speed, crank, rod"
CURVE = r"Body 'slider' has no curve 'xy' \(did you mean '[xy]'\?\); it has x, y, angle"
PART = r"no part named 'slidr' \(did you mean 'slider'\?\); known: crank, rod, slider"
CASES = {
    "part of a model": (lambda: crank()["slidr"], PART),
    "part of a result": (lambda: run()["slidr"], PART),
    "curve": (lambda: run()["slider.xy"], CURVE),
    "plot": (lambda: run().plot("slider.xy"), CURVE),
    "plot of a part": (lambda: run().plot("slidr"), PART),
    "path": (lambda: run().plot_path("slidr"), PART),
    "path on a page": (lambda: run().html(paths=["slidr"]), PART),
    "what is shown": (lambda: run().html(show=["name"]), r"did you mean 'names'"),
    "axes": (
        lambda: run()["A"].reaction(axes="jont"),
        r"'A' has no axes 'jont' \(did you mean 'joint'\?\); known: world",
    ),
    "side": (
        lambda: run()["A"].reaction(on="cran"),
        r"joins 'ground' and 'crank', not 'cran' \(did you mean 'crank'\?\)",
    ),
    "parameter": (lambda: crank().simulate(1, parameters={"rodd": 1}), ROD),
    "of a sensitivity": (lambda: crank().sensitivity(["slider.xy"], ["rod"]), CURVE),
    "a whole part": (
        lambda: crank().sensitivity(["slider"], ["rod"]),
        r"is a whole part .*; name one of slider.x, slider.y",
    ),
    "a vector": (lambda: crank().sensitivity(["slider.position"]), r"has 2 components; name one: slider.x, slider.y"),
    "no text": (lambda: crank().sensitivity([3], ["rod"]), r"of is a list of names, .* not"),
    "to a parameter": (lambda: crank().sensitivity(["slider.x"], ["rodd"]), ROD),
    "about a thing": (
        lambda: crank().sensitivity([], ["rod"], analysis="modes", about=crank()),
        r"about must be 'equilibrium' or nothing, got a Mechanism$",
    ),
    "analysis": (lambda: crank().sensitivity(["slider.x"], analysis="mode"), r"did you mean 'modes'"),
    "of an optimisation": (lambda: crank().optimize(["slider.xy"], ["rod"], target=[1]), CURVE),
    "to an optimisation": (lambda: crank().optimize(["slider.x"], ["rodd"], target=[1]), ROD),
    "input": (lambda: governor().linearize(["left sprin"]), r"no input 'left sprin' \(did you mean 'left spring'\?\)"),
    "output": (lambda: governor().linearize([], ["left.xx"]), r"Body 'left' has no curve 'xx' \(did you mean 'x'\?\)"),
    "output without end": (lambda: governor().linearize([], ["left.position"]), r"name one: left.x, left.y, left.z"),
    "turning": (
        lambda: governor().equilibrium(turning=["bearing.angel"]),
        r"turning='bearing.angel': .* \(did you mean 'bearing.angle'\?\); known: bearing.angle, guide.displacement",
    ),
    "turning of nothing": (
        lambda: governor().equilibrium(turning=["typo"]),
        r"turning='typo': name .*; known: bearing.angle",
    ),
    "preload": (lambda: governor().equilibrium(preload=["left sprin"]), r"did you mean 'left spring'"),
    "driver": (lambda: crank().singularities("motr", (0, 1)), r"no driver 'motr' \(did you mean 'motor'\?\)"),
    "series": (lambda: crank().equilibria("rodd", [1]), r"no parameter 'rodd' \(did you mean 'rod'\?\)"),
    "root locus": (lambda: crank().root_locus("rodd", [1]), r"no parameter 'rodd' \(did you mean 'rod'\?\)"),
    "body": (
        lambda: crank().mass_properties(drawn=True)["slidr"],
        r"no body named 'slidr' \(did you mean 'slider'\?\)",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_it_is_told(case):
    ask, message = CASES[case]
    with pytest.raises(fb.ModelError, match=message):
        ask()


@pytest.mark.parametrize(
    ("name", "here"), [("Spring", "SpringDamper"), ("Hinge", "Revolute"), ("Weld", "Fixed"), ("Belt", "GearPair")]
)
def test_names_of_other_programs_lead_to_those_here(name, here):
    with pytest.raises(AttributeError, match=rf"no attribute '{name}' \(did you mean '{here}'\?\)"):
        getattr(fb, name)


def test_every_name_of_another_program_leads_to_something():
    from flyball.model.messages import NAMES_ELSEWHERE

    assert {x for x in NAMES_ELSEWHERE.values() if not hasattr(fb, x)} == set()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fb.Body("b", m=1), r"unknown field 'm' \(did you mean 'mass'\?\)"),
        (lambda: fb.SpringDamper("s", "a", "b", k=1), r"unknown field 'k' \(did you mean 'stiffness'\?\)"),
        (lambda: fb.Revolute("ground", "rod"), r"'body_j' is missing; the name comes first: \('a name', 'ground', 'rod'"),
        (lambda: crank().simulate(1, outputs=0.01), r"for one every 0.01 s: outputs=np.arange\(0, 1, 0.01\)"),
        (lambda: fb.load("README.md"), r"README.md is no model file, these end in \.toml"),
    ],
)  # fmt: skip
def test_near_misses_get_the_right_word(make, message):
    with pytest.raises(fb.ModelError, match=message):
        make()


@pytest.mark.parametrize("name", ["A.rate", "A.angle_rate"])
def test_an_initial_rate_is_given_with_its_coordinate(name):
    m = fb.Mechanism("pendulum", planar=True)
    m.add(fb.Body("rod", mass=1, inertia=1), fb.Revolute("A", "ground", "rod", at=(0, 0)))
    with pytest.raises(fb.ModelError, match=r"is Initial\('A.angle', rate=...\)"):
        m.add(fb.Initial(name, value=2.0))
