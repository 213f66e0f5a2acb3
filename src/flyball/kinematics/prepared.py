"""The equations of motion on plain arrays, for robotics and control: what `Mechanism.prepare` returns.

M(q) vdot = f(t, q, v) + G(t, q)^T lam + effort        g(t, q) = 0        qdot = T(q) v
"""

from __future__ import annotations

import numbers
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..analysis_options import AnalysisOptions
from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import CompiledMechanism
from ..engine.entry_point import MOTION
from ..engine.kinematics import coordinate_rates, retract, turned_angles
from ..engine.rows import BY_TIME
from ..errors import AnalysisError, ModelError
from ..forces.limit import Limit
from ..laws.bytecode import evaluate_jet
from ..laws.python_functions import function_fault
from ..model.model import Model
from ..model.unsupported_elements import acts_while_sliding, refuse_unsupported
from ..results.motion_record import FULL_TURN
from ..results.result import Result
from ..simulation.initial_state import InitialState, find_initial_state
from ..tables.structure_definition import velocity_names
from .closed_loops import ClosedLoops
from .conventions import Convention, continuous_joints, convention
from .inverse_kinematics import InverseKinematics, PoseRequest, closed_nearby, inverse_kinematics
from .recursive_methods import RecursiveMethods

NEARBY = 32
"""Number of positions near the start from which closed ones are searched, to see the usual rank of constraints."""


class Prepared(RecursiveMethods):
    """A mechanism in one kind of coordinates, at one set of parameter values. It is immutable.

    Threads may share it. Results depend on the arguments only. Whole turns of angles count as far as q contains them:
    for tree joints that rotate about one axis, and for everything in the plane. In space other angles (all of them in
    absolute coordinates, where a quaternion is the same after a turn) are those within half a turn of the start's. Cam
    followers are where the profile is nearest.

    Attributes
    ----------
    model : Mechanism
        As it was when it was prepared; later additions to the original have no effect.
    coordinates : str
        The kind of coordinates, and why.
    q, v : ndarray (nq,), (nv,)
        The start: as described and assembled at t = 0. A free spatial body has x, y, z of its centre of mass and a
        quaternion (scalar first) in q, and the velocity of that point in world axes and its angular velocity in body
        axes in v; a planar one x, y, angle. Tree joints have their coordinates, measured from the drawn
        configuration, spherical ones a quaternion and the angular velocity in the moved axes.
    names : tuple of str
        The coordinate whose rate each velocity is, (nv,).
    rows : tuple of str
        Element and restrained quantity of each constraint row, (nr,).
    specialized : bool
        Whether `rnea`, `aba`, `mass_matrix` and the derivatives use machine code generated for this mechanism.
    stops : tuple of str
        Rigid stops (`Limit`), which count as open at every state; `simulate` sees them.
    """

    model: Any
    coordinates: str
    q: np.ndarray
    v: np.ndarray
    names: tuple[str, ...]
    rows: tuple[str, ...]
    stops: tuple[str, ...]
    specialized: bool
    _start: Assembly
    _here: threading.local

    def __init__(self, start: InitialState, model: Model, stops: tuple[str, ...], specialize: bool) -> None:
        c = start.assembly.compiled
        q, v = start.assembly.q.copy(), start.assembly.v.copy()
        for a in (q, v):
            a.setflags(write=False)
        names = tuple(n.name for n in velocity_names(c.structure))
        rows = tuple(f"{r.element.name}: {r.label}" for r in c.structure.rows)
        vars(self).update(model=model, stops=stops, specialized=specialize)
        vars(self).update(coordinates=start.coordinates, q=q, v=v, names=names, rows=rows)
        vars(self).update(_start=start.assembly.again(), _here=threading.local())

    def __setattr__(self, name: str, value: Any) -> None:
        """Raise an error: it is immutable."""
        raise ModelError(f"{name!r} cannot be set: a prepared mechanism is constant; prepare the changed mechanism")

    @property
    def parameters(self) -> dict[str, float]:
        """Values of its parameters [SI]."""
        return self._start.compiled.values.parameter_values

    def simulate(self, t_end: float | str, **options: Any) -> Result:
        """Simulate as `Mechanism.simulate` in these coordinates, with these parameter values.

        Parameters
        ----------
        t_end : float or str [s]
            End of the motion.
        **options
            Those of `Mechanism.simulate`; ``parameters`` change further values.
        """
        if "coordinates" in options:
            raise ModelError("coordinates were chosen when the mechanism was prepared: m.prepare(coordinates=...)")
        layer = "joint" if self._start.compiled.structure.tree else "absolute"
        values = self.parameters_given | dict(options.pop("parameters", None) or {})
        return self.model.simulate(t_end, coordinates=layer, parameters=values, **options)

    @property
    def parameters_given(self) -> dict[str, Any]:
        """Parameter values with which it was prepared, in place of the model's."""
        return dict(self._start.compiled.parameters)

    def acceleration(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return vdot, (nv,) [m/s^2, rad/s^2], including constraint reactions.

        Coordinates that drivers prescribe take their prescribed values at t, also in `multipliers`, `efforts` and
        `forces`.

        Raises
        ------
        AnalysisError
            If a law gives no finite number there, or the equations have no solution.
        """
        return self._moving(t, q, v).work.velocities.solved.copy()

    def multipliers(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return lam, (nr,): reactions are G^T lam."""
        return self._moving(t, q, v).work.rows.multiplier.copy()

    def efforts(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the driver efforts along the coordinates that they prescribe, (nv,) [N, N m]; 0 for the others."""
        return self._moving(t, q, v).work.velocities.effort.copy()

    def forces(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return f, (nv,) [N, N m]: all forces but reactions, gyroscopic ones included."""
        return self._moving(t, q, v).work.velocities.applied.copy()

    def jacobian(self, t: float, q: np.ndarray) -> np.ndarray:
        """Return G, (nr, nv): derivatives of the constraint rows along the velocities."""
        return self._at(self._workspace(), t, q, np.zeros(len(self.v))).jacobian()

    def constraint(self, t: float, q: np.ndarray) -> np.ndarray:
        """Return the constraint residuals g, (nr,) [m, rad, 1]; 0 for rows of velocities only."""
        return self._at(self._workspace(), t, q, np.zeros(len(self.v))).work.rows.value.copy()

    def constraint_rate(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return G v less the rates that drivers prescribe, (nr,) [m/s, rad/s]."""
        c = self._at(self._workspace(), t, q, v)
        return c.jacobian() @ np.asarray(v, float) - c.work.rows.nu

    def rates(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return qdot, (nq,): v, except for quaternions."""
        q, v = self._state(q, v)
        out = np.zeros(len(q))
        coordinate_rates(self._start.compiled.values.system, q, v, out)
        return out

    def step(self, q: np.ndarray, d: np.ndarray) -> np.ndarray:
        """Return q moved by the finite step d (nv,) along the velocities, (nq,); quaternions keep their length."""
        q, d = self._state(q, d)
        retract(self._start.compiled.values.system, q, d)
        return q

    def _loops(self) -> ClosedLoops:
        """Return its closed loops, for recursive dynamics; made on first use."""
        if "_closed_loops" not in vars(self):
            tree, turns = self._recursive, self._by_coordinates
            nearby = partial(closed_nearby, self, self._pose_request(self.model.bodies[0].name, self.q, NEARBY))
            vars(self)["_closed_loops"] = ClosedLoops(
                tree, self.names, self.rows, self.q, turns, self.mass_matrix, self.bias_forces, nearby
            )
        return vars(self)["_closed_loops"]  # type: ignore[no-any-return]

    def _scaled_rows(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values and Jacobians of constraint rows at many positions, lengths divided by the mechanism's."""
        loops = self._loops()
        found, units = loops.rows_at(q, np.zeros((len(q), len(self.v)))), loops.row_units()
        return found.value * units, found.jacobian * units[:, None]

    def inverse_kinematics(
        self,
        frame: str,
        position: Any = None,
        rotation: Any = None,
        *,
        near: np.ndarray | None = None,
        starts: int = 100,
        seed: int = 0,
    ) -> InverseKinematics:
        """Find the configurations at which a frame has a given position and orientation.

        By damped least squares from many starts at once: ``near``, and random configurations between the stops. An arm
        of six joints has up to 16 solutions but for whole turns of its joints; with more joints there is a continuum,
        of which some are found. Closed loops are closed in all of them. Without position and rotation all
        configurations that close them are looked for: of a parallel robot whose drives stand still its assembly modes.

        Parameters
        ----------
        frame : str
            A body (its reference frame) or a frame.
        position : point [m], optional
            Of the frame's origin, in the world. Not given: anywhere.
        rotation : orientation, optional
            Of the frame in the world: a quaternion (scalar first), Bryant angles [rad], or a matrix with the axes as
            columns; in the plane an angle [rad]. Not given: any.
        near : array_like, (nq,), optional
            The solution nearest to it comes first, and the search begins there. Not given: the initial state.
        starts : int
            Number of configurations to begin from.
        seed : int
            Of the random ones.

        Returns
        -------
        InverseKinematics
            Its ``q`` has a row for each configuration.

        Raises
        ------
        NotConverged
            If none is found; the message says how near the frame came.
        AnalysisError
            If there are drivers or curves besides closed loops.
        """
        first = self.q if near is None else self._states((near,))[0][0][0]
        return inverse_kinematics(self, self._pose_request(frame, first, starts, seed, position, rotation))

    def _pose_request(
        self, frame: str, near: np.ndarray, starts: int, seed: int = 0, position: Any = None, rotation: Any = None
    ) -> PoseRequest:
        x = self._recursive
        length, drawn = float(x.system.scales.length), x.system.bodies.offset[x.paths.body]
        rows = self._scaled_rows if self.rows else None
        sizes = x.compiled.sizes
        return PoseRequest(frame, position, rotation, near, starts, seed, rows, sizes, x.entries, drawn, length)

    def convention(
        self, program: str, *, joints: Sequence[str] | None = None, circles: Sequence[str] | None = None
    ) -> Convention:
        """Convert states to and from the convention of Pinocchio, MuJoCo or Drake.

        Free bodies have other coordinates and velocities there, joints may have another order, and values at the drawn
        configuration other than zero.

        Parameters
        ----------
        program : {"pinocchio", "mujoco", "drake"}
        joints : list of str, optional
            Names of joints in the order of their velocities, as ``list(model.names)[2:]`` of a free robot in Pinocchio;
            a free body that is not named among them comes first. Not needed where the joints form one chain.
        circles : list of str, optional
            Joints whose angle they store as cosine and sine. By default, for Pinocchio, revolute joints without stops:
            those of type continuous in URDF.

        Returns
        -------
        Convention
            Its ``from_flyball(q, v, a)`` and ``to_flyball(q, v, a)`` convert one state or many.

        Raises
        ------
        ModelError
            If a joint is not named, or the program has no counterpart of a point mass or a ball joint.
        """
        x = self._recursive
        if circles is None and program == "pinocchio":
            circles = continuous_joints(x, {e.coordinate_text() for e in self.model.limits if isinstance(e, Limit)})
        return convention(x, program, joints, circles)

    def __getstate__(self) -> dict[str, Any]:
        return {k: x for k, x in vars(self).items() if k not in ("_here", "_batch_dynamics", "_closed_loops")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, _here=threading.local())

    def lines(self) -> list[tuple[str, str]]:
        """Return labelled lines of text."""
        s = self._start.compiled.structure
        return [
            ("prepared", f"{self.model.name}, {s.nv} velocities, {len(s.rows)} constraint rows"),
            ("coordinates", self.coordinates),
            ("velocities", ", ".join(self.names[:12]) + (", ..." if len(self.names) > 12 else "")),
            *(
                [("open stops", ", ".join(self.stops[:12]) + (", ..." if len(self.stops) > 12 else ""))]
                * bool(self.stops)
            ),
        ]

    def as_dict(self) -> dict[str, Any]:
        """Return plain data: the start, names of velocities and rows, parameter values."""
        start = {"q": self.q.tolist(), "v": self.v.tolist()}
        names = {"velocities": list(self.names), "rows": list(self.rows)}
        return {"name": self.model.name, "coordinates": self.coordinates, "parameters": self.parameters} | names | start

    def __repr__(self) -> str:
        """Return the lines as text."""
        return "\n".join(f"{label:<12} {text}" for label, text in self.lines())

    def _workspace(self) -> CompiledMechanism:
        """Return this thread's own workspace, with the angles of the start."""
        found: CompiledMechanism | None = getattr(self._here, "workspace", None)
        if found is None:
            found = self._here.workspace = self._start.compiled.again()
        found.z = self._start.compiled.z.copy()
        return found

    def _moving(self, t: float, q: np.ndarray, v: np.ndarray) -> CompiledMechanism:
        c = self._at(self._workspace(), t, q, v, MOTION)
        if not np.isfinite(c.work.velocities.solved).all():
            found = c.structure.missed(c.work.stack) or function_fault(c.work.stack, c.structure.functions)
            why = found.message if found else "a force or a law gives no finite number, or the equations no solution"
            raise AnalysisError(f"{self.model.name!r} at t = {float(t):.6g} s: {why}")
        return c

    def _at(
        self, c: CompiledMechanism, t: float, q: np.ndarray, v: np.ndarray, task: int | None = None
    ) -> CompiledMechanism:
        q, v = self._state(q, v)
        if not (isinstance(t, numbers.Real) and np.isfinite(t)):
            raise ModelError(f"t is a finite number of seconds, not {t!r}")
        self._set_turn_counts(c, float(t), q)
        if c.has_curves:
            c.at(float(t), q, v)
            c.find_places()
        c.at(float(t), q, v) if task is None else c.at(float(t), q, v, task)
        return c

    def _set_turn_counts(self, c: CompiledMechanism, t: float, q: np.ndarray) -> None:
        """Set the angle states from the coordinates: whole turns since the start count where q contains them."""
        S = c.values.system
        if not len(S.angles.F):
            return
        way = q - self.q
        for b in np.flatnonzero(S.tree.law >= 0).tolist():  # prescribed by a driver
            law = evaluate_jet(S.code, S.const, int(S.tree.law[b]), c.work.stack, t, c.work.sensed, BY_TIME)
            way[S.tree.q[b]] = law[0] - S.bodies.offset[b] - self.q[S.tree.q[b]]
        at = S.angles.state
        c.z[at] = self._start.compiled.z[at] + self._by_coordinates @ way

    @property
    def _by_coordinates(self) -> np.ndarray:
        """Derivatives of the angle states by the coordinates, (angles, nq); computed on first access.

        Angles that are tree-joint coordinates equal these; in the plane all others follow from the rotations of bodies.
        In space the pose of a free body is the same after a whole turn.
        """
        if "_turning" not in vars(self):
            c = self._start.compiled.again()
            before = self._turned(c, self.q)
            columns = [(self._turned(c, self.q + FULL_TURN * e) - before) / FULL_TURN for e in np.eye(len(self.q))]
            vars(self)["_turning"] = np.rint(np.array(columns)).T
        return vars(self)["_turning"]  # type: ignore[no-any-return]

    def _turned(self, c: CompiledMechanism, q: np.ndarray) -> np.ndarray:
        """Return the angles as far as the coordinates determine them, (angles,); only differences are meaningful."""
        s, S = c.structure, c.values.system
        if not s.model.planar:
            known = {s.state_at[name]: angle for name, angle in c.turned(q).items() if name in s.state_at}
            return np.array([known.get(state, 0.0) for state in S.angles.state.tolist()])
        c.at(0.0, q, np.zeros(s.nv))
        angles = turned_angles(c.values, c.work, q)
        of = {-1: 0.0} | {s.place[name]: float(angle) for name, angle in angles.items()}
        return np.array(
            [of[int(S.frame_body[M])] - of[int(S.frame_body[F])] for F, M, _ in zip(*S.angles, strict=True)]
        )

    def _state(self, q: Any, v: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return copies of one state as floats, checked."""
        states, k = self._states((q, v))
        if k is not None:
            raise ModelError(f"this method takes one state, q ({len(self.q)},) and v ({len(self.v)},), not {k} of them")
        return states[0][0].copy(), states[1][0].copy()


@dataclass(frozen=True, kw_only=True)
class PrepareOptions(AnalysisOptions):
    """Arguments of `Mechanism.prepare`."""

    coordinates: str
    parameters: Mapping[str, float] | None
    specialize: bool


def prepare(model: Model, o: PrepareOptions) -> Prepared:
    """Return the prepared mechanism: see `Mechanism.prepare`."""
    stops = {e.name: None for e in model.limits if isinstance(e, Limit) and e.stiffness is None}
    free = model.changed(stops) if stops else model
    refuse_unsupported(free, "prepare", acts_while_sliding)
    start = find_initial_state(free.snapshot(), 0.0, o.parameters, None, o.coordinates)
    return Prepared(start, model.snapshot(), tuple(stops), o.specialize)
