"""The free motions of a mechanism by name: what moves in each of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...model.body import Body, Initial
from ...model.joint import Joint
from ...results.freedoms import FreeMotion
from ...tables.system import POINT
from ..assembly.start import Assembly
from ..compiled import Compiled, compiled
from .jacobian import lengths
from .supports import irreducible

STILL = 1e-7  # part of a motion's largest velocity below which something stands still
CLEAR = 1e-2  # part of it that a coordinate must have to name the motion


def free_motions(a: Assembly, motions: np.ndarray) -> tuple[FreeMotion, ...]:
    """A basis of the free motions in which each moves as few bodies as can be, named by what moves.

    Parameters
    ----------
    a : Assembly
        In absolute coordinates.
    motions : ndarray (nv, f)
        Any basis.
    """
    if not motions.shape[1]:
        return ()
    c = a.compiled
    place = {name: b for name, b in c.structure.place.items() if b >= 0}
    tree = c.values.system.tree
    groups = [np.arange(tree.v[b], tree.v[b] + tree.nv[b]) for b in place.values()]
    scale = lengths(c)[:, None]
    names, gradients = _coordinates(a)
    out: list[FreeMotion] = []
    for bodies, basis in sorted(irreducible(motions / scale, groups), key=lambda s: len(s[0])):
        moving = [list(place)[b] for b in bodies]
        used = {m.coordinate for m in out}
        free = [k for k, name in enumerate(names) if name not in used]
        out += _named(a, basis * scale, moving, [names[k] for k in free], gradients[free])
    return tuple(out)


def _coordinates(a: Assembly) -> tuple[list[str], Any]:
    """Coordinates that may name a motion, those next to ground first, then bodies' own; and their sparse gradients."""
    own = a.compiled
    model = own.structure.model
    depth = _depths(model)
    joints = sorted(model.joints, key=lambda j: _depth(depth, model, j))
    names = [f"{j.name}.{what}" for j in joints for what in j.measured(model.planar)]
    axes = ("angle", "x", "y") if model.planar else ("x", "y", "z")
    names += [f"{b.name}.{what}" for b in model.bodies for what in axes]
    measuring = model.copy()
    measuring.initial = [Initial(name=name, value=0.0) for name in names]
    held = dict.fromkeys(names, 0.0)
    probe = compiled(measuring, parameters=own.values.told, holds=measuring.initial, held=held)
    probe.follow(own.hints)
    probe.at(a.t, a.q, a.v)
    G = probe.sparse_jacobian()
    return names, G[[probe.structure.slices[name].start for name in names]]


def _depths(model: Any) -> dict[str, int]:
    """How many joints a body is away from ground."""
    depth = {"ground": 0}
    links = [tuple(model.carrier(n, j) for n in (j.body_i, j.body_j)) for j in model.joints]
    grown = True
    while grown:
        grown = False
        for i, j in links:
            for one, other in ((i, j), (j, i)):
                if one in depth and depth.get(other, 1 << 30) > depth[one] + 1:
                    depth[other], grown = depth[one] + 1, True
    return depth


def _depth(depth: dict[str, int], model: Any, j: Joint) -> int:
    return min(depth.get(model.carrier(n, j), 1 << 30) for n in (j.body_i, j.body_j))


def _named(a: Assembly, basis: np.ndarray, bodies: list[str], names: list[str], D: Any) -> list[FreeMotion]:
    """Motions that the same bodies share, told apart by coordinates of joints, then by how the bodies turn and move.

    Each coordinate chosen has the rate 1 in its own motion and 0 in the others.
    """
    c = a.compiled
    s = c.structure
    size = lengths(c)
    joints = {j.name for j in s.model.joints}
    moving = set(bodies)
    first = [k for k, name in enumerate(names) if name.partition(".")[0] in joints]
    later = [k for k, name in enumerate(names) if name.partition(".")[0] in moving]
    turns = np.zeros((0, s.nv)) if s.model.planar else np.vstack([_spin(c, s.place[b]) for b in bodies])
    labels = [names[k] for k in first] + [""] * len(turns) + [names[k] for k in later]
    rates = np.vstack([D[first] @ basis, turns @ basis, D[later] @ basis])
    full = np.concatenate([abs(D[first]) @ size, np.abs(turns) @ size, abs(D[later]) @ size])
    left, chosen = np.eye(basis.shape[1]), []  # coefficients of what is not named yet
    for k, row in enumerate(rates):
        if not left.shape[1]:
            break
        rate = row @ left
        j = int(np.argmax(np.abs(rate)))
        if not np.abs(rate[j]) > 0.0:
            continue
        largest = np.abs((basis @ left[:, j]) / size).max()
        if np.abs(rate[j]) > CLEAR * largest * max(full[k], 1e-300):
            chosen.append(k)
            left = np.delete(left, j, axis=1) - np.outer(left[:, j] / rate[j], np.delete(rate, j))
            left = left / np.maximum(np.sqrt((left**2).sum(axis=0)), 1e-300)
    tidy = basis @ np.linalg.inv(rates[chosen])
    return [_motion(a, tidy[:, i], labels[k]) for i, k in enumerate(chosen)]


def _spin(c: Compiled, b: int) -> np.ndarray:
    """Rows that give the angular velocity of a spatial body in world axes."""
    out = np.zeros((3, c.structure.nv))
    v0 = int(c.values.system.tree.v[b])
    if c.values.system.tree.joint[b] == POINT:
        return out
    out[:, v0 + 3 : v0 + 6] = c.work.BK[b, 3:12].reshape(3, 3)
    return out


def _motion(a: Assembly, velocity: np.ndarray, coordinate: str) -> FreeMotion:
    c = a.compiled
    s = c.structure
    tree = c.values.system.tree
    speed = np.abs(velocity / lengths(c))
    fast = {
        name: float(speed[tree.v[b] : tree.v[b] + tree.nv[b]].max())
        for name, b in s.place.items()
        if b >= 0 and isinstance(s.model[name], Body)
    }
    largest = max(fast.values())
    moving = tuple(name for name, x in fast.items() if x > STILL * largest)
    if coordinate:
        return FreeMotion(coordinate, coordinate, moving, velocity)
    name = max((n for n in moving if n not in s.points), key=fast.__getitem__)
    b = s.place[name]
    own = velocity[tree.v[b] : tree.v[b] + tree.nv[b]]
    others = f"; {', '.join(n for n in moving if n != name)} with it" if len(moving) > 1 else ""
    return FreeMotion(f"{name} {_turning(a, name, own)}{others}", "", moving, velocity)


def _turning(a: Assembly, name: str, u: np.ndarray) -> str:
    """How a spatial body turns: about its own axis, where its mass centre and all its joints lie on that."""
    c = a.compiled
    b = c.structure.place[name]
    p, R = c.work.BK[b, :3], c.work.BK[b, 3:12].reshape(3, 3)
    w, v = R @ u[3:], u[:3]
    axis = w / np.linalg.norm(w)
    at = p + np.cross(w, v) / (w @ w)
    S = c.values.system
    joints = {j.name for j in c.structure.model.joints}
    frames = {k for t in c.structure.terms if t.element.name in joints for k in (t.F, t.M)}
    points = [p, *(c.work.FK[k, :3] for k in sorted(frames) if S.frame_body[k] == b)]
    near = 1e-6 * c.values.length
    through = all(np.linalg.norm(np.cross(x - at, axis)) < near for x in points)
    direction = ", ".join(f"{x + 0.0:.3g}" for x in np.where(np.abs(axis) < 1e-9, 0.0, axis))
    if through and max(np.linalg.norm(x - p) for x in points) > near:
        return f"spins about its own axis ({direction})"
    if abs(w @ v) > 1e-9 * (w @ w) * c.values.length:
        return f"turns about ({direction}) and moves along it"
    where = ", ".join(f"{x + 0.0:.4g}" for x in np.where(np.abs(at) < near, 0.0, at))
    return f"turns about ({direction}) through ({where}) m"
