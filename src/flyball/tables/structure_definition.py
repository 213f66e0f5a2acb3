"""`Structure`: everything that no parameter can change, with its frames, terms and rows; names of the velocities."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ..compiler.kernels import CodeTable
from ..constraints.blocks import Row
from ..laws.compilation import compile_law
from ..laws.python_functions import TableFault, table_fault
from ..model.controller import Controller
from ..model.controller_signals import ConnectedState
from ..model.element import Element
from ..model.expression_parser import called_table
from ..model.expressions import Expression
from ..model.force import Force
from ..model.model import Model
from ..model.snapshot import ResultCache
from ..numerics.sparse_factorisation import LDLPattern
from .forest import TreeJoint, tree_joint_steps
from .table_definitions import POINT

T = TypeVar("T", bound=tuple)


@dataclass(frozen=True)
class FrameSpec:
    """A frame of an element: on which body (-1 ground), of which element, and in which role."""

    body: int
    element: Any
    role: str  # "F", "M", "P0"; "world" for ground itself
    coordinate: str = ""  # rotated for that coordinate of a joint or body


@dataclass
class TermSpec:
    """One term of a constraint row or of a measured quantity."""

    row: int  # measured quantities are counted after all rows, once their number is known
    F: int
    M: int
    formula: Row
    sign: float
    element: Element  # element that the row belongs to
    owner: Any = None  # element whose coordinate it is, and which; None for a joint's own rows
    what: str = ""
    measured: bool = False
    hint: int = -1  # state that it uses for whole turns or a place on a curve
    index: int = 0  # index among the row's coordinates
    switch: str | None = None  # label of the switch whose quantity it is part of, with a weight


@dataclass
class RowSpec:
    """One constraint row: its element, and the law it follows."""

    element: Element
    label: str
    law: int = -1
    wrap: bool = False
    work: int = -1
    holonomic: bool = True
    sensors: tuple[int, ...] = ()  # slots that the law depends on


@dataclass
class Structure:
    """Structure of a mechanism: everything that is decided before its numbers are known."""

    model: Model
    far: bool
    tree: tuple[str, ...]
    positions: bool = False  # without the rows that restrain velocities only
    coupled: bool = False  # the coupled matrix in absolute coordinates too
    place: dict[str, int] = field(default_factory=dict)  # body name -> row of the body table
    tree_joints: dict[str, TreeJoint] = field(default_factory=dict)
    points: frozenset[str] = frozenset()  # bodies that are point masses
    prescribed: dict[str, int] = field(default_factory=dict)  # driver -> row of the body table, in this order
    frames: list[FrameSpec] = field(default_factory=list)
    frame_at: dict[tuple[str, str, str], int] = field(default_factory=dict)  # (element, role, coordinate) -> frame
    terms: list[TermSpec] = field(default_factory=list)
    terms_of: dict[str, list[int]] = field(default_factory=dict)  # element -> terms of its rows
    rows: list[RowSpec] = field(default_factory=list)
    slices: dict[str, slice] = field(default_factory=dict)  # element name -> its rows
    measured: dict[str, int] = field(default_factory=dict)  # quantity -> its number
    slots: dict[str, int] = field(default_factory=dict)  # sensor -> slot that laws read (rates come after all values)
    angles: list[tuple[int, int, int]] = field(default_factory=list)  # frame F, frame M, state
    forces: list[Force] = field(default_factory=list)
    rotors: list[tuple[Any, int]] = field(default_factory=list)  # elements that add inertia to a velocity, and which
    rotors_without_velocity: list[Any] = field(default_factory=list)  # those whose coordinate is no velocity here
    force_code: list[CodeTable | None] = field(default_factory=list)  # code table of each user-defined force
    term_code: list[CodeTable | None] = field(default_factory=list)  # code table of each user-defined term
    guard_code: list[CodeTable | None] = field(default_factory=list)  # code table of each guard of a user's switch
    switches: list[Any] = field(default_factory=list)  # rows with modes (`constraint_rows.SwitchSpec`)
    branches: Any = (
        None  # finds the sides of nonsmooth points (`law_inputs.NonsmoothPoints`); None: laws decide themselves
    )
    guards: list[tuple[int, int, int]] = field(default_factory=list)  # (kind, switch or law, direction of the crossing)
    events: dict[int, Any] = field(default_factory=dict)  # guard -> event of the model
    controls: list[ConnectedState] = field(default_factory=list)  # states of controllers, the first of all states
    ordered: list[tuple[Controller, tuple[str, str], list[int]]] = field(default_factory=list)
    # controller, state, law, whether it comes last
    sampled: list[tuple[str, int, int, bool]] = field(default_factory=list)
    loads: list[Force] = field(default_factory=list)  # forces that depend on the load of their joint
    sensed_columns: dict[str, int] = field(
        default_factory=dict
    )  # element whose force events name -> its first column, from 0
    state_at: dict[str, int] = field(default_factory=dict)  # name -> work, turn or place state
    tables: dict[str, Any] = field(default_factory=dict)  # integers of `System`, by its fields
    code: list[int] = field(default_factory=list)
    const: list[float] = field(default_factory=list)
    table_at: dict[str, int] = field(default_factory=dict)  # table or joint's curve -> its place in const
    surfaces: np.ndarray = field(default_factory=lambda: np.zeros(1))  # `System.surfaces`
    surface_at: dict[str, int] = field(default_factory=dict)  # road -> place of its surface
    laws: dict[int, str] = field(default_factory=dict)  # start of each law in the code -> description of the law
    functions: list[Any] = field(default_factory=list)  # Python functions that laws call
    depth: int = 1
    ldl: LDLPattern = None  # type: ignore[assignment]
    cache: ResultCache = field(
        default_factory=ResultCache, init=False
    )  # cached values of it, and their cost; a changed copy has its own

    @cached_property
    def nq(self) -> int:
        """Number of coordinates."""
        return int(self.tables["tree"].nq.sum())

    @cached_property
    def nv(self) -> int:
        """Number of velocities."""
        return int(self.tables["tree"].nv.sum())

    @cached_property
    def code_tables(self) -> set[CodeTable]:
        """Code tables of all user-defined classes in it."""
        return {x for x in (*self.force_code, *self.term_code, *self.guard_code) if x is not None}

    @property
    def states(self) -> list[str]:
        """Names of the work, turn and place states."""
        return list(self.state_at)

    def state(self, name: str) -> int:
        """Index of a state of that name, created when first needed."""
        return self.state_at.setdefault(name, len(self.state_at))

    def law(self, law: Expression, inputs: tuple[str, ...], owner: Any = None, derivatives: bool = False) -> int:
        """Compile a law of an element into the code; returns where it begins."""
        if law.tables:
            self.add_table_derivatives(law)
        at, depth = compile_law(
            law,
            ("t", *inputs),
            list(self.model.parameters),
            self.code,
            self.const,
            sensors={name: self.slots[name] for name in law.names if name in self.slots},
            tables=self.table_at,
            functions=self.functions,
            derivatives=derivatives,
            corners=self.branches.of(owner, law, inputs) if self.branches is not None and owner is not None else None,
        )
        self.depth = max(self.depth, depth)
        self.laws[at] = law.where
        return at

    def add_table_derivatives(self, law: Expression) -> None:
        """Add derivatives of tables that a law calls to the constants."""
        tables = self.model.law_tables()
        for node in law.tree.walk():
            if node.kind == "table" and node.value not in self.table_at:
                name, order = called_table(node)
                self.table_at[node.value] = len(self.const)
                self.const += tables[name].derivative_data(order)

    def missed(self, stack: np.ndarray) -> TableFault | None:
        """Last law without a value due to a table, if one is recorded in the laws' scratch."""
        tables = self.model.law_tables()
        return table_fault(stack, self.laws, {self.table_at[name]: tables[name.rstrip("'")] for name in self.table_at})


def frame_index(s: Structure, e: Any, role: str, coordinate: str = "") -> int:
    """Index of a frame of an element, created when first needed."""
    world = role not in e.ends()  # of a body, whose coordinates are measured from the world's frame
    if world and not coordinate:
        return 0
    key = ("", "world", coordinate) if world else (e.name, role, coordinate)
    if key not in s.frame_at:
        s.frame_at[key] = len(s.frames)
        frame = FrameSpec(-1, None, "world", coordinate)
        if not world:
            frame = FrameSpec(s.place[s.model.carrier(e.ends()[role], e)], e, role, coordinate)
        s.frames.append(frame)
    return s.frame_at[key]


def integer_table(of: type[T], rows: Any) -> T:
    """Table of integers from its rows, one array for each field; there may be no rows."""
    width = len(of._fields)  # type: ignore[attr-defined]
    return of(*np.ascontiguousarray(np.array(rows, np.int64).reshape(-1, width).T))


AXES = ("x", "y", "z")


class VelocityName(NamedTuple):
    """Name of a velocity: the coordinate whose rate it is."""

    name: str
    unit: str  # of the coordinate: "m" or "rad"


def velocity_names(s: Structure) -> list[VelocityName]:
    """Names of the velocities, (nv,): the coordinates whose rates they are.

    Bodies connected to ground freely: ``x``, ``y``, ``z`` of the centre of mass along the world's axes; ``angle`` in
    the plane; in space ``turn x``, ``turn y``, ``turn z`` about the body's own axes, which point masses do not have.
    Tree joints: the joint's coordinates; a coordinate without a name is a ``turn`` or ``shift`` along an axis.
    """
    return s.cache.get("names of velocities", None, 1, lambda: _velocity_names(s))


def _velocity_names(s: Structure) -> list[VelocityName]:
    tree = s.tables["tree"]
    out = [VelocityName("", "m")] * s.nv
    hung = set()
    for t, row, step in tree_joint_steps(s):
        hung.add(row)
        v0, n = int(tree.v[row]), int(tree.nv[row])
        for k in range(n):
            told = step.coordinate if n == 1 else ""  # a spherical primitive has three velocities
            what = told or f"{'shift' if step.kind == 'P' else 'turn'} {AXES[k] if n > 1 else step.axis}"
            unit = "m" if step.kind == "P" else "rad"
            out[v0 + k] = VelocityName(f"{t.joint.name}.{what}", unit)
    own = ["x", "y", "angle"] if s.model.planar else [*AXES, *(f"turn {a}" for a in AXES)]
    for name, b in s.place.items():
        if b >= 0 and b not in hung and int(tree.joint[b]) <= POINT:
            for k, what in enumerate(own[: int(tree.nv[b])]):
                out[int(tree.v[b]) + k] = VelocityName(f"{name}.{what}", "m" if what in AXES else "rad")
    return out
