"""Absolute and joint coordinates: what must hold in both is tested in both.

``both_layers`` runs a test, or as ``pytestmark`` all of a file, once in each; ``simulate`` then takes that layer where a
test does not say which. Mechanisms without a joint that can be a tree joint are run once.
"""

from __future__ import annotations

import functools
from collections.abc import Callable

import pytest

import flyball as fb
from flyball.assembly.assembled_state import Assembly
from flyball.simulation import simulate
from flyball.simulation.initial_state import InitialState, find_initial_state

LAYERS = ("absolute", "joint")
AUTO = "auto"
both_layers = pytest.mark.usefixtures("layer")
_chosen = [AUTO]


def in_force() -> str:
    """The coordinates that ``simulate`` takes now where it is not told."""
    return _chosen[-1]


def take(layer: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Simulate in that layer until the test ends."""

    def begun(model, t, parameters, before, coordinates, **more) -> InitialState:
        coordinates = layer if coordinates == AUTO else coordinates
        start = find_initial_state(model, t, parameters, before, coordinates, **more)
        if coordinates == "joint" and not start.assembly.compiled.structure.tree:
            pytest.skip("no joint of it can be a tree joint")
        return start

    monkeypatch.setattr(simulate, "find_initial_state", begun)
    monkeypatch.setattr(f"{__name__}._chosen", [layer])


def cached(make: Callable) -> Callable:
    """As ``functools.cache``, for each layer its own."""

    @functools.cache
    def of_layer(layer, args, named):
        return make(*args, **dict(named))

    @functools.wraps(make)
    def found(*args, **named):
        return of_layer(in_force(), args, tuple(named.items()))

    return found


def started(model: fb.Mechanism) -> Assembly:
    """A mechanism where it starts, in the coordinates in force."""
    return simulate.find_initial_state(model, 0.0, None, None, in_force()).assembly
