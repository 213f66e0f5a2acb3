"""Modes of a linear model: eigenvalues, frequencies, damping ratios and shapes."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.writing import PAGE, write
from .growth import growing

if TYPE_CHECKING:
    from .result import Result

ROUNDING = 1e-9  # damping ratios below this are 0


@dataclass
class Modes:
    """Natural motions x(t) = Re(shape exp(eigenvalue t)), slowest first; one of each complex pair.

    Attributes
    ----------
    eigenvalues : ndarray (n,) complex [1/s]
    shapes : ndarray (nv, n) complex
        Changes of all positions along the mechanism's velocities; the largest part, turns counted at the mechanism's
        length, is 1.
    names, units : tuple of str
        Of what each row of the shapes is a change of.
    turning : ndarray (3,) [rad/s]
        Angular velocity of the frame that they are seen from.
    point : Result
        Where they are about.
    growing : bool
        Whether a mode that was not asked for grows.
    fastest : float [1/s]
        Size of the largest eigenvalue, those that were not asked for included.
    multiplicity, geometric_multiplicity : ndarray (n,) int
        How often each eigenvalue is repeated, and how many shapes it has; where these are fewer, the eigenvalue is
        defective: motions also grow as t exp(eigenvalue t), such as a body that nothing holds and that drifts away.
    residual : float
        The largest part that A x - eigenvalue x leaves of |A| |x| + |eigenvalue| |x|, over all shapes; refused above
        1e-9.
    seen_from : str
        The frame from which the motion is steady, in words; empty at rest.
    notes : tuple of str
        What holds for one side only: closed contacts that are about to part.
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
        """Undamped angular frequencies |eigenvalue| [rad/s], 0 for rigid ones; what grows or decays counts too."""
        return np.abs(self.eigenvalues)

    @property
    def frequency(self) -> np.ndarray:
        """Frequencies of oscillation |Im eigenvalue| / 2 pi [Hz]; 0 for those that do not oscillate."""
        return np.abs(self.eigenvalues.imag) / (2.0 * np.pi)

    @property
    def damping_ratio(self) -> np.ndarray:
        """-Re / |eigenvalue|: 0 undamped, 1 no oscillation, negative where the motion grows; 0 for rigid ones."""
        size = np.abs(self.eigenvalues)
        still = self._still
        ratio = np.where(still, 0.0, -self.eigenvalues.real / np.where(still, 1.0, size))
        return np.where(np.abs(ratio) > ROUNDING, ratio, 0.0)

    @property
    def kinds(self) -> tuple[str, ...]:
        """``"oscillation"``, ``"decay"``, ``"unstable"`` or ``"rigid"`` for every mode."""
        out = []
        for w, still, grows in zip(self.eigenvalues, self._still, growing(self.eigenvalues), strict=True):
            out.append("rigid" if still else "unstable" if grows else "decay" if w.imag == 0.0 else "oscillation")
        return tuple(out)

    @property
    def stable(self) -> bool:
        """Whether no mode grows, those that were not asked for included; of large mechanisms those listed."""
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
        """What is to be known of eigenvalues that are repeated, a text for each."""
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

        Damping is left out, so that the motion repeats. A mode that does not oscillate goes out and back.
        """
        from .shapes import motion

        return motion(self, k, amplitude, outputs)

    def to_html(self, path: str | os.PathLike, **options: Any) -> None:
        """Write a page in which the modes move; options as for `flyball.view.modes.page`."""
        from ..view.modes import page

        write(path, page(self, **options), PAGE)

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Eigenvalues in the complex plane; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.linear import eigenvalues

        return eigenvalues(self, path)

    def __repr__(self) -> str:
        return "\n".join(f"{a:>4} {b}" for a, b in self.lines())
