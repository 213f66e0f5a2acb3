"""Mechanisms from model files, with parameters changed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import ModelError

if TYPE_CHECKING:
    from ..mechanism import Mechanism


def load_mechanism(path: Path) -> Mechanism:
    """The mechanism of a model file."""
    from ..files import load

    return load(path)


def set_parameters(mechanism: Mechanism, changes: Sequence[str]) -> None:
    """Give parameters other values, and check again all that depends on them."""
    from ..model.model import listing, suggest

    for text in changes:
        name, equals, value = (x.strip() for x in text.partition("="))
        if not equals or not value:
            raise ModelError(f"--set {text!r}: write name=value, for instance --set mass=2 or --set speed='120 rpm'")
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
