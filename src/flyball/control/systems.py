"""Linear systems in numbers: of transfer functions, and of what the python-control library has."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt

from ..errors import ModelError

Rows = list[list[float]]
UNNAMED = re.compile(r"y\[\d+\]")
"""Outputs as python-control calls them by itself."""


def realised(num: npt.ArrayLike, den: npt.ArrayLike, whose: str) -> tuple[Rows, Rows, Rows, Rows]:
    """A, B, C, D of a transfer function, coefficients from the highest power: the controllable canonical form.

    Raises
    ------
    ModelError
        If there is more in the numerator than in the denominator.
    """
    a, b = (np.trim_zeros(np.array(x, float), "f") for x in (den, num))
    if not len(a):
        raise ModelError(f"{whose}: its denominator is zero")
    if len(b) > len(a):
        raise ModelError(
            f"{whose}: its numerator is of order {len(b) - 1}, its denominator of order {len(a) - 1}; a transfer "
            f"function that differentiates has no states: add a filter, a factor (1 + T s) in the denominator"
        )
    n = len(a) - 1
    b = np.r_[np.zeros(len(a) - len(b)), b] / a[0]
    a = a / a[0]
    A = np.vstack([-a[1:][None, :], np.eye(n)[:-1]]) if n else np.zeros((0, 0))
    C = (b[1:] - b[0] * a[1:])[None, :]
    return A.tolist(), np.eye(n)[:, :1].tolist(), C.tolist() if n else [], [[float(b[0])]]


def matrices(system: Any, name: str) -> dict[str, Any]:
    """Fields A, B, C, D of a `StateSpace` for a system of the python-control library, and its period if it has one.

    Raises
    ------
    ModelError
        If it is no such system, or has several inputs or outputs as a transfer function.
    """
    whose = f"StateSpace {name!r}"
    if all(hasattr(system, k) for k in "ABCD"):
        if any(np.iscomplexobj(getattr(system, k)) for k in "ABCD"):
            raise ModelError(f"{whose}: its matrices are complex; take another basis of its states")
        found = [np.atleast_2d(np.asarray(getattr(system, k), float)) for k in "ABCD"]
        states = 0 if found[0].size == 0 else len(found[0])
        A, B, C, D = (M.tolist() if states or k == "D" else [] for k, M in zip("ABCD", found, strict=True))
    elif hasattr(system, "num") and hasattr(system, "den"):
        num, den = (_single(getattr(system, k), whose) for k in ("num", "den"))
        A, B, C, D = realised(num, den, whose)
    else:
        raise ModelError(
            f"{whose}: {type(system).__name__} is no linear system; give a control.StateSpace or a "
            f"control.TransferFunction"
        )
    out: dict[str, Any] = {"A": A, "B": B, "C": C, "D": D}
    dt = getattr(system, "dt", None)
    if dt is not None and dt is not True and dt > 0.0:
        out["period"] = float(dt)
    return out


def output_names(system: Any) -> tuple[str, ...]:
    """What a system of the python-control library calls its outputs, as plain words; none if nobody named them."""
    labels = [str(x) for x in getattr(system, "output_labels", None) or ()]
    if all(UNNAMED.fullmatch(x) for x in labels):
        return ()
    return tuple(re.sub(r"^(?=\d)|\W", "_", x) for x in labels)


def _single(coefficients: Any, whose: str) -> np.ndarray:
    """The one polynomial of a transfer function."""
    found = coefficients
    while len(found) and np.ndim(found[0]) > 0:
        if len(found) > 1:
            raise ModelError(f"{whose}: a transfer function of several inputs or outputs; give control.ss(system)")
        found = found[0]
    return np.asarray(found, float)
