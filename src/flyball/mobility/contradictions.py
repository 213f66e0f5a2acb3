"""Why constraints and prescribed rates contradict one another: the elements, and the rank condition."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import CompiledMechanism, compile_mechanism
from ..model.body import Driver, Initial
from ..model.joint import Joint
from ..numerics.rank import RANK_TOLERANCE, fundamental_subspaces, null_space
from ..numerics.rank import rank as rank_of
from .mobility import free_motions, nearby_positions
from .null_spaces import MAX_DOUBTFUL_SVD_SIZE, scaled_jacobian

LEAST_SHARE = 1e-6  # relative share in a contradiction below which an element does not take part
LEAST_MOTION = 1e-6  # rate of a coordinate in a free motion, relative to its gradient, that counts as zero
PARALLEL_TOLERANCE = 1e-6  # largest angle between parallel axes [rad]
MAX_NAMED = 8


@dataclass(frozen=True)
class ContradictionCase:
    """Contradictory constraints G x = right at a state."""

    c: CompiledMechanism
    t: float
    q: np.ndarray
    v: np.ndarray
    right: np.ndarray
    per_time: str  # unit of x per unit of coordinate: "/s" or "/s^2"

    def rows(self, names: list[str]) -> np.ndarray:
        """Return which rows belong to the elements."""
        out = np.zeros(len(self.right), bool)
        for name in names:
            out[self.c.structure.slices[name]] = True
        return out

    def unit(self, name: str) -> str:
        """Return the unit of the rate of an element's first row."""
        return ("m" if self.c.metric[self.c.structure.slices[name].start] else "rad") + self.per_time


def explain_contradiction(
    c: CompiledMechanism, t: float, q: np.ndarray, v: np.ndarray, right: np.ndarray, per: str = "/s"
) -> str:
    """Explain why G x = right has no solution at a state, and what to do; "" where that is not known.

    Parameters
    ----------
    c : CompiledMechanism
        In absolute coordinates; it may have rows of initial rates.
    t, q, v
        The state.
    right : ndarray (nr,)
        Right-hand sides of the rows.
    per : str
        ``"/s"`` for velocities, ``"/s^2"`` for accelerations.
    """
    case = ContradictionCase(c, t, q, v, right, per)
    c.at(t, q, v)
    G, size, _ = scaled_jacobian(c)
    if max(G.shape) > MAX_DOUBTFUL_SVD_SIZE:  # singular values would take minutes
        return ""
    Y = fundamental_subspaces(G.toarray()).dependencies
    over = Y @ (Y.T @ (right / np.maximum(size, 1e-300)))
    s = c.structure
    shares = {k: float(np.abs(over[rows]).max(initial=0.0)) for k, rows in s.slices.items()}
    names = [k for k, x in shares.items() if x > LEAST_SHARE * max(shares.values()) > 0.0]
    asking = [k for k in names if _prescribes(s, k)]
    if not asking:
        return ""
    if len(asking) > 1:
        return _several_prescribe(case, asking, names)
    others = ~case.rows([k for k in s.slices if _prescribes(s, k)])
    free = null_space(G.toarray()[others])
    if not free.shape[1]:
        return _nothing_free(case, asking[0], [k for k in names if k not in asking], int(others.sum()), G[others])
    return _coordinate_not_moved(case, asking[0], [k for k in names if k not in asking])


def _prescribes(s: Any, name: str) -> bool:
    return any(isinstance(r.element, (Driver, Initial)) for r in s.rows[s.slices[name]])


def _prescriber_title(case: ContradictionCase, name: str) -> str:
    e = case.c.structure.rows[case.c.structure.slices[name].start].element
    return f"driver {name!r}" if isinstance(e, Driver) else f"the initial rate of {name!r}"


def _prescribed_coordinate(case: ContradictionCase, name: str) -> str:
    e: Any = case.c.structure.rows[case.c.structure.slices[name].start].element
    return e.coordinate if isinstance(e, Driver) else name


def _several_prescribe(case: ContradictionCase, prescribing: list[str], names: list[str]) -> str:
    """Explain that several elements prescribe the same freedom, with the prescribed and the resulting rates."""
    G = case.c.jacobian()
    said = []
    for name in prescribing[:MAX_NAMED]:
        own = case.rows([name])
        x = np.linalg.lstsq(G[~own], case.right[~own], rcond=RANK_TOLERANCE)[0]
        made, asked = float((G[own] @ x)[0]), float(case.right[own][0])
        said.append(f"{name} prescribes {asked:.6g} {case.unit(name)} where the other constraints give {made:.6g}")
    through = [k for k in names if k not in prescribing]
    by = f" through {', '.join(through[:MAX_NAMED])}" if through else ""
    who = " and ".join(_prescriber_title(case, name) for name in prescribing[:MAX_NAMED])
    return f"{who} move the same freedom{by} and disagree: {'; '.join(said)}. Leave out one, or make their laws agree"


def _nothing_free(case: ContradictionCase, name: str, holding: list[str], rows: int, G: Any) -> str:
    """Explain that the other constraints leave no freedom: it is a structure, or needs special dimensions."""
    counted = case.c.structure.nv - rows
    names = ", ".join(holding[:MAX_NAMED])
    begin = f"{_prescriber_title(case, name)} has nothing to move: the constraints of {names} leave no freedom"
    if counted >= 0 or case.c.structure.model.planar or rank_of(G.toarray()) == rows:
        return (
            f"{begin}, and counting joints leaves {counted}: it is a structure. Replace a joint by one with fewer "
            "constraints, add a body between two of them, or leave the driver out"
        )
    return (
        f"{begin}. Counting leaves {counted}, so that it moves only with special geometry of its joints: axes that "
        f"are parallel or meet in one point; {_nonparallel_axes(case, holding)}"
    )


def _nonparallel_axes(case: ContradictionCase, holding: list[str]) -> str:
    """Name the axes that are not parallel to most others."""
    s = case.c.structure
    axes = {}
    for name in holding:
        e = s.model[name]
        if isinstance(e, Joint) and e.needs_axis:
            k = s.frame_at.get((name, "F", ""))
            if k is not None:
                axes[name] = case.c.work.frames.rotation[k].reshape(3, 3)[:, 2].copy()
    best: list[str] = []
    for axis in axes.values():
        same = [k for k, a in axes.items() if np.linalg.norm(np.cross(a, axis)) < PARALLEL_TOLERANCE]
        best = same if len(same) > len(best) else best
    odd = [k for k in axes if k not in best]
    if len(best) < 2 or not odd:
        return "look at their axes and points, or replace a joint by one with fewer constraints, such as Spherical"
    lead = axes[best[0]]
    angles = {k: np.degrees(np.arctan2(np.linalg.norm(np.cross(axes[k], lead)), abs(axes[k] @ lead))) for k in odd}
    said = ", ".join(f"that of {k} is {x:.3g} deg off" for k, x in list(angles.items())[:MAX_NAMED])
    others = ", ".join(best[:MAX_NAMED])
    return f"the axes of {others} are parallel, {said}. Correct it, or replace a joint by one with fewer constraints"


def _coordinate_not_moved(case: ContradictionCase, name: str, holding: list[str]) -> str:
    """Explain that the free motion does not move the prescribed coordinate, in this position or in any."""
    c = case.c
    loose = c.structure.model.copy()
    loose.drivers, loose.initial = [], []
    own = compile_mechanism(loose, parameters=c.values.parameter_values)
    own.follow(c.hints)
    a = Assembly(own, case.t, case.q, case.v)
    own.at(case.t, case.q, case.v)
    G, _, scale = scaled_jacobian(own)
    motions = null_space(G.toarray()) * scale[:, None]
    free = ", ".join(m.name for m in free_motions(a, motions)[:MAX_NAMED])
    coordinate = _prescribed_coordinate(case, name)
    near = [q for q in nearby_positions(a, motions) if _coordinate_moves_at(case, name, q)]
    c.at(case.t, case.q, case.v)
    if not near:
        return (
            f"{_prescriber_title(case, name)} prescribes a motion of {coordinate!r}, which no freedom changes, here "
            f"or nearby; free is {free}. Drive that, or leave it out"
        )
    return (
        f"{_prescriber_title(case, name)} prescribes a motion of {coordinate!r} at a dead centre: in this position "
        f"{free} does not change it, at neighbouring positions it does (constraints of "
        f"{', '.join(holding[:MAX_NAMED])}). Start a little away from it, or prescribe a motion of {free}"
    )


def _coordinate_moves_at(case: ContradictionCase, name: str, q: np.ndarray) -> bool:
    """Return whether the motion left free by the others moves the prescribed coordinate at another position."""
    c = case.c
    c.at(case.t, q, case.v)
    G = scaled_jacobian(c)[0].toarray()
    others = ~case.rows([k for k in c.structure.slices if _prescribes(c.structure, k)])
    return bool(np.abs(G[case.rows([name])] @ null_space(G[others])).max(initial=0.0) > LEAST_MOTION)
