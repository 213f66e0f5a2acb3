"""Every result has a text, plain data, and a picture or a page, as the README says."""

from __future__ import annotations

import inspect
import json
import re
from pathlib import Path

import matplotlib.figure
import numpy as np
import pytest

import flyball as fb
from flyball.results.wording import number_text, range_text, tuple_text, without_rounding

EXAMPLES = Path(__file__).parents[2] / "examples"
OWED = {
    "Assembly",
    "Code",
    "MassReport",
    "Mobility",
    "Prepared",
    "Report",
}  # tables of names and numbers: have no picture


def crank() -> fb.Mechanism:
    return fb.load(EXAMPLES / "slider_crank.toml")


def rig(g: float = 9.81) -> fb.Mechanism:
    m = fb.Mechanism("rig", planar=True, gravity=(0, -g), parameters={"length": 1.0})
    m.add(fb.Body("bob", mass=1, inertia=0, position=("length", 0)), fb.Revolute("A", "ground", "bob", at=(0, 0)))
    m.add(fb.TorsionalSpringDamper("spring", "A", stiffness=30, damping=0.1))
    return m


MADE = {
    "Result": lambda: crank().simulate(0.02, outputs=3),
    "InverseDynamics": lambda: crank().inverse_dynamics(3, t_end=0.02),
    "Singularities": lambda: crank().singularities("motor", (0, 3)),
    "Comparison": lambda: rig().compare(0.02, formulations=["projection", "baumgarte"]),
    "Sensitivity": lambda: rig().sensitivity(["bob.x"], ["length"], t=0),
    "Study": lambda: rig().study({"length": [1.0, 1.1]}, ["end(bob.x)", "bob.y"], t_end=0.01, outputs=3),
    "Fit": lambda: rig().fit({"t": [0.01, 0.02, 0.03], "bob.x": [1.1, 1.1, 1.09]}, ["length"]),
    "Optimum": lambda: rig().optimize(["bob.x"], ["length"], target=[2.0]),
    "Equilibrium": lambda: rig().equilibrium(),
    "EquilibriumSeries": lambda: rig().equilibria("length", [1, 1.1]),
    "LinearModel": lambda: rig().linearize(["spring"], ["A.angle"], about=rig().equilibrium()),
    "Modes": lambda: rig().modes(about=rig().equilibrium()),
    "RootLocus": lambda: rig(g=0.0).root_locus("length", [1, 1.1]),
    "Mobility": lambda: crank().mobility(),
    "MassReport": lambda: crank().mass_properties(),
    "Report": lambda: crank().check(),
    "Assembly": lambda: crank().assemble(),
    "Equations": lambda: crank().symbolic(),
    "Prepared": lambda: crank().prepare(),
    "Code": lambda: rig().export(),
    "Differences": lambda: crank().simulate(0.02, outputs=3).differences(crank().simulate(0.02, outputs=4)),
    "MeasurementComparison": lambda: (
        crank().simulate(0.02, outputs=3).compare({"t": [0.0, 0.01], "slider.x": [0.7, 0.69]})
    ),
    "Momentum": lambda: crank().simulate(0.02, outputs=3).momentum(),
    "Spectrum": lambda: crank().simulate(0.2, outputs=101).spectrum("A.angle_rate", "slider.x"),
}


def returned() -> set[str]:
    """Names of the classes that methods of a mechanism return, and public ones that those of a motion return."""
    out = {str(f.__annotations__.get("return", "")) for _, f in inspect.getmembers(fb.Result, inspect.isfunction)}
    out &= set(dir(fb))
    for name, f in inspect.getmembers(fb.Mechanism, inspect.isfunction):
        if f.__module__.startswith("flyball.mechanism_methods") and not name.startswith("_"):
            out |= set(re.findall(r"\w+", str(f.__annotations__.get("return", "")))) - {
                "None",
                "str",
                "Any",
                "Stepper",
            }  # which is no result
    return out


def test_every_class_of_results_is_tried():
    assert returned() == set(MADE)


@pytest.mark.parametrize("name", MADE)
def test_a_result_has_a_text_plain_data_and_a_picture(name, tmp_path):
    r = MADE[name]()
    assert type(r).__name__ == name
    lines = list(r.lines())
    assert lines
    told = MEASURES | ({"reference", *r.names} if name == "Comparison" else set())
    assert all(isinstance(x, str) for line in lines for x in line)
    assert all(len(line) == 2 for line in lines)
    assert not any(re.search(r"\d[.\d]*e-(1[2-9]|[2-9]\d)\b", text) for label, text in lines if label not in told), (
        lines
    )
    assert json.loads(json.dumps(r.as_dict(), default=float))
    if name in OWED:
        assert len(repr(r)) < 4000
        return
    if hasattr(r, "plot"):
        assert isinstance(r.plot(), matplotlib.figure.Figure)
        assert r.plot(path=tmp_path / "picture.svg") is None
        assert (tmp_path / "picture.svg").stat().st_size > 1000
    else:
        r.to_html(tmp_path / "page.html")
        assert (tmp_path / "page.html").stat().st_size > 10_000
    assert "object at 0x" not in repr(r)
    assert len(repr(r)) < 4000


MEASURES = {
    "violation",
    "energy balance",
    "unbalanced",
    "residual",
    "acceleration violation",
    "projection",
    "baumgarte",
}
"""Lines that say how small something is."""


def test_rounding_is_not_shown_as_a_number():
    assert tuple_text([-2.639e-13, 0.0, 6.28318]) == "(0, 0, 6.283)"
    assert tuple_text([-2.6e-13, 0.0, 1e-13]) == "(-2.6e-13, 0, 1e-13)"  # small, but nothing is larger
    assert number_text(-1e-17, 0.3) == "0"
    assert number_text(-0.0) == "0"
    assert range_text(np.array([1e-14, 2.0, np.nan])) == "0 to 2"
    assert range_text(np.array([3.0, 3.0 + 1e-15])) == "3"
    np.testing.assert_array_equal(without_rounding([np.nan, 1.0, -1e-11]), [np.nan, 0.0 + 1.0, 0.0])


def test_a_result_says_between_which_values_it_stayed():
    r = MADE["Result"]()
    told = dict(r.lines())
    assert told["motion"] == "slider crank, 0 to 0.02 s, 3 times"
    low, high = (f(r["A.angle"]) for f in (np.min, np.max))
    assert told["A.angle"] == f"{low:.4g} to {high:.4g} rad"
    plain = r.as_dict()
    assert plain["curves"]["slider.x"] == {"unit": "m", "values": r["slider.x"].tolist()}
    assert plain["health"]["success"]
