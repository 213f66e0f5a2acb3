"""Animation of mode shapes."""

from __future__ import annotations

import html
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ModelError
from ..results.result import Result
from .animation import record_motion
from .page import player_page
from .recording import RecordedMode

if TYPE_CHECKING:
    from ..results.modes import Modes

DEFAULT_MODES = 12
SHOWN_PERIOD = 2.0  # duration of one period of any mode on the page [s]
FINE_SAMPLES, COARSE_SAMPLES = 41, 21  # samples of a period
COARSE_FROM = 2000  # number of bodies times modes from which sampling is coarser
MIN_SHAPE_PART = 0.02  # relative to the largest part of a shape: smaller ones are not listed
MAX_SHAPE_PARTS = 12  # number of listed parts of a shape


def modes_page(
    modes: Modes, *, count: int = DEFAULT_MODES, amplitude: float = 0.1, show: Collection[str] = ("grid",)
) -> str:
    """Return one self-contained web page with animated modes, which opens offline in any browser.

    Every mode is shown over one period, which takes 2 s at any frequency, without damping; modes that do not oscillate
    are shown going out and back. ``#mode=2`` after the page's address opens it at mode 2.

    Parameters
    ----------
    modes : Modes
    count : int
        Number of modes, slowest first; rigid ones only if there are fewer others.
    amplitude : float
        Largest amplitude: radians, or relative to the mechanism's length. The page can increase it up to three times.
    show : names
        Displays switched on when the page opens; see `flyball.view.recording.SHOW_OPTIONS`.

    Raises
    ------
    ModelError
        If there is no mode, no such thing to show, or the amplitude or the count is not greater than 0.
    """
    name = modes.point.model.name
    if not len(modes):
        raise ModelError(f"{name!r} has no modes to show: nothing in it can move")
    if not amplitude > 0.0 or count < 1:
        raise ModelError(f"amplitude and count must be greater than 0, got {amplitude!r} and {count!r}")
    shown = _chosen_modes(modes, count)
    samples = FINE_SAMPLES if len(modes.point.model.bodies) * len(shown) < COARSE_FROM else COARSE_SAMPLES
    recording = record_motion(_consecutive_modes(modes, shown, amplitude, samples), show=show, curves=False)
    recording = replace(
        recording,
        name=f"{name}: modes",
        notes=_mode_notes(modes, len(shown)),
        modes=tuple(_recorded_mode(modes, k, n) for n, k in enumerate(shown)),
        speed=1.0,  # one period a second
        remark="",
    )
    return player_page(recording, f"<h1>{html.escape(recording.name)}</h1>")


def _chosen_modes(modes: Modes, count: int) -> list[int]:
    """Return the slowest modes, then rigid ones if there are fewer."""
    order = sorted(range(len(modes)), key=lambda k: (modes.kinds[k] == "rigid", k))
    return sorted(order[:count])


def _mode_start(n: int) -> float:
    """Return the start time of the n-th mode; the first period is at rest, and there are pauses between modes."""
    return SHOWN_PERIOD * (2 * n + 1)


def _consecutive_modes(modes: Modes, chosen: Sequence[int], amplitude: float, samples: int) -> Result:
    """Return all modes as one motion: at rest, then a period of each."""
    x = modes.point
    parts = [x, *(modes.motion(k, amplitude, samples) for k in chosen)]
    t = np.concatenate([[0.0], *(_mode_start(n) + np.linspace(0.0, SHOWN_PERIOD, samples) for n in range(len(chosen)))])
    q, v, states, vdot, lam = (
        np.concatenate([getattr(p, name) for p in parts]) for name in ("q", "v", "states", "vdot", "multipliers")
    )
    return Result(x.model, x.values, t, q, v, states, vdot, lam, parts[1].health)


def _recorded_mode(modes: Modes, k: int, n: int) -> RecordedMode:
    units = dict(zip(modes.names, modes.units, strict=True))
    parts = list(modes.shape(k, MIN_SHAPE_PART).items())[:MAX_SHAPE_PARTS]
    return RecordedMode(
        name=str(k),
        begin=_mode_start(n),
        end=_mode_start(n) + SHOWN_PERIOD,
        frequency=float(modes.frequency[k]),
        omega=float(modes.omega[k]),
        damping_ratio=float(modes.damping_ratio[k]),
        kind=modes.kinds[k],
        shape=tuple((n, units[n], abs(z), float(np.degrees(np.angle(z)))) for n, z in parts),
    )


def _mode_notes(modes: Modes, number: int) -> dict[str, str]:
    """Return the summary beside the picture."""
    grow = [str(k) for k, kind in enumerate(modes.kinds) if kind == "unstable"]
    some = f": {', '.join(grow[:12])}{' ...' if len(grow) > 12 else ''}"
    out = {
        "modes": f"{len(modes)}" if number == len(modes) else f"{len(modes)}; {number} are shown, slowest first",
        "stability": "no mode grows" if not grow else f"{len(grow)} unstable{some}",
        "about": f"{'steady motion' if np.abs(modes.point.v).max(initial=0.0) > 0.0 else 'rest'}, "
        f"t = {modes.point.t[0]:g} s",
    }
    if modes.seen_from:
        out["seen from"] = modes.seen_from
    return out
