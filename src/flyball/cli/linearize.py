"""``flyball linearize``: linear equations of motion with named inputs and outputs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import ModelError
from .common import Changes, Json, Model, Resting, Time, app, print_json, reported, seconds, table
from .loading import load_mechanism, set_parameters
from .progress import announce_compiling


@app.command()
def linearize(
    model: Model,
    input: Annotated[
        list[str] | None, typer.Option(help="Force, torque, motor, driver or parameter; may be repeated.")
    ] = None,
    output: Annotated[
        list[str] | None, typer.Option(help='Sensor, or a curve such as "A.angle"; may be repeated.')
    ] = None,
    equilibrium: Resting = False,
    t: Time = "0",
    bode: Annotated[
        Path | None, typer.Option(help="Write the Bode plot of all outputs by the only input: PNG, SVG or PDF.")
    ] = None,
    change: Changes = None,
    as_json: Json = False,
) -> None:
    """Linearise about an equilibrium or a steady motion: x' = A x + B u, y = C x + D u."""
    with reported(as_json):
        inputs, outputs = input or [], output or []
        if bode is not None and (len(inputs) != 1 or not outputs):
            raise ModelError("--bode draws outputs over one input: give one --input, and one --output or more")
        mechanism = load_mechanism(model)
        set_parameters(mechanism, change or [])
        announce_compiling(not as_json, "motion_kernel", "residual_kernel")
        when = seconds(t, "--t")
        about = mechanism.equilibrium(t=when) if equilibrium else None
        linear = mechanism.linearize(inputs, outputs, about=about, t=when)
        files = []
        if bode is not None:
            linear.bode(path=bode)
            files.append(str(bode))
        if as_json:
            print_json(linear.as_dict() | {"files": files})
        else:
            table([*linear.lines(), *(("written", f) for f in files)])
