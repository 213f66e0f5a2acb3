"""What is said of a copy with bodies in place of controllers, in the words of the model that it is a copy of."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import numpy as np

from ...errors import FlyballError, NotConverged
from .derivatives import Equations
from .rest import Rest
from .search import failure
from .sliders import Slid, of_slides, of_states

NUMBER = r"[-+]?(?:\d[\d.]*(?:e[-+]?\d+)?|inf|nan)"


@contextmanager
def in_own_words(other: Slid) -> Iterator[None]:
    """Have errors that are raised within name states and signals as the user does.

    Parameters
    ----------
    other : Slid
        The copy.
    """
    try:
        yield
    except FlyballError as error:
        if error.args and isinstance(error.args[0], str):
            error.args = (told(error.args[0], other), *error.args[1:])
        if isinstance(getattr(error, "elements", None), tuple):
            error.elements = tuple(told(name, other) for name in error.elements)  # type: ignore[attr-defined]
        raise


def told(text: str, other: Slid) -> str:
    """A text about the copy as one about the model."""
    for theirs, own in sorted(other.words.items(), key=lambda x: -len(x[0])):
        text = text.replace(theirs, own)
    for body, name in other.slides.items():
        stride = other.scales[name].stride

        def value(found: re.Match[str], name: str = name, stride: float = stride) -> str:
            return f"{name} = {float(other.at[name]) + stride * float(found[1]) + 0.0:.6g}"

        text = re.sub(rf"\b{body}_now\.value = ({NUMBER})(?: m/s| m)?", value, text)
        text = re.sub(rf"Actuator '{body}_push'(?:: its law)?", f"the law of {name!r}:", text)
        text = re.sub(rf"\b{body}(?:_slide|_push|_now)?(?:\.\w+)?\b", name, text)
    return text


def refusal(x: Rest, other: Slid) -> NotConverged:
    """What remains where the search for a position at rest ended.

    Parameters
    ----------
    x : Rest
        Of the copy.
    other : Slid
        The copy.
    """
    best = Rest.at(x.c, x.t, x.q)
    error, rates = failure(best), rates_left(best.equations, other)
    rows = of_states(other, x.c.structure)
    left = np.abs(best.r)
    own = {name: value for name, value in error.residuals.items() if not of_slides(name, other.slides)} | rates
    if not rows or left[rows].max() < left.max():  # controllers without states are at rest by themselves
        return NotConverged(told(error.args[0], other), own)
    k = int(np.argmax(left[rows]))
    return NotConverged(
        f"no equilibrium of {x.c.structure.model.name!r} was found: where the search ended, "
        f"{changing(other, rates, [*rates][k])}, and nothing brings that to rest. Give a better guess, or look whether "
        f"the controller can change what it measures, its limits considered",
        own,
    )


def rates_left(e: Equations, other: Slid) -> dict[str, float]:
    """State -> its rate; of what is sampled by how much the next sample changes it."""
    left = e.block("r")[of_states(other, e.state.c.structure)]
    return {name: -float(r) / other.scales[name].push for name, r in zip(other.slides.values(), left, strict=True)}


def changing(other: Slid, rates: Mapping[str, float], name: str) -> str:
    """What a state does that does not rest, in words."""
    if name in other.held:
        return f"the next sample changes {name!r} by {rates[name]:.3g}"
    return f"{name!r} changes by {rates[name]:.3g} in a second"
