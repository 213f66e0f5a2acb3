"""Degrees of freedom and redundancy: Gruebler's count, the rank, free motions and redundant sets by name.

The counts are computed at once, since every motion starts with them. The rest is computed on access: the sets of
dependent constraints with their remedies (``sets``), the free motions by name (``motions``), and what the mobility
depends on (``geometry``): counting, special dimensions, or a singular position. Two numerical experiments decide the
last. The frames of all joints are perturbed at random; a freedom that is lost then depends on exact dimensions. The
mechanism is moved along its free motions and closed again; where the rank is larger there, the position is singular.

Where constraints and prescribed rates contradict one another, the elements are named, with the rank condition.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..assembly.assembled_state import Assembly, consistent_state
from ..assembly.compiled_mechanism import CompiledMechanism, compile_mechanism
from ..assembly.positions_and_velocities import closed_position_near
from ..engine.kinematics import retract
from ..errors import AssemblyError, ModelError
from ..model.body import Body, Driver, Initial
from ..model.geometry import orientation_matrix
from ..model.joint import Joint
from ..model.model import Model
from ..model.names import curve_parts
from ..model.unsupported_elements import ignored_elements
from ..numerics.rank import (
    MAX_DOUBTFUL_SVD_SIZE,
    RANK_TOLERANCE,
    fundamental_subspaces,
    null_space,
    null_spaces,
    rank,
    sparse_null_space,
)
from ..results.mobility import FreedomGeometry, FreeMotion, Mobility, RedundantSet
from ..tables.forest import point_mass_obstacles
from ..tables.table_definitions import POINT, Frames
from .null_spaces import (
    ConstraintNullSpaces,
    is_small,
    jacobian_rank,
    minimal_subspaces,
    scaled_jacobian,
    undetermined_components,
    velocity_scales,
)
from .remedies import find_remedies

NEGLIGIBLE_SPEED = 1e-7  # relative velocity in a motion below which a body is at rest
NAMING_THRESHOLD = 1e-2  # least relative rate of a coordinate by which a motion is named


def free_motions(a: Assembly, motions: np.ndarray) -> tuple[FreeMotion, ...]:
    """Return a basis of the free motions in which each moves as few bodies as possible, named by what moves.

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
    scale = velocity_scales(c)[:, None]
    names, gradients = _candidate_coordinates(a)
    out: list[FreeMotion] = []
    for bodies, basis in sorted(minimal_subspaces(motions / scale, groups), key=lambda s: len(s[0])):
        moving = [list(place)[b] for b in bodies]
        used = {m.coordinate for m in out}
        free = [k for k, name in enumerate(names) if name not in used]
        out += _named_motions(a, basis * scale, moving, [names[k] for k in free], gradients[free])
    return tuple(out)


def _candidate_coordinates(a: Assembly) -> tuple[list[str], Any]:
    """Return the coordinates by which motions may be named (nearest to ground first, then of bodies), and their
    gradients.
    """
    own = a.compiled
    model = own.structure.model
    depth = _joint_distances(model)
    joints = sorted(model.joints, key=lambda j: _joint_distance(depth, model, j))
    names = [f"{j.name}.{what}" for j in joints for what in j.independent(model.planar)]
    axes = ("angle", "x", "y") if model.planar else ("x", "y", "z")
    names += [f"{b.name}.{what}" for b in model.bodies for what in axes]
    measuring = model.copy()
    measuring.initial = [Initial(name=name, value=0.0) for name in names]
    held = dict.fromkeys(names, 0.0)
    probe = compile_mechanism(measuring, parameters=own.values.parameter_values, holds=measuring.initial, held=held)
    probe.follow(own.hints)
    probe.at(a.t, a.q, a.v)
    G = probe.sparse_jacobian()
    return names, G[[probe.structure.slices[name].start for name in names]]


def _joint_distances(model: Any) -> dict[str, int]:
    """Return the number of joints between each body and ground."""
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


def _joint_distance(depth: dict[str, int], model: Any, j: Joint) -> int:
    return min(depth.get(model.carrier(n, j), 1 << 30) for n in (j.body_i, j.body_j))


def _named_motions(a: Assembly, basis: np.ndarray, bodies: list[str], names: list[str], D: Any) -> list[FreeMotion]:
    """Return motions of the same bodies, distinguished by joint coordinates, then by rotation and translation of
    bodies.

    Each chosen coordinate has the rate 1 in its own motion and 0 in the others.
    """
    c = a.compiled
    s = c.structure
    size = velocity_scales(c)
    joints = {j.name for j in s.model.joints}
    moving = set(bodies)
    first = [k for k, name in enumerate(names) if curve_parts(name)[0] in joints]
    later = [k for k, name in enumerate(names) if curve_parts(name)[0] in moving]
    turns = (
        np.zeros((0, s.nv)) if s.model.planar else np.vstack([_angular_velocity_rows(c, s.place[b]) for b in bodies])
    )
    labels = [names[k] for k in first] + [""] * len(turns) + [names[k] for k in later]
    rates = np.vstack([D[first] @ basis, turns @ basis, D[later] @ basis])
    full = np.concatenate([abs(D[first]) @ size, np.abs(turns) @ size, abs(D[later]) @ size])
    left, chosen = np.eye(basis.shape[1]), []  # coefficients of the motions not named yet
    for k, row in enumerate(rates):
        if not left.shape[1]:
            break
        rate = row @ left
        j = int(np.argmax(np.abs(rate)))
        if not np.abs(rate[j]) > 0.0:
            continue
        largest = np.abs((basis @ left[:, j]) / size).max()
        if np.abs(rate[j]) > NAMING_THRESHOLD * largest * max(full[k], 1e-300):
            chosen.append(k)
            left = np.delete(left, j, axis=1) - np.outer(left[:, j] / rate[j], np.delete(rate, j))
            left = left / np.maximum(np.sqrt((left**2).sum(axis=0)), 1e-300)
    tidy = basis @ np.linalg.inv(rates[chosen])
    return [_free_motion(a, tidy[:, i], labels[k]) for i, k in enumerate(chosen)]


def _angular_velocity_rows(c: CompiledMechanism, b: int) -> np.ndarray:
    """Return rows that give the angular velocity of a spatial body in world axes."""
    out = np.zeros((3, c.structure.nv))
    v0 = int(c.values.system.tree.v[b])
    if c.values.system.tree.joint[b] == POINT:
        return out
    out[:, v0 + 3 : v0 + 6] = c.work.bodies.rotation[b].reshape(3, 3)
    return out


def _free_motion(a: Assembly, velocity: np.ndarray, coordinate: str) -> FreeMotion:
    c = a.compiled
    s = c.structure
    tree = c.values.system.tree
    speed = np.abs(velocity / velocity_scales(c))
    fast = {
        name: float(speed[tree.v[b] : tree.v[b] + tree.nv[b]].max())
        for name, b in s.place.items()
        if b >= 0 and isinstance(s.model[name], Body)
    }
    largest = max(fast.values())
    moving = tuple(name for name, x in fast.items() if x > NEGLIGIBLE_SPEED * largest)
    if coordinate:
        return FreeMotion(coordinate, coordinate, moving, velocity)
    name = max((n for n in moving if n not in s.points), key=fast.__getitem__)
    b = s.place[name]
    own = velocity[tree.v[b] : tree.v[b] + tree.nv[b]]
    others = f"; {', '.join(n for n in moving if n != name)} with it" if len(moving) > 1 else ""
    return FreeMotion(f"{name} {_rotation_text(a, name, own)}{others}", "", moving, velocity)


def _rotation_text(a: Assembly, name: str, u: np.ndarray) -> str:
    """Describe the rotation of a spatial body; "about its own axis" if its mass centre and all its joints lie on the
    axis.
    """
    c = a.compiled
    b = c.structure.place[name]
    p, R = c.work.bodies.position[b], c.work.bodies.rotation[b].reshape(3, 3)
    w, v = R @ u[3:], u[:3]
    axis = w / np.linalg.norm(w)
    at = p + np.cross(w, v) / (w @ w)
    S = c.values.system
    joints = {j.name for j in c.structure.model.joints}
    frames = {k for t in c.structure.terms if t.element.name in joints for k in (t.F, t.M)}
    points = [p, *(c.work.frames.position[k] for k in sorted(frames) if S.frame_body[k] == b)]
    near = 1e-6 * c.values.length
    through = all(np.linalg.norm(np.cross(x - at, axis)) < near for x in points)
    direction = ", ".join(f"{x + 0.0:.3g}" for x in np.where(np.abs(axis) < 1e-9, 0.0, axis))
    if through and max(np.linalg.norm(x - p) for x in points) > near:
        return f"spins about its own axis ({direction})"
    if abs(w @ v) > 1e-9 * (w @ w) * c.values.length:
        return f"turns about ({direction}) and moves along it"
    where = ", ".join(f"{x + 0.0:.4g}" for x in np.where(np.abs(at) < near, 0.0, at))
    return f"turns about ({direction}) through ({where}) m"


PERTURBATION = 0.03  # perturbation of frames, relative to the mechanism's length, and [rad]
MOTION_STEP = 0.04  # displacement of the mechanism along free motions, in the same units
MOTION_TRIALS = 6
LEAST_DISPLACEMENT = 0.2  # part of a step that must remain after the mechanism is closed again


def mobility_geometry(m: Mobility, spaces: ConstraintNullSpaces) -> FreedomGeometry:
    """Return what the freedoms of a count depend on."""
    if m.freedoms == 0:
        return FreedomGeometry(0, 0, 0, m.gruebler)
    a = spaces.assembly
    positions = nearby_positions(a, spaces.velocities)
    c = a.compiled
    still = np.zeros(c.structure.nv)
    ranks = []
    for q in positions:
        c.at(a.t, q, still)
        ranks.append(jacobian_rank(c))
    c.at(a.t, a.q, a.v)
    nearby = m.velocities - max(ranks) if ranks else (0 if m.redundancy else m.freedoms)
    generic = nearby if m.rows <= m.rank else min(nearby, m.velocities - _perturbed_rank(a))
    return FreedomGeometry(m.freedoms, nearby, generic, m.gruebler, positions)


def nearby_positions(a: Assembly, motions: np.ndarray) -> list[np.ndarray]:
    """Return closed positions a small step along free motions, as far as they exist."""
    c = a.compiled
    model = c.structure.model
    near = c
    if not all(r.holonomic for r in c.structure.rows):
        near = compile_mechanism(model, parameters=c.values.parameter_values, positions=True)
        near.follow(c.hints)
    scale = velocity_scales(c)
    random = np.random.default_rng(1)
    k = motions.shape[1]
    mixes = [*np.eye(k)[: MOTION_TRIALS // 2], *random.normal(size=(MOTION_TRIALS - min(k, MOTION_TRIALS // 2), k))]
    out = []
    for mix in mixes:
        u = motions @ mix
        d = MOTION_STEP * c.values.length * u / max(float(np.abs(u / scale).max(initial=0.0)), 1e-300)
        for step in (d, -d):
            start = a.q.copy()
            retract(c.values.system, start, step)
            q = closed_position_near(near, a.t, start)
            if q is not None and _position_distance(c, q, a.q) > LEAST_DISPLACEMENT * _position_distance(c, start, a.q):
                out.append(q)
                break
    return out


def _position_distance(c: CompiledMechanism, q: np.ndarray, start: np.ndarray) -> float:
    """Return the distance of two positions [m], with angles times the mechanism's length."""
    size = np.ones(len(q))
    shifts = 2 if c.structure.model.planar else 3
    tree = c.values.system.tree
    for q0, nq in zip(tree.q, tree.nq, strict=True):
        size[q0 + shifts : q0 + nq] = c.values.length
    return float(np.linalg.norm((q - start) * size))


def _perturbed_rank(a: Assembly) -> int:
    """Return the rank with slightly and randomly perturbed joint frames."""
    c = compile_mechanism(a.compiled.structure.model, parameters=a.compiled.values.parameter_values)
    s = c.structure
    S = c.values.system
    frames = Frames(S.frames.position.copy(), S.frames.rotation.copy())
    random = np.random.default_rng(2)
    for k in range(len(S.frame_body)):
        if s.frames[k].role == "world":
            continue
        shift, turn = PERTURBATION * c.values.length * random.normal(size=3), PERTURBATION * random.normal(size=3)
        if s.model.planar:
            shift[2] = turn[0] = turn[1] = 0.0
        frames.position[k] += shift
        frames.rotation[k] = (frames.rotation[k].reshape(3, 3) @ orientation_matrix(turn, "turn")).ravel()
    shaken = CompiledMechanism(replace(c.values, system=S._replace(frames=frames)), c.z)
    shaken.follow(a.compiled.hints)
    shaken.at(a.t, a.q, a.v)
    return jacobian_rank(shaken)


CONTRADICTION_TOLERANCE = (
    1e-8  # residual of a dependency of unit size, relative to the mechanism's length, above which it is contradictory
)

MAX_DEPENDENCIES = 64  # redundant constraints of a connected part that are searched for sets in a large mechanism
LEAST_DRIVER_SHARE = 1e-3  # relative share in a dependency from which on the disagreement is reported at a driver


def redundant_sets(
    spaces: ConstraintNullSpaces, positions: list[np.ndarray], infinitesimal: bool, redundancy: int
) -> tuple[RedundantSet, ...]:
    """Return the redundant sets, smallest first. Remedies hold in all these positions, together with those of earlier
    sets.

    ``infinitesimal``: the mechanism has an infinitesimal motion only, so that the dependencies exist only here.
    ``redundancy``: number of redundant constraints. For a large mechanism with more than `MAX_DEPENDENCIES` connected
    ones, the sets found are not complete.
    """
    lam, a = spaces.dependencies, spaces.assembly
    if not lam.shape[1]:
        return ()
    c = a.compiled
    s = c.structure
    c.at(a.t, a.q, a.v)
    G, size, _ = scaled_jacobian(c)
    size = np.maximum(size, 1e-300)
    names = list(s.slices)
    groups = [np.arange(r.start, r.stop) for r in s.slices.values()]
    most = MAX_DEPENDENCIES if max(G.shape) > MAX_DOUBTFUL_SVD_SIZE else lam.shape[1]
    found = minimal_subspaces(lam * size[:, None], groups, most)
    all_found = sum(basis.shape[1] for _, basis in found) == redundancy
    found.sort(key=lambda x: len(x[0]))
    g, nu = c.work.rows.value / size, (c.sparse_jacobian() @ a.v - c.work.rows.nu) / size
    those = [tuple(names[e] for e in elements) for elements, _ in found]
    tried = find_remedies(spaces, those, positions)
    out = []
    for elements, (numbers, basis), (cure, here_only, cut) in zip(those, found, tried, strict=True):
        what, gap, unit = _disagreement(basis, g, nu, size, c)
        loose = undetermined_components(a, basis / size[:, None], list(elements))
        drivers = tuple(n for n in elements if isinstance(s.model[n], Driver))
        loose = {k: v for k, v in loose.items() if k not in drivers}
        here_only = not what and (here_only or infinitesimal)
        cure = None if what or here_only else cure
        count = basis.shape[1]
        if not all_found:  # count the dependencies of the set's own rows
            own = G[np.concatenate([groups[e] for e in numbers])].toarray()
            count = len(own) - rank(own)
        out.append(RedundantSet(elements, count, what, gap, here_only, loose, cure, drivers, cut, unit))
    return tuple(out)


def _disagreement(
    basis: np.ndarray, g: np.ndarray, nu: np.ndarray, size: np.ndarray, c: CompiledMechanism
) -> tuple[str, float, str]:
    """Return on what the rows of a dependency disagree, by how much, and its unit.

    It is reported at the first driver among them, or at the row with the largest share.
    """
    unit, length = basis / np.abs(basis).max(axis=0), c.values.length
    for what, off, scale, per in (
        ("position", g, length, ""),
        ("velocity", nu, max(length, float(np.abs(nu).max(initial=0.0))), "/s"),
    ):
        gaps = np.abs(unit.T @ off)
        if gaps.max() > CONTRADICTION_TOLERANCE * scale:
            j = int(gaps.argmax())
            share = np.abs(unit[:, j])
            driven = np.array([isinstance(r.element, Driver) for r in c.structure.rows]) & (share > LEAST_DRIVER_SHARE)
            k = int(np.argmax(driven)) if driven.any() else int(share.argmax())
            return what, float(gaps[j] / share[k] * size[k]), ("m" if c.metric[k] else "rad") + per
    return "", 0.0, ""


MAX_NAMED_MOTIONS = 64  # free motions of a large mechanism that are named; all are counted


class MobilityAnalysis(ConstraintNullSpaces):
    """Data of a count, from which further results are computed on access."""

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return self.assembly.compiled.structure.model.name

    def sets(self, m: Mobility) -> tuple[RedundantSet, ...]:
        """See `Mobility.sets`."""
        if self.gap:
            return redundant_sets(self, [], False, m.redundancy)
        g = m.geometry
        return redundant_sets(self, g.positions, g.singular and not g.positions, m.redundancy)

    def motions(self, m: Mobility) -> tuple[FreeMotion, ...]:
        """See `Mobility.motions`."""
        a = self.assembly
        a.compiled.at(a.t, a.q, a.v)  # descriptions of rotations use the present positions
        large = max(m.rows, m.velocities) > MAX_DOUBTFUL_SVD_SIZE
        return free_motions(a, self.velocities[:, : MAX_NAMED_MOTIONS if large else None])

    def geometry(self, m: Mobility) -> FreedomGeometry:
        """See `Mobility.geometry`."""
        return mobility_geometry(m, self)


def mobility(
    model: Model,
    a: Assembly | None = None,
    *,
    t: float = 0.0,
    parameters: Mapping[str, float] | None = None,
    inertia: bool = False,
) -> Mobility:
    """Compute freedoms and redundancy at a position.

    Parameters
    ----------
    model : Model
    a : Assembly, optional
        The position; assembled at time ``t`` if not given. A mechanism that cannot be assembled is examined at the best
        position found: there the contradictory constraints are the dependent ones.
    t : float [s]
    parameters : mapping, optional
        Values of parameters in SI units, in place of the model's.
    inertia : bool
        Refuse bodies that can move without any inertia, whose motion forces would not determine.

    Returns
    -------
    Mobility

    Raises
    ------
    ModelError
        If ``inertia`` is set and a body can move without any inertia.
    AssemblyError
        If velocities disagree though positions do not depend on one another.
    """
    gap = ""
    if a is None:
        try:
            a = consistent_state(model, t=t, parameters=parameters)
        except AssemblyError as error:
            if error.best is None:
                raise
            a, gap = error.best, str(error)
    c = a.compiled
    if c.structure.rows:  # otherwise there is nothing to evaluate, and the engine need not be compiled
        c.at(a.t, a.q, a.v)
    s, S = c.structure, c.values.system
    G, size, scale = scaled_jacobian(c, is_small(c))
    nr, nv = (int(n) for n in G.shape)
    rank, dependent, motions = null_spaces(G)
    if inertia and S.scales.semidefinite > 0.0:
        check_inertia(model, a, massless_motions(a, G, scale) if motions is None else motions * scale[:, None])
    names: list[str] = []
    for k in np.flatnonzero(np.abs(dependent).max(axis=1, initial=0.0) > 1e-6).tolist():
        if (name := s.rows[k].element.name) not in names:
            names.append(name)
    lam = dependent / np.maximum(size, 1e-300)[:, None]
    there = MobilityAnalysis(a, lam, None if motions is None else motions * scale[:, None], gap)
    without = ignored_elements(model)
    loose = undetermined_components(a, lam, names) if len(names) else {}
    return Mobility(nv, nr, rank, tuple(names), loose, without, there, lam.shape[1])


# Motions without inertia: the constraints allow them and no mass resists, so that they are undetermined.


ROTATION_PART = 1e-3  # relative rotation below which a motion is a translation


def massless_motions(a: Assembly, G: Any, scale: np.ndarray) -> np.ndarray:
    """Return the motions (nv, k) that the constraints allow and no mass resists, from M + G^T G."""
    import scipy.sparse as sp

    M = sp.diags(scale) @ a.compiled.mass() @ sp.diags(scale)
    return sparse_null_space(M / M.diagonal().max() + G.T @ G)[1] * scale[:, None]


def check_inertia(model: Model, a: Assembly, motions: np.ndarray) -> None:
    """Refuse motions that no mass resists.

    Raises
    ------
    ModelError
        Naming the body that could move without inertia.
    """
    if not motions.shape[1]:
        return
    i, j, M = a.compiled.mass_entries()
    K = motions[i].T @ (M[:, None] * motions[j])
    w, V = np.linalg.eigh(K)
    if w[0] > 1e-9 * max(w[-1], 1e-300):
        return
    motion = motions @ V[:, 0]
    tree = a.compiled.values.system.tree
    size = [np.abs(motion[v0 : v0 + n]).max() for v0, n in zip(tree.v, tree.nv, strict=True)]
    b = int(np.argmax(size))
    name = next(k for k, v in a.compiled.structure.place.items() if v == b)
    v0, n = int(tree.v[b]), int(tree.nv[b])
    shifts = 2 if model.planar else 3
    turns = motion[v0 + shifts : v0 + n]
    if np.abs(turns).max(initial=0.0) < ROTATION_PART * size[b]:
        raise ModelError(
            f"body {name!r} can move without any mass resisting it, so its motion is not determined. Give it a "
            f"mass, or joints that make it move with bodies that have one"
        )
    about = "turn" if shifts == 2 else f"turn about ({', '.join(f'{x:.3g}' for x in turns / np.linalg.norm(turns))})"
    why = point_mass_obstacles(model).get(name, "")
    raise ModelError(
        f"body {name!r} can {about} (its own axes) without any inertia resisting it, so its motion is not determined. "
        f"Give it a moment of inertia, or joints that prevent this motion"
        + (f"; it is no point mass, which would not turn, since {why}" if why else "")
    )


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
    if counted >= 0 or case.c.structure.model.planar or rank(G.toarray()) == rows:
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
