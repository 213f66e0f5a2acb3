"""Tables: a curve through measured points, called by name in laws."""

from __future__ import annotations

import math
from functools import cached_property
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator

from ..errors import ModelError, UnitError
from ..math.spline import BREAKS, PIECE, pack_spline, spline, spline_expression
from .element import Element, checked_size, element, python_data
from .expression_parser import CONSTANTS, FUNCTIONS
from .names import is_plain
from .units import to_si

Column = Annotated[tuple[float, ...], BeforeValidator(python_data)]


@element
class Table(Element):
    """A function of one number, given by points; laws call it by its name: ``"spring_curve(length - 0.3)"``.

    Parameters
    ----------
    name : str
        A plain name, since expressions use it.
    x, y : numbers
        The points; x ascends.
    interpolation : ``"cubic"``, ``"monotone"`` or ``"linear"``
        Cubic: the smoothest, with two continuous derivatives (not-a-knot at the ends), good for laws of motion; it may
        swing beyond the points. Monotone: one continuous derivative and never beyond the points (Fritsch and Butland, A
        method for constructing local monotone piecewise cubic interpolants, SIAM J. Sci. Stat. Comput. 5, 1984).
        Linear: straight lines between the points, with kinks.
    beyond : ``"refuse"``, ``"hold"``, ``"line"`` or ``"repeat"``
        Beyond the points: undefined, and a motion that gets there stops; the value of the end; a straight line with the
        slope of the end; or periodic (the last y must then equal the first; cubic is smooth across the seam too).
    x_unit, y_unit : str
        Units that x and y are written in, such as ``"mm"`` and ``"kN"``; SI if not given.
    """

    x: Column
    y: Column
    interpolation: Literal["cubic", "monotone", "linear"] = "cubic"
    beyond: Literal["refuse", "hold", "line", "repeat"] = "refuse"
    x_unit: str = ""
    y_unit: str = ""

    category: ClassVar[str] = "tables"
    arguments: ClassVar[tuple[str, ...]] = ("x",)
    hints: ClassVar[dict[str, str]] = {
        "outside": "this field is now beyond: 'hold', 'line' (formerly 'linear') or 'repeat' (formerly 'periodic')"
    }

    def check(self, n: SimpleNamespace) -> None:
        """Refuse invalid points, and a name that expressions could not use."""
        check_table_name(self)
        self._points()

    def curves(self) -> dict[str, Table]:
        """Return itself by name: the tables of one argument that it is composed of."""
        return {self.name: self}

    def data(self) -> list[float]:
        """Return the curve in SI units as the flat list that `flyball.math.spline` reads.

        Raises
        ------
        ModelError
            If there are fewer than two points, x does not ascend, or a number is not finite.
        """
        return list(self._list)

    def derivative_data(self, order: int) -> list[float]:
        """Return the first or second derivative of the curve as such a list."""
        out = self._array.copy()
        pieces = out[BREAKS + int(out[1]) :].reshape(-1, PIECE)
        for _ in range(order):
            pieces[:] = np.c_[pieces[:, 1:] * np.arange(1.0, PIECE), np.zeros(len(pieces))]
        return out.tolist()

    def values(self, x: Any) -> tuple[Any, Any, Any]:
        """Value, first and second derivative at ``x`` [SI], a number (real or complex) or an array.

        They are nan beyond the ends if ``beyond`` is ``"refuse"``.
        """
        return spline(self._array if isinstance(x, np.ndarray | np.generic) else self._list, 0, x)

    def value(self, x: Any) -> Any:
        """Value at ``x`` [SI]: a number (real or complex), an array, or a SymPy expression."""
        if isinstance(x, float | int | complex | np.ndarray | np.generic):
            return self.values(x)[0]
        return spline_expression(self._array, 0, x)

    def ends(self) -> tuple[float, float]:
        """The first and the last x [SI] that it has a value for: all, unless ``beyond`` is ``"refuse"``."""
        if self.beyond != "refuse":
            return -math.inf, math.inf
        count = int(self._array[1])
        return float(self._array[BREAKS]), float(self._array[BREAKS + count - 1])

    def out_of_range_message(self, x: float) -> str:
        """Return the message on a missing value at ``x`` [SI], with remedies."""
        unit = f" {self.x_unit}" if self.x_unit else ""
        written = x / (to_si(f"1 {self.x_unit}", None) if self.x_unit else 1.0)
        at = f"x = {written:.6g}{unit}"
        if any(f"{end:.6g}" == f"{written:.6g}" for end in (self.x[0], self.x[-1])):
            at = f"a point just beyond x = {written:.6g}{unit}"
        return (
            f"{self.title} is evaluated at {at}, and its points extend from {self.x[0]:g} to {self.x[-1]:g}{unit}; "
            "give it more points, or choose its values beyond them: beyond='hold', 'line' or 'repeat'"
        )

    @cached_property
    def _list(self) -> list[float]:
        return self._array.tolist()

    @cached_property
    def _array(self) -> np.ndarray:
        x, y = self._points()
        with np.errstate(all="ignore"):
            return pack_spline(x, y, _MAKERS[self.interpolation](x, y, self.beyond == "repeat"), self.beyond)

    def _points(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the points in SI units, checked."""
        if len(self.x) != len(self.y):
            raise ModelError(f"{self.title}: x has {len(self.x)} numbers and y has {len(self.y)}; give pairs")
        if len(self.x) < 2:
            raise ModelError(f"{self.title}: {len(self.x)} point makes no curve; give two points or more")
        x, y = (self._column(name) for name in "xy")
        for k in range(1, len(x)):
            if not x[k] > x[k - 1]:
                raise ModelError(
                    f"{self.title}: x[{k}] = {self.x[k]:g} comes after x[{k - 1}] = {self.x[k - 1]:g}; x must ascend: "
                    f"sort the points and leave out repeated ones"
                )
        with np.errstate(all="ignore"):
            slopes = np.abs(np.diff(y) / np.diff(x))
        if not np.isfinite(slopes).all():
            k = int(np.argmax(slopes))
            raise ModelError(f"{self.title}: x[{k}] and x[{k + 1}] are too close, the slope between them is no number")
        if self.beyond == "repeat":
            if abs(y[-1] - y[0]) > 1e-9 * np.ptp(y):
                raise ModelError(
                    f"{self.title}: a table that repeats ends where it starts, but y[0] = {self.y[0]:g} and "
                    f"y[{len(y) - 1}] = {self.y[-1]:g}; add the point that closes the period, or choose another beyond="
                )
            y[-1] = y[0]
        return x, y

    def _column(self, name: str) -> np.ndarray:
        values, unit = getattr(self, name), getattr(self, f"{name}_unit")
        for k, value in enumerate(values):
            if value - value != 0.0:
                raise ModelError(f"{self.title}: {name}[{k}] is {value}; give a finite number, or leave the point out")
            checked_size(value, None, f"{self.title}: {name}[{k}]")
        try:
            return np.array(values) * (to_si(f"1 {unit}", None) if unit else 1.0)
        except UnitError as error:
            raise UnitError(f"{self.title}: {name}_unit: {error}") from None


def check_table_name(e: Element) -> None:
    """Refuse a name that expressions could not use.

    Raises
    ------
    ModelError
        Naming the table.
    """
    if not is_plain(e.name):
        raise ModelError(f"{e.title}: expressions call a table by its name; use letters, digits and _ only")
    if e.name in FUNCTIONS or e.name in CONSTANTS or e.name == "t":
        raise ModelError(f"{e.title}: the name has a meaning in expressions; call it '{e.name}_curve'")


def _cubic(x: np.ndarray, y: np.ndarray, periodic: bool) -> np.ndarray:
    from scipy.interpolate import CubicSpline

    return CubicSpline(x, y, bc_type="periodic" if periodic else "not-a-knot").c[::-1].T


def _monotone(x: np.ndarray, y: np.ndarray, periodic: bool) -> np.ndarray:
    from scipy.interpolate import PchipInterpolator

    if not periodic:
        return PchipInterpolator(x, y).c[::-1].T
    n, period = len(x) - 1, x[-1] - x[0]  # with a period before and after, the seam is an ordinary point
    x, y = np.r_[x[:-1] - period, x, x[1:] + period], np.r_[y[:-1], y, y[1:]]
    return PchipInterpolator(x, y).c[::-1].T[n : 2 * n]


def _linear(x: np.ndarray, y: np.ndarray, periodic: bool) -> np.ndarray:
    zero = np.zeros(len(x) - 1)
    return np.column_stack([y[:-1], np.diff(y) / np.diff(x), zero, zero])


_MAKERS = {"cubic": _cubic, "monotone": _monotone, "linear": _linear}
