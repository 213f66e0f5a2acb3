"""``flyball mobility``: freedoms, and constraints that depend on one another."""

from __future__ import annotations

from .common import Changes, Json, Model, app, print_json, reported, table
from .loading import load_mechanism, set_parameters
from .progress import announce_compiling


@app.command()
def mobility(model: Model, change: Changes = None, as_json: Json = False) -> None:
    """Freedoms by name, redundant constraints and their cures, special dimensions and singular positions."""
    with reported(as_json):
        mechanism = load_mechanism(model)
        set_parameters(mechanism, change or [])
        announce_compiling(not as_json)
        found = mechanism.mobility()
        if as_json:
            print_json(found.as_dict())
        else:
            table(found.lines())
