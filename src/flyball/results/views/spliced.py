"""A part of a motion on which parameters changed: the views of its pieces, end to end."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from ...model.quantities import Quantity
from .base import Curves, Named, same_sign


class Spliced(Named):
    """The views of one part over times that follow one another, each with parameters of its own."""

    def __init__(self, views: Sequence[Any], counts: Sequence[int]) -> None:
        self._views, self._counts = tuple(views), tuple(counts)

    @property
    def title(self) -> str:
        """Kind and name of the part."""
        return self._views[0].title

    @cached_property
    def names(self) -> dict[str, Quantity]:
        """Everything that the result says of the part."""
        return self._views[0].names

    def quantity(self, name: str) -> tuple[str, np.ndarray]:
        """Unit and values over all times."""
        every = [v.quantity(name) for v in self._views]
        return every[0][0], self._end_to_end(name, [x for _, x in every])

    @staticmethod
    def _end_to_end(name: str, every: Sequence[np.ndarray]) -> np.ndarray:
        values = np.concatenate(every)
        return same_sign(values) if name == "quaternion" else values

    def channels(self) -> Curves:
        """Curves that any piece has."""
        names = dict.fromkeys(k for v in self._views for k in v.channels())
        return {k: self.quantity(k) for k in names}

    def __getattr__(self, name: str) -> Any:
        """Anything that the views have; methods answer with what those of all pieces do."""
        if name.startswith("_"):  # asked for while it is being unpickled
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
