"""``flyball check``: what can be said without simulating."""

from __future__ import annotations

from .common import Json, Model, app, print_json, reported, table
from .loading import load_mechanism
from .progress import announce_compiling


@app.command()
def check(model: Model, as_json: Json = False) -> None:
    """Freedoms, redundant joints, assembly, mass properties and warnings, without simulating."""
    with reported(as_json):
        mechanism = load_mechanism(model)
        announce_compiling(not as_json)
        report = mechanism.check()
        if as_json:
            print_json(report.as_dict())
        else:
            table(report.lines())
