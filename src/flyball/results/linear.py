"""A linear model: x' = A x + B u, y = C x + D u, with names and units for everything; or from instant to instant."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ModelError, optional
from ..model.model import listing, suggest
from .descriptor import Descriptor
from .numbers import with_unit

if TYPE_CHECKING:
    from .result import Result

SHOWN = 10  # eigenvalues of a large mechanism in a text
ROUNDED = 1e-12  # part of a number below which its real or imaginary part is rounding


@dataclass
class StateSpace:
    """The equations with the constraints taken out; see the properties of `LinearModel`."""

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

    The states are changes of as many coordinates as there are freedoms, then changes of their rates. Where inputs move
    the mechanism (drivers), the states are shifted by multiples of the inputs.

    Of a mechanism that is ``large`` the sparse `descriptor` is made at once, and what is dense when it is first asked
    for: that takes long and much memory.

    Attributes
    ----------
    inputs, outputs, input_units, output_units : tuple of str
    output_values : ndarray
        Outputs at the state itself.
    turning : ndarray (3,) [rad/s]
        Angular velocity of the frame that the states are seen from, zero about an equilibrium.
    t : float [s]
    point : Result
        The state itself, as a result with one time.
    seen_from : str
        The frame from which the motion is steady, in words; empty about an equilibrium.
    large : bool
        Whether there are so many velocities that what is dense is made when asked for.
    notes : tuple of str
        What holds for one side only: closed contacts that are about to part.
    period : float, optional [s]
        With sampled controllers: the equations are x(t + period) = A x(t) + B u, y = C x + D u, t being an instant of
        the first of them, x the state just before it, y outputs from it on, u inputs that are held until the next. The
        eigenvalues are multipliers: what they do not exceed 1 in size dies out.
    """

    def __init__(
        self,
        name: str,
        inputs: Sequence[tuple[str, str]],
        outputs: Sequence[tuple[str, str]],
        output_values: np.ndarray,
        point: Result,
        dense: StateSpace | Callable[[], StateSpace],
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
        self.large = not isinstance(dense, StateSpace)
        self._dense, self._sparse = dense, sparse

    @property
    def dense(self) -> StateSpace:
        """All that is dense."""
        if not isinstance(self._dense, StateSpace):
            self._dense = self._dense()
        return self._dense

    @property
    def descriptor(self) -> Descriptor:
        """The equations with the constraints left in, sparse."""
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
        """Of A, by imaginary, then real part, (n,) complex [1/s]; those that cannot be told apart are their mean."""
        own = self.dense
        if callable(own.eigenvalues):
            own.eigenvalues = own.eigenvalues()
        return own.eigenvalues

    @property
    def motion(self) -> np.ndarray:
        """Changes of all positions along the mechanism's velocities, per unit of each state, (nv, n)."""
        return self.dense.motion

    def to_control(self) -> Any:
        """The model as ``control.StateSpace``; its names have ``_`` in place of points and blanks.

        Raises
        ------
        ImportError
            If the package ``control`` is not installed.
        """
        control = optional("control", "control")
        names = {k: [_plain(name) for name in getattr(self, k)] for k in ("states", "inputs", "outputs")}
        dt = 0 if self.period is None else self.period
        return control.ss(self.A, self.B, self.C, self.D, dt, name=_plain(self.name), **names)

    def transfer(self, input: str | None = None, output: str | None = None) -> tuple[np.ndarray, np.ndarray, float]:
        """Zeros, poles [1/s] and gain of a transfer function; the only input and output if not named.

        G(s) = gain prod(s - zeros) / prod(s - poles). The zeros are the finite eigenvalues of the pencil ([A b; c d],
        [I 0; 0 0]) (Emami-Naeini and Van Dooren 1982), the gain is found from G far from all of them.
        """
        from scipy.linalg import eigvals

        i, k = self.input_index(input), self.output_index(output)
        n = len(self.A)
        b, c, d = self.B[:, [i]], self.C[[k]], self.D[[k]][:, [i]]
        poles = self.eigenvalues
        pencil, E = np.block([[self.A, b], [c, d]]), np.zeros((n + 1, n + 1))
        E[:n, :n] = np.eye(n)
        size = 1.0 + np.abs(poles).max(initial=0.0)
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
        return follow(np.array(found))

    def bode(
        self,
        input: str | None = None,
        output: str | None = None,
        omega: Sequence[float] | None = None,
        path: str | os.PathLike | None = None,
    ) -> Any:
        """Bode plot; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.linear import bode

        return bode(self, input, output, omega, path)

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Eigenvalues in the complex plane, of a single input and output the zeros too; returns the Matplotlib figure.

        With ``path`` it is written instead, as PNG, SVG or PDF.
        """
        from ..view.poles import poles

        return poles(self, path)

    def plot_root_locus(
        self,
        gains: Sequence[float],
        input: str | None = None,
        output: str | None = None,
        path: str | os.PathLike | None = None,
    ) -> Any:
        """Root locus over the gain of a feedback; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.linear import root_locus

        names = self._named("input", self.inputs, input), self._named("output", self.outputs, output)
        title = f"u = -k y, u: {names[0]}, y: {names[1]}"
        return root_locus(self.root_locus(gains, input, output), gains, "k", title, path)

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
            slow = self.descriptor.nearest(SHOWN)
            return out + [("slowest", f"{_written(w)} 1/s") for w in slow if w.imag >= 0.0]
        unit, s = (" 1/s", "s") if self.period is None else ("", "z")
        if self.period is not None:
            out.append(("period", f"{self.period:.6g} s: eigenvalues are multipliers from one to the next"))
        out += [("eigenvalues", f"{_written(w)}{unit}") for w in self.eigenvalues if w.imag >= 0.0]
        if len(self.inputs) == len(self.outputs) == 1:
            zeros, _, gain = self.transfer()
            out += [("zeros", f"{_written(w)}{unit}") for w in zeros if w.imag >= 0.0]
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
        """Which input that is; the only one if not named."""
        return self.inputs.index(self._named("input", self.inputs, name))

    def output_index(self, name: str | None) -> int:
        """Which output that is; the only one if not named."""
        return self.outputs.index(self._named("output", self.outputs, name))

    def _named(self, what: str, names: tuple[str, ...], name: str | None) -> str:
        if name is None and len(names) == 1:
            return names[0]
        if name not in names:
            given = "say which" if name is None else f"there is no {what} {name!r}{suggest(name, list(names))}"
            there = listing(list(names)) if names else f"it was linearised without any: linearize({what}s=[...])"
            raise ModelError(f"{given}; {there}")
        return name


def _plain(name: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in name)


def _written(w: complex) -> str:
    """A number, or a complex pair; parts that are rounding beside the other are left out."""
    least = ROUNDED * abs(w)
    real, imag = (part if abs(part) > least else 0.0 for part in (w.real, w.imag))
    return f"{real:.6g} +- {imag:.6g} i" if imag else f"{real:.6g}"


def follow(roots: np.ndarray) -> np.ndarray:
    """Sort each row's roots so that they go on from the row before, (rows, n)."""
    from scipy.optimize import linear_sum_assignment

    out = roots.copy()
    for k in range(1, len(out)):
        _, order = linear_sum_assignment(np.abs(out[k - 1][:, None] - out[k][None, :]))
        out[k] = out[k][order]
    return out
