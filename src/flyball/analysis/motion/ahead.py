"""What can be told of a motion before it is computed: that a law will ask a table for a value that it has not."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...equations.engine import MOTION
from ...errors import ModelError
from ...laws.functions import Missed, forget
from ...model.expressions import Expression
from ...model.grammar import Node
from ...model.table import Table
from ..assembly.start import Assembly
from ..linear.jumps import laws

SAMPLES = 257  # times at which the arguments of tables are looked at


def refuse_missing(a: Assembly, until: float) -> None:
    """Refuse a motion from an assembled start up to ``until`` [s] on the way of which a table has no value.

    Arguments that depend on time alone are looked at over the whole time; the others at the start.

    Raises
    ------
    ModelError
        Naming the element, the table, the time and the value.
    """
    c = a.compiled
    model = c.structure.model
    tables = {x.name: x for x in model.tables}
    if all(x.beyond != "refuse" for x in tables.values()):
        return
    env = model.environment(c.parameters)
    for title, law in laws(model):
        if law.tables and (found := _first(law, env, tables, a.t, until)):
            t, table, x = found
            span = f"the motion is to go from {a.t:.6g} s to {until:.6g} s"
            raise ModelError(f"{title}: at t = {t:.6g} s {table.told_beyond(x)}. Here {span}")
    if missed := missed_at_start(a):
        raise ModelError(f"{model.name!r}: {missed.message}")


def missed_at_start(a: Assembly) -> Missed | None:
    """A law that has no value at an assembled start, since it asks a table beyond its ends."""
    c = a.compiled
    forget(c.work.stack)
    c.at(a.t, a.q, a.v, MOTION)
    return c.structure.missed(c.work.stack)


def _first(
    law: Expression, env: Mapping[str, Any], tables: Mapping[str, Table], start: float, end: float
) -> tuple[float, Table, float] | None:
    """The first time at which a table that is called has no value, the table, and the argument then."""
    times = np.linspace(start, end, SAMPLES)
    found = []
    for table, x, live in _asked(law.tree, law, {**env, "t": times}, tables, np.full(SAMPLES, True)):
        missing = np.flatnonzero(live & _beyond(table, x))
        if len(missing):
            found.append((float(times[missing[0]]), table, float(x[missing[0]])))
    if not found:
        return None
    late = min(found, key=lambda f: f[0])
    early = late[0] - (end - start) / (SAMPLES - 1)
    if early < start:
        return late
    for _ in range(60):  # nearer to where it leaves the table
        middle = 0.5 * (early + late[0])
        at = [
            (middle, table, float(x[0]))
            for table, x, live in _asked(law.tree, law, {**env, "t": np.array([middle])}, tables, np.full(1, True))
            if (live & _beyond(table, x))[0]
        ]
        early, late = (early, at[0]) if at else (middle, late)
    return late


def _beyond(table: Table, x: np.ndarray) -> np.ndarray:
    first, last = table.ends()
    return (x < first) | (x > last)


def _asked(
    node: Node, law: Expression, env: Mapping[str, Any], tables: Mapping[str, Table], live: np.ndarray
) -> Iterator[tuple[Table, np.ndarray, np.ndarray]]:
    """Tables that a law calls, their arguments where these depend on time alone, and when the law needs them."""

    def value(part: Node) -> Any:
        names = {n.value for n in part.walk() if n.kind == "name"}
        return Expression(law.text, part).evaluate(env, tables) if names <= env.keys() else None

    if node.kind == "where":
        condition = value(node.args[0])
        yield from _asked(node.args[0], law, env, tables, live)
        if condition is not None:
            condition = np.broadcast_to(condition, live.shape)
            yield from _asked(node.args[1], law, env, tables, live & condition)
            yield from _asked(node.args[2], law, env, tables, live & ~condition)
        return
    if node.kind == "table" and (x := value(node.args[0])) is not None:
        yield tables[node.value], np.broadcast_to(np.real(x), live.shape), live
    for arg in node.args:
        yield from _asked(arg, law, env, tables, live)
