"""What every view of a part shares: its quantities by name, as attributes and as curves."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ...errors import ModelError
from ...model.quantities import Quantity, quantities, unknown

if TYPE_CHECKING:
    from ..result import Result

Curves = dict[str, tuple[str, np.ndarray]]


def stacked(a: tuple, planar: bool) -> np.ndarray:
    """(n, 2) or (n, 3) array from a tuple of components."""
    return np.stack(a[:2] if planar else a, axis=1)


def same_sign(e: np.ndarray) -> np.ndarray:
    """Unit quaternions (n, 4), each with the sign that is nearer to the one before it."""
    flips = np.cumprod(np.r_[1.0, np.where((e[1:] * e[:-1]).sum(axis=1) < 0, -1.0, 1.0)])
    return e * flips[: len(e), None]


class Named:
    """Something that has quantities over time, by the names of `flyball.model.quantities`.

    Each of them is an attribute and an answer of `quantity`; what the class has no property for, ``_found`` knows.
    """

    instead: ClassVar[dict[str, str]] = {}  # a name that it has not -> what to ask for

    @property
    def title(self) -> str:
        """What it is, for messages."""
        raise NotImplementedError

    @property
    def names(self) -> dict[str, Quantity]:
        """Everything that it has, by name."""
        raise NotImplementedError

    def quantity(self, name: str) -> tuple[str, np.ndarray]:
        """Unit and values over time, (n,) or (n, k), of one of its names.

        Raises
        ------
        ModelError
            If it has none of that name; the message lists what there is.
        """
        x = self.names.get(name)
        if x is None:
            raise ModelError(self._unknown(name))
        whole = x.of or name
        values = getattr(self, whole) if hasattr(type(self), whole) else self._found(whole)
        return x.unit, values if x.component is None else values[:, x.component]

    def _found(self, name: str) -> Any:
        """Values of what the class has no property for."""
        raise AttributeError(name)

    def _unknown(self, name: str) -> str:
        more = f"; {self.instead[name]}" if name in self.instead else ""
        return f"{unknown(self.title, name, self.names)}{more}"

    def channels(self) -> Curves:
        """Its curves: name -> (unit, values)."""
        return {k: self.quantity(k) for k, x in self.names.items() if x.curve}

    def __getattr__(self, name: str) -> Any:
        """Any of its quantities by name."""
        if name.startswith("_") or name in ("element", "names"):  # asked for while it is being unpickled
            raise AttributeError(name)
        if name not in self.names:
            raise AttributeError(self._unknown(name))
        return self.quantity(name)[1]

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self.names})

    def _ipython_key_completions_(self) -> list[str]:
        return list(self.names)

    def __getitem__(self, name: str) -> np.ndarray:
        """One of its quantities by name."""
        return self.quantity(name)[1]


class View(Named):
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
        """Everything that the result says of the part, by name."""
        return quantities(self._x.structure.model, self.element.name)

    def __repr__(self) -> str:
        return f"<{self.title} over {len(self._result.t)} times: {', '.join(self.names)}>"
