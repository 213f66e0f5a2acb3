"""Which part of a law has no finite value, and for which argument: for messages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...equations.loads import wide
from ...equations.records import load
from ...errors import ModelError
from ...model.element import Element
from ...model.expressions import Expression
from ...model.force import CoordinateForce
from ...model.grammar import Node, written
from ...model.table import Table
from ...model.words import brief
from ...tables.branches import laws
from ...tables.system import RATE, VALUE
from ..compiled import Compiled

LONGEST = 100  # characters of a part of a law in a message


def inputs_of(c: Compiled, k: int) -> tuple[float, float]:
    """What the laws of force k may depend on besides time, at the kinematics in the scratch."""
    S, W, e = c.values.system, c.work, c.structure.forces[k]
    F, M = S.forces.F[k], S.forces.M[k]
    if isinstance(e, CoordinateForce):
        return float(W.sensed[VALUE, F]), float(W.sensed[RATE, F])
    x, y = e.inputs(wide(S.force_parameters, k), load(W.FK, F), load(W.FK, M))
    return float(x), float(y)


def undefined_in(c: Compiled, element: Element, t: float, given: tuple[float, ...] = ()) -> str:
    """The part without a finite value of a law of an element, at what sensors measured last; nothing if all have one.

    Parameters
    ----------
    c : Compiled
        Its scratch holds what is measured, and the states of controllers.
    element : Element
        A force, a driver or a controller.
    t : float
        Time [s].
    given : tuple of float
        Values of the inputs of a force's laws.
    """
    s = c.structure
    values = {name: float(c.work.sensed[VALUE, at]) for name, at in s.slots.items()}
    values |= dict(zip(s.model.parameters, c.values.system.const.tolist(), strict=False)) | {"t": t}
    tables = {x.name: x for x in s.model.tables}
    for owner, law, inputs in laws(s.model):
        if owner.name == element.name:
            known = values | dict(zip(inputs, given, strict=False))
            if text := undefined(law, known, tables):
                return text
    return ""


def undefined(law: Expression, values: Mapping[str, Any], tables: Mapping[str, Table]) -> str:
    """The part of a law that has no finite value though its arguments have, and these; nothing if there is none."""
    if law.function is not None or not law.names <= values.keys():
        return ""

    def value(node: Node) -> Any:
        try:
            with np.errstate(all="ignore"):
                return Expression(law.text, node).evaluate(values, tables)
        except (ModelError, ArithmeticError):
            return np.nan

    node = law.tree
    if np.isfinite(value(node)):
        return ""
    while True:
        read = node.args if node.kind != "where" else (node.args[0], node.args[1 if value(node.args[0]) else 2])
        part = next((arg for arg in read if not np.isfinite(value(arg))), None)
        if part is None:
            break
        node = part
    arguments = {written(x): value(x) for x in node.args if x.kind != "number"}
    for name in sorted({x.value for arg in node.args for x in arg.walk() if x.kind == "name"}):
        arguments.setdefault(name, values[name])
    shown = ", ".join(f"{brief(name, LONGEST)} = {x:.6g}" for name, x in arguments.items())
    at = f" for {shown}" if shown else ""
    return f"{brief(written(node), LONGEST)} is {value(node):g}{at}"
