"""Positions, velocities, accelerations and forces in the conventions of Pinocchio, MuJoCo and Drake, and back.

Let x and R be origin and axes of a free body's reference frame, w its angular velocity. The programs have

    Pinocchio   q = (x, quaternion of R, scalar last)     v = (R^T xdot, R^T w)
    MuJoCo      q = (x, quaternion of R, scalar first)    v = (xdot, R^T w)
    Drake       q = (quaternion of R, scalar first, x)    v = (w, xdot)

and accelerations that are the time derivatives of these components; flyball has the centre of mass in place of x, and
components of w along the body's axes. Generalised forces have the same power in both.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from ..errors import AnalysisError, ModelError
from ..math.vec import quaternion_matrix, quaternion_product
from ..model.names import curve_parts
from ..rotations.arrays import joined, quaternion_of, split
from ..tables.table_definitions import FREE, PLANAR, POINT, REVOLUTE, SPHERICAL, Tree

if TYPE_CHECKING:
    from .recursive_methods import BatchDynamics

Array = np.ndarray


def state_rows(given: Sequence[tuple[str, Any, int]], owner: str) -> tuple[list[Array], int | None]:
    """Arguments as float arrays (k, n), each row contiguous, and the number of states: None for one.

    An argument with one state is repeated for the states of the others. The arrays may be those given.

    Parameters
    ----------
    given : sequence of (str, array_like, int)
        Name, value, and length of one state.
    owner : str
        Name of the mechanism, for messages.

    Raises
    ------
    ModelError
        If numbers are not real and finite, a shape does not fit, or numbers of states differ.
    """
    arrays, k = [], None
    for name, value, n in given:
        found = np.asarray(value)
        if found.dtype.kind not in "iuf":
            raise ModelError(f"{name} contains {found.dtype.name} numbers; coordinates, velocities and forces are real")
        if found.ndim not in (1, 2) or found.shape[-1] != n:
            raise ModelError(
                f"{name} has the shape {found.shape}; {owner!r} has {n} numbers there in these coordinates: ({n},) for "
                f"one state, (k, {n}) for k states"
            )
        if not is_finite(found):
            raise ModelError(f"{name} of {owner!r} is not finite")
        if found.ndim == 2:
            if k not in (None, len(found)):
                raise ModelError(f"{name} has {len(found)} states, and the arguments before it {k}")
            k = len(found)
        arrays.append(found)
    rows = 1 if k is None else k
    return [
        np.ascontiguousarray(np.broadcast_to(x, (rows, x.shape[-1])) if x.ndim == 1 else x, np.float64) for x in arrays
    ], k


def is_finite(x: Array) -> bool:
    """Whether all numbers are finite."""
    return math.isfinite(np.add.reduce(x, axis=None)) or bool(np.isfinite(x).all())  # the sum may overflow


def refuse_overflow(results: Sequence[Array], owner: str) -> None:
    """Refuse results (k, ...) that are not finite numbers.

    Raises
    ------
    AnalysisError
        With the first state that has such results.
    """
    for x in results:
        flat = x.reshape(-1)
        if not math.isfinite(flat.dot(flat)) and not (finite := np.isfinite(x).reshape(len(x), -1).all(axis=1)).all():
            raise AnalysisError(
                f"{owner!r}: the results at state {int(np.argmin(finite))} are not finite: coordinates, velocities, "
                f"accelerations or forces there are so large that products of them overflow"
            )


def quaternion_places(tree: Tree) -> list[tuple[int, int]]:
    """Of each quaternion among the coordinates: its first entry, and the first velocity of its body or joint."""
    turning = np.flatnonzero((tree.joint == FREE) | (tree.joint == SPHERICAL)).tolist()
    return [(int(tree.q[b]) + (3 if tree.joint[b] == FREE else 0), int(tree.v[b])) for b in turning]


def refuse_zero_quaternions(q: Array, places: Sequence[tuple[int, int]], names: Sequence[str]) -> None:
    """Refuse quaternions without direction in rows of coordinates (k, nq).

    Raises
    ------
    ModelError
    """
    for at, d in places:
        if not np.all(np.any(q[:, at : at + 4] != 0.0, axis=1)):
            raise ModelError(f"q[{at}:{at + 4}], the quaternion beside {names[d]!r}, is zero; it must be a rotation")


class FreeBodyConvention(NamedTuple):
    """How a program describes a free body."""

    position: int  # place of x in q
    quaternion: int  # place of the quaternion in q
    scalar_last: bool  # in the quaternion
    linear: int  # place of the velocity of the origin in v
    angular: int
    linear_in_body: bool  # along the body's axes, not the world's
    angular_in_body: bool


PROGRAMS = {
    "pinocchio": FreeBodyConvention(0, 3, True, 0, 3, True, True),
    "mujoco": FreeBodyConvention(0, 3, False, 0, 3, False, True),
    "drake": FreeBodyConvention(4, 0, False, 3, 0, False, False),
}


class ConvertedState(NamedTuple):
    """Coordinates (k, nq), and velocities and accelerations (k, nv) as far as they are given."""

    q: Array
    motion: list[Array]


class Part(Protocol):
    """Coordinates and velocities that are converted together."""

    def from_flyball(self, ours: ConvertedState, theirs: ConvertedState) -> None:
        """Write theirs."""

    def to_flyball(self, theirs: ConvertedState, ours: ConvertedState) -> None:
        """Write ours."""


@dataclass(frozen=True)
class ConvertedCoordinate:
    """A coordinate that is one number in both programs, or cosine and sine in the other."""

    q: int
    v: int
    theirs_q: int
    theirs_v: int
    offset: float  # theirs less ours
    on_circle: bool

    def from_flyball(self, ours: ConvertedState, theirs: ConvertedState) -> None:
        """Write theirs."""
        x = ours.q[:, self.q] + self.offset
        for k, part in enumerate((np.cos(x), np.sin(x)) if self.on_circle else (x,)):
            theirs.q[:, self.theirs_q + k] = part
        for a, b in zip(ours.motion, theirs.motion, strict=True):
            b[:, self.theirs_v] = a[:, self.v]

    def to_flyball(self, theirs: ConvertedState, ours: ConvertedState) -> None:
        """Write ours."""
        x = theirs.q[:, self.theirs_q]
        ours.q[:, self.q] = (np.arctan2(theirs.q[:, self.theirs_q + 1], x) if self.on_circle else x) - self.offset
        for a, b in zip(ours.motion, theirs.motion, strict=True):
            a[:, self.v] = b[:, self.theirs_v]


@dataclass(frozen=True)
class Ball:
    """A ball joint; theirs turns the reference frame of its outer body."""

    q: int
    v: int
    theirs_q: int
    theirs_v: int
    axes: Array  # (3, 3): of the outer body's reference frame, in the moved axes of the joint here
    scalar_last: bool

    def from_flyball(self, ours: ConvertedState, theirs: ConvertedState) -> None:
        """Write theirs."""
        e = _unit(ours.q[:, self.q : self.q + 4])
        e[:, 1:] = e[:, 1:] @ self.axes
        theirs.q[:, self.theirs_q : self.theirs_q + 4] = _from_scalar_first(e, self.scalar_last)
        for a, b in zip(ours.motion, theirs.motion, strict=True):
            b[:, self.theirs_v : self.theirs_v + 3] = a[:, self.v : self.v + 3] @ self.axes

    def to_flyball(self, theirs: ConvertedState, ours: ConvertedState) -> None:
        """Write ours."""
        e = _scalar_first(theirs.q[:, self.theirs_q : self.theirs_q + 4], self.scalar_last)
        e[:, 1:] = e[:, 1:] @ self.axes.T
        ours.q[:, self.q : self.q + 4] = e
        for a, b in zip(ours.motion, theirs.motion, strict=True):
            a[:, self.v : self.v + 3] = b[:, self.theirs_v : self.theirs_v + 3] @ self.axes.T


@dataclass(frozen=True)
class FreeBody:
    """A free body. Its reference frame has the origin r and the axes F in the axes of the body here."""

    q: int
    v: int
    theirs_q: int
    theirs_v: int
    r: Array  # (3,): from the centre of mass
    F: Array  # (3, 3)
    theirs: FreeBodyConvention

    def from_flyball(self, ours: ConvertedState, theirs: ConvertedState) -> None:
        """Write theirs."""
        c, e = ours.q[:, self.q : self.q + 3], _unit(ours.q[:, self.q + 3 : self.q + 7])
        A = _matrix(e)
        R = A @ self.F
        self._place(theirs.q, self.theirs.position, 3)[...] = c + A @ self.r
        turned = _product(e, quaternion_of(self.F))
        self._place(theirs.q, self.theirs.quaternion, 4)[...] = _from_scalar_first(turned, self.theirs.scalar_last)
        rates = [x[:, self.v + 3 : self.v + 6] for x in ours.motion]
        linear = [x[:, self.v : self.v + 3] + y for x, y in zip(ours.motion, self._carried(A, rates), strict=True)]
        turns = [x @ self.F for x in rates]
        if self.theirs.linear_in_body:  # d/dt (R^T xdot) = R^T xddot - w x (R^T xdot)
            linear = [_times(R.swapaxes(1, 2), x) for x in linear]
            linear[1:] = [x - np.cross(turns[0], linear[0]) for x in linear[1:]]
        if not self.theirs.angular_in_body:
            turns = [_times(R, x) for x in turns]
        for x, shift, turn in zip(theirs.motion, linear, turns, strict=True):
            self._velocity(x, self.theirs.linear)[...] = shift
            self._velocity(x, self.theirs.angular)[...] = turn

    def to_flyball(self, theirs: ConvertedState, ours: ConvertedState) -> None:
        """Write ours."""
        given = _scalar_first(self._place(theirs.q, self.theirs.quaternion, 4), self.theirs.scalar_last)
        e = _product(given, quaternion_of(self.F.T))
        A = _matrix(e)
        R = A @ self.F
        ours.q[:, self.q : self.q + 3] = self._place(theirs.q, self.theirs.position, 3) - A @ self.r
        ours.q[:, self.q + 3 : self.q + 7] = e
        linear = [self._velocity(x, self.theirs.linear) for x in theirs.motion]
        turns = [self._velocity(x, self.theirs.angular) for x in theirs.motion]
        if not self.theirs.angular_in_body:
            turns = [_times(R.swapaxes(1, 2), x) for x in turns]
        if self.theirs.linear_in_body:
            linear[1:] = [x + np.cross(turns[0], linear[0]) for x in linear[1:]]
            linear = [_times(R, x) for x in linear]
        rates = [x @ self.F.T for x in turns]
        for x, shift, rate, y in zip(ours.motion, linear, rates, self._carried(A, rates), strict=True):
            x[:, self.v : self.v + 3] = shift - y
            x[:, self.v + 3 : self.v + 6] = rate

    def _carried(self, A: Array, rates: Sequence[Array]) -> list[Array]:
        """Velocity and acceleration of the origin relative to the centre of mass, in the world."""
        found = [np.cross(x, self.r) for x in rates]
        found[1:] = [x + np.cross(rates[0], found[0]) for x in found[1:]]
        return [_times(A, x) for x in found]

    def _place(self, Q: Array, at: int, n: int) -> Array:
        return Q[:, self.theirs_q + at : self.theirs_q + at + n]

    def _velocity(self, V: Array, at: int) -> Array:
        return V[:, self.theirs_v + at : self.theirs_v + at + 3]


@dataclass(frozen=True)
class Convention:
    """States of a prepared mechanism in the convention of another program: what `Prepared.convention` returns.

    Attributes
    ----------
    program : str
    names : tuple of str
        `Prepared.names` in the order of their joints; a free body's velocities stand in the order of flyball here.
    nq : int
        Number of their coordinates.
    """

    program: str
    names: tuple[str, ...]
    nq: int
    _dynamics: BatchDynamics = field(repr=False)
    _parts: Sequence[Part] = field(repr=False)

    def from_flyball(self, q: Any, v: Any = None, a: Any = None) -> Any:
        """Convert coordinates, with velocities also these, with accelerations all three.

        Parameters
        ----------
        q, v, a : array_like, (nq,), (nv,), (nv,), or k rows of these
            Of `Prepared`.

        Returns
        -------
        ndarray, or tuple of ndarray
            As many as are given, for one state or k.
        """
        x = self._dynamics
        given, k = self._rows(x.structure.nq, q, v, a)
        refuse_zero_quaternions(given[0], x.quaternions, x.names)
        ours = ConvertedState(given[0], given[1:])
        theirs = ConvertedState(np.zeros((len(given[0]), self.nq)), [np.zeros_like(x) for x in ours.motion])
        for part in self._parts:
            part.from_flyball(ours, theirs)
        return _one_or_many((theirs.q, *theirs.motion), k)

    def to_flyball(self, q: Any, v: Any = None, a: Any = None) -> Any:
        """Convert their coordinates, velocities and accelerations to those of `Prepared`: see `from_flyball`.

        An angle that they store as cosine and sine comes back between -pi and pi.
        """
        given, k = self._rows(self.nq, q, v, a)
        theirs = ConvertedState(given[0], given[1:])
        ours = ConvertedState(
            np.zeros((len(given[0]), self._dynamics.structure.nq)), [np.zeros_like(x) for x in theirs.motion]
        )
        for part in self._parts:
            part.to_flyball(theirs, ours)
        return _one_or_many((ours.q, *ours.motion), k)

    def velocity_matrix(self, q: Any) -> Array:
        """Return T, (nv, nv) or (k, nv, nv), at coordinates of `Prepared`: their velocities are T v.

        Their mass matrix is T^-T M T^-1, their Jacobians are J T^-1.
        """
        (x,), k = self._rows(self._dynamics.structure.nq, q)
        n = len(self.names)
        _, columns = self.from_flyball(np.repeat(x, n, axis=0), np.tile(np.eye(n), (len(x), 1)))
        return np.asarray(_one_or_many((np.swapaxes(columns.reshape(len(x), n, n), 1, 2),), k))

    def forces_from_flyball(self, q: Any, tau: Any) -> Array:
        """Convert generalised forces, (nv,) or (k, nv), at coordinates of `Prepared`: T^-T tau, of the same power."""
        T = self.velocity_matrix(q)
        return np.asarray(np.linalg.solve(np.swapaxes(T, -1, -2), self._force(tau)[..., None])[..., 0])

    def forces_to_flyball(self, q: Any, tau: Any) -> Array:
        """Convert their generalised forces, at coordinates of `Prepared`: T^T tau."""
        return np.asarray((np.swapaxes(self.velocity_matrix(q), -1, -2) @ self._force(tau)[..., None])[..., 0])

    @property
    def _owner(self) -> str:
        return self._dynamics.structure.model.name

    def _force(self, tau: Any) -> Array:
        found, k = state_rows([("tau", tau, len(self.names))], self._owner)
        return np.asarray(_one_or_many(found, k))

    def _rows(self, nq: int, q: Any, v: Any = None, a: Any = None) -> tuple[list[Array], int | None]:
        if v is None and a is not None:
            raise ModelError("accelerations are converted with velocities: give v too")
        n = len(self.names)
        given = [x for x in (("q", q, nq), ("v", v, n), ("a", a, n)) if x[1] is not None]
        return state_rows(given, self._owner)


def convention(
    x: BatchDynamics, program: str, joints: Sequence[str] | None, circles: Sequence[str] | None
) -> Convention:
    """Return the convention of another program: see `Prepared.convention`."""
    if program not in PROGRAMS:
        raise ModelError(f"{program!r} is no program whose conventions are known: {', '.join(PROGRAMS)}")
    tree, name = x.system.tree, x.structure.model.name
    owners = [curve_parts(n)[0] for n in x.names]
    if joints is not None:
        order = _in_their_order(x, owners, joints)
    elif (x.paths.previous == np.arange(-1, len(owners) - 1)).all():
        order = list(dict.fromkeys(owners))
    else:
        raise ModelError(
            f"the joints of {name!r} form several branches, and programs order them differently: name them in the "
            f"order of {program}'s velocities, joints=[...]"
        )
    parts: list[Part] = []
    names: list[str] = []
    nq = 0
    for owner in order:
        for b in dict.fromkeys(int(x.paths.body[d]) for d, mine in enumerate(owners) if mine == owner):
            at = int(tree.q[b]), int(tree.v[b]), nq, len(names)
            names += x.names[tree.velocities(b)]
            parts.append(_part(x, b, at, owner, program, owner in (circles or ())))
            nq += int(tree.nq[b]) + (owner in (circles or ()))
    return Convention(program, tuple(names), nq, x, parts)


def _part(x: BatchDynamics, b: int, at: tuple[int, int, int, int], owner: str, program: str, on_circle: bool) -> Part:
    """Row b of the tree, which belongs to a joint or a free body, with its places in both programs."""
    kind, theirs = x.system.tree.joint[b], PROGRAMS[program]
    if kind in (PLANAR, POINT):
        raise ModelError(f"{owner!r} is no free rigid body in space: {program} has no counterpart of its velocities")
    if kind == FREE:
        frame = x.frame(owner)
        return FreeBody(*at, frame.position, frame.rotation.reshape(3, 3), theirs)
    if kind != SPHERICAL:
        return ConvertedCoordinate(*at, float(x.system.bodies.offset[b]), on_circle)
    outer = [name for name, row in x.structure.place.items() if row == b]
    if program == "drake" or not outer:
        raise ModelError(f"{owner!r} turns freely about a point: {program} has no joint with these coordinates")
    axes = x.system.bodies.body_rotation[b].reshape(3, 3) @ x.frame(outer[0]).rotation.reshape(3, 3)
    return Ball(*at, axes, theirs.scalar_last)


def _in_their_order(x: BatchDynamics, owners: Sequence[str], joints: Sequence[str]) -> list[str]:
    """Joints and free bodies in their order: free bodies that are not named come first."""
    plain = [re.sub(r"\W", "_", name) for name in joints]
    free = {owners[d] for d, b in enumerate(x.paths.body) if x.system.tree.joint[b] == FREE}
    order = [name for name in dict.fromkeys(owners) if name in free and name not in plain] + plain
    known = dict.fromkeys(owners)
    wrong = [y for y in plain if y not in known or plain.count(y) > 1] + [y for y in known if y not in order]
    if wrong:
        raise ModelError(
            f"joints={list(joints)!r}: {wrong[0]!r} is missing, or there twice, or no joint that moves; name each of "
            f"{', '.join(y for y in known if y not in free)} once"
        )
    return order


def continuous_joints(x: BatchDynamics, stopped: Collection[str]) -> list[str]:
    """Joints that turn about one axis without a stop: Pinocchio stores the angle as cosine and sine."""
    turning = [x.names[d] for d, b in enumerate(x.paths.body) if x.system.tree.joint[b] == REVOLUTE]
    return [curve_parts(name)[0] for name in turning if name not in stopped]


def _unit(e: Array) -> Array:
    return np.asarray(e / np.linalg.norm(e, axis=1, keepdims=True))


def _scalar_first(e: Array, scalar_last: bool) -> Array:
    """Unit quaternions, scalar first, of theirs."""
    if not np.all(np.any(e != 0.0, axis=1)):
        raise ModelError("a quaternion is zero; it must be a rotation")
    return _unit(np.roll(e, 1, axis=1) if scalar_last else e)


def _from_scalar_first(e: Array, scalar_last: bool) -> Array:
    return np.roll(e, -1, axis=1) if scalar_last else e


def _matrix(e: Array) -> Array:
    flat = joined(quaternion_matrix(*split(e)))
    return flat.reshape(-1, 3, 3)


def _product(a: Array, b: Array) -> Array:
    return joined(quaternion_product(split(a), split(b)))


def _times(A: Array, x: Array) -> Array:
    return np.asarray((A @ x[..., None])[..., 0])


def _one_or_many(found: Sequence[Array], k: int | None) -> Any:
    out = tuple(found) if k is not None else tuple(x[0] for x in found)
    return out if len(out) > 1 else out[0]
