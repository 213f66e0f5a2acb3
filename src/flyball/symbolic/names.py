"""What the symbols of a mechanism are called: ``"hinge.angle"``, ``"crank.x'"``, ``"ball.w_x"``, ``"A.lam_nx"``.

Positions have the names of coordinates. A rate has a prime behind it, an acceleration two. A body that is free in
space has the Euler parameters ``e0`` to ``e3`` (scalar first) and the angular velocity ``w_x``, ``w_y``, ``w_z`` along
its own axes, a spherical joint those of what turns in it. Where a body's centre of mass is not its reference point,
its coordinates are ``com_x``, ``com_y``, ``com_z``, since ``x`` is the reference point's.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from ..graph.node import Symbol
from ..model.body import Driver
from ..model.element import Element
from ..model.joint import Joint
from ..tables.names import velocity_names
from ..tables.specs import Structure
from ..tables.system import FREE, SPHERICAL
from ..tables.values import Values

LETTERS = {"displacement": "s", "angle": r"\varphi", "angle_1": r"\varphi_1", "angle_2": r"\varphi_2"}
RATE, SECOND = "'", "''"


class Called(NamedTuple):
    """Symbols of a mechanism, in the order of the engine's arrays."""

    q: list[Symbol]
    v: list[Symbol]
    vdot: list[Symbol]
    z: list[Symbol]
    lam: list[Symbol]  # of the rows, then efforts of drivers that prescribe a coordinate
    loads: list[Symbol]


def called(x: Values) -> Called:
    """Symbols of a mechanism in some coordinates."""
    s = x.structure
    v = [_velocity(x, name.name, name.unit) for name in velocity_names(s)]
    q = _coordinates(s, v)
    rates = [_rate(p) if p.kind == "coordinate" else p for p in v]
    seconds = [_second(p) if p.kind == "coordinate" else _rate(p, "acceleration") for p in v]
    states = [_state(name) for name in s.states]
    loads = [Symbol(f"{e.name}.load", "load", rf"P_{{{text(e.name)}}}", "N", e.name) for e in s.loads]
    return Called(q, rates, seconds, states, _multipliers(s), loads)


def _velocity(x: Values, name: str, unit: str) -> Symbol:
    """The coordinate that a velocity is the rate of; an angular velocity is its own."""
    owner, _, what = name.rpartition(".")
    kind, _, axis = what.rpartition(" ")
    index = text(owner)
    if kind == "turn":
        return Symbol(f"{owner}.w_{axis}", "velocity", rf"\omega_{{{axis},{index}}}", "rad/s", owner)
    letter = LETTERS.get(what, what if what in "xyz" else rf"\mathrm{{{what}}}")
    if what in "xyz" and _beside(x, owner):
        what, index = f"com_{what}", f"S,{index}"
    return Symbol(f"{owner}.{what}", "coordinate", _indexed(letter, index), unit, owner)


def _beside(x: Values, owner: str) -> bool:
    """Whether that is a body whose centre of mass is not its reference point."""
    return owner in x.bodies and any(c.real != 0.0 for c in x.bodies[owner].com)


def _indexed(letter: str, index: str) -> str:
    base, _, own = letter.partition("_")
    return f"{base}_{{{own + ',' if own else ''}{index}}}"


def _coordinates(s: Structure, v: list[Symbol]) -> list[Symbol]:
    """Those of every row of the body table."""
    out: list[Symbol] = []
    tree = s.tables["tree"]
    for b, (first, kind) in enumerate(zip(tree.v.tolist(), tree.joint.tolist(), strict=True)):
        if kind in (FREE, SPHERICAL):
            owner = v[first + (3 if kind == FREE else 0)].element
            out += v[first : first + 3] if kind == FREE else []
            out += [Symbol(f"{owner}.e{k}", "coordinate", rf"e_{{{k},{text(owner)}}}", "1", owner) for k in range(4)]
        else:
            out += v[first : first + int(tree.nv[b])]
        assert len(out) == int(tree.q[b] + tree.nq[b])
    return out


def _rate(p: Symbol, kind: str = "velocity") -> Symbol:
    return Symbol(p.name + RATE, kind, _dotted(r"\dot", p.latex), f"{p.unit}/s", p.element)


def _second(p: Symbol) -> Symbol:
    return Symbol(p.name + SECOND, "acceleration", _dotted(r"\ddot", p.latex), f"{p.unit}/s^2", p.element)


def _dotted(dot: str, latex: str) -> str:
    """A dot over the letter, not over its indices."""
    letter, _, rest = latex.partition("_")
    return f"{dot}{{{letter}}}" + (f"_{rest}" if rest else "")


def _state(name: str) -> Symbol:
    owner, _, what = name.rpartition(".")
    latex = {"place": "s", "work": "W"}.get(what, rf"\mathrm{{{what}}}")
    unit = {"place": "m", "work": "J"}.get(what, "rad")
    return Symbol(
        name if what in ("place", "work") else f"{name} (turns)", "state", f"{latex}_{{{text(owner)}}}", unit, owner
    )


def _multipliers(s: Structure) -> list[Symbol]:
    """One for each row; what a driver or a coupling gives is its effort."""
    names = [_row_name(row.element, row.label) for row in s.rows]
    names = list(numbered(names))
    out = [_multiplier(s, name, row.element) for name, row in zip(names, s.rows, strict=True)]
    later = sorted(s.prescribed, key=lambda k: s.slices[k].start)
    return out + [_multiplier(s, f"{name}.effort", s.model[name]) for name in later]


def _row_name(e: Element, label: str) -> str:
    if isinstance(e, Driver):
        return f"{e.name}.effort"
    return f"{e.name}.lam_{label}" if label and isinstance(e, Joint) else f"{e.name}.lam"


def _multiplier(s: Structure, name: str, e: Element) -> Symbol:
    what = name.removeprefix(f"{e.name}.")
    letter, index = (
        (r"\tau", "")
        if what == "effort"
        else (r"\lambda", what.removeprefix("lam").removeprefix("_").removeprefix("n"))
    )
    unit = ("N*m" if s.model.unit(e.coordinate, e) == "rad" else "N") if isinstance(e, Driver) else ""
    return Symbol(name, "multiplier", _indexed(letter, (index + "," if index else "") + text(e.name)), unit, e.name)


def numbered(names: Iterable[str]) -> Iterable[str]:
    """The names; from the second of equal ones on with a number behind."""
    seen: dict[str, int] = {}
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        yield name if seen[name] == 1 else f"{name}_{seen[name]}"


def text(name: str) -> str:
    """A name of the mechanism's in LaTeX."""
    for c in "\\{}$&#^_%~":
        name = name.replace(c, rf"\{c}" if c in "{}$&#_%" else "-")
    return rf"\text{{{name}}}"
