"""Steady motions to be found: a mechanism of which some coordinates turn evenly while all others stand still.

In joint coordinates nothing then changes but those angles: r(q, v, 0, lam) = 0 and g(q) = 0 with v zero but for the
speeds. Newton's method finds positions and speeds; a speed that no torque decides (a governor that turns freely) stays
as described.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...equations.tree import retract
from ...errors import ModelError, NotConverged
from ...model.joint import Joint
from ...model.words import listing, suggest
from ...tables.forest import step_of
from ...tables.names import velocity_names
from ...tables.specs import Structure
from ..assembly.positions import row_scales
from ..assembly.start import Assembly
from ..motion.layer import in_coordinates
from .balance import acting, settled, unbalanced
from .derivatives import Equations, State
from .free import prescribed

PASSES = 60
LONGEST = 0.2  # a step in radians, parts of the mechanism's length, or parts of a speed
SETTLED = 1e-9  # what is left of an equation of motion, of what acts in it
ARRIVED = 1e-7  # Newton's last step
LEAST = 1e-11  # singular values below this part of the largest are none


@dataclass
class Turning:
    """A steady motion: its state in joint coordinates, and the speeds by name [rad/s or m/s]."""

    state: State
    speeds: dict[str, float]
    unbalanced: float  # the largest force left, of those that act in its equation


def turning(a: Assembly, described: Assembly, names: Sequence[str], parameters: Mapping[str, float] | None) -> Turning:
    """Find the steady motion near an assembly in absolute coordinates, with the speeds of the described one at first.

    Raises
    ------
    ModelError
        If a name is no coordinate of a joint, or of one that closes a loop.
    NotConverged
        If there is none nearby.
    """
    names = [names] if isinstance(names, str) else list(names)
    b, _ = in_coordinates(a, "joint", parameters)
    at = [_place(b, name) for name in names]
    c, s = b.compiled, b.compiled.structure
    v = np.zeros(c.structure.nv)
    v[at] = in_coordinates(described, "joint", parameters)[0].v[at]
    start = State(c, b.t, b.q, v, c.z.copy(), 0.0 * v, np.zeros(len(c.structure.rows)), 0.0 * v)
    found, _ = _search(start, at, [])  # with the speeds as they are, if anything balances at these
    if found is None:
        found, start = _search(start, at, [d for d in at if s.tables["tree"].law[_body(s, d)] < 0])
    if found is None:
        raise _failure(start, names)
    x = found
    c.at(x.t, x.q, x.v)
    speeds = {name: float(x.v[d]) for name, d in zip(names, at, strict=True)}
    return Turning(State.moving(c, x.t, x.q, x.v), speeds, unbalanced(Equations(x)))


def _search(x: State, at: list[int], free: list[int]) -> tuple[State | None, State]:
    """Newton's method; None where it does not settle, and where it ended."""
    for _ in range(PASSES):
        x, size = _step(x, at, free)
        if size < ARRIVED and _settled(x):
            return x, x
    return None, x


def _settled(x: State) -> bool:
    """Whether positions, speeds and multipliers fulfil the equations with all accelerations zero."""
    e = Equations(x)
    return max(_gaps(e).max(initial=0.0), _misses(e).max(initial=0.0)) < SETTLED and settled(e, SETTLED)


def _gaps(e: Equations) -> np.ndarray:
    """How far rows are from closed: of the mechanism's length, or in radians."""
    return np.abs(row_scales(e.state.c) * e.block("g"))


def _misses(e: Equations) -> np.ndarray:
    """By how much rows miss their rates, as a part of the fastest velocity or prescribed rate."""
    x, scale = e.state, row_scales(e.state.c)
    asked = scale * (e.block("n") - e.by_velocity[e.at["n"]] @ x.v)
    fastest = np.abs(x.v / x.c.sizes).max(initial=0.0) + np.abs(asked).max(initial=0.0)
    return np.abs(scale * e.block("n")) / (fastest or 1.0)


def _place(b: Assembly, name: str) -> int:
    """The velocity of a joint's coordinate."""
    s = b.compiled.structure
    floating = {n.name: d for d, n in enumerate(velocity_names(s)) if n.unit == "m"}
    if name in floating:  # of a body that hangs on nothing: where a vehicle rolls along
        return floating[name]
    owner, _, what = name.partition(".")
    element = s.model.find(owner)
    if not isinstance(element, Joint) or what not in element.coordinates:
        known = [f"{j.name}.{c}" for j in s.model.joints for c in j.measured(s.model.planar)]
        hint = f"{suggest(str(name), known)}; {listing(known)}"
        raise ModelError(f"turning={name!r}: name a joint's coordinate, for instance 'A.angle'{hint}")
    row = step_of(s, owner, what)
    if row is None:
        raise ModelError(
            f"turning={name!r}: {element.title} closes a loop of the mechanism; name a coordinate along the way from "
            f"ground, one of {', '.join(n.name for n in velocity_names(s))}"
        )
    return int(s.tables["tree"].v[row])


def _step(x: State, at: list[int], free: list[int]) -> tuple[State, float]:
    """One step of Newton's method: (state, size of the step)."""
    c, s = x.c, x.c.structure
    given = prescribed(c)
    moving = np.array([d for d in range(s.nv) if d not in at and not given[:, d].any()], int)
    scale = c.sizes
    e = Equations(x)
    A, left, size = _equations(e, moving, np.array(free, int), given, scale)
    by_row = 1.0 / np.maximum(np.abs(A).max(axis=1, initial=0.0), 1e-300)
    by_column = 1.0 / np.maximum(np.abs(by_row[:, None] * A).max(axis=0, initial=0.0), 1e-300)
    step = by_column * np.linalg.lstsq(by_row[:, None] * A * by_column, -by_row * left, rcond=LEAST)[0]
    m, k, rows = len(moving), len(free), len(s.rows)
    longest = float(np.abs(step[: m + k]).max(initial=0.0))
    part = min(1.0, LONGEST / max(longest, 1e-300))
    way = np.zeros(s.nv)
    way[moving] = scale[moving] * step[:m] * part
    q, v = x.q.copy(), x.v.copy()
    retract(c.values.system, q, way)
    v[free] += (1.0 + np.abs(v[free])) * step[m : m + k] * part
    c.at(x.t, q, v)
    lam, effort = x.lam + size * step[m + k : m + k + rows], x.effort + given.T @ (size * step[m + k + rows :])
    return replace(x, q=q, v=v, z=c.z.copy(), lam=lam, effort=effort), longest


def _equations(
    e: Equations, moving: np.ndarray, free: np.ndarray, given: np.ndarray, scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Scaled linear equations for changes of positions, speeds, multipliers and efforts: (A, right side, energy)."""
    x, s = e.state, e.state.c.structure
    length = x.c.values.length
    r, n = e.at["r"], e.at["n"]
    K, V = e.by_position[r].toarray(), e.by_position[n].toarray()
    D, G = e.by_velocity[r].toarray(), e.by_velocity[n].toarray()
    which = np.array([row.holonomic for row in s.rows], bool)
    size = np.abs(K * np.outer(scale, scale)).max(initial=1e-300) + np.abs(scale * e.block("r")).max(initial=0.0)
    by_place, by_speed = scale[moving], 1.0 + np.abs(x.v[free])
    width = len(moving) + len(free)
    A = np.zeros((s.nv + which.sum() + len(s.rows), width + len(s.rows) + len(given)))
    forces, gaps, rates = np.split(A, [s.nv, s.nv + which.sum()])
    forces[:, :width] = scale[:, None] * np.hstack([K[:, moving] * by_place, D[:, free] * by_speed]) / size
    forces[:, width:] = -scale[:, None] * np.vstack([G, given]).T
    if s.loads:
        forces[:, width : width + len(s.rows)] += scale[:, None] * e.by_reactions
    gaps[:, : len(moving)] = G[which][:, moving] * by_place / length
    rates[:, :width] = np.hstack([V[:, moving] * by_place, G[:, free] * by_speed])
    return A, np.r_[scale * e.block("r") / size, e.block("g")[which] / length, e.block("n")], float(size)


def _body(s: Structure, d: int) -> int:
    """The row of the body table that a velocity belongs to."""
    return int(np.searchsorted(s.tables["tree"].v, d, side="right")) - 1


def _failure(x: State, names: list[str]) -> NotConverged:
    """The error for a search that did not settle: what is left of forces, or which constraints are not fulfilled."""
    s, e = x.c.structure, Equations(x)
    left, known = e.block("r"), velocity_names(s)
    who = ", ".join(names)
    begin = f"no steady motion of {s.model.name!r} was found in which {who} turn evenly and all else stands still"
    residuals = {n.name: float(-value) for n, value in zip(known, left, strict=True)}
    gaps, misses = _gaps(e), _misses(e)
    if max(gaps.max(initial=0.0), misses.max(initial=0.0)) > SETTLED:
        worse, unit = (
            (misses, "of its rate") if misses.max() > gaps.max() else (gaps, "of the mechanism's length, or rad")
        )
        k = int(np.argmax(worse))
        others = ", ".join(n.name for n in known)
        return NotConverged(
            f"{begin}: {s.rows[k].element.title} is not fulfilled ({worse[k]:.3g} {unit}). Something else has to move "
            f"with it: where a wheel rolls, name the coordinate that it rolls along, too (one of {others}), and its "
            f"speed by Initial or velocity=; or give a better guess of positions and speeds",
            residuals,
        )
    acts = acting(e)
    part = np.abs(left) / np.where(acts > 0.0, acts, np.inf)
    d = int(np.argmax(part))
    return NotConverged(
        f"{begin}: {-left[d]:.3g} remain along {known[d].name}, {part[d]:.2g} of what acts there. Give a better guess "
        f"of positions and speeds",
        residuals,
    )
