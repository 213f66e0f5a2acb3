"""Equilibria over values of a parameter, and the jumps between their branches."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .equilibrium import UNSTABLE, Equilibrium
from .wording import number_text


@dataclass(frozen=True)
class Jump:
    """A jump from a branch: at ``value`` the equilibrium ``before`` ceases to exist, or to be stable."""

    value: float
    before: Equilibrium = field(repr=False)
    after: Equilibrium = field(repr=False)


@dataclass(repr=False)
class EquilibriumSeries:
    """Equilibria over values of a parameter, each following from the one before.

    ``series["A.angle"]`` is a curve over the values, ``series[3]`` one equilibrium.

    Attributes
    ----------
    parameter : str
        What is varied, ``"t"`` for time.
    values : ndarray (n,)
    equilibria : list of Equilibrium
    jumps : list of Jump
        Points where the branch ended, or became unstable and was left, and the equilibria reached then.
    """

    name: str
    parameter: str
    values: np.ndarray
    equilibria: list[Equilibrium]
    jumps: list[Jump] = field(default_factory=list)

    @property
    def stability(self) -> tuple[str, ...]:
        """``"stable"``, ``"marginal"`` or ``"unstable"`` at each value."""
        return tuple(e.stability for e in self.equilibria)

    @property
    def least(self) -> np.ndarray:
        """Lowest stiffness at each value, relative to the largest force term; with controllers for constant states."""
        return np.array([e.least for e in self.equilibria])

    def __len__(self) -> int:
        return len(self.equilibria)

    def __getitem__(self, which: str | int) -> Any:
        """Return a curve over the values by name, or an equilibrium by its index."""
        if isinstance(which, str):
            return self.channel(which)[1]
        return self.equilibria[which]

    def channel(self, name: str) -> tuple[str, np.ndarray]:
        """Unit of a curve, and its values.

        Raises
        ------
        ModelError
            If there is no such curve.
        """
        found = [e.result.channel(name) for e in self.equilibria]
        return found[0][0], np.array([values[0] for _, values in found])

    def lines(self) -> list[tuple[str, str]]:
        """A table for people."""
        names = self.telling()
        head = " ".join(f"{n:>16}" for n in names)
        sizes = {n: max((abs(e[n]) for e in self.equilibria), default=0.0) for n in names}
        held = any(e.judged_by for e in self.equilibria)
        what = "stiffness with constant controllers" if held else "least stiffness"
        out = [(self.parameter, f"{'stability':<9} {what:>16} {head}")]
        for value, e in zip(self.values, self.equilibria, strict=True):
            parts = " ".join(f"{number_text(e[n], sizes[n], 8):>16}" for n in names)
            out.append((f"{value:.6g}", f"{e.stability:<9} {e.least:16.4g} {parts}"))
        for j in self.jumps:
            why = "becomes unstable" if j.before.stability == UNSTABLE else "ends"
            where = ", ".join(f"{n} {j.before[n]:.6g} -> {j.after[n]:.6g}" for n in names)
            out.append(("jump", f"at {self.parameter} = {j.value:.6g} the branch {why}: {where}"))
        return out

    def telling(self) -> list[str]:
        """Up to three of the most important curves: coordinates of the degrees of freedom, else of the first body."""
        known = self.equilibria[0].result.channels() if self.equilibria else {}
        names = [f for f in self.equilibria[0].freedoms if f in known] if self.equilibria else []
        return (names or [n for n in known if n.partition(".")[2] in ("x", "y", "z", "angle")])[:3]

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names, all curves included."""
        jumps = [{"value": j.value, "before": j.before.as_dict(), "after": j.after.as_dict()} for j in self.jumps]
        return {
            "name": self.name,
            "parameter": self.parameter,
            "values": self.values.tolist(),
            "equilibria": [e.as_dict() for e in self.equilibria],
            "jumps": jumps,
        }

    def plot(self, *names: str, path: str | os.PathLike | None = None) -> Any:
        """Curves over the parameter, unstable parts dashed; returns the figure, or writes it to ``path``."""
        from ..view.study_plots import series

        return series(self, *names, path=path)

    def __repr__(self) -> str:
        return "\n".join(f"{a:>12}  {b}" for a, b in self.lines())
