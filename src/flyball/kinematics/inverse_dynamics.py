"""Inverse dynamics: driver efforts for a given motion, joint reactions, and which of these are determined.

The loop that follows the drivers also solves M vdot = f + G^T lam for the multipliers; those of the drivers are their
efforts. Where constraints are dependent, lam is one of many solutions. `determinacy` computes the self-stresses at
every position, and thus the reactions that all solutions have in common.

A fully driven mechanism has as many redundant constraints as it has more constraints than velocities, except at
singular positions. Dependencies are found by inverse iteration with one sparse factorization per position, in a
compiled loop. Where there are more or fewer, or the decision is close, singular values are used.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..assembly.compiled_mechanism import CompiledMechanism, compile_mechanism
from ..engine.entry_point import dependent_rows
from ..errors import ModelError
from ..math.vec import mtv
from ..mobility.null_spaces import CHANGE_TOLERANCE, scaled_jacobian, self_stresses, velocity_scales
from ..model.body import Body, Driver, Frame
from ..model.controller import Sensor
from ..model.geometry import matrix_to_quaternion
from ..model.joint import Coupling
from ..model.model import Model, listing, suggest
from ..model.names import is_curve
from ..model.table import Table
from ..model.unsupported_elements import refuse_unsupported
from ..numerics.rank import MAX_DOUBTFUL_SVD_SIZE, MAX_SVD_SIZE, fundamental_subspaces, rank_by_pivots
from ..results.inverse_dynamics import Drive, InverseDynamics
from ..results.motion_record import RecordedMotion
from ..results.result import Result
from ..simulation.prescribed_motion import is_checked_afterwards
from ..tables.table_definitions import PLANAR, POINT
from .driven_motion import KinematicsOptions, kinematics, requested_times

MAX_ITERATED = 64  # largest number of dependencies found by inverse iteration
LEAST_PART = 1e-6  # relative entry of a dependency from which on a row is part of it
ZERO_SINGULAR_VALUE, CLEAR_SINGULAR_VALUE = (
    1e-11,
    1e-5,
)  # relative singular values that are certainly zero, and certainly nonzero


class Determinacy:
    """Self-stresses of a mechanism along its motion.

    Attributes
    ----------
    count : ndarray (n,) of int
        Number of redundant constraints at every time.
    least : ndarray (n,)
        Smallest nonzero singular value of the constraints, relative to the largest: small near a singular position.
    wrenches : dict
        Joint -> change of its reaction by independent self-stresses, (n, 6, k): force and torque / length, world axes,
        on ``body_j`` at the joint's point there. Joints without change are left out.
    efforts : dict
        Driver or coupling -> whether its effort is undetermined, (n,) of bool; those without change are left out.
    """

    def __init__(self, n: int) -> None:
        self.least = np.ones(n)
        self.count = np.zeros(n, np.int64)
        self.wrenches: dict[str, np.ndarray] = {}
        self.efforts: dict[str, np.ndarray] = {}


def determinacy(result: Result) -> Determinacy:
    """Return the self-stresses at every output time of a motion."""
    out = Determinacy(len(result.t))
    own = compile_mechanism(result.model, parameters=result.values.parameter_values, tree=result.values.structure.tree)
    base = own if not own.structure.tree else compile_mechanism(result.model, parameters=own.values.parameter_values)
    if not len(base.structure.rows) or not len(result.t):
        return out
    states = absolute_states(result, own, base)
    lam = _DependencySearch(base, states, out).found()
    if lam.any():
        _add_self_stresses(base, states, lam, out)
    return out


@dataclass
class _DependencySearch:
    """Search for dependencies along a motion; their number and the smallest nonzero singular value are stored in
    ``out``.
    """

    base: CompiledMechanism
    states: np.ndarray
    out: Determinacy

    def found(self) -> np.ndarray:
        """Return multipliers (n, nr, most) without effect; zero where there are fewer."""
        nr, nv = len(self.base.structure.rows), self.base.structure.nv
        lam = np.zeros((len(self.states), nr, 0))
        count, left, tried = max(nr - nv, 0), np.arange(len(self.states)), set[int]()
        while len(left):
            if count not in tried and count < min(nr, MAX_ITERATED):
                tried.add(count)
                sure, own = self._by_iteration(left, count)
                lam = _with_dependencies(lam, left[sure], own[sure])
                left = left[~sure]
            if len(left):
                own = self._by_singular_values(left[0], count)
                lam, left, count = _with_dependencies(lam, left[:1], own[None]), left[1:], own.shape[1]
        return lam

    def _by_iteration(self, which: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return where there are certainly ``count`` dependencies, and these; by the compiled loop."""
        c = self.base
        lam, sizes = dependent_rows(c.values.system, c.work, self.states[which], velocity_scales(c), count)
        largest, least, none = sizes.T
        with np.errstate(invalid="ignore"):
            sure = (least > CLEAR_SINGULAR_VALUE * largest) & (none < ZERO_SINGULAR_VALUE * largest)
        self.out.count[which], self.out.least[which] = count, least / largest
        return sure, lam

    def _by_singular_values(self, k: int, count: int) -> np.ndarray:
        """Return multipliers (nr, dependencies) at one time, by singular values; by pivots where about many are
        expected.
        """
        c, nq, nv = self.base, self.base.structure.nq, self.base.structure.nv
        t, q, v, z = np.split(self.states[k], np.cumsum([1, nq, nv]))
        c.z = np.where(np.isnan(z), c.z, z)
        c.at(float(t[0]), q, v)
        G, size, _ = scaled_jacobian(c)
        size = np.maximum(size, 1e-300)
        large, many = max(G.shape) > MAX_DOUBTFUL_SVD_SIZE, count >= MAX_ITERATED and max(G.shape) > MAX_SVD_SIZE
        if (large or many) and (found := rank_by_pivots(G)) is not None:
            (count, own), self.out.least[k] = found, 1.0
        else:
            p = fundamental_subspaces(G.toarray())
            count, own = p.rank, p.dependencies
            self.out.least[k] = float(p.values[-1] / p.values[0]) if p.rank else 1.0
        self.out.count[k] = G.shape[0] - count
        return own / size[:, None]


def _with_dependencies(lam: np.ndarray, which: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Return ``lam`` with the dependencies at some of the times, widened if necessary."""
    more = found.shape[2] - lam.shape[2]
    lam = np.pad(lam, ((0, 0), (0, 0), (0, max(more, 0))))
    lam[which, :, : found.shape[2]] = found
    return lam


def _add_self_stresses(base: CompiledMechanism, states: np.ndarray, lam: np.ndarray, out: Determinacy) -> None:
    """Add the changes of joint reactions and of driver and coupling efforts by self-stresses."""
    s, n = base.structure, len(states)
    largest = np.abs(lam).max(axis=2)
    part = largest > LEAST_PART * largest.max(axis=1, keepdims=True)
    touched = {name: part[:, rows].any(axis=1) for name, rows in s.slices.items()}
    joints = []
    for name in [name for name, at in touched.items() if at.any()]:
        if isinstance(s.model[name], (Driver, Coupling)):
            out.efforts[name] = touched[name]
        else:
            joints.append(name)
    _, q, v, z = np.split(states, np.cumsum([1, s.nq, s.nv]), axis=1)
    records = RecordedMotion(base.values, q, v, np.zeros_like(v))
    wrenches = self_stresses(base.values, records.frame, z.T, lam, joints)
    most = np.zeros(n)
    for name, w in wrenches.items():
        w[~touched[name]] = 0.0
        np.maximum(most, np.abs(w).max(axis=(1, 2)), out=most)
    for name, w in wrenches.items():
        w /= np.maximum(most, 1e-300)[:, None, None]
        w[np.abs(w).max(axis=(1, 2)) <= CHANGE_TOLERANCE] = 0.0
        if w.any():
            out.wrenches[name] = w


# The states of a motion in absolute coordinates, all output times at once.


def absolute_states(result: Result, original: CompiledMechanism, base: CompiledMechanism) -> np.ndarray:
    """Return times and states (n, 1 + ny) of a motion in the coordinates of ``base``.

    nan stands for angles and curve positions that ``original``, the mechanism in the motion's coordinates, does not
    count; works are zero.
    """
    s, n = base.structure, len(result.t)
    if base is original:
        return np.column_stack([result.t, result.q, result.v, result.hints])
    q, v, z = np.zeros((n, s.nq)), np.zeros((n, s.nv)), np.full((n, len(s.states)), np.nan)
    for name, b in s.place.items():
        if b >= 0:
            _set_body_state(result, base, name, q, v)
    hints = {k: result.hints[:, at] for k, at in original.structure.state_at.items()} | original.turned(result.q.T)
    for name, at in s.state_at.items():
        if name.endswith(".work"):
            z[:, at] = 0.0
        elif name in hints:
            z[:, at] = hints[name]
    return np.column_stack([result.t, q, v, z])


def _set_body_state(result: Result, base: CompiledMechanism, name: str, q: np.ndarray, v: np.ndarray) -> None:
    """Set coordinates and velocities of one body in the order of ``base``."""
    tree = base.values.system.tree
    b, at = (x.structure.place[name] for x in (result.values, base.values))
    p, R, w, u, _, _ = result.records.body(b)
    q0, v0 = int(tree.q[at]), int(tree.v[at])
    if tree.joint[at] == POINT:
        n = int(tree.nv[at])
        q[:, q0 : q0 + n], v[:, v0 : v0 + n] = np.stack(p[:n], axis=1), np.stack(u[:n], axis=1)
    elif tree.joint[at] == PLANAR:
        q[:, q0 : q0 + 3] = np.stack([p[0], p[1], result.records.angle(b)], axis=1)
        v[:, v0 : v0 + 3] = np.stack([u[0], u[1], w[2]], axis=1)
    else:
        matrices = np.stack(np.broadcast_arrays(*R), axis=1).reshape(-1, 3, 3)
        q[:, q0 : q0 + 7] = np.column_stack([*p, matrix_to_quaternion(matrices)])
        v[:, v0 : v0 + 6] = np.stack([*u, *mtv(R, w)], axis=1)


MIN_SAMPLES = 4  # least number of samples of a curve with two continuous derivatives


@dataclass(frozen=True, kw_only=True)
class InverseDynamicsOptions(KinematicsOptions):
    """Arguments of `Mechanism.inverse_dynamics`."""

    motion: Mapping[str, Any] | None


def inverse_dynamics(model: Model, o: InverseDynamicsOptions) -> InverseDynamics:
    """Compute driver efforts and reactions for a given motion: see `Mechanism.inverse_dynamics`."""
    refuse_unsupported(model, "inverse_dynamics", is_checked_afterwards)
    model = model.copy() if o.motion else model.snapshot()
    labels = {d.name: d.name for d in model.drivers}
    if o.motion:
        outputs, begin = requested_times(o.times, o.t_start, o.t_end)
        model.initial = []
        for label, how in o.motion.items():
            first = _add_driver(model, label, how, outputs, labels)
            begin = max(begin, first) if o.t_start is None else begin
        if isinstance(o.times, (int, np.integer)) and outputs[0] < begin:
            outputs = np.linspace(begin, outputs[-1], int(o.times))
        o = replace(o, t_start=begin, times=outputs.tolist(), t_end=None)
    result = kinematics(model, o)
    drives = {labels[d.name]: _drive(result, d) for d in model.drivers}
    return InverseDynamics(result, drives, determinacy(result))


def _add_driver(model: Model, label: str, motion: Any, times: np.ndarray, labels: dict[str, str]) -> float:
    """Add the driver of one coordinate; return the start time of its samples."""
    coordinate = _driven_coordinate(model, label)
    name = f"{label.replace('.', ' ')} drive"
    law, first = motion, -np.inf
    if not isinstance(motion, (str, int, float)) and not callable(motion):
        t, x = _samples(label, motion, times)
        table = f"motion_{len(labels) + 1}"
        t, x = _extended_samples(t, x)
        model.add(Table(table, x=tuple(t.tolist()), y=tuple(x.tolist())))
        law, first = f"{table}(t)", float(t[1])
    model.add(Driver(name, coordinate=coordinate, law=law))
    labels[name] = label
    return first


def _driven_coordinate(model: Model, label: str) -> str:
    """Return the coordinate that a name in the motion refers to."""
    if is_curve(model, label):
        return label
    if not isinstance(e := model.find(label), Sensor):
        known = [x.name for x in model.sensors if isinstance(x, Sensor)]
        raise ModelError(
            f"motion of {label!r}: there is no sensor of that name{suggest(label, known)}; {listing(known)}. Name a "
            f"sensor of a coordinate, or a coordinate such as 'A.angle'"
        )
    found = model.measured(e)
    if found is None or found[0] != "coordinate" or found[2] != 0:
        raise ModelError(
            f"motion of {label!r}: the sensor measures {e.of!r}; only positions and angles of joints, bodies and "
            f"frames can be driven"
        )
    return found[1]


def _samples(label: str, motion: Any, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return checked times and values of samples."""
    try:
        pair = isinstance(motion, tuple) and len(motion) == 2 and np.ndim(motion[0]) == 1
        t, x = (np.asarray(part, float) for part in (motion if pair else (times, motion)))
    except (TypeError, ValueError):
        raise ModelError(
            f"motion of {label!r}: give an expression of t, samples at the times, or a pair (times, samples), not "
            f"{motion!r}"
        ) from None
    if t.ndim != 1 or t.shape != x.shape:
        raise ModelError(f"motion of {label!r}: {x.size} samples do not fit {t.size} times; give one for each")
    if len(t) < MIN_SAMPLES:
        raise ModelError(f"motion of {label!r}: {len(t)} samples make no smooth motion; give {MIN_SAMPLES} or more")
    if not (np.isfinite(t).all() and np.isfinite(x).all() and (np.diff(t) > 0).all()):
        raise ModelError(f"motion of {label!r}: samples must be finite and their times ascend")
    if t[0] > times[0] or t[-1] < times[-1]:
        raise ModelError(
            f"motion of {label!r}: its samples extend from {t[0]:g} s to {t[-1]:g} s, the requested times from "
            f"{times[0]:g} s to {times[-1]:g} s; the motion outside the samples is not known"
        )
    return t, x


def _extended_samples(t: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the same spline with one more point at either end, so that the ends of the samples are inside it."""
    from scipy.interpolate import CubicSpline

    curve = CubicSpline(t, x)  # not-a-knot: its first and last polynomials are extrapolated
    more = np.r_[2 * t[0] - t[1], t, 2 * t[-1] - t[-2]]
    return more, curve(more)


def _drive(result: Result, driver: Driver) -> Drive:
    """Return the effort of a driver and the rate of its coordinate."""
    model = result.model
    owner, what = model.coordinate(driver.coordinate, driver)
    view = result[owner.name]
    if what == "angle" and isinstance(owner, (Body, Frame)):
        rate = view.angular_velocity
    elif what in ("x", "y", "z") and isinstance(owner, (Body, Frame)):
        rate = view.velocity[:, "xyz".index(what)]
    else:
        rate = getattr(view, f"{what}_rate")
    unit, effort = result[driver.name].quantity("effort")
    return Drive(driver.name, driver.coordinate, unit, np.asarray(effort), np.asarray(rate))
