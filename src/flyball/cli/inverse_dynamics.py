"""``flyball inverse-dynamics``: what drives have to do, and what joints carry, for a given motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import ModelError
from .common import Changes, Json, Model, app, make_folder, print_json, reported, table
from .kinematics import Coordinates, End, Out, Outputs, Times, asked_times
from .loading import load_mechanism, set_parameters
from .progress import announce_compiling

Motion = Annotated[
    list[str] | None, typer.Option(help='How a coordinate moves: --motion "A.angle=0.3*sin(2*t)"; may be repeated.')
]


@app.command("inverse-dynamics")
def inverse_dynamics(
    model: Model,
    t_end: End = "1",
    outputs: Outputs = 501,
    times: Times = None,
    motion: Motion = None,
    coordinates: Coordinates = "auto",
    out: Out = None,
    change: Changes = None,
    as_json: Json = False,
) -> None:
    """Efforts of drives and reactions of joints: inverse_dynamics.csv, inverse_dynamics.png, result.nc."""
    with reported(as_json):
        mechanism = load_mechanism(model)
        set_parameters(mechanism, change or [])
        announce_compiling(not as_json)
        when, options = asked_times(times, t_end, outputs)
        found = mechanism.inverse_dynamics(when, _motion(motion or []), coordinates=coordinates, **options)
        folder = out if out is not None else Path(f"{model.stem}-inverse-dynamics")
        make_folder(folder)
        files = [folder / name for name in ("inverse_dynamics.csv", "inverse_dynamics.png", "result.nc")]
        found.to_csv(files[0])
        found.plot(files[1])
        found.result.save(files[2])
        written = [str(f) for f in files]
        if as_json:
            print_json(found.as_dict() | {"files": written})
        else:
            table([*found.lines(), *(("written", f) for f in written)])


def _motion(texts: list[str]) -> dict[str, str]:
    """Coordinates and laws from the command line."""
    out = {}
    for text in texts:
        name, equals, law = (x.strip() for x in text.partition("="))
        if not equals or not law:
            raise ModelError(f'--motion {text!r}: write coordinate=law, for instance --motion "A.angle=0.3*sin(2*t)"')
        out[name] = law
    return out
