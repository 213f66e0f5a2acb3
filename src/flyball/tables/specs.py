"""What structure is made of: frames, terms, rows, and `Structure`, which holds all that no parameter can change."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar

import numpy as np

from ..compiler.by_address import CodeTable
from ..constraints.blocks import Row
from ..laws.functions import Missed, missed
from ..laws.program import compile_law
from ..model.controller import Controller
from ..model.element import Element
from ..model.expressions import Expression
from ..model.force import Force
from ..model.kept import Kept
from ..model.model import Model
from ..model.wiring import Wired
from ..numerics.ldl import Pattern
from .forest import TreeJoint

T = TypeVar("T", bound=tuple)


@dataclass(frozen=True)
class FrameSpec:
    """A frame that some element needs: on which body (-1 ground), whose, and which of its frames."""

    body: int
    element: Any
    role: str  # "F", "M", "P0"; "world" for ground itself
    coordinate: str = ""  # turned for that coordinate of a joint


@dataclass
class TermSpec:
    """One term of a constraint row or of a measured quantity."""

    row: int  # measured quantities are counted from the number of rows, once that is known
    F: int
    M: int
    formula: Row
    sign: float
    element: Element  # whose row it is
    owner: Any = None  # whose coordinate it is, and which; a joint's own rows have none
    what: str = ""
    measured: bool = False
    hint: int = -1  # state that it leans on
    index: int = 0  # which of the row's coordinates
    switch: str | None = None  # label of the switch whose quantity it is part of, with a weight


@dataclass
class RowSpec:
    """One constraint row: whose it is, and the law it follows."""

    element: Element
    label: str
    law: int = -1
    wrap: bool = False
    work: int = -1
    holonomic: bool = True
    sensors: tuple[int, ...] = ()  # slots that the law depends on


@dataclass
class Structure:
    """All that is decided about a mechanism before its numbers are known."""

    model: Model
    far: bool
    tree: tuple[str, ...]
    positions: bool = False  # without the rows that restrain velocities only
    coupled: bool = False  # the coupled matrix in absolute coordinates too
    place: dict[str, int] = field(default_factory=dict)  # body name -> row of the body table
    tree_joints: dict[str, TreeJoint] = field(default_factory=dict)
    points: frozenset[str] = frozenset()  # bodies that are point masses
    prescribed: dict[str, int] = field(default_factory=dict)  # driver -> row of the body table it prescribes
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
    force_code: list[CodeTable | None] = field(default_factory=list)  # formulas of each force of a user's own
    term_code: list[CodeTable | None] = field(default_factory=list)  # of each term
    switches: list[Any] = field(default_factory=list)  # rows with modes (`switches.SwitchSpec`)
    branches: Any = None  # what finds the sides of laws' corners (`branches.Branches`); None: laws decide themselves
    guards: list[tuple[int, int, int]] = field(default_factory=list)  # what is watched: kind, of what, which way
    events: dict[int, Any] = field(default_factory=dict)  # guard -> event of the model
    controls: list[Wired] = field(default_factory=list)  # states of controllers, the first of all states
    ordered: list[tuple[Controller, tuple[str, str], list[int]]] = field(default_factory=list)
    sampled: list[tuple[str, int, int, bool]] = field(default_factory=list)  # controller, state, law, whether last
    loads: list[Force] = field(default_factory=list)  # those that need to know what their joint carries
    reads: dict[str, int] = field(default_factory=dict)  # element whose force events name -> its column (`reads`)
    state_at: dict[str, int] = field(default_factory=dict)  # name -> work, turn or place state
    tables: dict[str, Any] = field(default_factory=dict)  # integers of `System`, by its fields
    code: list[int] = field(default_factory=list)
    const: list[float] = field(default_factory=list)
    table_at: dict[str, int] = field(default_factory=dict)  # table or joint's curve -> its place in const
    laws: dict[int, str] = field(default_factory=dict)  # start of each law in the code -> what it is the law of
    functions: list[Any] = field(default_factory=list)  # Python functions that laws call
    depth: int = 1
    ldl: Pattern = None  # type: ignore[assignment]
    kept: Kept = field(default_factory=Kept, init=False)  # values of it, what they cost; a changed copy has its own

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
        """Code tables of all classes of a user's own in it."""
        return {x for x in (*self.force_code, *self.term_code) if x is not None}

    @property
    def states(self) -> list[str]:
        """Names of the work, turn and place states."""
        return list(self.state_at)

    def state(self, name: str) -> int:
        """Index of a state of that name, made when first asked for."""
        return self.state_at.setdefault(name, len(self.state_at))

    def law(self, law: Expression, inputs: tuple[str, ...], owner: Any = None, derivatives: bool = False) -> int:
        """Compile a law of an element into the code; returns where it begins."""
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

    def missed(self, stack: np.ndarray) -> Missed | None:
        """The last law that a table left without a value, if one is on record in the laws' scratch."""
        return missed(stack, self.laws, {self.table_at[x.name]: x for x in self.model.tables})


def frame(s: Structure, e: Any, role: str, coordinate: str = "") -> int:
    """Index of a frame of an element, made when first asked for."""
    key = (e.name, role, coordinate)
    if key not in s.frame_at:
        s.frame_at[key] = len(s.frames)
        s.frames.append(FrameSpec(s.place[s.model.carrier(e.ends()[role], e)], e, role, coordinate))
    return s.frame_at[key]


def integers(of: type[T], rows: Any) -> T:
    """A table of integers, one array for each of its fields, from its rows; there may be none."""
    width = len(of._fields)  # type: ignore[attr-defined]
    return of(*np.ascontiguousarray(np.array(rows, np.int64).reshape(-1, width).T))
