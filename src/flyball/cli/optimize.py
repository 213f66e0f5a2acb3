"""``flyball optimize``: parameters for which quantities come nearest to a target."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import ModelError
from .common import Changes, Json, Model, app, print_json, reported, table
from .loading import load_mechanism, set_parameters
from .progress import announce_compiling


@app.command()
def optimize(
    model: Model,
    of: Annotated[list[str], typer.Option(help="A curve or sensor, e.g. --of tip.x; may be repeated.")],
    to: Annotated[list[str], typer.Option(help="A parameter, with bounds if wanted: --to crank=0.1:0.3.")],
    target: Annotated[
        list[str], typer.Option(help="What each quantity should be, in SI units; or a CSV file with a column for each.")
    ],
    analysis: Annotated[str, typer.Option(help="instant, motion or equilibrium.")] = "instant",
    t: Annotated[str, typer.Option("--t", help="Time of an instant, start of a motion.")] = "0",
    t_end: Annotated[str | None, typer.Option(help="End of a motion; its times are evenly spaced.")] = None,
    change: Changes = None,
    as_json: Json = False,
) -> None:
    """Find parameters for which quantities come nearest to a target, by least squares with exact derivatives."""
    with reported(as_json):
        mechanism = load_mechanism(model)
        set_parameters(mechanism, change or [])
        goal = _target(target, len(of))
        options: dict[str, Any] = {"t": t, "analysis": analysis}
        if analysis == "motion":
            options |= {"t_end": t_end, "outputs": len(goal)}
        announce_compiling(not as_json, "motion_kernel", "residual_kernel")
        found = mechanism.optimize(of, _bounds(to), target=goal, **options)
        if as_json:
            print_json(found.as_dict())
        else:
            table(found.lines())


def _bounds(texts: list[str]) -> dict[str, tuple[str | None, str | None]]:
    """name, or name=low:high with either left out."""
    out: dict[str, tuple[str | None, str | None]] = {}
    for text in texts:
        name, equals, bounds = text.partition("=")
        low, colon, high = bounds.partition(":")
        if equals and not colon:
            raise ModelError(f"--to {text!r}: write name=low:high, for instance --to crank=0.1:0.3")
        out[name.strip()] = (low.strip() or None, high.strip() or None)
    return out


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
    from ..model.expressions import number

    return np.array([[float(number(x, {}, None, "--target")) for x in texts]])
