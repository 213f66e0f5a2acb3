"""The stepper: calls the compiled step loop, creates and enlarges its tables, records the residuals of solves."""

from __future__ import annotations

import ctypes
import time
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ...collision.contact_finder import ContactFinder
from ...collision.tables import DONE, ContactTable, Geometry, Movers
from ...compiler.kernels import StructBuffer, check_layout
from ...engine.entry_point import engine
from ...errors import ModelError
from ...numerics.complementarity.contact_problem import (
    MOST_SLABS,
    ContactProblem,
    ContactSolution,
    ContactWorkspace,
    Nodes,
    SolverSettings,
    allocate_solver,
    empty_problem,
)
from ...numerics.complementarity.friction_pyramid import MAX_UNKNOWNS
from ...numerics.complementarity.solve_history import COLUMNS, solve_history
from ...numerics.complementarity.solver_choice import PIVOTING_SOLVER
from ...numerics.thread_team import HelperThreads, new_team
from ...results.convergence import RESIDUALS, Convergence
from ...tables.table_definitions import Surfaces, assign, copied, named_arrays
from .free_bodies import rotation_matrices
from .mechanism_step import mechanism_kernel
from .step_loop import StepSolvers, bind_solvers, solver_counts, step_loop_kernel
from .stepping_tables import (
    NO_SOLUTION,
    STEP_TOO_LONG,
    TABLES_FULL,
    TASK_START,
    ContactMemory,
    FreeBodies,
    FreeBodyNumbers,
    Jobs,
    MechanismTables,
    SteppingState,
    StoredContacts,
    no_mechanism,
)

CALL_SECONDS = 0.05  # intended duration of one call of the loop [s]


MOST_STEPS_PER_CALL = 100_000  # largest number of steps in a call
MOST_HALVINGS = 6  # of a step that has no solution
MOST_IMPACT_HALVINGS = 12  # halvings of a step that is too long for the impacts of compliant contacts
REST_SHARE = 1e-2  # largest residual, relative to the velocity that gravity causes in a step
GROWTH_FACTOR = 1.5  # size of enlarged tables, relative to the size needed


DIVIDED_BODIES = 2000  # number of free bodies from which contacts are divided into slabs, for any number of threads
LAYERS = 3  # of bodies in a slab: a half slab is thicker than a body, so that contacts cross one border


class NoSolution(Exception):
    """The step of the mechanism has no solution, or its joints cannot be closed."""


class StepTooLong(Exception):
    """The step is too long to resolve an impact of compliant contacts."""


@dataclass
class StepWorkspaces:
    """Workspaces whose size is the number of contacts."""

    P: ContactProblem
    Q: ContactProblem
    R: ContactProblem
    X: ContactSolution
    Y: ContactSolution
    Z: ContactSolution
    E: ContactSolution
    W: ContactWorkspace
    O: SolverSettings
    F: StepSolvers
    T: StoredContacts
    U: StoredContacts


def make_workspaces(
    contacts: int,
    node: Nodes,
    turning: bool,
    A: MechanismTables,
    state: SteppingState,
    solver: str,
    team: np.ndarray,
    old: StepWorkspaces | None = None,
) -> StepWorkspaces:
    """Create workspaces for this number of contacts; contact history and velocities are taken from ``old``."""
    groups, lines, slabs = len(A.group) - 1, len(A.active), slab_count(len(node))
    P = empty_problem(contacts, len(node), groups, lines, int(A.count.needed), turning)._replace(
        node=node, half_slab=np.zeros(len(node) if slabs else 0, np.int64)
    )
    P.group[:] = A.group
    hard = {"mu": np.zeros(contacts), "soft": np.zeros(contacts), "turn": np.zeros((0, 2))}
    Q = P._replace(bias=np.zeros((contacts, 3)), **hard)
    R = P._replace(at=np.zeros((contacts, 2), np.int64), bias=np.zeros((contacts, 3)), least=np.zeros(contacts))
    X, W, O, _ = allocate_solver(P)
    O.count.slabs = slabs
    Y, E = allocate_solver(Q)[0], allocate_solver(P)[0]
    if old is not None:
        X.v[:], X.wide[:] = old.X.v, old.X.wide
        O = old.O
    Z = allocate_solver(P)[0]._replace(v=X.v, wide=X.wide)
    F = bind_solvers(solver, (P, Q, R), X, W, O, state, team)
    kept = [ContactMemory.blank(contacts) for _ in range(2)]
    if old is not None:
        for a, b in zip(kept, (old.T.memory, old.U.memory), strict=True):
            a[: len(b)] = b
        solver_counts(F)[:] += solver_counts(old.F)
    return StepWorkspaces(P, Q, R, X, Y, Z, E, W, O, F, StoredContacts(kept[0]), StoredContacts(kept[1]))


def slab_count(bodies: int) -> int:
    """Number of slabs of so many bodies, with some `LAYERS` of them each if they fill a cube; 0 for few bodies.

    It is even, so that two threads have equally many.
    """
    return 2 * min(MOST_SLABS // 2, round(bodies ** (1.0 / 3.0) / (2 * LAYERS))) if bodies >= DIVIDED_BODIES else 0


def free_bodies(mass: np.ndarray, inertia: np.ndarray, turn: np.ndarray, planar: bool) -> FreeBodies:
    """Create the tables of free bodies.

    Parameters
    ----------
    mass : (n,) [kg]
    inertia : (n, 3, 3) [kg m^2]
        About the mass centre, in body axes; in the plane its last entry counts.
    turn : (n, 4)
        Unit quaternions, body axes to the world.
    planar : bool
    """
    n = len(mass)
    body = FreeBodyNumbers.blank(n)
    body.mass[:], body.inverse_mass[:] = mass, 1.0 / mass
    if planar:  # torques act about z only: an isotropic inertia is equivalent
        inertia = inertia[:, 2, 2, None, None] * np.eye(3)
    inverse = np.linalg.inv(inertia)
    for packed, J in ((body.inertia, inertia), (body.inverse_inertia, inverse)):
        for k, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
            packed[:, k] = J[:, i, j]
    size = np.trace(inertia, axis1=1, axis2=2) / 3.0
    odd = np.abs(inertia - size[:, None, None] * np.eye(3)).max(axis=(1, 2), initial=0.0)
    body.isotropic[:] = odd <= 1e-12 * size
    return FreeBodies(body, turn.copy(), np.zeros((n, 6)), np.zeros((n, 6)), np.zeros(n), np.zeros((n, 18)))


def problem_nodes(free: FreeBodies) -> Nodes:
    """Return the nodes of the cone problem; those of bodies with anisotropic inertia are filled in every step."""
    out: Nodes = Nodes.blank(len(free.body))
    out.inverse_mass, out.inverse_inertia = free.body.inverse_mass, free.body.inverse_inertia
    out.isotropic = free.body.isotropic
    return out


class SavedState(NamedTuple):
    """Copies of all that a step changes: see `ImpulseStepper.save`."""

    free: FreeBodies
    movers: Movers
    run: SteppingState
    finder: dict[str, Any]  # by attribute of `ContactFinder`
    workspaces: dict[str, Any]  # by attribute of `StepWorkspaces`
    joints: dict[str, Any]  # by field of `MechanismTables`


CONTACT_TABLES = ("now", "before", "midway", "search")  # of `ContactFinder`, which a step changes
KEPT_WORKSPACES = ("P", "Q", "R", "X", "Y", "Z", "E", "W", "O", "T", "U")  # all but the solvers', which hold addresses
CONSTANT_TABLES = ("S", "R", "door", "job")  # of `MechanismTables`: no state


def _shapes(tables: dict[str, Any]) -> list[tuple[int, ...]]:
    return [x.shape for table in tables.values() for _, x in named_arrays(table)]


class ImpulseStepper:
    """Time stepping of free bodies, shapes, contact laws and the jointed mechanism.

    Parameters
    ----------
    geometry : Geometry
    free : FreeBodies
        Movers 0 to n - 1.
    position : (n, 3) [m]
        Of the mass centres.
    velocity : (n, 6) [m/s, rad/s]
        Of the mass centres, and angular velocities, in world axes.
    laws : Surfaces
    state : RunState
        With time, options and the solvers' addresses; the address of the contact search is set here.
    margin : float [m]
        Gap up to which non-approaching shapes are in contact.
    solver : str
        Of the cone problems, by its name in ``numerics/complementarity/solver_choice.py``.
    joints : MechanismTables, optional
        The jointed mechanism: the movers after the free bodies.
    threads : int
        Number of threads, where contacts are divided among them.
    """

    def __init__(
        self,
        geometry: Geometry,
        free: FreeBodies,
        position: np.ndarray,
        velocity: np.ndarray,
        laws: Surfaces,
        state: SteppingState,
        margin: float,
        solver: str = "auto",
        joints: MechanismTables | None = None,
        threads: int = 1,
    ) -> None:
        n = len(free.body)
        self.team, self.threads = new_team(), threads
        self.geometry, self.laws, self.state = geometry, laws, state
        self.joints = no_mechanism() if joints is None else joints
        count = n + len(self.joints.mover)
        self.free = free._replace(start=np.zeros((count, 18)))
        self.movers = Movers(np.zeros((count, 12)), np.zeros((count, 6)))
        self.movers.pose[:n, :3] = position
        self.movers.pose[:n, 3:] = rotation_matrices(free.turn)
        self.movers.twist[:n] = velocity
        self.finder = ContactFinder(geometry, margin=margin)
        turning = bool((laws.pair[..., 3:5] > 0.0).any())
        self.solver = solver
        self.workspaces = make_workspaces(
            len(self.finder.now.at), problem_nodes(free), turning, self.joints, state, solver, self.team
        )
        self.workspaces.X.v[:, :6] = velocity
        self.turning = turning
        self.quota = 1
        self.enough = float(
            state.tolerances.velocity
        )  # allowed residual of velocities [m/s] in a step that is not very short
        self.halved = 0  # steps that were divided
        self.recorder: SolveRecorder | None = None  # of the residuals of solves
        self._arguments: list[StructBuffer] = []  # of the step loop; empty after a table was replaced
        self._addresses: list[int] = []
        self._gravity = float(np.linalg.norm(state.gravity))
        if joints is not None:
            self._start_joints()

    def _start_joints(self) -> None:
        """Evaluate the mechanism at its start."""
        self.joints.door[0] = engine.address
        self.state.addresses.mechanism = mechanism_kernel.address
        if (
            mechanism_kernel(
                self.joints, self.movers, self.finder.now, self.workspaces.P, self.workspaces.X, TASK_START
            )
            != 0
        ):
            raise NoSolution

    def run(self, steps: int, h: float) -> None:
        """Take as many steps of h seconds, in calls short enough for keyboard interrupts.

        A step without solution is divided; ``state.times.step`` is the length of the last one.

        Raises
        ------
        ModelError
            If the contact search fails.
        NoSolution
            If shorter steps have no solution either.
        """
        counts = self.state.counts
        while steps > 0:
            began = time.perf_counter()
            asked = counts.steps_left = min(steps, self.quota)
            self.state.times.longest_step = h
            self._set_step(h)
            try:
                self._call_loop()
            except (NoSolution, StepTooLong) as reason:
                left = int(counts.steps_left)
                stuck = isinstance(reason, NoSolution)
                self._halve_step(h, MOST_HALVINGS if stuck else MOST_IMPACT_HALVINGS)
                self.halved += stuck
                counts.steps_left = left - 1
            steps -= int(asked - counts.steps_left)
            took = max(time.perf_counter() - began, 1e-6)
            self.quota = int(max(1, min(4 * self.quota, self.quota * CALL_SECONDS / took, MOST_STEPS_PER_CALL)))

    def _set_step(self, h: float) -> None:
        """Set the length of the next steps, and the allowed residual of their velocities.

        In a step so short that gravity causes less velocity than that residual, resting bodies would not be supported.
        """
        state = self.state
        falls = REST_SHARE * h * self._gravity
        state.times.step, state.tolerances.velocity = h, min(self.enough, falls) if falls > 0.0 else self.enough

    def _halve_step(self, h: float, depth: int) -> None:
        """Take a step of h, which has no solution, as two; at the last depth without requiring convergence."""
        if depth == 0:
            raise NoSolution
        divides = int(self.state.options.divides_steps)
        try:
            for _ in range(2):
                self._set_step(0.5 * h)
                self.state.counts.steps_left = 1
                self.joints.count.accept_unsettled = depth == 1
                self.state.options.divides_steps = divides and depth > 1
                try:
                    self._call_loop()
                except (NoSolution, StepTooLong):
                    self._halve_step(0.5 * h, depth - 1)
        finally:
            self.joints.count.accept_unsettled = 0
            self.state.options.divides_steps = divides

    def _call_loop(self) -> None:
        """Take ``state.counts.steps_left`` steps, enlarging tables that are full."""
        self.state.addresses.search = self.finder.address
        while True:
            if self.recorder is not None:
                self.recorder.attach()
            if not self._arguments:
                self._arguments = self._loop_arguments()
                self._addresses = [x.address for x in self._arguments]
            with HelperThreads(self.team, self.threads - 1 if self.workspaces.O.count.slabs > 1 else 0):
                status = step_loop_kernel.call(*self._addresses)
            if self.recorder is not None:
                self.recorder.raise_error()
            needed = self.workspaces.O.count.needed_numbers if self.solver == PIVOTING_SOLVER else 0
            if needed > 0:
                raise ModelError(
                    f"solver {self.solver!r} of Stepping solves at most {MAX_UNKNOWNS} unknowns for bodies in contact "
                    f"with each other (2 + directions for a contact with friction), and {needed} are needed; give "
                    f"fewer directions=, or solver='pyramid'"
                )
            if status == DONE:
                return
            if status == NO_SOLUTION:
                raise NoSolution
            if status == STEP_TOO_LONG:
                raise StepTooLong
            self._arguments = []
            if status == TABLES_FULL:
                self._enlarge_row_tables()
                continue
            f = self.finder
            f.enlarge(status, (f.now if self.state.counts.steps_taken % 2 == 0 else f.before).count)
            if len(f.now.at) > len(self.workspaces.P.mu):
                self.workspaces = self._enlarged_workspaces(len(f.now.at))

    def _loop_arguments(self) -> list[StructBuffer]:
        """Return the arguments of the step loop."""
        r, f = self.workspaces, self.finder
        tables = (
            self.geometry, self.joints, self.movers, f.now, f.before, f.midway, f.search, r.P, r.Q, r.R, r.X, r.Y, r.Z,
            r.E, r.W, r.O, r.F, self.free, self.laws, self.state, r.T, r.U,
        )  # fmt: skip
        made = [StructBuffer(x) for x in tables]
        for of, x in zip(step_loop_kernel.parameters, made, strict=True):
            check_layout(step_loop_kernel, of, x)
        return made

    def save(self) -> SavedState:
        """Return a copy of the state, from which the same steps give the same bits."""
        found, work = vars(self.finder), vars(self.workspaces)
        return SavedState(
            copied(self.free), copied(self.movers), copied(self.state),
            {name: copied(found[name]) for name in CONTACT_TABLES},
            {name: copied(work[name]) for name in KEPT_WORKSPACES},
            {k: copied(x) for k, x in self.joints._asdict().items() if k not in CONSTANT_TABLES},
        )  # fmt: skip

    def restore(self, saved: SavedState) -> None:
        """Return to a saved state, of this stepper or of another one of the same mechanism."""
        assign(self.free, saved.free)
        assign(self.movers, saved.movers)
        for table, values in zip(self.state[:-1], saved.run[:-1], strict=True):  # all but the addresses
            table[...] = values
        found, work = vars(self.finder), vars(self.workspaces)
        if _shapes({k: found[k] for k in CONTACT_TABLES}) != _shapes(saved.finder) or _shapes(
            {k: work[k] for k in KEPT_WORKSPACES}
        ) != _shapes(saved.workspaces):  # tables were enlarged since
            found |= {name: copied(x) for name, x in saved.finder.items()}
            self.joints.count.needed = len(saved.workspaces["P"].J)
            self.workspaces = make_workspaces(
                len(self.finder.now.at), self.workspaces.P.node, self.turning, self.joints, self.state, self.solver,
                self.team,
            )  # fmt: skip
            self._arguments, work = [], vars(self.workspaces)
        for name, values in saved.finder.items():
            assign(found[name], values)
        for name, values in saved.workspaces.items():
            assign(work[name], values)
        for name, values in saved.joints.items():
            assign(getattr(self.joints, name), values)

    def _enlarge_row_tables(self) -> None:
        """Enlarge the tables for rows of contacts on the mechanism."""
        A = self.joints
        A.count.needed = int(GROWTH_FACTOR * A.count.needed)
        self.joints = A._replace(job=Jobs.blank(int(GROWTH_FACTOR * A.count.jobs) + 1))
        self.workspaces = self._enlarged_workspaces(len(self.workspaces.P.mu))

    def _enlarged_workspaces(self, contacts: int) -> StepWorkspaces:
        """Return workspaces for this number of contacts that continue from the present ones."""
        r = self.workspaces
        return make_workspaces(contacts, r.P.node, self.turning, self.joints, self.state, self.solver, self.team, r)

    def last(self) -> tuple[ContactTable, ContactMemory]:
        """Return the contacts of the last step, and their history."""
        if self.state.counts.steps_taken % 2 == 1:
            return self.finder.now, self.workspaces.T.memory
        return self.finder.before, self.workspaces.U.memory


SOLVER_CALL = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 5, ctypes.c_int64)
SAME_TIME = 1e-9  # of a step: tolerance of the ends of a time range


class SolveRecorder:
    """Calls the solver of the velocities, and records its residuals over the iterations where they are wanted.

    The last solve of a step counts: compliant contacts need several, and a step is repeated when tables were too small.

    Parameters
    ----------
    stepper : ImpulseStepper
    wanted : "all", int or (float, float)
        All steps, every n-th step, or those that end within a time range [s].
    """

    def __init__(self, stepper: ImpulseStepper, wanted: str | int | tuple[float, float]) -> None:
        self.stepper, self.wanted = stepper, wanted
        self.histories: dict[int, tuple[float, np.ndarray]] = {}  # by the number of the step: its end, residuals
        self._callback = SOLVER_CALL(self._solve)
        self.address = int(ctypes.cast(self._callback, ctypes.c_void_p).value or 0)
        self._solver = 0
        self._error: BaseException | None = None

    def raise_error(self) -> None:
        """Raise what went wrong while a solve was recorded; compiled code cannot pass it on."""
        if self._error is not None:
            raise self._error

    def attach(self) -> None:
        """Take the solver's place; again after tables were enlarged, because they bind the solver anew."""
        addresses = self.stepper.state.addresses
        if int(addresses.velocities) != self.address:
            self._solver = int(addresses.velocities)
            addresses.velocities = self.address

    def _is_wanted(self, step: int, end: float) -> bool:
        if isinstance(self.wanted, str):
            return True
        if isinstance(self.wanted, int):
            return step % self.wanted == 0
        slack = SAME_TIME * float(self.stepper.state.times.step)
        return self.wanted[0] - slack <= end <= self.wanted[1] + slack

    def _solve(self, *words: int) -> int:
        """Solve, as the solver would: called by the step loop."""
        s, r = self.stepper, self.stepper.workspaces
        step, end = int(s.state.counts.steps_taken), float(s.state.times.now + s.state.times.step)
        try:
            if (r.P.size[0] or r.P.size[3]) and self._is_wanted(step, end):
                self.histories[step] = end, solve_history(s.solver, r.P, copied(r.X), r.O)
        except BaseException as error:  # Ctrl-C too: an exception in a callback would be lost
            self._error = error
        return int(SOLVER_CALL(self._solver)(*words))

    def convergence(self) -> Convergence:
        """Return all residuals recorded."""
        found = list(self.histories.values())
        rows = np.concatenate([np.zeros((0, COLUMNS)), *(rows for _, rows in found)])
        begin = np.cumsum([0, *(len(rows) for _, rows in found)])
        ends = np.array([end for end, _ in found])
        columns = dict(zip(("iteration", *RESIDUALS), rows.T, strict=True))
        return Convergence(ends, begin, solver=self.stepper.solver, **columns)
