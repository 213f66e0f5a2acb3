"""The compiled mechanism: tables, workspace, evaluation at a state, and access to its arrays by name.

All analyses evaluate a `CompiledMechanism`. This module also computes the steps along the velocities from one position
to another.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..compiler.kernels import BoundKernel, PooledBuffer, StructBuffer
from ..engine.calls import OutputBuffer
from ..engine.entry_point import POSITION, allocate_work, engine, evaluate_state, pooled_work, struct_tables
from ..engine.kinematics import count_plain_coordinates, joint_velocities, quaternion_at, turned_angles
from ..engine.stabilization import NONE
from ..model.body import Body, Frame, Initial
from ..model.model import Model
from ..numerics.integrators.butcher_tableaux import Tableau
from ..numerics.integrators.time_loop import StepState
from ..tables.forest import tree_joint_steps
from ..tables.law_inputs import initial_controller_states
from ..tables.reference_configuration import BodyState, positions
from ..tables.structure import Choices, structure
from ..tables.structure_definition import Structure
from ..tables.table_definitions import System, Work, assign, with_numbers
from ..tables.values import Values, values


@dataclass
class CompiledMechanism:
    """A compiled mechanism with its own workspace."""

    values: Values
    z: np.ndarray  # controller states, angles and curve positions as last evaluated; work states are zero
    parameters: dict[str, Any] = field(default_factory=dict)  # values that replace the model's own
    system: System = field(init=False, repr=False, compare=False)  # tables of `values`, or with addresses of `made`
    generated: Any = field(default=None, init=False, repr=False, compare=False)  # generated code; None: general engine
    _complex: Any = field(default=None, init=False, repr=False, compare=False)  # see `complex_tables`

    def __post_init__(self) -> None:
        self.system = self.values.system

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without workspace and addresses, which are invalid in another process."""
        return {k: x for k, x in vars(self).items() if k not in ("work", "scratch", "system", "generated", "_complex")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, system=state["values"].system, generated=None, _complex=None)

    def run_on(self, code: Any) -> None:
        """Use generated code from now on, as far as it replaces the engine; the contents of the workspace are kept."""
        x, before = self.values, vars(self).pop("scratch", None)
        vars(self).pop("work", None)
        self.generated, self.system = code, x.cache.get("made", id(code), 1, lambda: (code, code.system(x.system)))[1]
        if before is not None:
            kept = self.work._replace(flat=before.fields.flat)  # the new flat array is longer, for the code itself
            assign(kept, before.fields)

    def run_on_tables(self) -> None:
        """Use the general engine from now on."""
        self.generated, self.system = None, self.values.system

    @cached_property
    def work(self) -> Work:
        """Its workspace."""
        if self.system.const.dtype.kind in "fc":
            return self.scratch.fields  # type: ignore[no-any-return]
        w = allocate_work(self.structure, self.system)
        w.options.stabilization, w.options.solve_tolerance = NONE, 1e-13
        return w

    @cached_property
    def scratch(self) -> PooledBuffer:
        """The workspace as compiled code takes it."""
        made = pooled_work(self.structure, self.system, self.system.const.dtype)
        made.array("options").stabilization, made.array("options").solve_tolerance = NONE, 1e-13
        return made

    @property
    def complex_tables(self) -> tuple[StructBuffer, PooledBuffer]:
        """Tables in complex numbers, and a workspace for them, as compiled code takes them."""
        real = self.values.system
        if self._complex is None or self._complex[0] is not real:
            system = with_numbers(real, lambda _, x: x.astype(complex))
            self._complex = real, struct_tables(self.structure, system), pooled_work(self.structure, system, complex)
        return self._complex[1:]  # type: ignore[no-any-return]

    def array(self, name: str) -> Any:
        """Return an array of the workspace, without creating the others."""
        return self.scratch.array(name)

    @property
    def buffers(self) -> tuple[Any, Any]:
        """Tables and workspace as kernels take them: struct pointers that need no further conversion."""
        return struct_tables(self.structure, self.system), self.scratch

    def bound(self, R: Tableau, clock: StepState, out: np.ndarray) -> BoundKernel:
        """Return the engine bound to the present tables and workspace; otherwise as `entry_point.run_task`."""
        return BoundKernel(engine, *self.buffers, StructBuffer(R), StructBuffer(clock), StructBuffer(OutputBuffer(out)))

    @property
    def structure(self) -> Structure:
        """The structure of the mechanism."""
        return self.values.structure

    @property
    def y(self) -> np.ndarray:
        """State vector of the reference configuration."""
        return np.concatenate([self.values.q, self.values.v, self.z])

    def again(self) -> CompiledMechanism:
        """Return a copy with its own workspace; angles and curve positions as here."""
        return CompiledMechanism(self.values, self.z.copy(), self.parameters)

    def at(self, t: float, q: np.ndarray, v: np.ndarray, task: int = POSITION) -> tuple[int, np.ndarray]:
        """Evaluate at a state; rows and kinematics are left in ``work``. Returns (status, dy).

        Angles and curve positions are those nearest to the last ones.
        """
        s = self.structure
        if np.iscomplexobj(self.values.system.const):
            raise TypeError("the compiled code takes floats; complex tables are for the formulas")
        if len(q) != s.nq or len(v) != s.nv:  # compiled code would read beyond them
            raise ValueError(f"the state has {len(q)} + {len(v)} numbers; these coordinates have {s.nq} + {s.nv}")
        y = np.concatenate([q, v, self.z])
        out = evaluate_state(*self.buffers, float(t), y, task)
        z = y[len(q) + len(v) :]
        if np.isfinite(z).all():
            self.z = z
        return out

    @property
    def sizes(self) -> np.ndarray:
        """Reference length along every velocity: the mechanism's length [m], or a radian, (nv,)."""
        return self.values.system.velocity_units.real.copy()

    @cached_property
    def metric(self) -> np.ndarray:
        """Whether the value of a row is a length [m] or contains one; else it is an angle or a cosine, (nr,)."""
        out = np.zeros(len(self.structure.rows), bool)
        for t in self.structure.terms:
            if not t.measured:
                out[t.row] |= t.formula.measure == "m"
        return out

    @cached_property
    def row_units(self) -> np.ndarray:
        """Unit of the value of every row: the mechanism's length or a radian, by the largest factor of its terms."""
        return self.values.length / self.values.system.row_levers.real

    @cached_property
    def has_curves(self) -> bool:
        """Whether a term depends on a position on a curve."""
        return any(t.formula.of_kind.place for t in self.structure.terms)

    def find_places(self) -> None:
        """Set positions on curves to the nearest points at the poses last evaluated, independent of earlier ones."""
        for t in self.structure.terms:
            if t.formula.of_kind.place:
                p, R = self.work.frames.position, self.work.frames.rotation.reshape(-1, 3, 3)
                F, M = ((p[k], R[k]) for k in (t.F, t.M))
                e: Any = t.element if t.owner is None else t.owner
                self.z[t.hint] = e.nearest(self.values.numbers[e.name], F, M)[0]

    @property
    def hints(self) -> dict[str, float]:
        """Angles, curve positions and other states by name."""
        return dict(zip(self.structure.states, self.z.tolist(), strict=True))

    def follow(self, hints: Mapping[str, float]) -> None:
        """Take over angles and curve positions."""
        for name, k in self.structure.state_at.items():
            if name in hints and not name.endswith(".work"):
                self.z[k] = hints[name]

    def moving(self, t: float, q: np.ndarray, v: np.ndarray) -> dict[str, BodyState]:
        """Return pose and velocity of every body at a state."""
        W = self.work
        self.at(t, q, v)
        angles = turned_angles(self.values, W, q) if self.structure.model.planar else {}
        out = {}
        K = W.bodies.copy()
        p, v, w, R = K.position, K.velocity, K.angular_velocity, K.rotation.reshape(-1, 3, 3)
        for name, b in self.structure.place.items():
            if b >= 0:
                out[name] = BodyState(p[b], R[b], v[b], w[b], angles.get(name, 0.0))
        return out

    def take(self, other: CompiledMechanism, t: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (q, v) in these coordinates of a state (t, q, v) in other coordinates; take over angles and curve
        positions too.
        """
        hints = other.hints | other.turned(q)
        self.follow(hints)
        same = other.is_reference_configuration(q) and self.values.given is other.values.given
        bodies = other.moving(t, q, v) if v.any() or not same else {}
        own = self.values.q.copy() if same else positions(self.values, bodies, hints)
        self.at(t, own, np.zeros(self.structure.nv))
        return own, joint_velocities(self.values, bodies, self.work) if bodies else np.zeros(self.structure.nv)

    def is_reference_configuration(self, q: np.ndarray) -> bool:
        """Return whether q is the reference configuration, with its angles."""
        return np.array_equal(q, self.values.q) and np.array_equal(self.z, initial_hints(self.values))

    def turned(self, q: np.ndarray) -> dict[str, float]:
        """Return the angles of joints that are coordinates, by name, with the sign of the angle states."""
        return {name: sign * q[k] for name, (k, sign) in self.turning_coordinates.items()}

    @cached_property
    def turning_coordinates(self) -> dict[str, tuple[int, float]]:
        """Angles of joints that are coordinates: name -> entry of q, and the sign of the angle state."""
        s = self.structure
        return {
            f"{t.joint.name}.{p.coordinate}": (int(s.tables["tree"].q[row]), t.joint.coordinates[p.coordinate].sign)
            for t, row, p in tree_joint_steps(s)
            if p.kind == "R" and p.coordinate in t.joint.coordinates
        }

    def jacobian(self) -> np.ndarray:
        """Return a dense copy of the constraint Jacobian last evaluated, (nr, nv)."""
        S = self.values.system
        nr, row_p = len(S.rows.law), S.row_start[: len(S.rows.law) + 1]
        n = row_p[-1]
        out = np.zeros((nr, self.structure.nv))
        np.add.at(out, (np.repeat(np.arange(nr), np.diff(row_p)), S.column[:n]), self.work.G[:n])
        return out

    def sparse_jacobian(self):
        """Return a sparse copy of the constraint Jacobian last evaluated."""
        import scipy.sparse as sp

        S = self.values.system
        row_p = S.row_start[: len(S.rows.law) + 1]
        n = row_p[-1]
        return sp.csr_matrix((self.work.G[:n].copy(), S.column[:n], row_p), shape=(len(S.rows.law), self.structure.nv))

    def mass(self):
        """Return the sparse mass matrix of absolute coordinates, (nv, nv)."""
        table = self.values.system.bodies
        return self._blocks(table.inertia, table.mass)

    def kinetic_energy(self, v: np.ndarray) -> float:
        """Return the kinetic energy [J] at velocities v (nv,) of absolute coordinates."""
        if not v.any():
            return 0.0
        i, j, M = self.mass_entries()
        return float(0.5 * (v[i] * M * v[j]).sum())

    def mass_entries(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return rows, columns and entries of the mass matrix of absolute coordinates."""
        x, table = self.values, self.values.system.bodies
        return x.unforced.cache.get("mass", None, 1, lambda: self._entries(table.inertia, table.mass))

    def inverse_mass_root(self, movable: np.ndarray, dense: bool = False):
        """Return R, sparse unless ``dense``, with R R^T the inverse mass matrix of absolute coordinates; 0 for fixed
        velocities.

        Missing inertias are substituted.
        """
        table = self.values.system.bodies
        return self._blocks(table.inverse_inertia, table.inverse_mass, movable, dense)

    def _blocks(self, turning: np.ndarray, shifting: np.ndarray, root: np.ndarray | None = None, dense: bool = False):
        """Return the matrix of `_entries`, sparse unless ``dense``. With ``root``: its square root, rows times these
        factors.
        """
        rows, columns, entries = self._entries(turning, shifting, root is not None)
        entries = entries if root is None else entries * root[rows]
        nv = self.structure.nv
        if dense:
            out = np.zeros((nv, nv), entries.dtype)
            out[rows, columns] = entries
            return out
        import scipy.sparse as sp

        return sp.csr_matrix((entries, (rows, columns)), shape=(nv, nv))

    def _entries(
        self, turning: np.ndarray, shifting: np.ndarray, root: bool = False
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return rows, columns and entries of a matrix with one block per body, or of its square root.

        A block is ``shifting`` (nb,) times the identity, and the matrix of ``turning`` (nb, 9).
        """
        S = self.values.system
        J = turning.reshape(-1, 3, 3)
        if root:
            if np.iscomplexobj(J):
                raise TypeError("the root of complex inertias is not known; give real parameters")
            w, V = np.linalg.eigh(J)
            J = (V * np.sqrt(np.maximum(w, 0.0))[:, None, :]) @ V.transpose(0, 2, 1)
            shifting = np.sqrt(shifting)
        none = np.zeros(0, np.int64)
        i, j, x = [none], [none], [np.zeros(0)]
        plane = self.structure.model.planar
        used = slice(2, 3) if plane else slice(0, 3)
        for n in np.unique(S.tree.nv):
            b = np.flatnonzero(S.tree.nv == n)
            v0 = S.tree.v[b]
            shifts, turns = np.split(np.arange(n), [2 if plane else 3])
            at = v0[:, None] + shifts
            i += [at.ravel(), np.repeat(v0[:, None] + turns, len(turns), axis=1).ravel()]
            j += [at.ravel(), np.tile(v0[:, None] + turns, len(turns)).ravel()]
            x += [np.repeat(shifting[b], len(shifts)), J[b, used, used].ravel() if len(turns) else np.zeros(0)]
        return np.concatenate(i), np.concatenate(j), np.concatenate(x)


def compile_mechanism(
    model: Model,
    *,
    parameters: Mapping[str, complex] | None = None,
    far: bool = False,
    positions: bool = False,
    holds: Sequence[Initial] = (),
    held: Mapping[str, complex] | None = None,
    tree: Sequence[str] = (),
    coupled: bool = False,
    solved: bool = True,
    switches: bool = False,
    outputs: Sequence[str] = (),
) -> CompiledMechanism:
    """Compile a mechanism (see `tables.structure` and `tables.values`)."""
    choices = Choices(
        far=far,
        positions=positions,
        holds=tuple(holds),
        tree=tuple(tree),
        coupled=coupled,
        solved=solved,
        switches=switches,
        outputs=tuple(outputs),
    )
    with garbage_collection_paused():
        x = values(structure(model, choices), parameters, held)
    return CompiledMechanism(x, initial_hints(x), dict(parameters or {}))


def initial_hints(x: Values) -> np.ndarray:
    """Return the states of the reference configuration: no turns of joints, no works, bodies' own angles.

    Positions on curves are those nearest to the followers.
    """
    s = x.structure
    z = np.zeros(len(s.states), x.q.dtype)
    z[: len(s.controls)] = initial_controller_states(s, x.numbers)
    for t in s.terms:
        if t.hint >= 0 and isinstance(t.owner, (Body, Frame)):
            z[t.hint] = x.poses.turned(t.owner)
    for e in (*s.model.joints, *s.model.forces):
        if (name := f"{e.name}.place") in s.state_at:
            z[s.state_at[name]] = e.nearest(x.numbers[e.name], *x.poses.ends(e))[0]  # type: ignore[attr-defined, arg-type]
    return z


# Python's cyclic garbage collector is paused while many long-lived objects are created.


@contextmanager
def garbage_collection_paused() -> Iterator[None]:
    """Pause garbage collection, which would repeatedly search a large mechanism's objects and free none."""
    before = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if before:
            gc.enable()


HALF_TURN = 1e-3  # cosine of half an angle below which the angle counts as half a turn


def tangent_rate(c: CompiledMechanism, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """Return the change along the velocities that corresponds to changes of the coordinates, (nv,)."""
    S = c.values.system
    out = np.zeros(c.structure.nv)
    for b in range(len(S.tree.parent)):
        q0, v0 = int(S.tree.q[b]), int(S.tree.v[b])
        n = count_plain_coordinates(S, b)
        out[v0 : v0 + n] = dq[q0 : q0 + n]
        k, w = quaternion_at(S, b)
        if k >= 0:
            (a, *u), (e, *p) = q[k : k + 4], dq[k : k + 4]
            out[w : w + 3] = 2.0 * (a * np.array(p) - e * np.array(u) - np.cross(u, p))
    return out


def tangent_step(c: CompiledMechanism, q: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the step along the velocities from one position to another, (nv,), as ``retract`` takes it.

    Rotations of bodies in space are Cayley steps, 2 tan(angle / 2) about the axis, bounded near half a turn. Planar
    angles include whole turns.
    """
    S = c.values.system
    out = np.zeros(c.structure.nv)
    for b in range(len(S.tree.parent)):
        q0, v0 = int(S.tree.q[b]), int(S.tree.v[b])
        n = count_plain_coordinates(S, b)
        out[v0 : v0 + n] = other[q0 : q0 + n] - q[q0 : q0 + n]
        k, w = quaternion_at(S, b)
        if k >= 0:
            (a, *u), (e, *p) = q[k : k + 4], other[k : k + 4]
            turn = a * np.array(p) - e * np.array(u) - np.cross(u, p)
            cosine = a * e + np.dot(u, p)
            out[w : w + 3] = 2.0 * turn / (cosine if abs(cosine) > HALF_TURN else HALF_TURN)
    return out
