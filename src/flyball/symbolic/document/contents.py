"""Contents of the document of a mechanism's equations, section by section, with traced, unsimplified expressions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...constraints import blocks as building
from ...expression_graph.graph import Node
from ...expression_graph.printers.formula_layout import latex_symbol
from ...expression_graph.printers.latex import latex
from ...expression_graph.printers.text import text
from ...expression_graph.simplification.simplify import simplified
from ...model.joint import Joint
from ...model.messages import kind_in_words
from ..named_equations import generalised_forces
from .parts import (
    Block,
    Cell,
    DataTable,
    Display,
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

if TYPE_CHECKING:
    from ..equations import Equations

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


def mechanism_tables(eq: Equations) -> Section:
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


def symbols(used: list[Node]) -> Section:
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


def coordinates(eq: Equations) -> Section:
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


def constraints(eq: Equations) -> list[Section]:
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


def mass_matrix(eq: Equations) -> Section:
    """The mass matrix."""
    T = eq.named_equations.traced
    names = tuple(map(symbol_label, T.v))
    return Section("mass", "Mass matrix", [Matrix(bold("M"), T.M.copy(), names, names, symmetric=True)])


def forces(eq: Equations) -> Section:
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


def equations_of_motion(eq: Equations, acting: Section) -> Section:
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


def controllers(eq: Equations) -> list[Section]:
    """Rates of the states of controllers."""
    T = eq.named_equations.traced
    rates = zip(T.states, T.state_rates, strict=True)
    rows = [Formula(Tex(rf"\frac{{d}}{{dt}} {latex_symbol(x.data)}", f"{x.data.name}'"), y) for x, y in rates]
    return [Section("controllers", "Controllers", [Formulas("", rows)])] if rows else []


def energies(eq: Equations) -> Section:
    """Kinetic and potential energy."""
    rows = [
        Formula(Tex(letter, letter), eq[f"energy.{name}"].nodes[()], "J")
        for letter, name in (("T", "kinetic"), ("V", "potential"))
    ]
    return Section("energies", "Energies", [Formulas("", rows)])
