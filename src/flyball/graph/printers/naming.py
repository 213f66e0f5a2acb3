"""Names in generated code: valid, and each for one thing."""

from __future__ import annotations

import re
from collections.abc import Iterable


class Names:
    """Gives each thing an identifier of its own, as near to what it is called as the language allows.

    Parameters
    ----------
    reserved : iterable of str
        What the language or the generated code itself uses.
    """

    def __init__(self, reserved: Iterable[str] = ()) -> None:
        self._taken = set(reserved)

    def __call__(self, wanted: str) -> str:
        """An identifier that nothing else has."""
        name = re.sub(r"\W+", "_", wanted, flags=re.ASCII).strip("_") or "x"
        if name[0].isdigit():
            name = "x" + name
        given, n = name, 2
        while given in self._taken:
            given, n = f"{name}_{n}", n + 1
        self._taken.add(given)
        return given
