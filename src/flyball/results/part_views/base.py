"""Base classes of views: quantities by name as attributes and curves; concatenated views of consecutive parts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ...errors import ModelError
from ...model.joint import ORIENTATION_ANGLES
from ...model.quantities import Quantity, quantities, unknown_quantity

if TYPE_CHECKING:
    from ..result import Result


Curves = dict[str, tuple[str, np.ndarray]]


def components_array(a: tuple, planar: bool) -> np.ndarray:
    """(n, 2) or (n, 3) array from a tuple of components."""
    return np.stack(a[:2] if planar else a, axis=1)


def continuous_quaternions(e: np.ndarray) -> np.ndarray:
    """Unit quaternions (n, 4), each with the sign that is nearer to the one before it."""
    flips = np.cumprod(np.r_[1.0, np.where((e[1:] * e[:-1]).sum(axis=1) < 0, -1.0, 1.0)])
    return e * flips[: len(e), None]


class NamedQuantities:
    """Base class of objects with quantities over time, by the names of `flyball.model.quantities`.

    Each of them is an attribute, and a result of `quantity`; those without a property are provided by ``_found``.
    """

    instead: ClassVar[dict[str, str]] = {}  # unknown name -> the name to use instead

    @property
    def title(self) -> str:
        """Title for messages."""
        raise NotImplementedError

    @property
    def names(self) -> dict[str, Quantity]:
        """All its quantities by name."""
        raise NotImplementedError

    def quantity(self, name: str) -> tuple[str, np.ndarray]:
        """Return unit and values over time, (n,) or (n, k), of a quantity.

        Raises
        ------
        ModelError
            If there is none of that name; the message lists the existing ones.
        """
        x = self.names.get(name)
        if x is None:
            raise ModelError(self._unknown(name))
        whole = x.of or name
        values = getattr(self, whole) if hasattr(type(self), whole) else self._found(whole)
        return x.unit, values if x.component is None else values[:, x.component]

    def _found(self, name: str) -> Any:
        """Return the values of a quantity without a property."""
        raise AttributeError(name)

    def _unknown(self, name: str) -> str:
        more = f"; {self.instead[name]}" if name in self.instead else ""
        return f"{unknown_quantity(self.title, name, self.names)}{more}"

    def channels(self) -> Curves:
        """Return its curves: name -> (unit, values)."""
        return {k: self.quantity(k) for k, x in self.names.items() if x.curve}

    def __getattr__(self, name: str) -> Any:
        """Return any of its quantities by name."""
        if name.startswith("_") or name in ("element", "names"):  # accessed during unpickling
            raise AttributeError(name)
        if name not in self.names:
            raise AttributeError(self._unknown(name))
        return self.quantity(name)[1]

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self.names})

    def _ipython_key_completions_(self) -> list[str]:
        return list(self.names)

    def __getitem__(self, name: str) -> np.ndarray:
        """Return one of its quantities by name."""
        return self.quantity(name)[1]


class PartView(NamedQuantities):
    """One part of a result."""

    def __init__(self, result: Result, element: Any) -> None:
        self._result = result
        self.element = element
        self._x = result.values

    @property
    def title(self) -> str:
        """Kind and name of the part."""
        return self.element.title

    @cached_property
    def names(self) -> dict[str, Quantity]:
        """All quantities of the part, by name."""
        return quantities(self._x.structure.model, self.element.name)

    def lock_effort(self, what: str) -> np.ndarray:
        """Return the force [N] or torque [N m] along a coordinate of the part while it is locked, else 0."""
        label = f"{self.element.name}.{what}"
        rows = [w.row for w in self._result.values.structure.switches if w.switch.label == label]
        return self._result.multipliers[:, rows[0]] if rows else self._result.motions.zeros()

    def __repr__(self) -> str:
        return f"<{self.title} over {len(self._result.t)} times: {', '.join(self.names)}>"


class SplicedView(NamedQuantities):
    """Concatenated views of one part over consecutive times, each with its own parameters."""

    def __init__(self, views: Sequence[Any], counts: Sequence[int]) -> None:
        self._views, self._counts = tuple(views), tuple(counts)

    @property
    def title(self) -> str:
        """Kind and name of the part."""
        return self._views[0].title

    @cached_property
    def names(self) -> dict[str, Quantity]:
        """All quantities of the part."""
        return self._views[0].names

    def quantity(self, name: str) -> tuple[str, np.ndarray]:
        """Unit and values over all times."""
        every = [v.quantity(name) for v in self._views]
        return every[0][0], self._end_to_end(name, [x for _, x in every])

    @staticmethod
    def _end_to_end(name: str, every: Sequence[np.ndarray]) -> np.ndarray:
        values = np.concatenate(every)
        if name in ORIENTATION_ANGLES:
            return np.unwrap(values)
        return continuous_quaternions(values) if name == "quaternion" else values

    def channels(self) -> Curves:
        """Return the curves of all pieces."""
        names = dict.fromkeys(k for v in self._views for k in v.channels())
        return {k: self.quantity(k) for k in names}

    def __getattr__(self, name: str) -> Any:
        """Return any attribute of the views; results of methods are concatenated over all pieces."""
        if name.startswith("_"):  # accessed during unpickling
            raise AttributeError(name)
        if name in self.names:
            return self.quantity(name)[1]
        return self._joined([getattr(v, name) for v in self._views])

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *dir(self._views[0])})

    def _joined(self, every: list[Any]) -> Any:
        first = every[0]
        if isinstance(first, np.ndarray) and all(
            np.ndim(x) and len(x) == n for x, n in zip(every, self._counts, strict=True)
        ):
            return np.concatenate(every)
        if isinstance(first, (tuple, list)):
            return type(first)(self._joined(list(parts)) for parts in zip(*every, strict=True))
        if isinstance(first, dict):
            return {k: self._joined([x[k] for x in every]) for k in first}
        return self._called(every) if callable(first) else first

    def _called(self, every: Sequence[Callable]) -> Callable:
        def joined(*args: Any, **options: Any) -> Any:
            return self._joined([f(*args, **options) for f in every])

        return joined

    def __repr__(self) -> str:
        return f"<{self.title} over {sum(self._counts)} times, {len(self._views)} sets of parameters>"
