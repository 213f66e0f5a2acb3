"""Derivatives with respect to parameters; parameters found by optimisation and by fits to measurements."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import ModelError
from ..model.model import listing, suggest
from .wording import json_numbers, without_rounding


@dataclass
class Sensitivity:
    """Derivatives of named quantities with respect to named parameters.

    ``s["slider.x", "crank"]`` is the derivative of the first with respect to the second: a number, or an array over the
    times of a motion.

    Attributes
    ----------
    analysis : str
        Analysis of the quantities: ``"motion"``, ``"instant"``, ``"equilibrium"`` or ``"modes"``.
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
        The derivatives by central differences of the whole analysis, if requested.
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
        """The derivative of a quantity with respect to a parameter; without a parameter those for all, as a dict.

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
        """Return the largest difference between derivatives and verification, relative; nan without verification.

        It is relative to the largest derivative over time of each quantity with respect to each parameter.
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
            out.append((name, f"{_value_text(self.values[-1, i])} {self.units[i]}; {head}"))
            for k, parameter in enumerate(self.to):
                text = f"{parameter:<16} {_value_text(self.derivatives[-1, i, k]):>16}"
                if self.verification is not None:
                    text += f" {_value_text(self.verification[-1, i, k]):>16}"
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
                    "value": json_numbers(self.values[:, i]),
                    "derivatives": {p: json_numbers(self.derivatives[:, i, k]) for k, p in enumerate(self.to)},
                }
                | (
                    {}
                    if checked is None
                    else {"differences": {p: json_numbers(checked[:, i, k]) for k, p in enumerate(self.to)}}
                )
                for i, name in enumerate(self.of)
            },
        }

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """Derivatives over time, or as bars; returns the Matplotlib figure, or writes it to ``path``."""
        from ..view.study_plots import sensitivity_plot

        return sensitivity_plot(self, path)

    def __repr__(self) -> str:
        return "\n".join(f"{a:<16} {b}" for a, b in self.lines())


def _value_text(x: Any) -> str:
    if np.isrealobj(x):
        return f"{x:.8g}"
    real, imaginary = without_rounding([x.real, x.imag])
    return f"{real:.6g}{imaginary:+.6g}j"


@dataclass
class Optimum:
    """Parameters that fit best.

    Attributes
    ----------
    parameters : dict
        The best values, in SI units; use them as ``parameters=`` of any analysis.
    start : dict
        Where the search began.
    cost : float
        Half the sum of squares, or the value of the function that was minimised.
    start_cost : float
    success : bool
    message : str
        Why the search ended.
    evaluations : int
        Number of analyses.
    of, units : tuple of str
        The quantities, and their units.
    t : ndarray (n,) [s]
    values, start_values : ndarray (n, of)
        The quantities at the optimum, and where the search began.
    target : ndarray (n, of) or None
        Target values; None if a function was minimised.
    at_bound : tuple of str
        Parameters that ended at one of their bounds.
    """

    parameters: dict[str, float]
    start: dict[str, float]
    cost: float
    start_cost: float
    success: bool
    message: str
    evaluations: int
    of: tuple[str, ...]
    t: np.ndarray
    values: np.ndarray = field(repr=False)
    at_bound: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    start_values: np.ndarray | None = field(default=None, repr=False)
    target: np.ndarray | None = field(default=None, repr=False)

    def lines(self) -> list[tuple[str, str]]:
        """A table for people."""
        out = [("found" if self.success else "stopped", self.message)]
        out.append(("cost", f"{self.start_cost:.6g} at the start, {self.cost:.6g} now"))
        for name, value in self.parameters.items():
            note = ", at its bound" if name in self.at_bound else ""
            out.append(("parameter", f"{name}: {self.start[name]:.8g} -> {value:.8g}{note}"))
        return [*out, ("analyses", str(self.evaluations))]

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        kept = ("parameters", "start", "cost", "start_cost", "success", "message", "evaluations")
        out = {k: getattr(self, k) for k in kept} | {"at_bound": list(self.at_bound), "t": self.t.tolist()}
        parts = {"values": self.values, "start_values": self.start_values, "target": self.target}
        columns = {
            k: None if v is None else {n: json_numbers(v[:, i]) for i, n in enumerate(self.of)}
            for k, v in parts.items()
        }
        return out | {"units": dict(zip(self.of, self.units, strict=False))} | columns

    def plot(self, path: str | os.PathLike | None = None) -> Any:
        """The quantities where the search began, at the optimum, and the target; the figure, or written to ``path``."""
        from ..view.study_plots import optimum_plot

        return optimum_plot(self, path)

    def __repr__(self) -> str:
        return "\n".join(f"{a}: {b}" for a, b in self.lines())


@dataclass(kw_only=True, repr=False)
class Fit(Optimum):
    """Parameters that fit measurements best, with their confidence intervals.

    Attributes
    ----------
    intervals : dict
        Parameter -> lower and upper end of its confidence interval.
    standard_errors : dict
        Parameter -> standard deviation of its estimate.
    covariance : ndarray (to, to)
        Of the estimates, in the order of ``parameters``.
    confidence : float
        Probability that an interval contains the true value.
    noise : dict
        Quantity -> standard deviation of its measurements: as given, or estimated from the residuals.
    """

    intervals: dict[str, tuple[float, float]]
    standard_errors: dict[str, float]
    covariance: np.ndarray = field(repr=False)
    confidence: float
    noise: dict[str, float]

    @property
    def residuals(self) -> np.ndarray:
        """Measured less computed values, (n, of); nan where nothing was measured."""
        assert self.target is not None
        return np.asarray(self.target - self.values)

    def lines(self) -> list[tuple[str, str]]:
        """A table for people."""
        out = super().lines()
        percent = f"{100 * self.confidence:g} %"
        for k, (name, (low, high)) in enumerate(self.intervals.items()):
            at = next(i for i, (kind, text) in enumerate(out) if kind == "parameter" and text.startswith(f"{name}:"))
            out[at] = "parameter", f"{out[at][1]}, {percent}: {low:.6g} to {high:.6g}"
            for i, other in list(enumerate(self.intervals))[:k]:
                r = self.covariance[k, i] / (self.standard_errors[name] * self.standard_errors[other])
                if abs(r) > STRONG_CORRELATION:
                    out.append(("correlation", f"{other} and {name}: {r:.3f}"))
        units = dict(zip(self.of, self.units, strict=True))
        return [*out, *(("noise", f"{name}: {x:.4g} {units[name]}") for name, x in self.noise.items())]

    def as_dict(self) -> dict[str, Any]:
        """Everything as plain numbers and names."""
        own = {"intervals": {k: list(x) for k, x in self.intervals.items()}, "standard_errors": self.standard_errors}
        own |= {"covariance": self.covariance.tolist(), "confidence": self.confidence, "noise": self.noise}
        return super().as_dict() | own


STRONG_CORRELATION = 0.9  # correlation of two estimates from which on it is printed
