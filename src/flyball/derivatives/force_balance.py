"""Force balance: magnitude and rounding error of every equation, and natural sizes of the controller states.

The rounding error is the spread of the residuals under random changes of the last digits (Vignes 1993). The natural
sizes make results independent of the units of controllers. A change of a state is large if the forces that it causes
are as large as the forces in the mechanism; a rate is large if large changes cause it (equilibration: van der Sluis
1969).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ..engine.kinematics import count_plain_coordinates, retract
from ..tables.table_definitions import with_numbers
from .equation_derivatives import EquationDerivatives, MechanismState

PERTURBED_SAMPLES = 4
PERTURBATION = 4.0 * np.finfo(float).eps  # relative perturbation of positions and multipliers
EXACT_BITS = 24  # numbers with at most so many significant bits are taken as exact
ROUNDING_MARGIN = 8.0  # differences below so many times the spread of the samples are rounding


def force_magnitudes(e: EquationDerivatives) -> np.ndarray:
    """Magnitude of the forces in every equation of motion: total force plus each reaction, (nv,)."""
    x, at = e.state, e.at
    G = e.by_velocity[at["n"]]
    M = e.by_acceleration[at["r"]]
    force = e.residual[at["r"]] - M @ x.vdot + G.T @ x.lam
    return np.abs(force) + abs(G).T @ np.abs(x.lam) + np.abs(x.effort)


def residual_rounding(e: EquationDerivatives) -> np.ndarray:
    """Rounding error of every equation of motion, and of the rates of the controller states, (nv + nz,).

    Constraints transmit rounding errors. Each equation of motion therefore gets the largest error, as energy, of its
    connected part of the mechanism.
    """
    z = np.abs(e.state.z[: e.nz])
    return _residual_rounding(e, z + state_sizes(e).change if e.nz else z)


def _residual_rounding(e: EquationDerivatives, states: np.ndarray) -> np.ndarray:
    """Like `residual_rounding`, for given magnitudes of the controller states."""
    size = e.state.c.sizes
    forces, rates = np.zeros(len(size)), PERTURBATION * np.abs(e.state_rates)
    for x in perturbed_states(e.state, states):
        other = EquationDerivatives(x)
        np.maximum(forces, np.abs(other.block("r") - e.block("r")), out=forces)
        np.maximum(rates, np.abs(other.state_rates - e.state_rates), out=rates)
    part = _connected_parts(e)
    most = np.zeros(len(size))
    np.maximum.at(most, part, size * np.maximum(forces, PERTURBATION * force_magnitudes(e)))
    return ROUNDING_MARGIN * np.r_[most[part] / size, rates]


def _connected_parts(e: EquationDerivatives) -> np.ndarray:
    """Number of the connected part of the mechanism that each velocity belongs to, (nv,).

    Two velocities are connected if a constraint can act on both, even if it does not in this position. An equation may
    contain only a multiplier that is itself rounding; the forces connected to it give its magnitude.
    """
    from scipy.sparse.csgraph import connected_components

    G, r = e.state.c.sparse_jacobian(), e.at["r"]
    G.data[:] = 1.0
    return connected_components(abs(e.by_position[r]) + abs(e.by_acceleration[r]) + G.T @ G, directed=False)[1]


def stiffness_rounding(e: EquationDerivatives) -> list:
    """Samples of the rounding error of the stiffness, sparse (nv, nv) each."""
    K = e.by_position[e.at["r"]]
    return [
        ROUNDING_MARGIN * (EquationDerivatives(other).by_position[e.at["r"]] - K)
        for other in perturbed_states(e.state, np.abs(e.state.z[: e.nz]))
    ]


def is_balanced(e: EquationDerivatives, part: float, states: bool = False) -> bool:
    """Whether the residual of every equation is below ``part`` of its forces plus rounding.

    ``states``: and whether the rates of the controller states are within rounding.
    """
    return is_balanced_beyond_rounding(e, part, states) or _is_below(e, part, states, residual_rounding(e))


def is_balanced_beyond_rounding(e: EquationDerivatives, part: float, states: bool = False) -> bool:
    """Like `is_balanced` without the rounding allowance, which is too large where a force jumps."""
    return _is_below(e, part, states, np.zeros(len(e.state.v) + e.nz))


def _is_below(e: EquationDerivatives, part: float, states: bool, rounding: np.ndarray) -> bool:
    nv = len(e.state.v)
    rates = np.abs(e.state_rates) if states else np.zeros(0)
    return bool(
        (np.abs(e.block("r")) <= part * force_magnitudes(e) + rounding[:nv]).all()
        and (rates <= rounding[nv:][: len(rates)]).all()
    )


def unbalanced_fraction(e: EquationDerivatives) -> float:
    """Largest residual relative to the forces of its equation; 0 where it is within rounding."""
    left, acts = np.abs(e.block("r")), force_magnitudes(e)
    return float(
        np.where(left > residual_rounding(e)[: len(left)], left / np.where(acts > 0.0, acts, 1.0), 0.0).max(initial=0.0)
    )


def perturbed_states(x: MechanismState, states: np.ndarray) -> Iterator[MechanismState]:
    """Yield copies of the state and the mechanism's values with random changes of the last digits.

    ``states`` (nz,) are the magnitudes of the controller states.
    """
    S = x.c.values.system
    size = x.c.sizes
    for b in range(len(S.tree.parent)):
        q0, v0, n = int(S.tree.q[b]), int(S.tree.v[b]), count_plain_coordinates(S, b)
        size[v0 : v0 + n] += np.abs(x.q[q0 : q0 + n])
    rng = np.random.default_rng(0)
    for _ in range(PERTURBED_SAMPLES):
        digits = partial(rng.uniform, -PERTURBATION, PERTURBATION)
        q = x.q.copy()
        retract(S, q, size * digits(size=len(size)))
        v, vdot, lam, effort = (a * (1.0 + digits(size=len(a))) for a in (x.v, x.vdot, x.lam, x.effort))
        rounded = with_numbers(S, lambda _, a: np.where(_is_exact(a), a, a * (1.0 + digits(size=a.shape))))  # noqa: B023
        z = x.z.copy()
        z[: len(states)] += states * digits(size=len(states))
        c = replace(x.c, values=replace(x.c.values, system=rounded))
        yield replace(x, c=c, q=q, v=v, z=z, vdot=vdot, lam=lam, effort=effort)


def _is_exact(a: np.ndarray) -> np.ndarray:
    """Which numbers have few significant bits, such as 0, 3 and 0.75: results of roundings have not."""
    leading = np.ldexp(np.frexp(a)[0], EXACT_BITS)
    return leading == np.rint(leading)


class StateSizes(NamedTuple):
    """Natural sizes of the controller states.

    Attributes
    ----------
    change, rate : ndarray (nz,)
        A large change of each state; a large rate, 0 if nothing determines it.
    energy : float [J]
        Energy scale of the mechanism.
    """

    change: np.ndarray
    rate: np.ndarray
    energy: float


def state_sizes(e: EquationDerivatives) -> StateSizes:
    """Natural sizes of the controller states, from the derivatives at a state; computed once."""
    if e.sizes is None:
        e.sizes = _computed_sizes(e)
    return e.sizes  # type: ignore[no-any-return]


def _computed_sizes(e: EquationDerivatives) -> StateSizes:
    size, r, s = e.state.c.sizes, e.at["r"], e.at["s"]
    K, M = e.by_position[r].tocsr(), e.by_acceleration[r].diagonal()
    among = abs(K).multiply(size).multiply(size[:, None])
    inertia = float((size**2 * M).max(initial=0.0))
    pace = float(e.state.c.work.options.rate)
    moved = (abs(e.by_position[s].toarray()) * size).max(axis=1, initial=0.0)  # rates by large steps of the mechanism
    between = np.abs(e.state_jacobian)
    decay = np.diag(between)
    usual = usual_states(np.abs(e.state.z[: e.nz]), moved, between, np.where(decay > 0.0, decay, pace or 1.0))
    energy = _energy_scale(e, float(among.max() if among.nnz else 0.0), usual) or inertia * pace**2 or 1.0
    forces = (np.abs(e.by_state[r]) * size[:, None]).max(axis=0, initial=0.0)  # per unit state
    change = np.where(forces > 0.0, energy / np.where(forces > 0.0, forces, 1.0), np.nan)
    change = _propagated_changes(change, moved, between)
    alone = np.abs(e.state.z[: e.nz]) + np.where(
        decay > 0.0, np.abs(e.state_rates) / np.where(decay > 0.0, decay, 1.0), 0.0
    )
    change = np.where(np.isnan(change) & (alone > 0.0), alone, change)  # value plus distance to rest
    change = _propagated_changes(change, moved, between)
    change = np.where(np.isnan(change), 1.0, change)
    return StateSizes(change, _large_rates(change, moved, between), energy)


def _propagated_changes(change: np.ndarray, moved: np.ndarray, between: np.ndarray) -> np.ndarray:
    """Large changes of states that act on states with known changes; NaN if they act on none."""
    for _ in range(len(change)):
        rate = _large_rates(change, moved, between)[:, None]
        most = np.where(rate > 0.0, between / np.where(rate > 0.0, rate, 1.0), 0.0).max(axis=0, initial=0.0)
        found = np.isnan(change) & (most > 0.0)
        if not found.any():
            break
        change[found] = 1.0 / most[found]
    return change


def usual_states(z: np.ndarray, moved: np.ndarray, between: np.ndarray, decay: np.ndarray) -> np.ndarray:
    """Magnitudes of the states, at least those to which large steps of the mechanism lead them, (nz,)."""
    followed = moved / decay
    for _ in range(len(z)):
        followed = np.where(followed > 0.0, followed, (between * followed).max(axis=1, initial=0.0) / decay)
    return z + followed


def _large_rates(change: np.ndarray, moved: np.ndarray, between: np.ndarray) -> np.ndarray:
    """Large rates caused by the mechanism and by states with known large changes, (nz,)."""
    by_states = between * np.where(np.isnan(change), 0.0, change)
    return np.maximum(moved, by_states.max(axis=1, initial=0.0))


def _energy_scale(e: EquationDerivatives, stiff: float, usual: np.ndarray) -> float:
    """Energy scale [J] of forces and stiffness ``stiff``; 0 if they are rounding, with states of a ``usual`` size."""
    acts, size = force_magnitudes(e), e.state.c.sizes
    loads = float((size * acts).max(initial=0.0))
    if loads > stiff:
        rounding = _residual_rounding(e, usual)[: len(size)]
        loads = float((size * np.where(acts > rounding, acts, 0.0)).max(initial=0.0))
    return max(loads, stiff)
