"""A linear model x' = A x + B u, y = C x + D u with names and units; in sparse descriptor form too.

With sampled controllers the equations are discrete, from one sampling instant to the next.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..engine.entry_point import characteristic_rate_within
from ..errors import AnalysisError, ModelError, import_optional
from ..model.model import listing, suggest
from ..numerics.eigen import QuadraticPencil
from ..numerics.rank import saddle_point_solver
from ..numerics.reachability import unreachable_modes
from .wording import with_unit

if TYPE_CHECKING:
    from .result import Result


@dataclass(repr=False)
class Descriptor:
    """Sparse linear equations E z' = A z + B u, y = C z + D u (a descriptor system, of index 3).

    The states z are changes of all positions along the mechanism's velocities, of these velocities, of the
    accelerations, and of the multipliers of independent constraints. Inputs and outputs are those of the `LinearModel`;
    inputs that move the mechanism enter the constraints, and act through their rates.

    Attributes
    ----------
    mass, damping, stiffness : sparse (nv, nv)
        M, D and K in K x + D v + M a = G^T l + (inputs).
    constraints : sparse (m, nv)
        G; constraints on positions say G x = 0.
    on_positions : ndarray (m,) of bool
        Others are on velocities: G v + V x = 0.
    by_position : sparse (m, nv)
        V.
    kinematic, turning : sparse (nv, nv) [1/s]
        N - H and H in x' = (N - H) x + v, v' = a - H v, where H accounts for the rotation of the reference frame; zero
        at rest.
    forces, gaps : ndarray (nv, inputs), (m, inputs)
        Input matrices of the equations of motion (left side), and of the constraints.
    C : sparse (outputs, 3 nv + m)
    D : ndarray (outputs, inputs)
    coordinates, units : tuple of str
        Coordinate of each position.
    rows : tuple of str
        Element of each constraint.
    scale : ndarray (nv,)
        1 for metres, 1 / length of the mechanism for radians.
    """

    mass: Any
    damping: Any
    stiffness: Any
    constraints: Any
    on_positions: np.ndarray
    by_position: Any
    kinematic: Any
    turning: Any
    forces: np.ndarray
    gaps: np.ndarray
    C: Any
    D: np.ndarray
    coordinates: tuple[str, ...]
    units: tuple[str, ...]
    rows: tuple[str, ...]
    scale: np.ndarray = field(repr=False)

    @property
    def E(self) -> Any:
        """Sparse (3 nv + m,) square: ones for x' and v'."""
        import scipy.sparse as sp

        nv, m = self.mass.shape[0], len(self.rows)
        return sp.diags(np.r_[np.ones(2 * nv), np.zeros(nv + m)]).tocsr()

    @property
    def A(self) -> Any:
        """Sparse (3 nv + m,) square."""
        import scipy.sparse as sp

        nv, G = self.mass.shape[0], self.constraints
        one, m = sp.identity(nv), len(self.rows)
        held, moving = sp.diags(1.0 * self.on_positions), sp.diags(1.0 * ~self.on_positions)
        lines = [
            [self.kinematic, one, None, None],
            [None, -self.turning, one, None],
            [self.stiffness, self.damping, self.mass, -G.T],
        ]
        if m:
            lines.append([held @ G + moving @ self.by_position, moving @ G, None, sp.csr_matrix((m, m))])
        else:
            lines = [line[:3] for line in lines]
        return sp.bmat(lines).tocsr()

    @property
    def B(self) -> Any:
        """Sparse (3 nv + m, inputs)."""
        import scipy.sparse as sp

        return sp.csr_matrix(
            np.vstack([np.zeros((2 * len(self.forces), self.forces.shape[1])), self.forces, self.gaps])
        )

    @property
    def states(self) -> tuple[str, ...]:
        """Names of z."""
        rates = (f"{name}{what}" for what in ("", " rate", " acceleration") for name in self.coordinates)
        return (*rates, *(f"{row} multiplier" for row in self.rows))

    def __repr__(self) -> str:
        nv, m = self.mass.shape[0], len(self.rows)
        return f"descriptor form: {3 * nv + m} states ({nv} positions, {m} constraints), {self.A.nnz} entries in A"

    def response(self, omega: Sequence[float], input: int, output: int) -> np.ndarray:
        """Frequency response of an output to an input, by their indices, at frequencies [rad/s]; complex, (n,).

        At an undamped pole it is infinite.
        """
        return np.array([self._at(1j * w, input, output) for w in np.atleast_1d(omega)])

    def _at(self, s: complex, i: int, k: int) -> complex:
        """G(s)."""
        import scipy.sparse as sp

        nv = self.mass.shape[0]
        one = sp.identity(nv)
        first = (s * one - self.kinematic).tocsr()  # v = first x, a = second v
        second = s * one + self.turning
        held, moving = sp.diags(1.0 * self.on_positions), sp.diags(1.0 * ~self.on_positions)
        P = self.stiffness + self.damping @ first + self.mass @ (second @ first)
        rows = (held @ self.constraints + moving @ (self.constraints @ first + self.by_position)).tocsr()
        unit = sp.diags(self.scale)
        try:
            solve = saddle_point_solver(
                (unit @ P @ unit).tocsc(), (self.constraints @ unit).tocsr(), (rows @ unit).tocsr()
            )
        except AnalysisError:
            return complex(np.inf)
        x, lam = solve(-self.scale * self.forces[:, i], -self.gaps[:, i])
        x = self.scale * x
        v = first @ x
        z = np.concatenate([x, v, second @ v, lam])
        return complex((self.C[[k]] @ z)[0] + self.D[k, i])

    def nearest(self, count: int = 10, near: complex = 0.0) -> np.ndarray:
        """Eigenvalues [1/s] nearest to a number, by shift and invert, (k,) complex: ``count`` and their conjugates.

        Parameters
        ----------
        count : int
        near : complex [1/s]

        Raises
        ------
        ModelError
            If the mechanism moves, or has constraints on velocities (then use `LinearModel.eigenvalues`); or if the
            arguments are invalid.
        AnalysisError
            If they are not found.
        """
        import scipy.sparse as sp

        if not isinstance(count, (int, np.integer)) or count < 1:
            raise ModelError(f"count must be a whole number of at least 1, got {count!r}")
        if not np.isfinite(near):
            raise ModelError(f"near must be a finite number, got {near!r}")
        if not self.on_positions.all() or self.kinematic.nnz or self.turning.nnz:
            raise ModelError(
                "few eigenvalues of the descriptor form are found at rest, and for constraints on positions only; "
                "compute all of them: eigenvalues"
            )
        S = sp.diags(self.scale)
        G = self.constraints @ S
        size = np.sqrt(np.asarray(G.multiply(G).sum(axis=1)).ravel())
        own = (S @ self.mass @ S, S @ self.damping @ S, S @ self.stiffness @ S, sp.diags(1.0 / size) @ G)
        return QuadraticPencil(*(X.tocsr() for X in own)).nearest(count, near)[0]

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain numbers and names; matrices by their nonzero entries."""
        matrices = {k: _matrix_entries(getattr(self, k)) for k in ("E", "A", "B", "C")}
        return {"states": list(self.states), "units": list(self.units), **matrices, "D": self.D.tolist()}


def _matrix_entries(X: Any) -> dict[str, Any]:
    X = X.tocoo()
    return {"shape": list(X.shape), "row": X.row.tolist(), "column": X.col.tolist(), "value": X.data.tolist()}


MAX_EIGENVALUES = 10  # number of eigenvalues of a large mechanism in a text
SHOWN_PART = 1e-9  # coefficients of a combination of states, relative to the largest, that are shown
ROUNDING_PART = 1e-12  # relative to a complex number: smaller real or imaginary parts are rounding


@dataclass
class StateSpaceForm:
    """State-space equations with eliminated constraints; see the properties of `LinearModel`."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: tuple[str, ...]
    state_units: tuple[str, ...]
    mass: np.ndarray | None
    damping: np.ndarray | None
    stiffness: np.ndarray | None
    eigenvalues: np.ndarray | Callable[[], np.ndarray]
    motion: np.ndarray


class LinearModel:
    """Linear equations of a mechanism about a state.

    The states are changes of as many coordinates as there are degrees of freedom, then changes of their rates. If
    inputs move the mechanism (drivers), the states are shifted by multiples of the inputs.

    For a ``large`` mechanism the sparse `descriptor` is computed at once, and dense matrices on demand: these take long
    and much memory.

    Attributes
    ----------
    inputs, outputs, input_units, output_units : tuple of str
    output_values : ndarray
        Outputs at the state itself.
    turning : ndarray (3,) [rad/s]
        Angular velocity of the frame of the states, zero about an equilibrium.
    t : float [s]
    point : Result
        The state itself, as a result with one time.
    seen_from : str
        Description of the frame in which the motion is steady; empty about an equilibrium.
    large : bool
        Whether there are so many velocities that dense matrices are computed on demand.
    notes : tuple of str
        Conditions valid on one side only: closed contacts that are about to open.
    period : float, optional [s]
        With sampled controllers: the equations are x(t + period) = A x(t) + B u, y = C x + D u, where t is an instant
        of the first of them, x the state just before it, y outputs from it on, u inputs constant until the next. The
        eigenvalues are multipliers: modes with magnitude below 1 decay.
    """

    def __init__(
        self,
        name: str,
        inputs: Sequence[tuple[str, str]],
        outputs: Sequence[tuple[str, str]],
        output_values: np.ndarray,
        point: Result,
        dense: StateSpaceForm | Callable[[], StateSpaceForm],
        sparse: Descriptor | Callable[[], Descriptor],
        turning: np.ndarray,
        seen_from: str = "",
        period: float | None = None,
    ) -> None:
        self.period = period
        self.name, self.point, self.t = name, point, float(point.t[0])
        self.notes: tuple[str, ...] = ()
        self.inputs, self.input_units = (tuple(x[k] for x in inputs) for k in range(2))
        self.outputs, self.output_units = (tuple(x[k] for x in outputs) for k in range(2))
        self.output_values = output_values
        self.turning, self.seen_from = turning, seen_from
        self.large = not isinstance(dense, StateSpaceForm)
        self._dense, self._sparse = dense, sparse

    @property
    def dense(self) -> StateSpaceForm:
        """The dense equations."""
        if not isinstance(self._dense, StateSpaceForm):
            self._dense = self._dense()
        return self._dense

    @property
    def descriptor(self) -> Descriptor:
        """The sparse equations with constraints."""
        if callable(self._sparse):
            self._sparse = self._sparse()
        return self._sparse

    @property
    def A(self) -> np.ndarray:
        """In x' = A x + B u, (n, n)."""
        return self.dense.A

    @property
    def B(self) -> np.ndarray:
        """In x' = A x + B u, (n, inputs)."""
        return self.dense.B

    @property
    def C(self) -> np.ndarray:
        """In y = C x + D u, (outputs, n)."""
        return self.dense.C

    @property
    def D(self) -> np.ndarray:
        """In y = C x + D u, (outputs, inputs)."""
        return self.dense.D

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states x."""
        return self.dense.states

    @property
    def state_units(self) -> tuple[str, ...]:
        """Their units."""
        return self.dense.state_units

    @property
    def mass(self) -> np.ndarray | None:
        """M of M a'' + D a' + K a = 0 in the first f states, (f, f); None with constraints on velocities only."""
        return self.dense.mass

    @property
    def damping(self) -> np.ndarray | None:
        """D of the same."""
        return self.dense.damping

    @property
    def stiffness(self) -> np.ndarray | None:
        """K of the same."""
        return self.dense.stiffness

    @property
    def eigenvalues(self) -> np.ndarray:
        """Eigenvalues of A, by imaginary, then real part, (n,) complex [1/s]; indistinguishable ones are averaged."""
        own = self.dense
        if callable(own.eigenvalues):
            own.eigenvalues = own.eigenvalues()
        return own.eigenvalues

    @property
    def motion(self) -> np.ndarray:
        """Changes of all positions along the mechanism's velocities, per unit of each state, (nv, n)."""
        return self.dense.motion

    def to_control(self) -> Any:
        """The model as ``control.StateSpaceForm``; its names have ``_`` in place of points and blanks.

        Raises
        ------
        ImportError
            If the package ``control`` is not installed.
        """
        control = import_optional("control", "control")
        names = {k: [_control_name(name) for name in getattr(self, k)] for k in ("states", "inputs", "outputs")}
        dt = 0 if self.period is None else self.period
        return control.ss(self.A, self.B, self.C, self.D, dt, name=_control_name(self.name), **names)

    def uncontrollable_modes(self, *inputs: str) -> list[tuple[complex, dict[str, complex]]]:
        """Eigenvalues that no input changes, each with the combination of the states that follows no input.

        Constraints and symmetries cause them: the difference of two equal pendulums on one driven cart. Ranks are
        decided in balanced units by the staircase form (Van Dooren 1981).

        Parameters
        ----------
        *inputs : str
            All inputs if not given.

        Returns
        -------
        list of (eigenvalue, {state: coefficient})
            Of a complex pair the one with positive imaginary part. Empty if the model is controllable.
        """
        columns = [self.input_index(name) for name in inputs] or range(len(self.inputs))
        return self._unreachable(self.A, self.B[:, columns])

    def unobservable_modes(self, *outputs: str) -> list[tuple[complex, dict[str, complex]]]:
        """Eigenvalues whose motions no output shows, each with that motion; as `uncontrollable_modes`."""
        rows = [self.output_index(name) for name in outputs] or range(len(self.outputs))
        return self._unreachable(self.A.T, self.C[rows].T)

    def _unreachable(self, A: np.ndarray, B: np.ndarray) -> list[tuple[complex, dict[str, complex]]]:
        values, vectors = unreachable_modes(A, B)
        return [
            (complex(w), {name: complex(x) for name, x in zip(self.states, v, strict=True) if abs(x) > SHOWN_PART})
            for w, v in zip(values, vectors.T, strict=True)
            if w.imag >= 0.0
        ]

    def transfer(self, input: str | None = None, output: str | None = None) -> tuple[np.ndarray, np.ndarray, float]:
        """Return zeros, poles [1/s] and gain of a transfer function; the only input and output if not named.

        G(s) = gain prod(s - zeros) / prod(s - poles). The zeros are the finite eigenvalues of the pencil ([A b; c d],
        [I 0; 0 0]) (Emami-Naeini and Van Dooren 1982), the gain follows from G far from all of them.
        """
        from scipy.linalg import eigvals

        i, k = self.input_index(input), self.output_index(output)
        n = len(self.A)
        b, c, d = self.B[:, [i]], self.C[[k]], self.D[[k]][:, [i]]
        poles = self.eigenvalues
        pencil, E = np.block([[self.A, b], [c, d]]), np.zeros((n + 1, n + 1))
        E[:n, :n] = np.eye(n)
        size = characteristic_rate_within(self.point.values.system) + np.abs(poles).max(initial=0.0)
        zeros = eigvals(pencil, E)
        zeros = zeros[np.isfinite(zeros)]
        zeros = zeros[np.abs(zeros) < 1e6 * size]
        s = 1j * 2.0 * (size + np.abs(zeros).max(initial=0.0))
        value = (c @ np.linalg.solve(s * np.eye(n) - self.A, b) + d)[0, 0]
        gain = value * np.prod(s - poles) / np.prod(s - zeros)
        return zeros, poles, float(gain.real)

    def response(self, omega: Sequence[float], input: str | None = None, output: str | None = None) -> np.ndarray:
        """Frequency response G(i omega) of an input and an output at angular frequencies [rad/s]; complex, (n,).

        At an undamped pole it is infinite. With sampled controllers G(exp(i omega period)).
        """
        i, k = self.input_index(input), self.output_index(output)
        if self.large:
            return self.descriptor.response(omega, i, k)
        one = np.eye(len(self.A))
        b, c, d = self.B[:, i], self.C[k], self.D[k, i]

        def at(w: float) -> complex:
            try:
                s = 1j * w if self.period is None else np.exp(1j * w * self.period)
                return c @ np.linalg.solve(s * one - self.A, b) + d
            except np.linalg.LinAlgError:
                return complex(np.inf)

        return np.array([at(w) for w in np.atleast_1d(omega)])

    def root_locus(self, gains: Sequence[float], input: str | None = None, output: str | None = None) -> np.ndarray:
        """Eigenvalues of the closed loop u = -k y for every gain k, (gains, n)."""
        i, k = self.input_index(input), self.output_index(output)
        b, c, d = self.B[:, [i]], self.C[[k]], self.D[k, i]
        found = [np.linalg.eigvals(self.A - b @ c * (g / (1.0 + g * d))) for g in gains]
        return sort_branches(np.array(found))

    def bode(
        self,
        input: str | None = None,
        output: str | None = None,
        omega: Sequence[float] | None = None,
        path: str | os.PathLike | None = None,
    ) -> Any:
        """Bode plot; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.linear_plots import bode_plot

        return bode_plot(self, input, output, omega, path)

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Eigenvalues in the complex plane, of a single input and output the zeros too; returns the Matplotlib figure.

        With ``path`` it is written instead, as PNG, SVG or PDF.
        """
        from ..view.linear_plots import pole_zero_plot

        return pole_zero_plot(self, path)

    def plot_root_locus(
        self,
        gains: Sequence[float],
        input: str | None = None,
        output: str | None = None,
        path: str | os.PathLike | None = None,
    ) -> Any:
        """Root locus over the gain of a feedback; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.linear_plots import root_locus_plot

        names = self._named("input", self.inputs, input), self._named("output", self.outputs, output)
        title = f"u = -k y, u: {names[0]}, y: {names[1]}"
        return root_locus_plot(self.root_locus(gains, input, output), gains, "k", title, path)

    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts for people: names, eigenvalues; of a single input and output poles, zeros and gain."""
        out = [("states", f"many: {self.descriptor!r}")] if self.large else []
        for what in ("input", "output") if self.large else ("state", "input", "output"):
            units = getattr(self, f"{what}_units")
            for k, (name, unit) in enumerate(zip(getattr(self, f"{what}s"), units, strict=True)):
                now = f", {self.output_values[k]:.6g} at the state itself" if what == "output" else ""
                out.append((what, with_unit(name, unit) + now))
        if self.seen_from:
            out.append(("seen from", self.seen_from))
        out += [("note", text) for text in self.notes]
        if self.large:
            slow = self.descriptor.nearest(MAX_EIGENVALUES)
            return out + [("slowest", f"{_eigenvalue_text(w)} 1/s") for w in slow if w.imag >= 0.0]
        unit, s = (" 1/s", "s") if self.period is None else ("", "z")
        if self.period is not None:
            out.append(("period", f"{self.period:.6g} s: eigenvalues are multipliers from one to the next"))
        out += [("eigenvalues", f"{_eigenvalue_text(w)}{unit}") for w in self.eigenvalues if w.imag >= 0.0]
        for what, missing in (("controllable", self.uncontrollable_modes), ("observable", self.unobservable_modes)):
            if self.inputs if what == "controllable" else self.outputs:
                out += [(f"not {what}", f"{_eigenvalue_text(w)}{unit}") for w, _ in missing()]
        if len(self.inputs) == len(self.outputs) == 1:
            zeros, _, gain = self.transfer()
            out += [("zeros", f"{_eigenvalue_text(w)}{unit}") for w in zeros if w.imag >= 0.0]
            out.append(("gain", f"{gain:.6g}: G({s}) = gain prod({s} - zeros) / prod({s} - eigenvalues)"))
        return out

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        out: dict[str, Any] = {
            "name": self.name,
            "t": self.t,
            "turning": self.turning.tolist(),
            "seen_from": self.seen_from,
        }
        if self.period is not None:
            out["period"] = self.period
        for what in ("inputs", "outputs") if self.large else ("states", "inputs", "outputs"):
            units = getattr(self, f"{what[:-1]}_units")
            out[what] = [{"name": n, "unit": u} for n, u in zip(getattr(self, what), units, strict=True)]
        if self.large:
            return out | {"descriptor": self.descriptor.as_dict()}
        matrices = {k: getattr(self, k) for k in ("A", "B", "C", "D", "mass", "damping", "stiffness")}
        out |= {k: None if X is None else X.tolist() for k, X in matrices.items()}
        return out | {"eigenvalues": [[float(w.real), float(w.imag)] for w in self.eigenvalues]}

    def __repr__(self) -> str:
        return "\n".join(f"{a}: {b}" for a, b in self.lines())

    def input_index(self, name: str | None) -> int:
        """Return the index of an input; the only one if not named."""
        return self.inputs.index(self._named("input", self.inputs, name))

    def output_index(self, name: str | None) -> int:
        """Return the index of an output; the only one if not named."""
        return self.outputs.index(self._named("output", self.outputs, name))

    def _named(self, what: str, names: tuple[str, ...], name: str | None) -> str:
        if name is None and len(names) == 1:
            return names[0]
        if name not in names:
            given = "say which" if name is None else f"there is no {what} {name!r}{suggest(name, list(names))}"
            there = listing(list(names)) if names else f"it was linearised without any: linearize({what}s=[...])"
            raise ModelError(f"{given}; {there}")
        return name


def _control_name(name: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in name)


def _eigenvalue_text(w: complex) -> str:
    """Return a number, or a complex pair, as text; negligible parts are left out."""
    least = ROUNDING_PART * abs(w)
    real, imag = (part if abs(part) > least else 0.0 for part in (w.real, w.imag))
    return f"{real:.6g} +- {imag:.6g} i" if imag else f"{real:.6g}"


def sort_branches(roots: np.ndarray) -> np.ndarray:
    """Sort each row's roots so that they continue those of the row before, (rows, n)."""
    from scipy.optimize import linear_sum_assignment

    out = roots.copy()
    for k in range(1, len(out)):
        _, order = linear_sum_assignment(np.abs(out[k - 1][:, None] - out[k][None, :]))
        out[k] = out[k][order]
    return out
