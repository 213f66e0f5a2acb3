"""``flyball kinematics``: the motion that drivers prescribe."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .common import Changes, Json, Model, app, fail, make_folder, print_json, reported, seconds, table
from .loading import load_mechanism, set_parameters
from .progress import announce_compiling

Times = Annotated[str | None, typer.Option(help='Times [s] themselves, as "0,0.1,0.2".')]
End = Annotated[str, typer.Option(help='End of the motion, e.g. 1 or "500 ms".')]
Outputs = Annotated[int, typer.Option(help="Number of times.")]
Out = Annotated[
    Path | None, typer.Option("--out", "-o", help="Folder for the results; by default named after the model.")
]
Coordinates = Annotated[str, typer.Option(help="absolute, joint, or auto: those that cost less.")]


@app.command()
def kinematics(
    model: Model,
    t_end: End = "1",
    outputs: Outputs = 501,
    times: Times = None,
    point: Annotated[
        list[str] | None, typer.Option(help='Body, frame, or "body:x,y" whose path is drawn; may be repeated.')
    ] = None,
    coordinates: Coordinates = "auto",
    out: Out = None,
    change: Changes = None,
    as_json: Json = False,
) -> None:
    """Positions, velocities and accelerations of a driven mechanism: result.csv, result.nc, paths.png."""
    from ..errors import SingularityError

    with reported(as_json):
        mechanism = load_mechanism(model)
        set_parameters(mechanism, change or [])
        announce_compiling(not as_json)
        when, options = asked_times(times, t_end, outputs)
        try:
            result = mechanism.kinematics(when, coordinates=coordinates, **options)
        except SingularityError as error:
            fail(str(error), type(error).__name__, 3, as_json, {"t": error.where, "elements": list(error.elements)})
        folder = out if out is not None else Path(f"{model.stem}-kinematics")
        make_folder(folder)
        files = [folder / name for name in ("result.csv", "result.nc", "paths.png")]
        result.to_csv(files[0])
        result.save(files[1])
        result.plot_path(*map(asked_point, point or []), path=files[2])
        written = [str(f) for f in files]
        if as_json:
            print_json({"name": mechanism.name, "times": len(result.t), "t": result.t[[0, -1]].tolist(),
                        "health": result.health.as_dict(), "files": written})  # fmt: skip
        else:
            table([*result.health.lines(), *(("written", f) for f in written)])


def asked_times(times: str | None, t_end: str, outputs: int) -> tuple[int | list[float], dict[str, float]]:
    """Times from the command line, and what else goes with them."""
    from ..model.expressions import number

    if times is None:
        return outputs, {"t_end": seconds(t_end)}
    return [float(number(_plain(x), {}, "s", "--times")) for x in times.split(",")], {}


def asked_point(text: str) -> str | tuple[str, list[float]]:
    """A point from the command line: a name, or ``body:x,y``."""
    from ..model.expressions import number

    name, colon, rest = text.partition(":")
    return (name, [float(number(_plain(x), {}, "m", "--point")) for x in rest.split(",")]) if colon else text


def _plain(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text.strip()
