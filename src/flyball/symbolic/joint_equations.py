"""The equations of one joint between two free frames, row by row, with their building blocks, as in textbooks.

Position, velocity and acceleration of every row, and the Jacobian along (v_F, w_F, v_M, w_M), come from the row's
own formula evaluated on symbols. Frame F has the origin ``F.x``, ``F.y``, ``F.z``, the velocity ``F.vx`` ..., the
angular velocity ``F.wx`` ... and the accelerations ``F.ax`` ..., ``F.alphax`` ..., all in world axes. Its
orientation is given by the Euler parameters ``F.e0`` to ``F.e3`` or the Bryant angles ``F.b1`` to ``F.b3``
(rotations about x, y, z in sequence), with w = H(b) bdot. M likewise. `VECTORS` is the vector form of the rows.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..constraints import coincident, displacement, distance, knife_edge, perpendicular, relative_spin, skew_lines
from ..constraints.registry import Kind
from ..errors import ModelError
from ..expression_graph.graph import Graph, Node, Symbol, object_vector, symbols_of
from ..math.rotation import axes_in_base, axis_rotation
from ..math.vec import mm, neg, quaternion_matrix
from ..model.joint import Joint
from ..model.model import Model
from ..tables.structure import structure
from ..tables.values import values
from .expressions import Expressions, SymbolTable
from .named_equations import TurnElimination


class VectorForm(NamedTuple):
    """A row as a vector equation.

    Attributes
    ----------
    text : str
        Its left-hand side, which is zero.
    hahn : str
        The same in Hahn's index order; r_P0 is the vector from O to P in the axes of 0, A_0P rotates from P to 0.
    block : str
        Hahn's building block.
    of_velocity : bool
        Whether it constrains velocities only.
    """

    text: str
    hahn: str
    block: str = ""
    of_velocity: bool = False


VECTORS = {
    coincident.KIND: VectorForm("n @ (p_M - p_F) - c", "n^T (r^R_{MO} - r^R_{FO}) = 0", "BB1"),
    displacement.KIND: VectorForm("n_F @ (p_M - p_F) - c", "(A^{RF} n^F)^T (r^R_{MO} - r^R_{FO}) = c", "BB3"),
    perpendicular.KIND: VectorForm("m_M @ n_F - c", "(A^{RM} m^M)^T A^{RF} n^F = 0", "BB2, BB4"),
    distance.KIND: VectorForm("sqrt((p_M - p_F) @ (p_M - p_F)) - c", "|r^R_{MO} - r^R_{FO}| = c", "BB5"),
    skew_lines.KIND: VectorForm(
        "n @ (p_M - p_F - s_1*z_F - s_2*z_M - k*cross(z_F, z_M))",
        "n^T (r^R_{MO} - r^R_{FO} - s_1 f - s_2 m - k f x m) = 0",
    ),
    knife_edge.KIND: VectorForm(
        "n_M @ (v_M - v_F - cross(w_F, p_M - p_F))", "(A^{RM} n^M)^T (v_M - v_F - w_F x (r_M - r_F)) = 0", "", True
    ),
    relative_spin.KIND: VectorForm("n_M @ (w_M - w_F)", "(A^{RM} n^M)^T (w_M - w_F) = 0", "", True),
}
"""Kind of row -> vector form; the rows of angles, curves and wheels have no short one."""


AXES = "xyz"
ORIENTATIONS = ("quaternion", "bryant")


class RowTerm(NamedTuple):
    """A term of a row: kind and parameters of its formula, weight, rotations of its frames."""

    kind: Kind
    par: tuple
    weight: float
    turn_F: tuple = ()
    turn_M: tuple = ()


class JointEquations(SymbolTable):
    """Equations of one joint between two free frames.

    Attributes
    ----------
    position, velocity, acceleration : Expressions
        Left-hand sides of the rows, which are zero; rows on velocities only have no position.
    jacobian : Expressions
        Velocity = jacobian (v_F, w_F, v_M, w_M), (rows, 12).
    H_F, H_M : Expressions
        Angular velocity, world axes, from the rates of the Bryant angles: w = H bdot, (3, 3).
    vectors : list of VectorForm or None
        The vector form of every row: as text, in Hahn's order of indices, and its building block.
    """

    def __init__(
        self, joint: Joint, graph: Graph, rows: Sequence[tuple[Any, list[RowTerm], Any]], orientation: str
    ) -> None:
        if orientation not in ORIENTATIONS:
            raise ModelError(f"orientation is {orientation!r}; must be one of {', '.join(ORIENTATIONS)}")
        self.joint, self.orientation = joint, orientation
        self.graph = graph
        self._symbols: dict[str, Node] = {}
        self.terms = [terms for _, terms, _ in rows]  # kind, parameters and weight of each term of a row
        self.F, self.M = self._frame("F"), self._frame("M")
        self.labels = tuple(("n" if row.world else "") + row.axes or "distance" for row, _, _ in rows)
        self.vectors: list[VectorForm | None] = [VECTORS.get(row.kind) for row, _, _ in rows]
        self._constructed = [self._sum(terms, data) for _, terms, data in rows]
        self._symbols |= {x.data.name: x for x in symbols_of([y for m in self._constructed for y in m[:1]])}

    @property
    def title(self) -> str:
        """Kind and name of the joint."""
        return self.joint.title

    @property
    def named(self) -> dict[str, Node]:
        """Every symbol by its name."""
        return self._symbols

    @property
    def units(self) -> list[list[Node]]:
        """The quaternions of both frames."""
        if self.orientation != "quaternion":
            return []
        return [[self._symbols[f"{f}.e{k}"] for k in range(4)] for f in "FM"]

    @property
    def position(self) -> Expressions:
        """Left-hand sides g, (rows,)."""
        return self._vector([m[0] for m in self._constructed])

    @property
    def velocity(self) -> Expressions:
        """Rates of g, (rows,): jacobian times the frames' velocities."""
        speeds = object_vector([*self.F[3], *self.F[2], *self.M[3], *self.M[2]])
        return self._vector(self.jacobian.nodes @ speeds if self._constructed else [])

    @property
    def acceleration(self) -> Expressions:
        """Second derivative, (rows,): jacobian times the frames' accelerations, plus velocity terms."""
        gained = object_vector([*self.F[5], *self.F[4], *self.M[5], *self.M[4]])
        bias = object_vector([m[4] for m in self._constructed])
        return self._vector(self.jacobian.nodes @ gained + bias if self._constructed else [])

    @property
    def jacobian(self) -> Expressions:
        """Jacobian along (v_F, w_F, v_M, w_M), (rows, 12)."""
        out = np.zeros((len(self._constructed), 12), object)
        for k, (_, f, tM, tF, _) in enumerate(self._constructed):
            out[k] = [*neg(f), *tF, *f, *tM]
        columns = [f"{f}.{w}{a}" for f in "FM" for w in "vw" for a in AXES]
        return Expressions(self, out, self.labels, columns)

    @property
    def H_F(self) -> Expressions:
        """Matrix H_F of w_F = H_F bdot."""
        return self._relation("F")

    @property
    def H_M(self) -> Expressions:
        """Matrix H_M of w_M = H_M bdot."""
        return self._relation("M")

    def text(self, notation: str = "flyball") -> str:
        """The equations row by row: building block, vector form, position, velocity, acceleration.

        Parameters
        ----------
        notation : {"flyball", "hahn"}
            Notation of the vector form.
        """
        if notation not in ("flyball", "hahn"):
            raise ModelError(f"notation is {notation!r}; must be 'flyball' or 'hahn'")
        lines = [f"{self.title}: frames F on body_i and M on body_j, {self.orientation}"]
        parts = [e.texts() for e in (self.position, self.velocity, self.acceleration)]
        for k, (label, v) in enumerate(zip(self.labels, self.vectors, strict=True)):
            lines.append(f"{label}" + (f" ({v.block})" if v and v.block else ""))
            if v:
                lines.append(f"  {v.hahn if notation == 'hahn' else v.text + ' = 0'}")
            names = ("position", "velocity", "acceleration")
            lines += [f"  {name}: {p[k]} = 0" for name, p in zip(names, parts, strict=True)]
        return "\n".join(lines)

    def __str__(self) -> str:
        return self.text()

    def _symbol(self, name: str, kind: str) -> Node:
        made = self._symbols[name] = self.graph.symbol(Symbol(name, kind))
        return made

    def _frame(self, f: str) -> tuple:
        """Record of a free frame."""
        p, v, w, a, alpha = (
            tuple(self._symbol(f"{f}.{what}{axis}", kind) for axis in AXES)
            for what, kind in (
                ("", "coordinate"), ("v", "velocity"), ("w", "velocity"), ("a", "acceleration"),
                ("alpha", "acceleration"),
            )
        )  # fmt: skip
        if self.orientation == "quaternion":
            R: tuple = quaternion_matrix(*(self._symbol(f"{f}.e{k}", "coordinate") for k in range(4)))
        else:
            b1, b2, b3 = (self._symbol(f"{f}.b{k}", "coordinate") for k in (1, 2, 3))
            R = mm(mm(axis_rotation(0, b1), axis_rotation(1, b2)), axis_rotation(2, b3))
        return p, R, w, v, alpha, a

    def _relation(self, f: str) -> Expressions:
        if self.orientation != "bryant":
            raise ModelError("H relates Bryant angles to angular velocities: give orientation='bryant'")
        H = np.array(axes_in_base(0, 1, 2, self._symbols[f"{f}.b1"], self._symbols[f"{f}.b2"]), object).T
        return Expressions(self, H, [f"{f}.w{a}" for a in AXES], [f"{f}.b{k}'" for k in (1, 2, 3)])

    def _sum(self, terms: Sequence[RowTerm], data: Any) -> tuple:
        """Value, unit wrench and bias of one row: a sum of terms."""
        total = np.zeros(11, object)
        for t in terms:
            total = total + t.weight * self._term(t, data)
        flat = total.tolist()
        return flat[0], tuple(flat[1:4]), tuple(flat[4:7]), tuple(flat[7:10]), flat[10]

    def _term(self, t: RowTerm, data: Any) -> np.ndarray:
        """One term with the accelerations separated: value, force, torques on M and F, bias."""
        kind, par = t.kind, t.par
        zero = (0.0, 0.0, 0.0)
        F, M = (
            (f[0], mm(f[1], tuple(np.ravel(turn))) if len(turn) else f[1], *f[2:4], zero, zero)
            for f, turn in ((self.F, t.turn_F), (self.M, t.turn_M))
        )
        if kind.foot is None:
            value, f, tM, tF, bias = kind.row(par, F, M, 0.0, data)
            return object_vector([value, *f, *tM, *tF, bias])
        place = self._symbol("place", "state")
        foot = kind.foot(par, F, M, place, data)
        value, f, tM, tF, bias = kind.row(par, F, M, place, data)
        return TurnElimination(self.graph, [(foot, place)], [])(object_vector([value, *f, *tM, *tF, bias]))

    def _vector(self, nodes: Any) -> Expressions:
        return Expressions(self, nodes if isinstance(nodes, np.ndarray) else object_vector(nodes), self.labels)


def joint_equations(
    model: Model, parameters: Iterable[tuple[str, Node]], name: str, orientation: str
) -> JointEquations:
    """Equations of a joint of a mechanism, with ``parameters`` as symbols."""
    joint = model[name]
    if not isinstance(joint, Joint):
        raise ModelError(f"{joint.title} is no joint; joints are {', '.join(j.name for j in model.joints)}")
    graph = Graph()
    given: Any = {k: graph.symbol(x.data, x.value) for k, x in parameters}
    x = values(structure(model), given or None)
    n, ends = x.numbers[name], x.poses.ends(joint)
    rows = []
    for row in joint.rows(model.planar):
        par = [_parameter_expression(c) for c in joint.row_parameters(n, row, *ends)]
        data: list[Any] = []
        if row.of_kind.splines:
            curves = joint.curves(n)
            data = [float(c.real) for curve in curves for c in curve]
            par[1:3] = 0.0, float(len(curves[0]))
        terms = [RowTerm(row.of_kind, (*par, 1.0), row.par[7])]
        for what in row.plus:
            c = joint.coordinates[what]
            if c.frames != "FM":
                raise ModelError(f"{joint.title}: its row of {what!r} is from M to F and has no textbook form")
            weight = c.sign * c.row.par[7] * _parameter_expression(joint.weight(n, what, *ends))
            terms.append(RowTerm(c.row.of_kind, (*c.row.par[:6], 0.0, 1.0), weight, c.turn_F, c.turn_M))
        rows.append((row, terms, np.array(data, object)))
    return JointEquations(joint, graph, rows, orientation)


def _parameter_expression(x: Any) -> Any:
    """An expression of parameters, or a number."""
    return x if isinstance(x, Node) else float(x.real)
