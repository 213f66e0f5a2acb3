"""What the freedoms of a mechanism rest on: counting, special dimensions, or a position that is singular.

Two experiments tell. The frames of all joints are shaken at random: what freedom is then lost rests on dimensions that
no workshop hits exactly (Bricard's mechanism; axes that are in line). And the mechanism is moved along its free motions
and closed again: where the rank is larger there, the position is singular and part of its freedom is for the moment
only.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...equations.tree import retract
from ...model.geometry import orientation_matrix
from ...results.freedoms import Geometry
from ...tables.system import Frames
from ..assembly.positions import closed_near
from ..assembly.start import Assembly
from ..compiled import Compiled, compiled
from .jacobian import Found, lengths, rank_of

if TYPE_CHECKING:
    from ...results.mobility import Mobility

SHAKEN = 0.03  # how far frames are shaken: part of the mechanism's length, and radians
STEP = 0.04  # how far the mechanism is moved: the same
TRIES = 6
MOVED = 0.2  # part of a step that must be left of it when the mechanism is closed again


def geometry(m: Mobility, there: Found) -> Geometry:
    """What the freedoms of a count rest on."""
    if m.freedoms == 0:
        return Geometry(0, 0, 0, m.gruebler)
    a = there.assembly
    positions = positions_nearby(a, there.velocities)
    c = a.compiled
    still = np.zeros(c.structure.nv)
    ranks = []
    for q in positions:
        c.at(a.t, q, still)
        ranks.append(rank_of(c))
    c.at(a.t, a.q, a.v)
    nearby = m.velocities - max(ranks) if ranks else (0 if m.redundancy else m.freedoms)
    generic = nearby if m.rows <= m.rank else min(nearby, m.velocities - _shaken_rank(a))
    return Geometry(m.freedoms, nearby, generic, m.gruebler, positions)


def positions_nearby(a: Assembly, motions: np.ndarray) -> list[np.ndarray]:
    """Closed positions a small step along free motions, as far as there are any."""
    c = a.compiled
    model = c.structure.model
    near = c
    if not all(r.holonomic for r in c.structure.rows):
        near = compiled(model, parameters=c.values.told, positions=True)
        near.follow(c.hints)
    scale = lengths(c)
    random = np.random.default_rng(1)
    k = motions.shape[1]
    mixes = [*np.eye(k)[: TRIES // 2], *random.normal(size=(TRIES - min(k, TRIES // 2), k))]
    out = []
    for mix in mixes:
        u = motions @ mix
        d = STEP * c.values.length * u / max(float(np.abs(u / scale).max(initial=0.0)), 1e-300)
        for step in (d, -d):
            start = a.q.copy()
            retract(c.values.system, start, step)
            q = closed_near(near, a.t, start)
            if q is not None and _way(c, q, a.q) > MOVED * _way(c, start, a.q):
                out.append(q)
                break
    return out


def _way(c: Compiled, q: np.ndarray, start: np.ndarray) -> float:
    """How far apart positions are [m], turns counted by the mechanism's length."""
    size = np.ones(len(q))
    shifts = 2 if c.structure.model.planar else 3
    tree = c.values.system.tree
    for q0, nq in zip(tree.q, tree.nq, strict=True):
        size[q0 + shifts : q0 + nq] = c.values.length
    return float(np.linalg.norm((q - start) * size))


def _shaken_rank(a: Assembly) -> int:
    """Rank where the frames of all joints are somewhere else, by a little and at random."""
    c = compiled(a.compiled.structure.model, parameters=a.compiled.values.told)
    s = c.structure
    S = c.values.system
    frames = Frames(S.frames.position.copy(), S.frames.rotation.copy())
    random = np.random.default_rng(2)
    for k in range(len(S.frame_body)):
        if s.frames[k].role == "world":
            continue
        shift, turn = SHAKEN * c.values.length * random.normal(size=3), SHAKEN * random.normal(size=3)
        if s.model.planar:
            shift[2] = turn[0] = turn[1] = 0.0
        frames.position[k] += shift
        frames.rotation[k] = (frames.rotation[k].reshape(3, 3) @ orientation_matrix(turn, "turn")).ravel()
    shaken = Compiled(replace(c.values, system=S._replace(frames=frames)), c.z)
    shaken.follow(a.compiled.hints)
    shaken.at(a.t, a.q, a.v)
    return rank_of(shaken)
