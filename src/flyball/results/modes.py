"""Modes of a linear model, their shapes as motions, root loci over a parameter, and stability.

Equilibria, modes and root loci use the same stability criterion: rounding errors are removed from eigenvalues
(`derivatives/eigenvalues.py`), so a nonzero real part is significant.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..engine.kinematics import retract
from ..model.output_files import PAGE, write_file
from .health import Health
from .result import Result

AXIS_TOLERANCE = 1e-8  # relative to an eigenvalue: real parts below this count as on the axis in a locus


def is_growing(values: np.ndarray) -> np.ndarray:
    """Return whether each eigenvalue belongs to a growing motion, bool as ``values``."""
    return np.asarray(values).real > 0.0


def half_plane(values: np.ndarray) -> np.ndarray:
    """Return the half plane of each eigenvalue of a locus: 1, -1, or 0 on or very near the axis, as ``values``."""
    w = np.asarray(values)
    return np.where(np.abs(w.real) > AXIS_TOLERANCE * np.abs(w), np.sign(w.real), 0.0).astype(int)


def largest_growth(values: np.ndarray, blur: np.ndarray, *, discrete: bool) -> float:
    """Return the largest growth: positive if a motion grows, negative if all decay, zero if undecided.

    Parameters
    ----------
    values : ndarray (n,) complex
        Eigenvalues.
    blur : ndarray (n,)
        Uncertainty of each.
    discrete : bool
        Whether they are multipliers from one instant to the next, with the stability limit 1.
    """
    grows = values.real
    if discrete:
        grows = np.abs(values) - 1.0
        grows[np.abs(grows) <= blur] = 0.0
    return float(grows.max(initial=-1.0))


DAMPING_ROUNDING = 1e-9  # damping ratios below this are 0


@dataclass
class Modes:
    """Natural motions x(t) = Re(shape exp(eigenvalue t)), slowest first; one of each complex pair.

    Attributes
    ----------
    eigenvalues : ndarray (n,) complex [1/s]
    shapes : ndarray (nv, n) complex
        Changes of all positions along the mechanism's velocities; the largest part is 1, with angles multiplied by the
        mechanism's length.
    names, units : tuple of str
        Coordinate of each row of the shapes.
    turning : ndarray (3,) [rad/s]
        Angular velocity of the frame in which they are given.
    point : Result
        Operating point.
    growing : bool
        Whether a mode that is not listed grows.
    fastest : float [1/s]
        Magnitude of the largest eigenvalue, including modes that are not listed.
    multiplicity, geometric_multiplicity : ndarray (n,) int
        How often each eigenvalue is repeated, and how many shapes it has; if these are fewer, the eigenvalue is
        defective: motions also grow as t exp(eigenvalue t), such as the drift of a free body.
    residual : float
        Largest residual A x - eigenvalue x relative to |A| |x| + |eigenvalue| |x| over all shapes; above 1e-9 an error
        is raised.
    seen_from : str
        Description of the frame in which the motion is steady; empty at rest.
    notes : tuple of str
        Conditions valid on one side only: closed contacts that are about to open.
    """

    eigenvalues: np.ndarray
    shapes: np.ndarray
    names: tuple[str, ...]
    units: tuple[str, ...]
    turning: np.ndarray
    point: Result = field(repr=False)
    fastest: float = 0.0
    growing: bool = False
    multiplicity: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    geometric_multiplicity: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    residual: float = 0.0
    seen_from: str = ""
    notes: tuple[str, ...] = ()

    @property
    def _still(self) -> np.ndarray:
        return self.eigenvalues == 0.0

    @property
    def omega(self) -> np.ndarray:
        """Undamped angular frequencies |eigenvalue| [rad/s], also of real eigenvalues; 0 for rigid modes."""
        return np.abs(self.eigenvalues)

    @property
    def frequency(self) -> np.ndarray:
        """Frequencies of oscillation |Im eigenvalue| / 2 pi [Hz]; 0 for modes that do not oscillate."""
        return np.abs(self.eigenvalues.imag) / (2.0 * np.pi)

    @property
    def damping_ratio(self) -> np.ndarray:
        """-Re / |eigenvalue|: 0 undamped, 1 no oscillation, negative where the motion grows; 0 for rigid ones."""
        size = np.abs(self.eigenvalues)
        still = self._still
        ratio = np.where(still, 0.0, -self.eigenvalues.real / np.where(still, 1.0, size))
        return np.where(np.abs(ratio) > DAMPING_ROUNDING, ratio, 0.0)

    @property
    def kinds(self) -> tuple[str, ...]:
        """``"oscillation"``, ``"decay"``, ``"unstable"`` or ``"rigid"`` for every mode."""
        out = []
        for w, still, grows in zip(self.eigenvalues, self._still, is_growing(self.eigenvalues), strict=True):
            out.append("rigid" if still else "unstable" if grows else "decay" if w.imag == 0.0 else "oscillation")
        return tuple(out)

    @property
    def stable(self) -> bool:
        """Whether no mode grows, including modes not listed; for large mechanisms those listed only."""
        return not self.growing and "unstable" not in self.kinds

    def __len__(self) -> int:
        return len(self.eigenvalues)

    def shape(self, k: int, least: float = 0.01) -> dict[str, complex]:
        """Mode k by name, largest parts first; parts below ``least`` of the largest are left out."""
        size = np.abs(self.shapes[:, k])
        order = np.argsort(-size, kind="stable")
        return {self.names[d]: complex(self.shapes[d, k]) for d in order if size[d] > least * size.max(initial=0.0)}

    def lines(self) -> list[tuple[str, str]]:
        """A table for people."""
        out = [("mode", f"{'frequency [Hz]':>15} {'omega [rad/s]':>15} {'damping ratio':>14}  kind         moves")]
        for k in range(len(self)):
            most = ", ".join(list(self.shape(k, 0.3))[:4])
            figures = f"{self.frequency[k]:15.6g} {self.omega[k]:15.6g} {self.damping_ratio[k]:14.4g}"
            out.append((str(k), f"{figures}  {self.kinds[k]:<12} {most}"))
        if not len(self):
            return [("modes", "none: no freedom is left to move in"), *(("note", text) for text in self.notes)]
        out += [("repeated", text) for text in self.repeated()]
        if self.seen_from:
            out.append(("seen from", self.seen_from))
        return out + [("note", text) for text in self.notes]

    def repeated(self) -> list[str]:
        """Return a text on each repeated eigenvalue."""
        out, told = [], set()
        for k, (m, g) in enumerate(zip(self.multiplicity.tolist(), self.geometric_multiplicity.tolist(), strict=True)):
            if m > 1 and (value := complex(self.eigenvalues[k])) not in told:
                told.add(value)
                own = np.flatnonzero(self.eigenvalues == value)
                few = f", with {g} shape{'s' * (g > 1)} only: defective, motions also grow in proportion to time"
                which = f"modes {own[0]} to {own[-1]}" if len(own) > 1 else f"mode {k}"
                out.append(f"{which}: the eigenvalue is {m}-fold{few if g < m else f', with {g} shapes'}")
        return out

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        modes = [
            {
                "eigenvalue": [float(w.real), float(w.imag)],
                "frequency": float(self.frequency[k]),
                "omega": float(self.omega[k]),
                "damping_ratio": float(self.damping_ratio[k]),
                "kind": self.kinds[k],
                "multiplicity": int(self.multiplicity[k]),
                "geometric_multiplicity": int(self.geometric_multiplicity[k]),
                "shape": {n: [x.real, x.imag] for n, x in self.shape(k).items()},
            }
            for k, w in enumerate(self.eigenvalues)
        ]
        about = {"turning": self.turning.tolist(), "seen_from": self.seen_from, "residual": self.residual}
        return about | {"modes": modes}

    def motion(self, k: int, amplitude: float = 0.1, outputs: int = 81) -> Result:
        """Mode k as a motion over one period, largest part ``amplitude`` (radians, or parts of the length).

        Damping is left out, so that the motion is periodic. A mode that does not oscillate is shown going out and back.
        """
        return mode_motion(self, k, amplitude, outputs)

    def to_html(self, path: str | os.PathLike, **options: Any) -> None:
        """Write a page with animated modes; options as for `flyball.view.mode_animation.modes_page`."""
        from ..view.mode_animation import modes_page

        write_file(path, modes_page(self, **options), PAGE)

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Eigenvalues in the complex plane; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.linear_plots import eigenvalues

        return eigenvalues(self, path)

    def __repr__(self) -> str:
        return "\n".join(f"{a:>4} {b}" for a, b in self.lines())


NONOSCILLATING_PERIOD = 1.0  # period [s] of a mode that does not oscillate


def mode_motion(m: Modes, k: int, amplitude: float, outputs: int) -> Result:
    """See `Modes.motion`. To first order in the amplitude the joints stay closed."""
    x = m.point
    rate = abs(m.eigenvalues[k].imag)
    period = 2.0 * np.pi / rate if rate > 0.0 else NONOSCILLATING_PERIOD
    t = np.linspace(0.0, period, outputs)
    length = x.values.length
    scale = np.array([1.0 if u == "m" else length for u in m.units])
    shape = m.shapes[:, k] * (amplitude * length / np.abs(scale * m.shapes[:, k]).max())
    swing = np.exp(2j * np.pi * t / period)
    step, speed, acceleration = (
        ((2j * np.pi / period) ** n * shape[:, None] * swing).real for n in range(3)
    )  # (nv, outputs) each
    q = np.repeat(x.q.T, outputs, axis=1)
    retract(x.values.system, q, step)
    states = np.repeat(x.states, outputs, axis=0)
    lam = np.repeat(x.multipliers, outputs, axis=0)
    health = Health(True, f"mode {k}, not a simulation", 0.0, 0.0, 0, 0, 0, 0, 0.0, late=dict(x.health.late))
    return Result(x.model, x.values, t, np.ascontiguousarray(q.T), speed.T, states, acceleration.T, lam, health)


class Crossing(NamedTuple):
    """A change of stability: eigenvalues cross the imaginary axis, or multipliers the unit circle.

    Attributes
    ----------
    value : float
        Value of the parameter.
    eigenvalue : complex [1/s]
        Eigenvalue on the imaginary axis; of a pair the upper one. Of sampled loops the multiplier on the circle [1].
    kind : str
        ``"flutter"`` where oscillations begin to grow or cease to, ``"divergence"`` at zero (of a multiplier at 1),
        ``"alternation"`` where a multiplier is -1.
    change : int
        Change in the number of unstable eigenvalues beyond it.
    """

    value: float
    eigenvalue: complex
    kind: str
    change: int


ON_CIRCLE = 1e-7  # distance of a multiplier from the unit circle that may be rounding, also of double ones


def outside_circle(w: np.ndarray) -> np.ndarray:
    """Whether multipliers lie outside the unit circle by more than rounding."""
    return np.abs(w) > 1.0 + ON_CIRCLE


@dataclass(repr=False)
class RootLocus:
    """Eigenvalues of the linear equations over values of a parameter.

    Attributes
    ----------
    parameter : str
    values : ndarray (m,)
    eigenvalues : ndarray (m, n) complex [1/s]
        Each column is a branch, tracked by eigenvalues and shapes; rounding errors are set to 0. With sampled
        controllers the multipliers [1] of a deviation in one cycle.
    crossings : list of Crossing
        Every change of stability between the values, found to rounding, not interpolated.
    path_values, path : ndarray (p,), (p, n) complex
        The same branches with values added at crossings and meeting points, as drawn.
    seen_from : tuple of str
        Descriptions of the frames in which motions along it are steady; empty at rest.
    period : float or None [s]
        Length of a cycle of sampled controllers; None without.
    """

    name: str
    parameter: str
    values: np.ndarray
    eigenvalues: np.ndarray
    crossings: list[Crossing] = field(default_factory=list)
    path_values: np.ndarray = field(default_factory=lambda: np.zeros(0))
    path: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), complex))
    seen_from: tuple[str, ...] = ()
    period: float | None = None

    @property
    def unstable(self) -> np.ndarray:
        """How many eigenvalues have a positive real part, or multipliers lie outside the unit circle, (m,)."""
        if self.period is not None:
            return outside_circle(self.eigenvalues).sum(axis=1)
        return (half_plane(self.eigenvalues) > 0).sum(axis=1)

    def lines(self) -> list[tuple[str, str]]:
        """A table for people."""
        if self.period is None:
            heading, unit = "largest real part [1/s], with imaginary part [rad/s]", " rad/s"
        else:
            heading, unit = f"largest multiplier of a cycle of {self.period:.6g} s", ""
        out = [(self.parameter, f"{'unstable':>8}  {heading}")]
        for value, w, n in zip(self.values, self.eigenvalues, self.unstable, strict=True):
            top = max(w, key=lambda x: (x.real if self.period is None else abs(x), x.imag)) if len(w) else 0j
            out.append((f"{value:.6g}", f"{n:8d}  {top.real:.6g}, {abs(top.imag):.6g}"))
        for c in self.crossings:
            at = f"{self.parameter} = {c.value:.9g}, imaginary part {c.eigenvalue.imag:.6g}{unit}"
            now = f"{abs(c.change)} {'more' if c.change > 0 else 'fewer'} unstable"
            out.append(("stability changes", f"{at}: {c.kind}, {now}"))
        out += [("seen from", text) for text in self.seen_from]
        return out

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        return {
            "name": self.name,
            "parameter": self.parameter,
            "values": self.values.tolist(),
            "eigenvalues": [[[float(x.real), float(x.imag)] for x in row] for row in self.eigenvalues],
            "crossings": [c._asdict() | {"eigenvalue": [c.eigenvalue.real, c.eigenvalue.imag]} for c in self.crossings],
            "unstable": self.unstable.tolist(),
            "seen_from": list(self.seen_from),
            "period": self.period,
        }

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Branches in the complex plane; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.linear_plots import root_locus_plot

        sampled = self.period is not None
        title = f"{self.name}: {'multipliers of one cycle' if sampled else 'eigenvalues'} over {self.parameter}"
        return root_locus_plot(
            self.path, self.path_values, self.parameter, title, path, known=self.crossings, sampled=sampled
        )

    def __repr__(self) -> str:
        return "\n".join(f"{a:>18}  {b}" for a, b in self.lines())
