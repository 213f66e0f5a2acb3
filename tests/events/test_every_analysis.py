"""Every analysis is asked of every part that holds at times: it answers for what holds there, or refuses it by name.

A new part, or a new method of `Mechanism`, fails here by its name until its cells are told.
"""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import numpy as np
import pytest

import flyball as fb
from flyball.model.element import Element

DOCS = Path(__file__).parents[2] / "docs" / "events.md"

PARTS = {
    "JointFriction": lambda: [fb.JointFriction("part", "A", static=0.5, radius=10.0)],
    "Brake": lambda: [fb.Brake("part", "A.angle", capacity=100)],
    "Clutch": lambda: [fb.Clutch("part", "A.angle", "B.angle", capacity=100)],
    "Limit": lambda: [fb.Limit("part", "A.angle", lower=0.0)],
    "Backlash": lambda: [fb.Backlash("part", ("A.angle",), gap=0.2, middle=0.1)],
    "OneWay": lambda: [fb.OneWay("part", "A.angle")],
    "Ratchet": lambda: [fb.Ratchet("part", "A.angle", teeth=12)],
    "ShearPin": lambda: [fb.ShearPin("part", "A.angle", strength=100)],
    "Rope": lambda: [fb.Rope("part", bodies=("ground", "a"), at=((1, 1), (1, 0)))],
    "Event": lambda: [fb.Event("part", "A.angle > 0.05", do=[fb.Lock("B")])],
    "Contact": lambda: [fb.Ground("floor", shape=fb.Plane(normal=(0, 1), position=(0, -9))), fb.Contact(name="part")],
    "Bodies": lambda: [fb.Bodies("part", shape=fb.Sphere(radius=0.1), density=1.0, position=[(9, 9)])],
}
"""A sample of every part that holds at times; it holds the upper link, or may, where the links are drawn."""
INNER = {"Held", "Touch"}  # made by analyses, not described

ASKED = {
    "assemble": lambda m: m.assemble(),
    "check": lambda m: m.check(),
    "mobility": lambda m: m.mobility(),
    "mass_properties": lambda m: m.mass_properties(),
    "kinematics": lambda m: driven(m).kinematics(3, t_end=0.2),
    "inverse_dynamics": lambda m: driven(m).inverse_dynamics(3, t_end=0.2),
    "singularities": lambda m: driven(m).singularities("drive A", (0.0, 0.2)),
    "equilibrium": lambda m: m.equilibrium(),
    "equilibria": lambda m: m.equilibria("k", (1.0, 2.0)),
    "linearize": lambda m: m.linearize(),
    "modes": lambda m: m.modes(),
    "root_locus": lambda m: m.root_locus("k", (1.0, 2.0)),
    "sensitivity": lambda m: m.sensitivity(("B.angle",), ("k",)),
    "optimize": lambda m: m.optimize(("B.angle",), ("k",), target=0.0),
    "fit": lambda m: m.fit({"t": (0.01, 0.02, 0.03), "B.angle": (0.0, 0.01, 0.03)}, ("k",)),
    "stepper": lambda m: m.stepper(0.01).step,
    "prepare": lambda m: m.prepare(),
    "compare": lambda m: m.compare(0.01, repeats=0),
    "symbolic": lambda m: m.symbolic(),
    "export": lambda m: m.export(),
}
ELSEWHERE = {"simulate", "study", "live"}  # know them all: the other files of this folder, and many of such runs
POSITIONS = {"assemble", "check", "mobility", "mass_properties"}
HOLDS = {"equilibrium", "linearize", "modes"}
DRIVEN = {"kinematics", "inverse_dynamics"}
SLIDES = {"prepare", "symbolic", "export"}
STEPS = {"stepper"}
KNOWN = {
    **dict.fromkeys(("JointFriction", "Brake", "Clutch"), POSITIONS | HOLDS | DRIVEN | SLIDES | STEPS),
    "Limit": POSITIONS | HOLDS | DRIVEN | STEPS | {"prepare"},
    **dict.fromkeys(("Backlash", "OneWay", "Rope"), POSITIONS | HOLDS | DRIVEN),
    "Ratchet": POSITIONS | HOLDS,
    "ShearPin": POSITIONS | HOLDS,
    "Contact": POSITIONS | HOLDS | STEPS,
    "Bodies": POSITIONS | STEPS,
    "Event": POSITIONS,
}
"""Which analyses answer; all others refuse."""


def links(*parts):
    """A horizontal link on ground that carries a hanging one; both ways they may turn."""
    m = fb.Mechanism("links", planar=True, gravity=(0, -9.81), parameters={"k": 5.0})
    m.add(fb.Body("a", mass=1, inertia=0.1, position=(0.5, 0)), fb.Body("b", mass=1, inertia=0.1, position=(1.0, -0.5)))
    m.add(fb.Revolute("A", "ground", "a", at=(0, 0)), fb.Revolute("B", "a", "b", at=(1, 0)))
    m.add(fb.CoordinateSpring("spring", "B.angle", stiffness="k"))
    m.add(fb.CoordinateSpring("prop", "A.angle", stiffness=1000, rest=9.81 * 1.5 / 1000))
    m.add(*parts)
    return m


def driven(m):
    """Both angles prescribed: the upper link rises a little."""
    m.add(fb.Driver("drive A", "A.angle", "0.1*t**2"), fb.Driver("drive B", "B.angle", "0.1*t"))
    return m


def test_every_part_that_holds_at_times_is_asked_about():
    found = {
        name for name, cls in Element.registry.items()
        if (cls.switches is not Element.switches or cls.category in ("events", "contacts", "bulk"))
        and cls.__module__.startswith("flyball.")
    }  # fmt: skip
    assert found - INNER == set(PARTS) == set(KNOWN)


def test_every_analysis_is_asked():
    public = {
        n for n, f in inspect.getmembers(fb.Mechanism, inspect.isfunction)
        if not n.startswith("_") and f.__module__.startswith("flyball.mechanism_methods")
    }  # fmt: skip
    assert public == set(ASKED) | ELSEWHERE


@pytest.mark.parametrize("analysis", ASKED)
@pytest.mark.parametrize("part", PARTS)
def test_it_answers_or_refuses_by_name(part, analysis):
    m = links(*PARTS[part]())
    title = f"{part} 'part'"
    if analysis in KNOWN[part]:
        answer = ASKED[analysis](m)
        if analysis in ("check", "mobility"):
            assert title in str(answer) or part == "Bodies"
        return
    with pytest.raises(fb.ModelError) as error:
        ASKED[analysis](m)
    text = str(error.value)
    assert title in text or part == "Bodies", text
    assert "changed({" in text or part == "Bodies", text


def test_the_page_says_the_same():
    """The table of docs/events.md: a line for each part, a column for each group of analyses."""
    lines = [x for x in DOCS.read_text().splitlines() if re.match(r"\| `\w+`", x)]
    rows = {re.match(r"\| `(\w+)`", x)[1]: [c.strip() for c in x.strip("|").split("|")[1:]] for x in lines}
    head = next(x for x in DOCS.read_text().splitlines() if x.startswith("| element |") and "simulate" in x)
    groups = [re.findall(r"`(\w+)`", c) for c in head.strip("|").split("|")[1:]]
    assert {a for g in groups for a in g} == set(ASKED) | ELSEWHERE
    for part, known in KNOWN.items():
        for group, cell in zip(groups, rows[part], strict=True):
            for analysis in set(group) - ELSEWHERE:
                assert (cell == "refused") == (analysis not in known), (part, analysis, cell)


def test_friction_of_a_driven_joint_slides_the_way_it_is_driven():
    """Torque of the drive: 4 kg m^2 at 2 rad/s^2, and the brake's 3 N m against the motion."""
    m = fb.Mechanism("wheel", planar=True)
    m.add(fb.Body("w", mass=1, inertia=4.0), fb.Revolute("A", "ground", "w", at=(0, 0)))
    m.add(fb.Brake("brake", "A.angle", capacity=3.0), fb.Driver("drive", "A.angle", "t**2 - 2*t"))
    r = m.inverse_dynamics(np.linspace(0.0, 2.0, 5))
    assert np.allclose(r.result["drive.effort"], [5.0, 5.0, 8.0, 11.0, 11.0])
    assert any("taken as zero where it does not slide" in x for x in r.result.health.remarks)


def test_drivers_do_not_lead_past_a_stop():
    m = links(fb.Limit("part", "A.angle", lower=-1.0, upper=0.003))
    with pytest.raises(fb.ModelError, match=r"Limit 'part': the drivers take A.angle past it at t = 0.1[5-9]"):
        driven(m).kinematics(3, t_end=0.2)
