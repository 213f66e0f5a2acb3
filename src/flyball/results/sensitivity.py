"""Derivatives of curves with respect to parameters, with names and units."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import ModelError
from ..model.model import listing, suggest
from .numbers import clean, plain


@dataclass
class Sensitivity:
    """Derivatives of named quantities with respect to named parameters.

    ``s["slider.x", "crank"]`` is the derivative of one by the other: a number, or an array over the times of a motion.

    Attributes
    ----------
    analysis : str
        What the quantities are of: ``"motion"``, ``"instant"``, ``"equilibrium"`` or ``"modes"``.
    of, to : tuple of str
    units : tuple of str
        Of the quantities, in SI; the parameters count in SI units too.
    parameters : dict
        Their values.
    t : ndarray (n,) [s]
        Times; one, where there is only one instant.
    values : ndarray (n, of)
        Complex for eigenvalues.
    derivatives : ndarray (n, of, to)
    verification : ndarray (n, of, to) or None
        The same by central differences of the whole analysis, if asked for.
    """

    analysis: str
    of: tuple[str, ...]
    to: tuple[str, ...]
    units: tuple[str, ...]
    parameters: dict[str, float]
    t: np.ndarray
    values: np.ndarray
    derivatives: np.ndarray
    verification: np.ndarray | None = None

    def __getitem__(self, key: tuple[str, str] | str) -> Any:
        """Derivative of a quantity by a parameter; of a quantity alone those by all parameters, as a dict.

        Raises
        ------
        ModelError
            If there is none of that name.
        """
        if isinstance(key, str):
            return {to: self[key, to] for to in self.to}
        of, to = key
        for what, name, names in (("quantity", of, self.of), ("parameter", to, self.to)):
            if name not in names:
                raise ModelError(f"there is no {what} {name!r}{suggest(name, list(names))}; {listing(list(names))}")
        found = self.derivatives[:, self.of.index(of), self.to.index(to)]
        return found if len(self.t) > 1 else found[0].item()

    @property
    def difference(self) -> float:
        """Largest difference between derivatives and verification, of the largest derivative of each quantity by each
        parameter over time; nan if there is no verification.
        """
        if self.verification is None:
            return float("nan")
        size = np.maximum(np.abs(self.derivatives).max(axis=0), 1e-9 * np.abs(self.derivatives).max(initial=1e-300))
        return float((np.abs(self.verification - self.derivatives) / size).max(initial=0.0))

    def lines(self) -> list[tuple[str, str]]:
        """A table for people; of a motion the last time."""
        out = [("at", f"t = {self.t[-1]:g} s" if len(self.t) > 1 else self.analysis)]
        head = f"{'by':<16} {'derivative':>16}" + (f" {'differences':>16}" if self.verification is not None else "")
        for i, name in enumerate(self.of):
            out.append((name, f"{_text(self.values[-1, i])} {self.units[i]}; {head}"))
            for k, parameter in enumerate(self.to):
                text = f"{parameter:<16} {_text(self.derivatives[-1, i, k]):>16}"
                if self.verification is not None:
                    text += f" {_text(self.verification[-1, i, k]):>16}"
                out.append((name, text))
        return out

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        checked = self.verification
        return {
            "analysis": self.analysis,
            "t": self.t.tolist(),
            "parameters": self.parameters,
            "quantities": {
                name: {
                    "unit": self.units[i],
                    "value": plain(self.values[:, i]),
                    "derivatives": {p: plain(self.derivatives[:, i, k]) for k, p in enumerate(self.to)},
                }
                | (
                    {}
                    if checked is None
                    else {"differences": {p: plain(checked[:, i, k]) for k, p in enumerate(self.to)}}
                )
                for i, name in enumerate(self.of)
            },
        }

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Derivatives over time, or as bars; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.sensitivity import sensitivity

        return sensitivity(self, path)

    def __repr__(self) -> str:
        return "\n".join(f"{a:<16} {b}" for a, b in self.lines())


def _text(x: Any) -> str:
    if np.isrealobj(x):
        return f"{x:.8g}"
    real, imaginary = clean([x.real, x.imag])
    return f"{real:.6g}{imaginary:+.6g}j"
