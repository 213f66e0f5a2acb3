"""What inputs by name do to the equations of a mechanism at a state."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...tables.values import Values
from .derivatives import Equations, by_prescription
from .inputs import Input


def stepped(e: Equations, i: Input) -> Values:
    """Numbers of the mechanism, a complex step along an input."""
    return e.stepped_law(i.parameter) if i.parameter != i.name else e.stepped(i.name)


def effects(e: Equations, inputs: Sequence[Input]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Derivatives by the inputs of the equations of motion, of all constraints, and of these on velocities.

    (nv, inputs), then (rows and prescribed coordinates, inputs) twice.
    """
    by, g, n = [], [], []
    for i in inputs:
        values = stepped(e, i)
        by.append(e.by_values(values))
        told = by_prescription(e.state, values)
        g.append(told[0])
        n.append(told[1])
    W = np.array(by).reshape(len(inputs), e.width).T
    prescribed = len(e.state.c.structure.prescribed)
    given, rates = (np.array(part).reshape(len(inputs), prescribed).T for part in (g, n))
    return W[e.at["r"]], np.vstack([W[e.at["g"]], given]), np.vstack([W[e.at["n"]], rates])
