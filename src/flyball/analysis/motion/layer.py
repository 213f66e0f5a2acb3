"""Absolute or joint coordinates: which are used for a motion, and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from ...equations.engine import MOTION
from ...errors import AnalysisError, ModelError
from ...results.doubts import open_forces, open_loads
from ...tables.cost import cost, least
from ...tables.reads import read
from ...tables.spanning import spanning
from ...tables.specs import Structure
from ...tables.system import COUPLED, POINT
from ..assembly.start import Assembly
from ..compiled import Compiled, compiled
from ..mobility import mobility

COORDINATES = ("auto", "absolute", "joint")
THIN = 1e-7  # inertia of a coordinate, as part of that of the mechanism's mass at its length, that is none
SINGULAR = 1e-13  # least eigenvalue of the mass matrix with a unit diagonal: below it lie rounding errors
MOST = 8  # joints that are taken out of the forest, one after the other, before it is given up
UNSOLVED = 1e-9  # what the solve may leave of the equations at the start


def in_coordinates(a: Assembly, wish: str, parameters: Mapping[str, float] | None) -> tuple[Assembly, str]:
    """The assembled start in the coordinates to be used, and what they are and why.

    Parameters
    ----------
    a : Assembly
        In absolute coordinates.
    wish : str
        One of `COORDINATES`.
    parameters : mapping, optional
        As for assembly.

    Raises
    ------
    ModelError
        For an unknown wish.
    AnalysisError
        If friction or an event follows reactions that redundancy leaves undetermined, for joint coordinates: there a
        tree joint would carry all, here what redundant joints carry is chosen by the size of their rows.
    """
    known(wish)
    if wish == "absolute":
        return a, "absolute: as asked for"
    if why := _open_loads(a):
        if wish == "joint":
            raise AnalysisError(
                f"{a.compiled.structure.model.name!r} has no motion of its own in joint coordinates: {why}"
            )
        return a, f"absolute: {why}"
    here = _cost(a.compiled.structure)
    c, why = _forest(a, parameters, here if wish == "auto" else np.inf)
    if c is None:
        return a, f"absolute: {why}"
    if wish == "auto":
        there = _cost(c.structure)
        if here <= there:
            return a, f"absolute: {_counts(a.compiled)} cost less than {_counts(c)} in joint coordinates"
        why = f"{_counts(c)} cost less than {_counts(a.compiled)} in absolute coordinates"
    else:
        why = "as asked for"
    q, v = c.take(a.compiled, a.t, a.q, a.v)
    return replace(a, compiled=c, q=q, v=v), f"joint: {why}{_cuts(c)}"


def _cost(s: Structure) -> float:
    return s.kept.get("cost", None, 1, partial(cost, s))


def _open_loads(a: Assembly) -> str:
    """Why friction, or an event that names what a joint carries, needs absolute coordinates, if it does."""
    s = a.compiled.structure
    if not s.loads and not read(s.model):
        return ""
    m = mobility(s.model, a)
    found = [f.title for f, _ in open_loads(s.loads, m.undetermined)]
    found += [f"an event on {name!r}" for name, _ in open_forces(s.model, m.undetermined)]
    if not found:
        return ""
    titles = ", ".join(found)
    names = ", ".join(m.redundant[:8])
    return (
        f"{titles} follow{'s' if len(found) == 1 else ''} reactions that the constraints of {names} leave open; "
        f"what each carries is then a choice (the least for its size), which is made for rows"
    )


def known(wish: str) -> None:
    """Refuse unknown coordinates."""
    if wish not in COORDINATES:
        raise ModelError(f"unknown coordinates {wish!r}; choose one of {', '.join(COORDINATES)}")


def _counts(c: Compiled) -> str:
    return f"{c.structure.nv} velocities with {len(c.structure.rows)} rows"


def _cuts(c: Compiled) -> str:
    """Joints that close loops."""
    s = c.structure
    cut = [j.name for j in s.model.joints if j.name not in s.tree_joints]
    if not cut:
        return ""
    return f"; rows remain for {', '.join(cut[:8])}" + (f" and {len(cut) - 8} more" if len(cut) > 8 else "")


def _forest(a: Assembly, parameters: Mapping[str, float] | None, most: float = np.inf) -> tuple[Compiled | None, str]:
    """A forest that is sound where the mechanism starts and may cost less than ``most``; else none, and why."""
    model = a.compiled.structure.model
    avoided: list[str] = []
    for _ in range(MOST):
        tree = spanning(model, avoided)
        if not tree:
            what = " that has inertia along its coordinates" if avoided else ""
            return None, f"no joint{what} can be a tree joint"
        if model.kept.get("least", tree, MOST, partial(least, model, tree)) > most:
            return None, f"{_counts(a.compiled)} cost less than the mass matrix alone in joint coordinates"
        c = compiled(model, parameters=parameters, tree=tree)
        bad = _unsound(c, a)
        if bad is None:
            return c, ""
        if bad not in c.structure.tree_joints:
            return None, (
                f"{bad} has no inertia, or less than {THIN:g} of that of the whole mass at the mechanism's length, "
                f"and no joint that could be a tree joint"
            )
        avoided.append(bad)
    return None, f"along {', '.join(avoided)} hardly any inertia moves"


def _unsound(c: Compiled, a: Assembly) -> str | None:
    """A tree joint along whose coordinates hardly any inertia moves, or a body that hangs by none and has none.

    Each may move inertia alone and several together none, as a body without inertia that turns about its mass centre
    while its neighbour keeps its place. The factorisation then divides by rounding errors, or by zero.
    """
    s, S = c.structure, c.values.system
    if S.scales.semidefinite == 0.0 or S.sizes.solver != COUPLED or not s.nv:
        return None
    q, v = c.take(a.compiled, a.t, a.q, a.v)
    c.at(a.t, q, v, MOTION)
    names = [*s.tree_joints, *s.place]
    roots = [(b,) if b >= 0 and S.tree.joint[b] <= POINT else () for b in s.place.values()]
    of = np.full(s.nv, -1)
    for k, links in enumerate([*(t.links for t in s.tree_joints.values()), *roots]):
        for b in links:
            of[S.tree.v[b] : S.tree.v[b] + S.tree.nv[b]] = k
    row, column, _ = S.mass_entries
    own = of[row] == of[column]
    M: dict[int, dict[tuple[int, int], float]] = {}
    for i, j, x in zip(
        row[own].tolist(),
        column[own].tolist(),
        (c.work.M[own] * c.sizes[row[own]] * c.sizes[column[own]]).tolist(),
        strict=True,
    ):
        M.setdefault(int(of[i]), {})[i, j] = x
    size = S.bodies.mass.sum() * c.values.length**2
    for k in sorted(M):
        first = min(i for i, _ in M[k])
        block = np.zeros((max(i for i, _ in M[k]) - first + 1,) * 2)
        for (i, j), x in M[k].items():
            block[i - first, j - first] = block[j - first, i - first] = x
        if np.linalg.eigvalsh(block)[0] < THIN * size:
            return names[k]
    whole = np.zeros((s.nv, s.nv))
    whole[row, column] = whole[column, row] = c.work.M
    scale = 1.0 / np.sqrt(whole.diagonal())
    least, moves = np.linalg.eigh(scale[:, None] * whole * scale)
    return names[of[np.argmax(np.abs(moves[:, 0]))]] if least[0] < SINGULAR else None
