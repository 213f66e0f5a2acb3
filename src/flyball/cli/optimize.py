"""``flyball optimize``: parameters for which quantities come nearest to a target."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..errors import ModelError
from ..methods.design import Design
from .asking import Asked, command
from .flags import Flag, once, quantity, values


def _bounds(texts: list[str], unit: str, flag: str) -> dict[str, tuple[str | None, str | None]]:
    """name, or name=low:high with either left out."""
    out: dict[str, tuple[str | None, str | None]] = {}
    for text in texts:
        name, equals, bounds = text.partition("=")
        low, colon, high = bounds.partition(":")
        if equals and not colon:
            raise ModelError(f"{flag} {text!r}: write name=low:high, for instance {flag} crank=0.1:0.3")
        once(out, name.strip(), flag, text)
        out[name.strip()] = (low.strip() or None, high.strip() or None)
    return out


OWN = {
    "to": Flag(type=list[str], read=_bounds, help="A parameter, with bounds if wanted: --to crank=0.1:0.3."),
    "target": Flag(
        type=list[str],
        help="What each quantity should be, in SI units or with a unit; or a CSV file with a column for each.",
    ),
    "weights": Flag(type=str, read=values, help="A weight for each quantity, as 1,0.5."),
}


@command(Design.optimize, own=OWN, without=("minimize",))
def optimize(asked: Asked) -> None:
    """Print the best parameters."""
    goal = _target(asked.given.pop("target", []), len(asked.given["of"]))
    if asked.given.get("analysis") == "motion":
        asked.given.setdefault("outputs", len(goal))
    asked.say(asked.answer(target=goal))


def _target(texts: list[str], count: int) -> Any:
    """Numbers, or the columns of a file, (times, quantities)."""
    import numpy as np

    if len(texts) == 1 and Path(texts[0]).suffix.lower() == ".csv":
        try:
            found = np.genfromtxt(texts[0], delimiter=",", ndmin=2)
        except (OSError, ValueError) as error:
            raise ModelError(f"cannot read {texts[0]!r}: {error}") from None
        found = found[~np.isnan(found).all(axis=1)]  # a line of names
        if found.shape[1] != count or not len(found) or np.isnan(found).any():
            raise ModelError(f"{texts[0]!r} needs a column of numbers for each of the {count} quantities")
        return found
    if len(texts) != count:
        raise ModelError(f"{count} quantities need as many targets, got {len(texts)}")
    return np.array([[quantity(x, "", "--target") for x in texts]])
