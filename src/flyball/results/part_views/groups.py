"""What a result says of a group of parts, such as one of several copies of a mechanism."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...errors import ModelError
from ...model.messages import listing, suggest

if TYPE_CHECKING:
    from ..result import Result


class GroupView:
    """The parts of a group by their names in it: ``run["front_left"]["arm.x"]`` is ``run["front_left.arm.x"]``.

    Attributes
    ----------
    name : str
    """

    def __init__(self, result: Result, name: str) -> None:
        self._result, self.name = result, name

    def parts(self) -> list[str]:
        """Names of the parts in the group, and of those of groups in it."""
        first = f"{self.name}."
        return [x.removeprefix(first) for x in self._result.parts() if x.startswith(first)]

    def names(self) -> list[str]:
        """Every name that it can be asked for: parts, and ``"part.quantity"``."""
        first = f"{self.name}."
        return [x.removeprefix(first) for x in self._result.names() if x.startswith(first)]

    def __contains__(self, name: object) -> bool:
        return f"{self.name}.{name}" in self._result

    def __getitem__(self, name: str) -> Any:
        """Return a part of the group by its name in it, or one of its quantities.

        Raises
        ------
        ModelError
            If there is none.
        """
        owner = str(name).partition(".")[0]
        known = list(dict.fromkeys(x.partition(".")[0] for x in self.parts()))
        if owner not in known:
            raise ModelError(f"{self.name!r} has no part named {owner!r}{suggest(owner, known)}; {listing(known)}")
        return self._result[f"{self.name}.{name}"]

    def _ipython_key_completions_(self) -> list[str]:
        return self.names()

    def __repr__(self) -> str:
        return f"<group {self.name!r} of {self._result.model.name!r}: {', '.join(self.parts())}>"
