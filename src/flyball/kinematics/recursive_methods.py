"""Recursive dynamics on plain arrays, at one state or at many: the methods of `Prepared` that need no constraint."""

from __future__ import annotations

import ctypes
import math
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..codegen.batch_code import LARGEST_ANGLE, TASKS, BatchCode, ForwardDerivativesCode, batch_code
from ..compiler.kernels import BoundKernel, StructBuffer
from ..engine.batch_dynamics import (
    CENTROIDAL_MATRIX,
    FORWARD_DERIVATIVES,
    FORWARD_DYNAMICS,
    FRAME_JACOBIAN,
    FRAME_JACOBIAN_RATE,
    FRAME_POSE,
    INVERSE_DERIVATIVES,
    INVERSE_DYNAMICS,
    MASS_MATRIX,
    MOMENTUM,
    BatchArrays,
    FrameOnBody,
    batch_kernel,
)
from ..engine.entry_point import pooled_work, struct_tables
from ..engine.recursive_dynamics import tree_dynamics, velocity_paths
from ..errors import AnalysisError, ModelError
from ..model.body import GROUND, Frame
from ..tables.table_definitions import FREE, SPHERICAL, System
from .closed_loops import ClosedLoops
from .conventions import quaternion_places, refuse_overflow, refuse_zero_quaternions, state_rows

if TYPE_CHECKING:
    from ..assembly.assembled_state import Assembly

Array = np.ndarray
FLOAT, copyto = np.dtype(np.float64), np.copyto
_NO_COLUMNS = np.zeros((1, 0, 0))


class InverseDynamicsDerivatives(NamedTuple):
    """Derivatives of generalised forces tau (rows) along each velocity (columns): (nv, nv), or (k, nv, nv).

    By position: for a displacement of the bodies along the velocity, as `Prepared.step` makes it.
    """

    by_position: Array
    by_velocity: Array
    by_acceleration: Array
    """The mass matrix."""


class ForwardDynamicsDerivatives(NamedTuple):
    """Derivatives of accelerations (rows) along each velocity (columns): (nv, nv), or (k, nv, nv).

    By position: for a displacement of the bodies along the velocity, as `Prepared.step` makes it.
    """

    by_position: Array
    by_velocity: Array
    by_force: Array
    """The inverse of the mass matrix."""


class _Workspace:
    """Tables and workspace of one thread."""

    def __init__(self, x: BatchDynamics) -> None:
        s = x.structure
        work = pooled_work(s, x.system, np.float64)
        self.parts = (
            x.tables, work, StructBuffer(x.paths), StructBuffer(tree_dynamics(len(x.system.tree.parent), s.nq, s.nv))
        )  # fmt: skip

        self.single: dict[tuple[int, str | None], OneState] = {}

    def bound(self, arrays: BatchArrays) -> BoundKernel:
        """The kernel with arrays of states."""
        return BoundKernel(batch_kernel, *self.parts, StructBuffer(arrays))


class OneState:
    """Arrays for a task at one state, with the kernel bound to them: a call from Python takes a few microseconds.

    Attributes
    ----------
    results : list of ndarray
    """

    def __init__(
        self,
        x: BatchDynamics,
        task: int,
        lengths: Sequence[int],
        shapes: Sequence[tuple[int, ...]],
        frame: FrameOnBody,
    ) -> None:
        sizes = [math.prod(shape) for shape in shapes]
        self._given, self._result = np.zeros(sum(lengths)), np.zeros(sum(sizes))
        self._given_zeros, self._result_zeros = np.zeros(sum(lengths)), np.zeros(sum(sizes))
        parts = np.split(self._given, np.cumsum(lengths)[:-1])
        self._parts = [(part, part.shape) for part in parts]
        pieces = np.split(self._result, np.cumsum(sizes)[:-1])
        self.results = [piece.reshape(shape) for piece, shape in zip(pieces, shapes, strict=True)]
        flat = _in_rows(self.results, 1, shapes)
        self._call = x.bound(task, [part[None] for part in parts], flat, frame, x.workspace)
        self._quaternions = [k for k, _ in x.quaternions]
        self._largest_square = None if x.code(task) is None else LARGEST_ANGLE**2

    def evaluate(self, given: Sequence[Array]) -> bool:
        """Evaluate; return False if arguments or results need the checked path."""
        for (part, shape), x in zip(self._parts, given):
            if type(x) is not Array or x.dtype is not FLOAT or x.shape != shape:
                return False
            copyto(part, x)
        if self._given.dot(self._given_zeros) != 0.0:  # 0 times a number that is not finite is nan
            return False
        q = given[0]
        if self._largest_square is not None and q.dot(q) > self._largest_square:
            return False
        for k in self._quaternions:
            if not (q[k] or q[k + 1] or q[k + 2] or q[k + 3]):
                return False
        return self._call() == 1 and self._result.dot(self._result_zeros) == 0.0


class BatchDynamics:
    """The tables that recursive dynamics reads; in them no driver prescribes a coordinate.

    Parameters
    ----------
    start : Assembly
    names : sequence of str
        Of the velocities, for messages.
    specialize : bool
        Whether machine code is generated for the mechanism.
    """

    def __init__(self, start: Assembly, names: Sequence[str], specialize: bool) -> None:
        c = start.compiled
        self.start, self._specialize = start.q, specialize
        self._code: dict[int, BatchCode | ForwardDerivativesCode | None] = {}
        S: System = c.values.system
        self.compiled, self.structure, self.names = c, c.structure, names
        self.system = S._replace(tree=S.tree._replace(law=np.full_like(S.tree.law, -1)))
        self.tables = struct_tables(self.structure, self.system)
        self.paths = velocity_paths(S.tree)
        self.quaternions = quaternion_places(S.tree)
        self._thread = threading.local()
        self._lock = threading.Lock()

    @property
    def entries(self) -> Array:
        """The entry of q whose rate each velocity is, (nv,); -1 of those of quaternions."""
        tree, body = self.system.tree, self.paths.body
        number = np.arange(len(body)) - tree.v[body]
        kind = tree.joint[body]
        turning = (kind == SPHERICAL) | ((kind == FREE) & (number >= 3))
        return np.where(turning, -1, tree.q[body] + number)

    @property
    def workspace(self) -> _Workspace:
        """This thread's workspace."""
        found: _Workspace | None = getattr(self._thread, "workspace", None)
        if found is None:
            found = self._thread.workspace = _Workspace(self)
        return found

    def frame(self, name: str) -> FrameOnBody:
        """A body's reference frame, or a named frame."""
        if name == GROUND:
            return _frame_on_body(-1, np.zeros(3), np.eye(3))
        e = self.structure.model[name]
        if e.category not in ("bodies", "frames"):
            raise ModelError(f"{e.title} has no pose; name a body or a frame")
        values = self.compiled.values
        p, R = values.poses.named(name)
        carrier = e.body if isinstance(e, Frame) else name
        if carrier == GROUND:
            return _frame_on_body(-1, p, R)
        body = values.bodies[carrier]
        return _frame_on_body(self.structure.place[carrier], body.R.T @ (p - body.c), body.R.T @ R)

    def code(self, task: int) -> BatchCode | ForwardDerivativesCode | None:
        """Machine code generated for this mechanism; None if none is wanted, or possible."""
        if not self._specialize or task not in TASKS:
            return None
        with self._lock:
            if task not in self._code:
                self._code[task] = batch_code(self.structure, self.system, self.paths, task)
            return self._code[task]

    def bound(
        self, task: int, states: Sequence[Array], results: Sequence[Array], frame: FrameOnBody, workspace: _Workspace
    ) -> Callable[[], int]:
        """A call on these arrays: it returns the number of states that succeeded."""
        if (code := self.code(task)) is not None:
            return code.bound(states, results)
        kernel = workspace.bound(_batch_arrays(states, results, frame))
        addresses = [ctypes.c_void_p(int(x)) for x in kernel.words[1:]]  # converted once: half the time of a call
        call = partial(kernel.kernel.call, *addresses, ctypes.c_int64(task))
        call.in_memory = kernel  # type: ignore[attr-defined]  # the arrays, as long as the call exists
        return call

    def evaluate(
        self, task: int, states: Sequence[Array], results: Sequence[Array], frame: FrameOnBody, threads: int
    ) -> None:
        """Evaluate at all states (k, n), into results (k, rows, columns)."""
        code = self.code(task)
        far = np.abs(states[0]).max(axis=1, initial=0.0) > LARGEST_ANGLE if code is not None else np.zeros(0, bool)

        def part(begin: int, end: int) -> int:
            """Evaluate some states; returns the first at which that failed, or ``end``."""
            mine, out = [x[begin:end] for x in states], [x[begin:end] for x in results]
            done = 0
            if code is not None:  # with the start in place of states that are not for it
                near = np.where(far[begin:end, None], self.start, mine[0]) if far.any() else mine[0]
                done = code.bound([near, *mine[1:]], out)()
            if done < len(mine[0]):  # also to find the state that fails among those of a block
                rest = _batch_arrays([x[done:] for x in mine], [x[done:] for x in out], frame)
                done += self.workspace.bound(rest)(task)
            for i in np.flatnonzero(far[begin : begin + done]).tolist():
                one = _batch_arrays([x[i : i + 1] for x in mine], [x[i : i + 1] for x in out], frame)
                if self.workspace.bound(one)(task) == 0:
                    return begin + i
            return begin + done

        ends = np.linspace(0, len(states[0]), threads + 1).astype(int).tolist()
        if threads == 1:
            failed = [part(*ends)]
        else:
            with ThreadPoolExecutor(threads) as pool:
                failed = list(pool.map(part, ends[:-1], ends[1:]))
        for i, end in zip(failed, ends[1:], strict=True):
            if i < end:
                self.raise_singular(i, states)
        refuse_overflow(results, self.structure.model.name)

    def raise_singular(self, i: int, states: Sequence[Array]) -> None:
        """Raise the error of a state at which the accelerations are not determined."""
        q, v = (x[i : i + 1] for x in states[:2])
        arrays = _batch_arrays([q, v, np.zeros_like(v)], [np.zeros((1, 1, v.shape[1]))], _NO_FRAME)
        self.workspace.bound(arrays)(FORWARD_DYNAMICS)
        raise AnalysisError(
            f"{self.structure.model.name!r}: the accelerations are not determined at state {i}: the mass matrix is "
            f"singular there; {self.names[int(arrays.singular[0])]!r} moves no inertia that velocities before it do "
            f"not. Give the bodies that it moves mass and inertia"
        )


def _frame_on_body(b: int, p: Array, R: Array) -> FrameOnBody:
    return FrameOnBody(np.array([b]), np.array(p, float), np.array(R, float).reshape(9))


_NO_FRAME = _frame_on_body(-1, np.zeros(3), np.eye(3))


def _batch_arrays(states: Sequence[Array], results: Sequence[Array], frame: FrameOnBody) -> BatchArrays:
    padded: list[Array] = [*states, *[states[0][:, :0]] * (3 - len(states))]
    outputs: list[Array] = [*results, *[_NO_COLUMNS] * (3 - len(results))]
    singular = np.zeros(1, np.int64)
    return BatchArrays(padded[0], padded[1], padded[2], frame, outputs[0], outputs[1], outputs[2], singular)


BOUND_METHODS = {
    "rnea": (INVERSE_DYNAMICS, 1),
    "aba": (FORWARD_DYNAMICS, 1),
    "rnea_derivatives": (INVERSE_DERIVATIVES, 3),
    "aba_derivatives": (FORWARD_DERIVATIVES, 3),
}
"""Methods that can be bound to arrays: task, number of results."""


class RecursiveMethods:
    """Recursive dynamics of the bodies and joints of a prepared mechanism, at one state or at many.

    Every argument has one state, ``(nq,)`` or ``(nv,)``, or one in each of k rows; an argument with one state is used
    with every row of the others. The result has k rows then. ``out`` takes the result (float, without gaps; for
    several results a tuple); ``threads`` divides the states among threads, with the same result to the last bit.
    Generalised forces and velocities are in the order of `Prepared.names`, in SI units.

    These methods see bodies, tree joints and gravity (of a law of time, its value at t = 0). Springs, drivers,
    contacts and other forces are not part of them:
    `forces` and `acceleration` include these. Of mechanisms with closed loops, the mass matrix and the inverse dynamics
    are those of the tree of joints (loops add G^T lam), unless drives are named; `aba` and `reduced_mass_matrix`
    include the loops. Non-finite numbers, wrong shapes and quaternions of length zero raise `ModelError`; other
    quaternions are normalised.
    """

    _start: Assembly
    q: Array
    v: Array
    names: tuple[str, ...]
    rows: tuple[str, ...]
    model: Any
    specialized: bool
    _loops: Callable[[], ClosedLoops]

    def rnea(
        self,
        q: Array,
        v: Array,
        a: Array,
        *,
        drives: Sequence[str] | None = None,
        out: Array | None = None,
        threads: int = 1,
    ) -> Array:
        """Inverse dynamics: the generalised forces that give accelerations (recursive Newton-Euler algorithm).

        tau = M(q) a + c(q, v) - g(q). Featherstone (2008), table 5.1.

        Parameters
        ----------
        q, v, a : array_like, (nq,), (nv,), (nv,), or k rows of these
            Coordinates, velocities, accelerations [SI].
        drives : list of str, optional
            Names of the velocities along which forces act. With closed loops, the accelerations must satisfy the
            constraints (`dependent_velocities`), and there must be as many drives as freedoms.
        out : ndarray, optional
            Array for the result.
        threads : int
            Number of threads.

        Returns
        -------
        ndarray, (nv,) or (k, nv) [N, N m]
            With drives their forces, (drives,) or (k, drives).

        Raises
        ------
        AnalysisError
            If the drives cannot give these accelerations, or their forces are not determined.
        """
        if drives is not None:
            forces = self._batch(INVERSE_DYNAMICS, (q, v, a), ((len(self.v),),), None, threads)[0]
            found = self._for_states(lambda x, y, f, b: self._loops().drive_forces(f, x, y, b, drives), q, v, forces, a)
            return self._delivered([found], out)[0]
        return self._batch(INVERSE_DYNAMICS, (q, v, a), ((len(self.v),),), out, threads)[0]

    def bias_forces(self, q: Array, v: Array, *, out: Array | None = None, threads: int = 1) -> Array:
        """Forces at zero accelerations: Coriolis, centrifugal and gyroscopic ones less gravity, c(q, v) - g(q).

        Returns
        -------
        ndarray, (nv,) or (k, nv) [N, N m]
        """
        return self.rnea(q, v, np.zeros(len(self.v)), out=out, threads=threads)

    def gravity_forces(self, q: Array, *, out: Array | None = None, threads: int = 1) -> Array:
        """Forces that hold the mechanism at rest against gravity, -g(q).

        Returns
        -------
        ndarray, (nv,) or (k, nv) [N, N m]
        """
        rest = np.zeros(len(self.v))
        return self.rnea(q, rest, rest, out=out, threads=threads)

    def mass_matrix(self, q: Array, *, out: Array | None = None, threads: int = 1) -> Array:
        """Mass matrix M(q) of the tree, symmetric, by the composite-rigid-body algorithm; also named ``crba``.

        Featherstone (2008), table 6.2.

        Returns
        -------
        ndarray, (nv, nv) or (k, nv, nv) [kg, kg m, kg m^2]
        """
        n = len(self.v)
        return self._batch(MASS_MATRIX, (q,), ((n, n),), out, threads)[0]

    crba = mass_matrix

    def aba(self, q: Array, v: Array, tau: Array, *, out: Array | None = None, threads: int = 1) -> Array:
        """Forward dynamics: the accelerations that generalised forces give, in O(n) (articulated bodies).

        Featherstone (2008), table 7.1.

        Parameters
        ----------
        q, v, tau : array_like, (nq,), (nv,), (nv,), or k rows of these
            Coordinates, velocities, generalised forces [SI].
        out : ndarray, optional
            Array for the result.
        threads : int
            Number of threads.

        Returns
        -------
        ndarray, (nv,) or (k, nv) [m/s^2, rad/s^2]

        Raises
        ------
        AnalysisError
            If a velocity moves no inertia; with closed loops also if a state violates the constraints.
        """
        if self.rows:
            found = self._with_loops(lambda x: x.forward_dynamics, (q, v, tau), threads)
            return self._delivered(found[:1], out)[0]
        return self._batch(FORWARD_DYNAMICS, (q, v, tau), ((len(self.v),),), out, threads)[0]

    def loop_multipliers(self, q: Array, v: Array, tau: Array) -> Array:
        """Multipliers lam of the constraint rows at the accelerations of `aba`: loops load the tree with G^T lam.

        Returns
        -------
        ndarray, (nr,) or (k, nr)
            In the order of `Prepared.rows`. With dependent rows those of least norm.
        """
        return np.asarray(self._with_loops(lambda x: x.forward_dynamics, (q, v, tau), 1)[1])

    def dependent_velocities(self, q: Array, v: Array, independent: Sequence[str]) -> tuple[Array, Array]:
        """All velocities and accelerations of a mechanism with closed loops, by independent ones w.

        Parameters
        ----------
        q, v : array_like, (nq,), (nv,), or k rows of these
            A state that satisfies the constraints.
        independent : list of str
            Names of as many velocities as there are freedoms.

        Returns
        -------
        B : ndarray, (nv, f) or (k, nv, f)
            v = B w.
        c : ndarray, (nv,) or (k, nv) [m/s^2, rad/s^2]
            vdot = B wdot + c.

        Raises
        ------
        AnalysisError
            If these velocities are not independent, or do not determine the others.
        """
        B, c = self._with_loops(lambda x: lambda q, v: x.dependent_velocities(q, v, independent), (q, v), 1)
        return B, c

    def reduced_mass_matrix(self, q: Array, independent: Sequence[str]) -> Array:
        """Mass matrix of a mechanism with closed loops for independent velocities: B^T M B.

        Returns
        -------
        ndarray, (f, f) or (k, f, f) [kg, kg m, kg m^2]
        """
        B, _ = self.dependent_velocities(q, np.zeros(len(self.v)), independent)
        return np.asarray(np.swapaxes(B, -1, -2) @ self.mass_matrix(q) @ B)

    def rnea_derivatives(
        self, q: Array, v: Array, a: Array, *, out: Sequence[Array] | None = None, threads: int = 1
    ) -> InverseDynamicsDerivatives:
        """Analytic derivatives of `rnea` by position, velocity and acceleration.

        In the manner of Carpentier and Mansard (2018).

        Returns
        -------
        InverseDynamicsDerivatives
            Three arrays (nv, nv) or (k, nv, nv); the last is the mass matrix.
        """
        n = len(self.v)
        return InverseDynamicsDerivatives(*self._batch(INVERSE_DERIVATIVES, (q, v, a), ((n, n),) * 3, out, threads))

    def aba_derivatives(
        self, q: Array, v: Array, tau: Array, *, out: Sequence[Array] | None = None, threads: int = 1
    ) -> ForwardDynamicsDerivatives:
        """Exact derivatives of `aba` by position, velocity and generalised forces.

        -M^-1 times those of `rnea`, and M^-1. With closed loops, derivatives of the equations with the loops; products
        with changes dq, dv of the state have a meaning where the changed state satisfies the constraints.

        Returns
        -------
        ForwardDynamicsDerivatives
            Three arrays (nv, nv) or (k, nv, nv).

        Raises
        ------
        AnalysisError
            As for `aba`.
        """
        if self.rows:
            found = self._with_loops(lambda x: x.forward_dynamics_derivatives, (q, v, tau), threads)
            return ForwardDynamicsDerivatives(*self._delivered(found, out))
        n = len(self.v)
        return ForwardDynamicsDerivatives(*self._batch(FORWARD_DERIVATIVES, (q, v, tau), ((n, n),) * 3, out, threads))

    def pose(self, name: str, q: Array, *, threads: int = 1) -> tuple[Array, Array]:
        """Forward kinematics: origin and axes of a body's reference frame or a named frame, in the world.

        Returns
        -------
        position : ndarray, (3,) or (k, 3) [m]
        rotation : ndarray, (3, 3) or (k, 3, 3)
            The frame's axes as columns.
        """
        x = self._batch(FRAME_POSE, (q,), ((12,),), None, threads, name)[0]
        return x[..., :3].copy(), x[..., 3:].reshape(*x.shape[:-1], 3, 3).copy()

    def frame_jacobian(self, name: str, q: Array, *, out: Array | None = None, threads: int = 1) -> Array:
        """Derivatives of a frame's velocity (rows 0 to 2) and angular velocity (3 to 5), world axes.

        Returns
        -------
        ndarray, (6, nv) or (k, 6, nv)
        """
        return self._batch(FRAME_JACOBIAN, (q,), ((6, len(self.v)),), out, threads, name)[0]

    def frame_jacobian_rate(
        self, name: str, q: Array, v: Array, *, out: Array | None = None, threads: int = 1
    ) -> Array:
        """Rate of `frame_jacobian`: a frame's acceleration is J vdot + Jdot v.

        Returns
        -------
        ndarray, (6, nv) or (k, 6, nv)
        """
        return self._batch(FRAME_JACOBIAN_RATE, (q, v), ((6, len(self.v)),), out, threads, name)[0]

    def centre_of_mass(self, q: Array, *, threads: int = 1) -> Array:
        """Centre of mass of all bodies, in the world.

        Returns
        -------
        ndarray, (3,) or (k, 3) [m]
        """
        return self._momenta(q, np.zeros(len(self.v)), threads)[..., :3].copy()

    def momentum(self, q: Array, v: Array, *, threads: int = 1) -> Array:
        """Momentum and angular momentum about the centre of mass of all bodies, world axes (centroidal momentum).

        Returns
        -------
        ndarray, (6,) or (k, 6) [kg m/s, kg m^2/s]
        """
        return self._momenta(q, v, threads)[..., 3:9].copy()

    def energies(self, q: Array, v: Array, *, threads: int = 1) -> Array:
        """Kinetic energy, and potential energy of gravity (zero at the world's origin), of all bodies.

        Returns
        -------
        ndarray, (2,) or (k, 2) [J]
        """
        return self._momenta(q, v, threads)[..., 9:].copy()

    def centroidal_momentum_matrix(self, q: Array, *, out: Array | None = None, threads: int = 1) -> Array:
        """Matrix A of the centroidal momentum A(q) v: momentum (rows 0 to 2), angular momentum (3 to 5).

        Orin, Goswami and Lee (2013).

        Returns
        -------
        ndarray, (6, nv) or (k, 6, nv)
        """
        return self._batch(CENTROIDAL_MATRIX, (q,), ((6, len(self.v)),), out, threads)[0]

    def bind(self, method: str, q: Array, v: Array, a: Array, out: Any) -> Callable[[], None]:
        """A call of `rnea`, `aba` or their derivatives on fixed arrays, without checks: the fastest from Python.

        Parameters
        ----------
        method : {"rnea", "aba", "rnea_derivatives", "aba_derivatives"}
        q, v, a : ndarray
            Float arrays without gaps, read at each call: coordinates, velocities, accelerations (or forces, for
            ``aba``), of one state or of k. Numbers that are not finite or whose squares overflow, and with
            ``specialize`` angles beyond 1e5 rad, give results that are not.
        out : ndarray, or tuple of three for derivatives
            Arrays for the results.

        Returns
        -------
        callable
            Without arguments; it raises AnalysisError where accelerations are not determined. One thread at a time may
            call it. With closed loops, ``aba`` and its derivatives check each state as always.
        """
        if method not in BOUND_METHODS:
            raise ModelError(f"{method!r} cannot be bound; choose one of {', '.join(BOUND_METHODS)}")
        task, results = BOUND_METHODS[method]
        if out is None:
            raise ModelError("bind needs arrays for the results, out=")
        n, x = len(self.v), self._recursive
        given, k = self._states((q, v, a))
        if any(not np.shares_memory(mine, theirs) for mine, theirs in zip(given, (q, v, a), strict=True) if mine.size):
            raise ModelError("q, v and a must be arrays of float64 without gaps, each with as many states")
        shape = (n,) if results == 1 else (n, n)
        arrays = _result_arrays([(*(() if k is None else (k,)), *shape)] * results, out, given)
        if self.rows and method.startswith("aba"):
            return lambda: vars(RecursiveMethods)[method](self, q, v, a, out=out)
        flat = _in_rows(arrays, len(given[0]), [shape] * results)
        evaluate = x.bound(task, given, flat, _NO_FRAME, _Workspace(x))  # its own: other calls may run beside it

        def call() -> None:
            if evaluate() < len(given[0]):
                x.evaluate(task, given, flat, _NO_FRAME, 1)

        return call

    @staticmethod
    def _delivered(found: Sequence[Array], out: Any, given: Sequence[Array] = ()) -> list[Array]:
        """Results, in the arrays that are wanted, which do not overlap those given."""
        if out is None:
            return list(found)
        arrays = _result_arrays([x.shape for x in found], out, given)
        for x, y in zip(arrays, found, strict=True):
            x[...] = y
        return arrays

    def _with_loops(self, method: Callable[[ClosedLoops], Any], given: Sequence[Array], threads: int) -> Any:
        """Results of a method of the closed loops, for one state or many."""
        if threads != 1:
            raise ModelError("threads are for mechanisms without closed loops; leave them out")
        return self._for_states(method(self._loops()), *given, several=True)

    def _for_states(self, evaluate: Callable[..., Any], *given: Array, several: bool = False) -> Any:
        """Result of a function of rows (k, n), for one state or many."""
        states, k = self._states(given)
        found = evaluate(*[np.broadcast_to(x, (len(states[0]), x.shape[1])) for x in states])
        refuse_overflow(found if several else (found,), self.model.name)
        if k is None:
            return tuple(x[0] for x in found) if several else found[0]
        return found

    def _momenta(self, q: Array, v: Array, threads: int) -> Array:
        return self._batch(MOMENTUM, (q, v), ((11,),), None, threads)[0]

    @property
    def _recursive(self) -> BatchDynamics:
        found: BatchDynamics | None = vars(self).get("_batch_dynamics")
        if found is None:
            found = vars(self)["_batch_dynamics"] = BatchDynamics(self._start, self.names, self.specialized)
        return found

    def _batch(
        self,
        task: int,
        given: Sequence[Any],
        shapes: Sequence[tuple[int, ...]],
        out: Any,
        threads: int,
        frame: str | None = None,
    ) -> list[Array]:
        """Check the arguments, evaluate, and return results of the given shapes for each state."""
        x = self._recursive
        if threads == 1 and (out is None or len(shapes[0]) == 1):  # matrices are written in place
            one = x.workspace.single.get((task, frame)) or self._one_state(task, len(given), shapes, frame)
            if one.evaluate(given):
                found = [r.copy() for r in one.results]
                return found if out is None else self._delivered(found, out, given)
        states, k = self._states(given)
        if not isinstance(threads, int) or threads < 1:
            raise ModelError(f"threads is {threads!r}; it must be a number of threads, 1 or more")
        full = [(*(() if k is None else (k,)), *shape) for shape in shapes]
        results = _result_arrays(full, out, states)
        flat = _in_rows(results, len(states[0]), shapes)
        x.evaluate(task, states, flat, x.frame(frame) if frame is not None else _NO_FRAME, threads)
        return results

    def _one_state(self, task: int, given: int, shapes: Sequence[tuple[int, ...]], frame: str | None) -> OneState:
        """Arrays of this thread for a task at one state, with a number of arguments."""
        x = self._recursive
        at = x.frame(frame) if frame is not None else _NO_FRAME
        found = x.workspace.single[task, frame] = OneState(
            x, task, (len(self.q), len(self.v), len(self.v))[:given], shapes, at
        )
        return found

    def _states(self, given: Sequence[Any]) -> tuple[list[Array], int | None]:
        """Arguments as arrays of rows, and their number: None for one state."""
        lengths = (len(self.q), *[len(self.v)] * 3)
        named = zip(("q", "v", "a or tau", "a"), given, lengths, strict=False)
        states, k = state_rows(list(named), self.model.name)
        refuse_zero_quaternions(states[0], self._recursive.quaternions, self.names)
        return states, k


def _in_rows(results: Sequence[Array], k: int, shapes: Sequence[tuple[int, ...]]) -> list[Array]:
    """Results as arrays (k, rows, columns)."""
    return [
        r.reshape(k, shape[0] if len(shape) == 2 else 1, shape[-1]) for r, shape in zip(results, shapes, strict=True)
    ]


def _result_arrays(shapes: Sequence[tuple[int, ...]], out: Any, states: Sequence[Array] = ()) -> list[Array]:
    """Arrays for results: new ones, or those of ``out``, which are checked."""
    if out is None:
        return [np.empty(shape) for shape in shapes]
    given = list(out) if isinstance(out, tuple | list) else [out]
    for shape, x in zip(shapes, given, strict=False):
        fits = isinstance(x, np.ndarray) and x.shape == shape and x.dtype == np.float64 and x.flags.c_contiguous
        if not fits or not x.flags.writeable:
            raise ModelError(f"out must be an array of float64 of the shape {shape}, without gaps and writeable")
    for k, x in enumerate(given):
        if any(np.may_share_memory(x, y) for y in (*states, *given[:k])):
            raise ModelError("out must not overlap the arguments or another result")
    if len(given) != len(shapes):
        raise ModelError(f"out must contain {len(shapes)} arrays, not {len(given)}")
    return given
