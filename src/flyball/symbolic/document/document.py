"""Document of a mechanism's equations, simplified, with symbols for kinematic quantities and common subexpressions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ...expression_graph.evaluation import nodes_in_order
from ...expression_graph.graph import MULTIPLY, NUMBER, SYMBOL, Node, Symbol
from ...expression_graph.printers.formula_layout import latex_symbol
from ...expression_graph.simplification.common_subexpressions import Definitions, extract_common_subexpressions
from ...expression_graph.simplification.reading_cost import symbol_count
from ...expression_graph.simplification.simplify import simplified
from ..named_equations import quaternions
from . import contents
from .parts import Document, Formula, Formulas, Section, Tex

if TYPE_CHECKING:
    from ..equations import Equations


FEW_OPERATIONS = 2500  # up to so many operations everything is written out first
BRIEF_COUNT = 4.0  # parts with fewer symbols get no name
READABLE_COUNT = 900.0  # the written-out form is kept up to so many symbols in all equations


Candidate = tuple[Any, Symbol]


def name_parts(nodes: Sequence[Any], candidates: Sequence[Candidate]) -> tuple[list[Any], Definitions, list[Candidate]]:
    """Expressions with symbols for meaningful parts; also their definitions and the candidates used.

    If a part is a number times something, other multiples of it use its symbol, too.
    """
    wanted: dict[int, tuple[float, Candidate]] = {}
    for x, symbol in candidates:
        if isinstance(x, Node) and x.op not in (NUMBER, SYMBOL):
            scaled = x.op == MULTIPLY and x.args[0].op == NUMBER
            inner = x.args[1] if scaled else x
            if inner.op != SYMBOL and inner.index not in wanted:
                wanted[inner.index] = (x.args[0].value if scaled else 1.0, (x, symbol))
    made: dict[int, Node] = {}
    definitions: Definitions = []
    found: list[Candidate] = []
    for x in nodes_in_order(nodes):
        args = tuple(made.get(a.index, a) for a in x.args)
        new = made[x.index] = x if args == x.args else x.graph.rebuilt(x, args)
        if x.index in wanted:
            c, candidate = wanted[x.index]
            name = x.graph.symbol(candidate[1], None if x.moving else c * x.value)
            definitions.append((name, c * new))
            found.append(candidate)
            made[x.index] = name / c
    return [made.get(x.index, x) if isinstance(x, Node) else x for x in nodes], definitions, found


def simplify_with_names(
    nodes: Sequence[Any], units: Sequence[Sequence[Node]], candidates: Sequence[Candidate]
) -> tuple[list[Any], Definitions]:
    """Simplify expressions with or without names for parts, whichever is shorter."""
    found: list[Any] | None = None
    if len(nodes_in_order(nodes)) <= FEW_OPERATIONS or not candidates:
        found = simplified(nodes, units=units)
        if not candidates or symbol_count(found) <= READABLE_COUNT:
            return found, []
    left = list(candidates)
    while True:
        rest, meant, of = name_parts(nodes, left)
        defined = simplified([y for _, y in meant], units=units)
        brief = {x.index for (x, _), y in zip(of, defined, strict=True) if symbol_count([y]) < BRIEF_COUNT}
        if not brief:
            break
        left = [c for c in left if not (isinstance(c[0], Node) and c[0].index in brief)]
    other = simplified(rest, units=units)
    if found is not None and len(nodes_in_order(found)) < len(nodes_in_order([*other, *defined])):
        return found, []
    return other, [(x, y) for (x, _), y in zip(meant, defined, strict=True)]


LONG_EXPRESSION = 400.0  # parts with more symbols are summed once more
KINEMATIC_PARTS = (  # entries of a body record: field, letter, name
    ("rotation", "R", "R"),
    ("position", "p", "p"),
    ("angular_velocity", r"\omega", "omega"),
    ("velocity", "v", "v"),
    ("bias_angular_acceleration", r"\alpha", "alpha"),
    ("bias_acceleration", "a", "a"),
)


def document(eq: Equations) -> Document:
    """Build the document of a mechanism's equations.

    Parameters
    ----------
    eq : Equations

    Returns
    -------
    Document
    """
    sections = [
        contents.mechanism_tables(eq),
        contents.coordinates(eq),
        *contents.constraints(eq),
        contents.mass_matrix(eq),
        acting := contents.forces(eq),
        contents.equations_of_motion(eq, acting),
        *contents.controllers(eq),
        contents.energies(eq),
    ]
    made = Document(eq.model.name, size_description(eq), sections)
    found, meant = simplify_with_names(made.expressions(), quaternions(eq.named_equations), candidate_symbols(eq))
    made.put(found)
    as_sums(made, quaternions(eq.named_equations))
    without_zeros(made)
    count = len(made.expressions())
    found, letters = extract_common_subexpressions([*made.expressions(), *(y for _, y in meant)])
    made.put(found[:count])
    meant = [(x, y) for (x, _), y in zip(meant, found[count:], strict=True)]
    later = []
    if meant:
        later.append(Section("kinematics", "Kinematics of the bodies", kinematic_formulas(meant)))
    if letters:
        later.append(Section("abbreviations", "Abbreviations", [Formulas("", definition_formulas(letters))]))
    at = next(k for k, s in enumerate(sections) if s.name == "coordinates") + 1
    sections[at:at] = later
    used = [x for x in nodes_in_order([*made.expressions(), *added_symbols(sections)]) if x.op == SYMBOL]
    sections.insert(1, contents.symbols(used))
    return made


def as_sums(made: Document, units: list[list[Node]]) -> None:
    """Write right-hand sides as sums of others, where that is shorter: each by itself has cancelled more."""
    blocks = [b for s in made.sections for b in s.blocks if isinstance(b, Formulas)]
    sums = [
        f for b in blocks for f in b.formulas if f.parts and symbol_count([p.right for p in f.parts]) <= LONG_EXPRESSION
    ]
    others = simplified([sum((p.right for p in f.parts), 0.0) for f in sums], units=units)
    for f, other in zip(sums, others, strict=True):
        f.right = other if symbol_count([other]) < symbol_count([f.right]) else f.right


def without_zeros(made: Document) -> None:
    """Remove products and forces that turned out to be zero."""
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


def added_symbols(sections: list[Section]) -> list[Node]:
    """Symbols that occur outside of expressions."""
    formulas = [f for s in sections for b in s.blocks if isinstance(b, Formulas) for f in b.formulas]
    return [x for f in formulas for _, x in (*f.before, *f.after)]


def size_description(eq: Equations) -> str:
    """Text with the sizes of the equations."""
    count = {"coordinate": len(eq.q), "velocity": len(eq.v), "constraint": len(eq.lam)}
    many = {"velocity": "velocities"}
    return ", ".join(f"{n} {k if n == 1 else many.get(k, k + 's')}" for k, n in count.items())


def candidate_symbols(eq: Equations) -> list[tuple[Any, Symbol]]:
    """Kinematic quantities of the bodies, which get names where they are long."""
    x = eq.named_equations
    if x.values.structure.model.planar:
        return []
    out: list[tuple[Any, Symbol]] = []
    for name, b in x.values.structure.place.items():
        if b < 0:
            continue
        for field, letter, plain in KINEMATIC_PARTS:
            numbers = x.cleaned(getattr(x.traced.work.bodies, field)[b])
            for k, number in enumerate(numbers):
                index = f"{k // 3 + 1}{k % 3 + 1}" if field == "rotation" else str(k + 1)
                circle = r",\circ" if plain in ("alpha", "a") else ""
                latex = rf"{letter}_{{{index}{circle}}}^{{\text{{{name}}}}}"
                out.append((number, Symbol(f"{name}.{plain}_{index}", "shared", latex, "", name)))
    return out


def definition_formulas(definitions: Definitions) -> list[Formula]:
    """Definitions of symbols, as formulas."""
    return [Formula(Tex(latex_symbol(x.data), x.data.name), y) for x, y in definitions]


def kinematic_formulas(meant: Definitions) -> list[Any]:
    """Positions, rotations, velocities by body."""
    by: dict[str, Definitions] = {}
    for x, y in meant:
        by.setdefault(x.data.element, []).append((x, y))
    return [Formulas(name, definition_formulas(rows)) for name, rows in by.items()]
