"""Mechanism -> integers: who touches whom, which row, which entry goes where. Numbers come later (``values``).

Everything that a change of a parameter leaves alone is decided here, once: bodies here, rows and measured quantities
in ``terms``, forces in ``forces``, patterns of matrices in ``patterns``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import ModelError
from ..model.body import Initial
from ..model.model import Model
from . import controllers, events, forces, patterns, reads, switches, terms
from .branches import Branches, settle
from .forest import body_table
from .points import single
from .specs import FrameSpec, Structure

MOST = 8  # structures of one mechanism that are kept


@dataclass(frozen=True, kw_only=True)
class Choices:
    """What tables are wanted of a mechanism.

    Attributes
    ----------
    far : bool
        Use the rows that lead from a far start (assembly) in place of those of motion.
    positions : bool
        Leave out rows that restrain velocities only, which have no say in assembly.
    holds : tuple of Initial
        Coordinates to be held at a value, as further rows.
    tree : tuple of str
        Names of joints that become tree joints instead of rows.
    coupled : bool
        Solve through the coupled matrix also where M is constant and block diagonal: to compare what that costs.
    solved : bool
        Whether accelerations are asked for; if not, no matrix is made ready to be factored.
    switches : bool
        With rows that have modes: those of a motion.
    """

    far: bool = False
    positions: bool = False
    holds: tuple[Initial, ...] = ()
    tree: tuple[str, ...] = ()
    coupled: bool = False
    solved: bool = True
    switches: bool = False


PLAIN = Choices()


def structure(model: Model, choices: Choices = PLAIN) -> Structure:
    """The tables of a mechanism, decided once for each of its snapshots and shared by all who ask: not to be changed.

    Raises
    ------
    ModelError
        If there are no bodies.
    """
    model = model.snapshot()
    key = choices, single(model)
    found = model.kept.get("structure", key, MOST, lambda: _decided(model, choices))
    if outdated(found):
        model.kept.drop("structure", key)
        found = model.kept.get("structure", key, MOST, lambda: _decided(model, choices))
    return found


def outdated(s: Structure) -> bool:
    """Whether a Python function that it was made of is no longer what it was: a law, or a formula of a user's class."""
    return any(f.native.stale for f in s.functions) or any(x.stale for x in s.code_tables)


def _decided(model: Model, choices: Choices) -> Structure:
    if not model.bodies and not model.bulk:
        raise ModelError(f"{model.name!r} has no bodies; add at least one")
    c = choices
    s = Structure(model, c.far, c.tree, c.positions or c.far, c.coupled)
    s.const = [0.0] * len(model.parameters)
    for table in model.tables:
        s.table_at[table.name] = len(s.const)
        s.const += table.data()
    controllers.states(s)
    body_table(s)
    s.frames.append(FrameSpec(-1, None, "world"))
    if c.switches:
        s.branches = Branches(s)
        s.branches.quantities()
        switches.quantities(s)
        events.quantities(s)
    forces.measured_quantities(s, {**controllers.names(model), **(events.names(model) if c.switches else {})})
    controllers.slots(s)
    if c.switches:
        reads.quantities(s)
    terms.rows(s, c.holds)
    if c.switches:
        switches.rows(s)
    forces.forces(s)
    controllers.table(s)
    if c.switches:
        events.guards(s)
    switches.table(s)
    for e in s.loads:
        if (joint := getattr(e, "joint", "")) in s.tree_joints:
            raise ModelError(f"{e.title} needs the reaction of {joint!r}, which must then be rows, not a tree joint")
    terms.sort(s)
    patterns.patterns(s, c.solved)
    settle(s)
    s.tables["code"] = np.array(s.code or [0], np.int64)
    return s
