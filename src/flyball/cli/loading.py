"""Mechanisms from model files, with parameters changed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import ModelError
from .flags import once

if TYPE_CHECKING:
    from ..mechanism import Mechanism


def load_mechanism(path: Path) -> Mechanism:
    """The mechanism of a model file."""
    from ..files import load

    return load(path)


def set_parameters(mechanism: Mechanism, changes: Sequence[str]) -> None:
    """Give parameters other values, and check again all that depends on them."""
    from ..model.model import listing, suggest

    given: dict[str, str] = {}
    for text in changes:
        name, equals, value = (x.strip() for x in text.partition("="))
        if not equals or not value:
            raise ModelError(f"--set {text!r}: write name=value, for instance --set mass=2 or --set speed='120 rpm'")
        once(given, name, "--set", text)
        given[name] = value
        known = list(mechanism.parameters)
        if name not in known:
            problem = f"{mechanism.name!r} has no parameter {name!r}{suggest(name, known)}"
            raise ModelError(f"--set {text!r}: {problem}; {listing(known) if known else 'it has none'}")
        try:
            new: float | str = float(value)
        except ValueError:
            new = value
        try:
            mechanism.environment({name: new})
        except ModelError as error:
            raise type(error)(f"--set {text!r}: {error}") from None
        mechanism.parameters[name] = new
    if changes:
        env = mechanism.environment()
        for e in mechanism.elements():
            mechanism.validate(e, env)


def leave_out(mechanism: Mechanism, names: Sequence[str]) -> Mechanism:
    """The mechanism without parts of these names, or of these kinds (``events``, ``limits``, ...).

    Raises
    ------
    ModelError
        If there is none of that name, or what is left names one that is left out.
    """
    from ..model.model import CATEGORIES, suggest

    if not names:
        return mechanism
    kinds = [k for k in CATEGORIES if getattr(mechanism, k)]
    parts = {e.name: None for name in names if name in kinds for e in getattr(mechanism, name)}
    for name in (n for n in names if n not in kinds):
        if name not in mechanism.by_name:
            known = suggest(name, [*mechanism.by_name, *kinds])
            raise ModelError(
                f"--without {name!r}: {mechanism.name!r} has no such part{known}; kinds: {', '.join(kinds)}"
            )
        parts[name] = None
    left = mechanism.changed(parts)
    env = left.environment()
    for e in left.elements():
        left.validate(e, env)
    return left
