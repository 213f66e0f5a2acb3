"""A joint's equations as a textbook has them: of two frames that move freely, row by row, with the building blocks.

Position, velocity and acceleration of every row, and the Jacobian along (v_F, w_F, v_M, w_M), come from the row's own
formula, run on symbols. Frame F has the origin ``F.x``, ``F.y``, ``F.z``, the velocity ``F.vx`` ..., the angular
velocity ``F.wx`` ... and the accelerations ``F.ax`` ..., ``F.alphax`` ..., all along the world's axes; how it is turned
say the Euler parameters ``F.e0`` to ``F.e3`` or the Bryant angles ``F.b1`` to ``F.b3`` (turns about x, y, z, one after
the other), with w = H(b) bdot. M likewise.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..constraints.registry import Kind
from ..errors import ModelError
from ..graph.arrays import objects
from ..graph.node import Graph, Node, Symbol
from ..graph.values import symbols
from ..math.turns import axes_in_base, turn
from ..math.vec import mm, neg, quaternion_matrix
from ..model.joint import Joint
from ..model.model import Model
from ..tables.structure import structure
from ..tables.values import values
from .angles import Cleaned
from .expressions import Expressions
from .home import Home
from .vectors import VECTORS, Vector

AXES = "xyz"
ORIENTATIONS = ("quaternion", "bryant")


class Term(NamedTuple):
    """A term of a row: kind and parameters of its formula, what it counts, how its frames are turned before."""

    kind: Kind
    par: tuple
    weight: float
    turn_F: tuple = ()
    turn_M: tuple = ()


class Textbook(Home):
    """Equations of one joint between two free frames.

    Attributes
    ----------
    position, velocity, acceleration : Expressions
        Left sides of the rows, which are zero; rows that restrain velocities only have no position.
    jacobian : Expressions
        Velocity = jacobian (v_F, w_F, v_M, w_M), (rows, 12).
    H_F, H_M : Expressions
        Angular velocity, world axes, from the rates of the Bryant angles: w = H bdot, (3, 3).
    vectors : list of Vector or None
        The vector form of every row: as text, in Hahn's order of indices, and its building block.
    """

    def __init__(
        self, joint: Joint, graph: Graph, rows: Sequence[tuple[Any, list[Term], Any]], orientation: str
    ) -> None:
        if orientation not in ORIENTATIONS:
            raise ModelError(f"orientation is {orientation!r}; must be one of {', '.join(ORIENTATIONS)}")
        self.joint, self.orientation = joint, orientation
        self.graph = graph
        self._symbols: dict[str, Node] = {}
        self.terms = [terms for _, terms, _ in rows]  # kind, parameters and weight of each term of a row
        self.F, self.M = self._frame("F"), self._frame("M")
        self.labels = tuple(("n" if row.world else "") + row.axes or "distance" for row, _, _ in rows)
        self.vectors: list[Vector | None] = [VECTORS.get(row.kind) for row, _, _ in rows]
        self._made = [self._sum(terms, data) for _, terms, data in rows]
        self._symbols |= {x.data.name: x for x in symbols([y for m in self._made for y in m[:1]])}

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
        """G, (rows,)."""
        return self._vector([m[0] for m in self._made])

    @property
    def velocity(self) -> Expressions:
        """Gdot, (rows,): jacobian times the frames' velocities."""
        speeds = objects([*self.F[3], *self.F[2], *self.M[3], *self.M[2]])
        return self._vector(self.jacobian.nodes @ speeds if self._made else [])

    @property
    def acceleration(self) -> Expressions:
        """The second derivative, (rows,): jacobian times the frames' accelerations, and what velocities add."""
        gained = objects([*self.F[5], *self.F[4], *self.M[5], *self.M[4]])
        bias = objects([m[4] for m in self._made])
        return self._vector(self.jacobian.nodes @ gained + bias if self._made else [])

    @property
    def jacobian(self) -> Expressions:
        """Along (v_F, w_F, v_M, w_M), (rows, 12)."""
        out = np.zeros((len(self._made), 12), object)
        for k, (_, f, tM, tF, _) in enumerate(self._made):
            out[k] = [*neg(f), *tF, *f, *tM]
        columns = [f"{f}.{w}{a}" for f in "FM" for w in "vw" for a in AXES]
        return Expressions(self, out, self.labels, columns)

    @property
    def H_F(self) -> Expressions:
        """W_F = H_F bdot."""
        return self._relation("F")

    @property
    def H_M(self) -> Expressions:
        """W_M = H_M bdot."""
        return self._relation("M")

    def text(self, notation: str = "flyball") -> str:
        """The equations row by row: building block, vector form, position, velocity, acceleration.

        Parameters
        ----------
        notation : {"flyball", "hahn"}
            Of the vector form.
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
            R = mm(mm(turn(0, b1), turn(1, b2)), turn(2, b3))
        return p, R, w, v, alpha, a

    def _relation(self, f: str) -> Expressions:
        if self.orientation != "bryant":
            raise ModelError("H relates Bryant angles to angular velocities: ask with orientation='bryant'")
        H = np.array(axes_in_base(0, 1, 2, self._symbols[f"{f}.b1"], self._symbols[f"{f}.b2"]), object).T
        return Expressions(self, H, [f"{f}.w{a}" for a in AXES], [f"{f}.b{k}'" for k in (1, 2, 3)])

    def _sum(self, terms: Sequence[Term], data: Any) -> tuple:
        """Value, unit wrench and bias of one row: a sum of terms."""
        total = np.zeros(11, object)
        for t in terms:
            total = total + t.weight * self._term(t, data)
        flat = total.tolist()
        return flat[0], tuple(flat[1:4]), tuple(flat[4:7]), tuple(flat[7:10]), flat[10]

    def _term(self, t: Term, data: Any) -> np.ndarray:
        """One term with all accelerations apart: value, force, torques on M and F, bias."""
        kind, par = t.kind, t.par
        zero = (0.0, 0.0, 0.0)
        F, M = (
            (f[0], mm(f[1], tuple(np.ravel(turn))) if len(turn) else f[1], *f[2:4], zero, zero)
            for f, turn in ((self.F, t.turn_F), (self.M, t.turn_M))
        )
        if kind.foot is None:
            value, f, tM, tF, bias = kind.row(par, F, M, 0.0, data)
            return objects([value, *f, *tM, *tF, bias])
        place = self._symbol("place", "state")
        foot = kind.foot(par, F, M, place, data)
        value, f, tM, tF, bias = kind.row(par, F, M, place, data)
        return Cleaned(self.graph, [(foot, place)], [])(objects([value, *f, *tM, *tF, bias]))

    def _vector(self, nodes: Any) -> Expressions:
        return Expressions(self, nodes if isinstance(nodes, np.ndarray) else objects(nodes), self.labels)


def textbook(model: Model, parameters: Iterable[tuple[str, Node]], name: str, orientation: str) -> Textbook:
    """A joint of a mechanism, with ``parameters`` of that as symbols."""
    joint = model[name]
    if not isinstance(joint, Joint):
        raise ModelError(f"{joint.title} is no joint; joints are {', '.join(j.name for j in model.joints)}")
    graph = Graph()
    given: Any = {k: graph.symbol(x.data, x.value) for k, x in parameters}
    x = values(structure(model), given or None)
    n, ends = x.numbers[name], x.poses.ends(joint)
    rows = []
    for row in joint.rows(model.planar):
        par = [_shown(c) for c in joint.row_parameters(n, row, *ends)]
        data: list[Any] = []
        if row.of_kind.place:
            curves = joint.curves(n)
            data = [float(c.real) for curve in curves for c in curve]
            par[1:3] = 0.0, float(len(curves[0]))
        terms = [Term(row.of_kind, (*par, 1.0), row.par[7])]
        for what in row.plus:
            c = joint.coordinates[what]
            if c.frames != "FM":
                raise ModelError(f"{joint.title}: its row of {what!r} is from M to F and has no textbook form")
            weight = c.sign * c.row.par[7] * _shown(joint.weight(n, what, *ends))
            terms.append(Term(c.row.of_kind, (*c.row.par[:6], 0.0, 1.0), weight, c.turn_F, c.turn_M))
        rows.append((row, terms, np.array(data, object)))
    return Textbook(joint, graph, rows, orientation)


def _shown(x: Any) -> Any:
    """An expression of parameters, or a number."""
    return x if isinstance(x, Node) else float(x.real)
