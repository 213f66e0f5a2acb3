"""Document of a mechanism's equations: its sections, simplified, with symbols for kinematic quantities.

The sections are built from traced, unsimplified expressions; common subexpressions get symbols afterwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..constraints import blocks as building
from ..expression_graph.graph import MULTIPLY, NUMBER, SYMBOL, Node, Symbol, nodes_in_order
from ..expression_graph.printers.formula_layout import latex_symbol
from ..expression_graph.printers.latex import latex
from ..expression_graph.printers.text import text
from ..expression_graph.simplification.factors import symbol_count
from ..expression_graph.simplification.simplify import Definitions, extract_common_subexpressions, simplified
from ..model.joint import Joint
from ..model.messages import kind_in_words
from .document_formats import (
    Block,
    Cell,
    DataTable,
    Display,
    Document,
    Formula,
    Formulas,
    Matrix,
    Paragraph,
    Section,
    Tex,
    connected_parts,
    inertia_labels,
    symbol_meaning,
    unit_text,
)
from .named_equations import generalised_forces, quaternions

if TYPE_CHECKING:
    from .equations import Equations


ZERO = Tex("0", "0")
# From so many velocities on, the equations of motion are not written out row by row.
LARGE_MATRIX = 14


def bold(letter: str, plain_text: str = "") -> Tex:
    """Bold letter of a matrix or vector."""
    style = "boldsymbol" if letter.startswith("\\") else "mathbf"
    return Tex(rf"\{style}{{{letter}}}", plain_text or letter.strip("\\"))


def symbol_label(x: Any) -> Tex:
    """A symbol as a label."""
    return Tex(latex_symbol(x.data), x.data.name)


def expression_cell(x: Any) -> Cell:
    """An expression in a cell."""
    return Tex(latex(x), text(x)) if isinstance(x, Node) and not x.known else f"{float(x):.6g}"


def mechanism_section(eq: Equations) -> Section:
    """Tables of bodies with masses, joints with building blocks, forces and drivers."""
    m, s = eq.model, eq.named_equations.values.structure
    S = eq.named_equations.traced.system
    out: list[Block] = [Paragraph(f"{'Planar' if m.planar else 'Spatial'} mechanism. Coordinates: {eq.coordinates}.")]
    names = ("J",) if m.planar else ("J_xx", "J_yy", "J_zz", "J_xy", "J_xz", "J_yz")
    rows = []
    for e in m.bodies:
        b = s.place[e.name]
        weight = [S.bodies.mass[b], *inertia_labels(S.bodies.inertia[b], m.planar)]
        rows.append(
            (
                e.name,
                *map(
                    expression_cell, simplified(weight if e.name not in s.points else weight[:1] + [0.0] * len(names))
                ),
            )
        )
    used = [k for k in range(len(names) + 2) if k < 2 or any(row[k] != "0" for row in rows)]
    head = ("body", "mass [kg]", *(f"{n} [kg m²]" for n in names))
    out.append(DataTable(tuple(head[k] for k in used), tuple(tuple(row[k] for k in used) for row in rows)))
    joints = tuple((e.name, type(e).__name__, connected_parts(e), joint_blocks(e)) for e in (*m.joints, *m.couplings))
    out.append(DataTable(("joint", "kind", "between", "building blocks"), joints))
    acting = tuple((e.name, type(e).__name__, connected_parts(e)) for e in (*m.forces, *m.drivers))
    out.append(DataTable(("force or driver", "kind", "between"), acting))
    return Section("mechanism", "Mechanism", [b for b in out if not isinstance(b, DataTable) or b.rows])


BLOCK_NAMES = {
    "COMMON_POINT": "common point (BB1)",
    "PARALLEL_AXES": "parallel axes (BB2)",
    "STRAIGHT_LINE": "straight line (BB3)",
    "SAME_AXES": "same axes (BB2, BB4)",
    "CROSSED_AXES": "axes at right angles (BB4)",
    "CONSTANT_DISTANCE": "constant distance (BB5)",
}


def joint_blocks(e: Any) -> str:
    """Building blocks of a joint."""
    if not isinstance(e, Joint):
        return "relation of coordinates"
    rows = list(e.blocks)
    found = []
    for name, called in BLOCK_NAMES.items():
        block = list(getattr(building, name))
        at = next((k for k in range(len(rows)) if rows[k : k + len(block)] == block), None)
        if at is not None:
            found.append(called)
            del rows[at : at + len(block)]
    if rows:
        found.append(f"{len(rows)} more row{'s' if len(rows) > 1 else ''}" if found else f"{len(rows)} rows")
    return ", ".join(found)


def symbols_section(used: list[Node]) -> Section:
    """Table of the symbols that occur, with meaning, unit and the parameters' values."""
    rows: dict[bool, list[tuple[Cell, ...]]] = {False: [], True: []}
    for x in used:
        if x.data.kind not in ("shared", "constant"):
            value = () if x.moving else (f"{x.value:.6g}",)
            rows[x.moving].append(
                (symbol_label(x), x.data.name, symbol_meaning(x.data), unit_text(x.data.unit), *value)
            )
    head = ("symbol", "name", "meaning", "unit")
    tables = [DataTable((*head, "value [SI]"), tuple(rows[False])), DataTable(head, tuple(rows[True]))]
    return Section("symbols", "Symbols", [t for t in tables if t.rows])


def coordinates_section(eq: Equations) -> Section:
    """Coordinates q, velocities v and their relation."""
    T = eq.named_equations.traced
    out: list[Block] = []
    if T.q:
        rows = tuple((Tex(str(k + 1), str(k + 1)), symbol_label(x), x.data.name) for k, x in enumerate(T.q))
        out.append(DataTable(("", "coordinate", "name"), rows))
    same = len(T.q) == len(T.v) and all(T.T[i, j] == (1.0 if i == j else 0.0) for i, j in np.ndindex(T.T.shape))
    out.append(
        Display(
            Tex(
                r"\dot{\mathbf{q}} = \mathbf{v}" if same else r"\dot{\mathbf{q}} = \mathbf{T} \mathbf{v}",
                "qdot = v" if same else "qdot = T v",
            )
        )
    )
    if not same:
        out.append(Matrix(bold("T"), T.T.copy(), tuple(map(symbol_label, T.q)), tuple(map(symbol_label, T.v))))
    return Section("coordinates", "Coordinates and velocities", out)


def constraint_sections(eq: Equations) -> list[Section]:
    """Rows of each joint, driver and coupling; the Jacobian."""
    T, s = eq.named_equations.traced, eq.named_equations.values.structure
    if not T.lam:
        return []
    owners: dict[str, list[int]] = {}
    for k, x in enumerate(T.lam):
        owners.setdefault(x.data.element, []).append(k)
    out: list[Block] = [
        Display(
            Tex(
                r"\mathbf{g}(\mathbf{q}, t) = \mathbf{0}, \quad \mathbf{G} \mathbf{v} = \boldsymbol{\nu}, \quad "
                r"\mathbf{G} \dot{\mathbf{v}} = \boldsymbol{\gamma}",
                "g = 0, G v = nu, G vdot = gamma",
            )
        )
    ]
    for owner, rows in owners.items():
        e = s.model[owner]
        what = joint_blocks(e) if isinstance(e, Joint) else kind_in_words(type(e))
        formulas = []
        for k in rows:
            free = k < len(s.rows) and not s.rows[k].holonomic
            formulas += [] if free else [Formula(_of("g", k), T.g[k])]
        formulas += [Formula(_of(r"\nu", k), T.nu[k]) for k in rows if T.nu[k] != 0.0]
        formulas += [Formula(_of(r"\gamma", k), T.gamma[k]) for k in rows]
        out.append(Formulas(f"{owner} ({connected_parts(e)})", formulas, what))
    G = Matrix(bold("G"), T.G.copy(), tuple(map(symbol_label, T.lam)), tuple(map(symbol_label, T.v)))
    return [Section("constraints", "Constraints", out), Section("jacobian", "Jacobian of the constraints", [G])]


def _of(letter: str, k: int) -> Tex:
    return Tex(f"{letter}_{{{k + 1}}}", f"{letter.strip(chr(92))}[{k + 1}]")


def mass_matrix_section(eq: Equations) -> Section:
    """The mass matrix."""
    T = eq.named_equations.traced
    names = tuple(map(symbol_label, T.v))
    return Section("mass", "Mass matrix", [Matrix(bold("M"), T.M.copy(), names, names, symmetric=True)])


def forces_section(eq: Equations) -> Section:
    """Generalised forces: inertia, gravity, each element."""
    T = eq.named_equations.traced
    out: list[Block] = []
    for title, f in generalised_forces(eq.named_equations):
        rows = [Formula(velocity_force(k, x), y) for k, (x, y) in enumerate(zip(T.v, f, strict=True)) if y != 0.0]
        if rows:
            out.append(Formulas(title, rows))
    if not out:
        out = [Paragraph("No force acts: f = 0.")]
    return Section("forces", "Forces along the velocities", out)


def velocity_force(k: int, x: Node) -> Tex:
    """The force along a velocity."""
    return Tex(rf"f_{{{k + 1}}} [{latex_symbol(x.data)}]", f"f[{k + 1}], {x.data.name}")


def motion_section(eq: Equations, acting: Section) -> Section:
    """The equations of motion: as matrices, and row by row where these are few."""
    x = eq.named_equations
    T = x.traced
    closed = r" + \mathbf{G}^{\top} \boldsymbol{\lambda}" if T.lam else ""
    told = Tex(
        rf"\mathbf{{M}} \dot{{\mathbf{{v}}}} = \mathbf{{f}}{closed}", f"M vdot = f{' + G^T lam' if T.lam else ''}"
    )
    out: list[Block] = [Display(told)]
    if len(T.v) <= LARGE_MATRIX:
        by: dict[str, list[Formula]] = {}
        given = [f for b in acting.blocks if isinstance(b, Formulas) for f in b.formulas]
        for k, v in enumerate(T.v):
            before = [(T.M[k, j], a) for j, a in enumerate(x.vdot) if T.M[k, j] != 0.0]
            after = [(T.G[r, k], lam) for r, lam in enumerate(T.lam) if T.G[r, k] != 0.0]
            parts = [f for f in given if f.left.text == velocity_force(k, v).text]
            by.setdefault(v.data.element, []).append(Formula(ZERO, T.f[k], "", before, after, parts))
        out += [Formulas(owner, rows) for owner, rows in by.items()]
    return Section("motion", "Equations of motion", out)


def controller_sections(eq: Equations) -> list[Section]:
    """Rates of the states of controllers."""
    T = eq.named_equations.traced
    rates = zip(T.states, T.state_rates, strict=True)
    rows = [Formula(Tex(rf"\frac{{d}}{{dt}} {latex_symbol(x.data)}", f"{x.data.name}'"), y) for x, y in rates]
    return [Section("controllers", "Controllers", [Formulas("", rows)])] if rows else []


def energies_section(eq: Equations) -> Section:
    """Kinetic and potential energy."""
    rows = [
        Formula(Tex(letter, letter), eq[f"energy.{name}"].nodes[()], "J")
        for letter, name in (("T", "kinetic"), ("V", "potential"))
    ]
    return Section("energies", "Energies", [Formulas("", rows)])


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
        mechanism_section(eq),
        coordinates_section(eq),
        *constraint_sections(eq),
        mass_matrix_section(eq),
        acting := forces_section(eq),
        motion_section(eq, acting),
        *controller_sections(eq),
        energies_section(eq),
    ]
    made = Document(eq.model.name, size_description(eq), sections)
    found, meant = simplify_with_names(made.expressions(), quaternions(eq.named_equations), candidate_symbols(eq))
    made.replace_expressions(found)
    as_sums(made, quaternions(eq.named_equations))
    without_zeros(made)
    count = len(made.expressions())
    found, letters = extract_common_subexpressions([*made.expressions(), *(y for _, y in meant)])
    made.replace_expressions(found[:count])
    meant = [(x, y) for (x, _), y in zip(meant, found[count:], strict=True)]
    later = []
    if meant:
        later.append(Section("kinematics", "Kinematics of the bodies", kinematic_formulas(meant)))
    if letters:
        later.append(Section("abbreviations", "Abbreviations", [Formulas("", definition_formulas(letters))]))
    at = next(k for k, s in enumerate(sections) if s.name == "coordinates") + 1
    sections[at:at] = later
    used = [x for x in nodes_in_order([*made.expressions(), *added_symbols(sections)]) if x.op == SYMBOL]
    sections.insert(1, symbols_section(used))
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
