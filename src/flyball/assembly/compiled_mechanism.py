"""The compiled mechanism: tables, workspace, evaluation at a state, and how its arrays are read back by name.

`CompiledMechanism` is what every analysis evaluates. Also the steps along the velocities that lead from one
position to another.
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
from ..engine.projection import NONE
from ..model.body import Body, Frame, Initial
from ..model.model import Model
from ..numerics.integrators.butcher_tableaux import Tableau
from ..numerics.integrators.time_loop import StepState
from ..tables.forest import tree_joint_steps
from ..tables.law_inputs import initial_controller_states
from ..tables.reference_configuration import BodyState, positions
from ..tables.structure import Choices, structure
from ..tables.structure_definition import Structure, velocity_names
from ..tables.table_definitions import System, Work, assign
from ..tables.values import Values, values


@dataclass
class CompiledMechanism:
    """A compiled mechanism with scratch of its own."""

    values: Values
    z: np.ndarray  # turns of angles and places on curves, as last evaluated; work states are zero
    parameters: dict[str, Any] = field(default_factory=dict)  # values in place of the model's own
    system: System = field(init=False, repr=False, compare=False)  # the values' tables, or with addresses of `made`
    made: Any = field(default=None, init=False, repr=False, compare=False)  # code that it runs on, if not all's

    def __post_init__(self) -> None:
        self.system = self.values.system

    def __getstate__(self) -> dict[str, Any]:
        """Without scratch, and without addresses, which mean nothing in another process."""
        return {k: x for k, x in vars(self).items() if k not in ("work", "scratch", "system", "made")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, system=state["values"].system, made=None)

    def run_on(self, code: Any) -> None:
        """From now on code that was made for this mechanism does what it can for the engine; the scratch is kept."""
        x, before = self.values, vars(self).pop("scratch", None)
        vars(self).pop("work", None)
        self.made, self.system = code, x.kept.get("made", id(code), 1, lambda: (code, code.system(x.system)))[1]
        if before is not None:
            kept = self.work._replace(flat=before.fields.flat)  # that of the code itself is longer now
            assign(kept, before.fields)

    def run_on_tables(self) -> None:
        """From now on the engine's own loops do all."""
        self.made, self.system = None, self.values.system

    @cached_property
    def work(self) -> Work:
        """Scratch of its own."""
        if self.system.const.dtype.kind in "fc":
            return self.scratch.fields  # type: ignore[no-any-return]
        w = allocate_work(self.structure, self.system)
        w.options.stabilization, w.options.solve_tolerance = NONE, 1e-13
        return w

    @cached_property
    def scratch(self) -> PooledBuffer:
        """The same as compiled code has it."""
        made = pooled_work(self.structure, self.system, self.system.const.dtype)
        made.array("options").stabilization, made.array("options").solve_tolerance = NONE, 1e-13
        return made

    def array(self, name: str) -> Any:
        """An array of the scratch, without the others."""
        return self.scratch.array(name)

    @property
    def buffers(self) -> tuple[Any, Any]:
        """The tables and the scratch as kernels take them: a System and a Work that need not be described again."""
        return struct_tables(self.structure, self.system), self.scratch

    def bound(self, R: Tableau, clock: StepState, out: np.ndarray) -> BoundKernel:
        """The engine bound to the tables and the scratch that are its own now; as `entry_point.run_task` else."""
        return BoundKernel(engine, *self.buffers, StructBuffer(R), StructBuffer(clock), StructBuffer(OutputBuffer(out)))

    @property
    def structure(self) -> Structure:
        """The integers."""
        return self.values.structure

    @property
    def y(self) -> np.ndarray:
        """The drawn state."""
        return np.concatenate([self.values.q, self.values.v, self.z])

    def again(self) -> CompiledMechanism:
        """The same with scratch of its own; turns and places as here."""
        return CompiledMechanism(self.values, self.z.copy(), self.parameters)

    def at(self, t: float, q: np.ndarray, v: np.ndarray, task: int = POSITION) -> tuple[int, np.ndarray]:
        """Evaluate at a state; rows and kinematics are left in ``work``. Returns (status, dy).

        Turns and places are those nearest to the last ones.
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
        """What a large step is along every velocity: the mechanism's length [m], or a radian, (nv,)."""
        return np.array([self.values.length if n.unit == "m" else 1.0 for n in velocity_names(self.structure)])

    @cached_property
    def metric(self) -> np.ndarray:
        """Whether the value of a row is a length [m]; else it is a turn, or a cosine, (nr,)."""
        out = np.zeros(len(self.structure.rows), bool)
        for t in self.structure.terms:
            if not t.measured:
                out[t.row] = t.formula.measure == "m"
        return out

    @cached_property
    def has_curves(self) -> bool:
        """Whether a term leans on a place on a curve."""
        return any(t.formula.of_kind.place for t in self.structure.terms)

    def find_places(self) -> None:
        """Take for the places on curves those nearest of all at the poses last evaluated, wherever one was before."""
        for t in self.structure.terms:
            if t.formula.of_kind.place:
                F, M = ((x[:3], x[3:12].reshape(3, 3)) for x in self.work.FK[[t.F, t.M]])
                self.z[t.hint] = t.element.nearest(self.values.numbers[t.element.name], F, M)[0]  # type: ignore[attr-defined]

    @property
    def hints(self) -> dict[str, float]:
        """Turns and places by name."""
        return dict(zip(self.structure.states, self.z.tolist(), strict=True))

    def follow(self, hints: Mapping[str, float]) -> None:
        """Take turns and places from elsewhere."""
        for name, k in self.structure.state_at.items():
            if name in hints and not name.endswith(".work"):
                self.z[k] = hints[name]

    def moving(self, t: float, q: np.ndarray, v: np.ndarray) -> dict[str, BodyState]:
        """How every body moves at a state."""
        W = self.work
        self.at(t, q, v)
        angles = turned_angles(self.values, W, q) if self.structure.model.planar else {}
        out = {}
        K = W.BK.copy()
        R = K[:, 3:12].reshape(-1, 3, 3)
        for name, b in self.structure.place.items():
            if b >= 0:
                out[name] = BodyState(K[b, :3], R[b], K[b, 15:18], K[b, 12:15], angles.get(name, 0.0))
        return out

    def take(self, other: CompiledMechanism, t: float, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(q, v) of this mechanism in the state (t, q, v) of it in other coordinates; turns and places too."""
        hints = other.hints | other.turned(q)
        self.follow(hints)
        same = other.drawn(q) and self.values.given is other.values.given
        bodies = other.moving(t, q, v) if v.any() or not same else {}
        own = self.values.q.copy() if same else positions(self.values, bodies, hints)
        self.at(t, own, np.zeros(self.structure.nv))
        return own, joint_velocities(self.values, bodies, self.work) if bodies else np.zeros(self.structure.nv)

    def drawn(self, q: np.ndarray) -> bool:
        """Whether that is the position that is drawn, with the turns that it is drawn with."""
        return np.array_equal(q, self.values.q) and np.array_equal(self.z, initial_hints(self.values))

    def turned(self, q: np.ndarray) -> dict[str, float]:
        """Angles of joints that are coordinates, by name, as the states that count turns have them."""
        s = self.structure
        return {
            f"{t.joint.name}.{p.coordinate}": t.joint.coordinates[p.coordinate].sign * q[s.tables["tree"].q[row]]
            for t, row, p in tree_joint_steps(s)
            if p.kind == "R" and p.coordinate in t.joint.coordinates
        }

    def jacobian(self) -> np.ndarray:
        """Dense copy of the constraint Jacobian last evaluated, (nr, nv)."""
        S = self.values.system
        nr, row_p = len(S.rows.law), S.row_start[: len(S.rows.law) + 1]
        n = row_p[-1]
        out = np.zeros((nr, self.structure.nv))
        np.add.at(out, (np.repeat(np.arange(nr), np.diff(row_p)), S.column[:n]), self.work.G[:n])
        return out

    def sparse_jacobian(self):
        """Sparse copy of the constraint Jacobian last evaluated."""
        import scipy.sparse as sp

        S = self.values.system
        row_p = S.row_start[: len(S.rows.law) + 1]
        n = row_p[-1]
        return sp.csr_matrix((self.work.G[:n].copy(), S.column[:n], row_p), shape=(len(S.rows.law), self.structure.nv))

    def mass(self):
        """Sparse mass matrix of absolute coordinates, (nv, nv)."""
        table = self.values.system.bodies
        return self._blocks(table.inertia, table.mass)

    def kinetic_energy(self, v: np.ndarray) -> float:
        """Kinetic energy [J] at velocities v (nv,) of absolute coordinates."""
        if not v.any():
            return 0.0
        i, j, M = self.mass_entries()
        return float(0.5 * (v[i] * M * v[j]).sum())

    def mass_entries(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows, columns and entries of the mass matrix of absolute coordinates."""
        x, table = self.values, self.values.system.bodies
        return x.unforced.kept.get("mass", None, 1, lambda: self._entries(table.inertia, table.mass))

    def inverse_mass_root(self, movable: np.ndarray, dense: bool = False):
        """R, sparse if not told, with R R^T the inverse mass matrix of absolute coordinates; 0 for the fixed.

        Missing inertias have stand-ins.
        """
        table = self.values.system.bodies
        return self._blocks(table.inverse_inertia, table.inverse_mass, movable, dense)

    def _blocks(self, turning: np.ndarray, shifting: np.ndarray, root: np.ndarray | None = None, dense: bool = False):
        """The matrix of `_entries`, sparse if not told. With ``root`` its square root, rows times these numbers."""
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
        """Rows, columns and entries of a matrix with one block a body, or of its square root.

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
) -> CompiledMechanism:
    """Compile a mechanism (see ``structure`` and ``values``)."""
    choices = Choices(
        far=far,
        positions=positions,
        holds=tuple(holds),
        tree=tuple(tree),
        coupled=coupled,
        solved=solved,
        switches=switches,
    )
    with garbage_collection_paused():
        x = values(structure(model, choices), parameters, held)
    return CompiledMechanism(x, initial_hints(x), dict(parameters or {}))


def initial_hints(x: Values) -> np.ndarray:
    """States as drawn: joints have no turns yet and works are none; bodies are turned as drawn, places on curves are
    those nearest to the followers.
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


# Python's collector of cycles, kept away while very many objects are made that stay.


@contextmanager
def garbage_collection_paused() -> Iterator[None]:
    """No collection in here, where it would look through a large mechanism's objects time and again and free none."""
    before = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if before:
            gc.enable()


HALF_TURN = 1e-3  # cosine of half an angle below which it counts as half a turn


def tangent_rate(c: CompiledMechanism, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """The change along the velocities that changes of the coordinates are, (nv,)."""
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
    """The step along the velocities that leads from one position to another, (nv,): what ``retract`` takes.

    Turns of bodies in space are Cayley steps, 2 tan(angle / 2) about the axis; towards half a turn, where these have no
    end, they stay finite. Angles of the plane count whole turns.
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
