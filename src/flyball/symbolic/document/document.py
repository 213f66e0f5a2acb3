"""The document of a mechanism's equations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...graph.node import Node, Symbol
from ...graph.operations import SYMBOL
from ...graph.printers.spelling import spelt
from ...graph.simplify.cost import length
from ...graph.simplify.shared import Definitions, shared
from ...graph.simplify.simplify import simplified
from ...graph.values import reached
from ..quaternions import quaternions
from . import contents
from .parted import shortened
from .parts import Document, Formula, Formulas, Section, Tex

if TYPE_CHECKING:
    from ..equations import Equations

LONG = 400.0  # symbols in parts that are added up once more
PARTS = (  # of the record of a body: place, letter, name, what
    (3, 9, "R", "R"),
    (0, 3, "p", "p"),
    (12, 3, r"\omega", "omega"),
    (15, 3, "v", "v"),
    (18, 3, r"\alpha", "alpha"),
    (21, 3, "a", "a"),
)


def document(eq: Equations) -> Document:
    """Everything about a mechanism's equations, short and in order.

    Parameters
    ----------
    eq : Equations

    Returns
    -------
    Document
    """
    sections = [
        contents.mechanism(eq),
        contents.coordinates(eq),
        *contents.constraints(eq),
        contents.masses(eq),
        acting := contents.forces(eq),
        contents.motion(eq, acting),
        contents.energies(eq),
    ]
    made = Document(eq.model.name, subtitle(eq), sections)
    found, meant = shortened(made.expressions(), quaternions(eq.formulated), candidates(eq))
    made.put(found)
    summed(made, quaternions(eq.formulated))
    tidied(made)
    count = len(made.expressions())
    found, letters = shared([*made.expressions(), *(y for _, y in meant)])
    made.put(found[:count])
    meant = [(x, y) for (x, _), y in zip(meant, found[count:], strict=True)]
    later = []
    if meant:
        later.append(Section("kinematics", "Kinematics of the bodies", kinematics(meant)))
    if letters:
        later.append(Section("abbreviations", "Abbreviations", [Formulas("", defined(letters))]))
    at = next(k for k, s in enumerate(sections) if s.name == "coordinates") + 1
    sections[at:at] = later
    used = [x for x in reached([*made.expressions(), *added(sections)]) if x.op == SYMBOL]
    sections.insert(1, contents.symbols(used))
    return made


def summed(made: Document, units: list[list[Node]]) -> None:
    """Right sides that are sums of others, by these, where that is shorter: each by itself has cancelled more."""
    blocks = [b for s in made.sections for b in s.blocks if isinstance(b, Formulas)]
    sums = [f for b in blocks for f in b.formulas if f.parts and length([p.right for p in f.parts]) <= LONG]
    others = simplified([sum((p.right for p in f.parts), 0.0) for f in sums], units=units)
    for f, other in zip(sums, others, strict=True):
        f.right = other if length([other]) < length([f.right]) else f.right


def tidied(made: Document) -> None:
    """Without what has turned out to be zero: products, and forces."""
    for section in made.sections:
        for block in section.blocks:
            if isinstance(block, Formulas):
                for f in block.formulas:
                    f.before = [(c, x) for c, x in f.before if c != 0.0]
                    f.after = [(c, x) for c, x in f.after if c != 0.0]
                if section.name == "forces":
                    block.formulas = [f for f in block.formulas if f.right != 0.0]
        if section.name == "forces":
            section.blocks = [b for b in section.blocks if not isinstance(b, Formulas) or b.formulas]


def added(sections: list[Section]) -> list[Node]:
    """Symbols beside expressions."""
    formulas = [f for s in sections for b in s.blocks if isinstance(b, Formulas) for f in b.formulas]
    return [x for f in formulas for _, x in (*f.before, *f.after)]


def subtitle(eq: Equations) -> str:
    """Sizes, in words."""
    count = {"coordinate": len(eq.q), "velocity": len(eq.v), "constraint": len(eq.lam)}
    many = {"velocity": "velocities"}
    return ", ".join(f"{n} {k if n == 1 else many.get(k, k + 's')}" for k, n in count.items())


def candidates(eq: Equations) -> list[tuple[Any, Symbol]]:
    """Kinematics of the bodies, which have names where they are long."""
    x = eq.formulated
    if x.values.structure.model.planar:
        return []
    out: list[tuple[Any, Symbol]] = []
    for name, b in x.values.structure.place.items():
        if b < 0:
            continue
        record = x.cleaned(x.traced.work.BK[b])
        for first, count, letter, plain in PARTS:
            for k in range(count):
                index = f"{k // 3 + 1}{k % 3 + 1}" if count == 9 else str(k + 1)
                circle = r",\circ" if plain in ("alpha", "a") else ""
                latex = rf"{letter}_{{{index}{circle}}}^{{\text{{{name}}}}}"
                out.append((record[first + k], Symbol(f"{name}.{plain}_{index}", "shared", latex, "", name)))
    return out


def defined(definitions: Definitions) -> list[Formula]:
    """Symbols and what they stand for, as formulas."""
    return [Formula(Tex(spelt(x.data), x.data.name), y) for x, y in definitions]


def kinematics(meant: Definitions) -> list[Any]:
    """Positions, rotations, velocities by body."""
    by: dict[str, Definitions] = {}
    for x, y in meant:
        by.setdefault(x.data.element, []).append((x, y))
    return [Formulas(name, defined(rows)) for name, rows in by.items()]
