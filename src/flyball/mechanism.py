"""``Mechanism``: the description with every analysis as a method."""

from __future__ import annotations

import os

from .methods.design import Design
from .methods.freedom import Freedom
from .methods.motion import Motions
from .methods.statics import Statics
from .methods.symbols import Symbols
from .methods.threads import on_one_thread
from .model.model import Model


class Mechanism(Motions, Statics, Design, Freedom, Symbols, Model):
    """A mechanism: described once, then asked anything. See `Model` for what it takes.

    Nothing that an analysis finds is stored in it, so sweeps are loops.
    """

    def save(self, path: str | os.PathLike) -> None:
        """Write the description to a TOML file; `flyball.load` reads it back exactly."""
        from .model.io import save

        save(self, path)

    def _repr_html_(self) -> str:
        from .view.described import described

        return described(self)


for _family in (Motions, Statics, Design, Freedom, Symbols):  # so that Python's own messages name what the user called
    for _name, _method in list(vars(_family).items()):
        if not _name.startswith("_") and callable(_method):
            _method.__qualname__ = f"Mechanism.{_name}"
            setattr(_family, _name, on_one_thread(_method, by_scipy=_family is Statics))
