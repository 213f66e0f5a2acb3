"""A stop: how far a coordinate goes."""

from __future__ import annotations

from dataclasses import field
from types import SimpleNamespace
from typing import ClassVar

from ..errors import ModelError
from .element import Element, Number, Ratio, element
from .material import check_restitution


@element
class Limit(Element):
    """Hard stops of a coordinate: it stays between ``lower`` and ``upper``, and bounces off by ``restitution``.

    Parameters
    ----------
    name : str
    coordinate : str
        ``"joint.coordinate"`` such as ``"knee.angle"``, or a world coordinate of a body's or frame's origin such as
        ``"slider.x"``.
    lower, upper : number [rad] or [m]
        Least and greatest value; no stop on a side that is not given.
    restitution : number [1]
        From 0 (dead) to 1 (elastic).
    """

    coordinate: str = field(kw_only=False)
    lower: Number | None = None
    upper: Number | None = None
    restitution: Ratio = 0.0

    category: ClassVar[str] = "limits"

    def check(self, n: SimpleNamespace) -> None:
        """One stop at least, and a restitution from 0 to 1."""
        check_restitution(self, n)
        if self.lower is None and self.upper is None:
            raise ModelError(f"{self.title}: it stops nothing; give lower=..., upper=... or both")
