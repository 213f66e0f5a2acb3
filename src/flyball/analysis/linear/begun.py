"""How the assembled start of a mechanism changes with a parameter.

Where drivers leave no freedom the constraints tell it. Elsewhere the start is the described positions and velocities,
put on the constraints by steps of least size: so are their changes, which carry the parameter's complex step. Where
assembly had a longer way to go, its result is differenced.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...equations.tree import retract
from ...model.model import Model
from ...numerics.rank import TOLERANCE
from ..assemble import assemble
from ..assembly.described import described, deviation
from ..assembly.positions import inverse_weights, row_scales
from ..assembly.start import Assembly
from ..assembly.velocities import Wanted
from ..motion.driven import leaves_no_freedom
from ..motion.start import Start
from ..steps import tangent_rate, tangent_step
from .derivatives import State
from .differences import derivative
from .loads import STEP
from .tangent import Direction, Linear, Tangent, closed, nearest

ROUNDED = 1e-12  # difference of the start from what is described, of the mechanism's length or the largest velocity


def start_tangents(
    model: Model, parameters: Mapping[str, float], base: Assembly, x: State, directions: Sequence[Direction]
) -> list[Tangent]:
    """Changes of the start with each parameter, with accelerations and multipliers; see `start_changes`."""
    lin = Linear(x)
    pairs = start_changes(model, parameters, base, x, directions, lin)
    return [closed(d, x, lin, *pair) for d, pair in zip(directions, pairs, strict=True)]


def start_changes(
    model: Model,
    parameters: Mapping[str, float],
    base: Assembly,
    x: State,
    directions: Sequence[Direction],
    lin: Linear,
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Changes of positions and velocities of the start with each parameter.

    Parameters
    ----------
    model : Model
    parameters : mapping
        Values in place of the model's.
    base : Assembly
        The start.
    x : State
        The same with accelerations and multipliers.
    directions : sequence of Direction
        Parameters.
    lin : Linear
        The constraints there.
    """
    still = np.zeros(len(x.v))
    if held(base):
        return [nearest(d, x, lin, still, still) for d in directions]
    if as_described(model, base):
        return [nearest(d, x, lin, *_described(d, base, x)) for d in directions]

    def found(p: Mapping[str, float]) -> np.ndarray:
        b = assemble(model, t=base.t, parameters=p)
        return np.r_[tangent_step(base.compiled, base.q, b.q), b.v]

    return [nearest(d, x, lin, *np.split(derivative(model, parameters, d.name, found), 2)) for d in directions]


def held(base: Assembly) -> bool:
    """Whether drivers leave no freedom."""
    return leaves_no_freedom(Start(base, base, base.y, "", {}))


def as_described(model: Model, base: Assembly) -> bool:
    """Whether the start is what the description says, to rounding, or all that it leaves open follows from it."""
    drawn = base.compiled.values
    apart = np.abs(tangent_step(base.compiled, drawn.q, base.q) / base.compiled.sizes).max(initial=0.0)
    if apart > ROUNDED or model.initial:
        return False
    return bool(_none_added(base)) or (_wanted(base).determined and not any(d.given for d in base.departures))


def _none_added(base: Assembly) -> bool:
    """Whether velocities that are not described are zero."""
    sizes = base.compiled.sizes
    faster = np.abs((base.v - described(base.compiled.values, base.q)) / sizes).max(initial=0.0)
    return bool(faster <= ROUNDED * np.abs(base.v / sizes).max(initial=0.0))


def _wanted(base: Assembly) -> Wanted:
    c = base.compiled
    c.at(base.t, base.q, base.v)
    return Wanted.at(c, base.q, c.work.rows.nu.copy())


def _described(d: Direction, base: Assembly, x: State) -> tuple[np.ndarray, np.ndarray]:
    """Changes of the described positions and velocities, put on the constraints in the way of assembly."""
    c, at = base.compiled, d.e.at
    dq = tangent_rate(c, x.q, d.derivative(d.values.q))
    c.at(x.t, x.q, x.v)
    rows = row_scales(c)
    G = rows[:, None] * c.jacobian()
    which = np.array([r.holonomic for r in c.structure.rows], bool)
    size = np.sqrt(inverse_weights(c))
    left = (rows * d.along(x, dq, np.zeros(len(x.v)))[at["g"]])[which]
    if which.any():
        dq -= size * np.linalg.lstsq(G[which] * size, left, rcond=TOLERANCE)[0]
    q = x.q.astype(complex)
    retract(d.values.system, q, 1j * STEP * dq)
    dv = d.derivative(described(d.values, q)) if _none_added(base) else np.zeros(len(x.v))
    w = _wanted(base)
    if w.G.shape[0]:
        of_held = [d.derivative(deviation(d.values, g, q, x.v + 1j * STEP * dv)) for g in w.held]
        of_soft = [w.weights[g.name] @ d.derivative(deviation(d.values, g, q, x.v + 1j * STEP * dv)) for g in w.soft]
        missed = np.concatenate([d.along(x, dq, dv)[at["n"]], *of_held])
        dv += w.steps()(-missed, -np.concatenate([np.zeros(0), *of_soft]))
    return dq, dv
