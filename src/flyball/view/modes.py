"""The page in which mode shapes move: the animation page with a list of modes to choose from."""

from __future__ import annotations

import html
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..errors import ModelError
from ..results.result import Result
from .animate import record
from .page import document
from .recording import RecordedMode

if TYPE_CHECKING:
    from ..results.modes import Modes

COUNT = 12
PERIOD = 2.0  # one period of any mode takes this long on the page [s]
FINE, COARSE = 41, 21  # samples of a period
MANY = 2000  # bodies times modes from which it is sampled coarsely
TELLING = 0.02  # parts of a shape below this one of its largest are not listed
MOST = 12  # parts of a shape that are listed


def page(modes: Modes, *, count: int = COUNT, amplitude: float = 0.1, show: Collection[str] = ("grid",)) -> str:
    """Write modes as one web page in which they move; it needs nothing else and opens offline in any browser.

    Every mode is shown over one period, which takes 2 s at any frequency, without damping; modes that do not
    oscillate go out and back. ``#mode=2`` after the page's address opens it at mode 2.

    Parameters
    ----------
    modes : Modes
    count : int
        How many of them, slowest first; rigid ones only where the others are fewer.
    amplitude : float
        Largest part of a swing: radians, or parts of the mechanism's length. The page can make it up to three times
        as large.
    show : names
        What is switched on when the page opens; see `flyball.view.recording.SHOW`.

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
    shown = _shown(modes, count)
    samples = FINE if len(modes.point.model.bodies) * len(shown) < MANY else COARSE
    recording = record(_one_after_another(modes, shown, amplitude, samples), show=show, curves=False)
    recording = replace(
        recording,
        name=f"{name}: modes",
        notes=_notes(modes, len(shown)),
        modes=tuple(_mode(modes, k, n) for n, k in enumerate(shown)),
    )
    return document(recording, f"<h1>{html.escape(recording.name)}</h1>")


def _shown(modes: Modes, count: int) -> list[int]:
    """The slowest modes; rigid ones where there is room left."""
    order = sorted(range(len(modes)), key=lambda k: (modes.kinds[k] == "rigid", k))
    return sorted(order[:count])


def _begin(n: int) -> float:
    """Time at which the n-th mode shown begins; the first period is that of rest, and between two there is a pause."""
    return PERIOD * (2 * n + 1)


def _one_after_another(modes: Modes, shown: Sequence[int], amplitude: float, samples: int) -> Result:
    """All modes as one motion: at rest, then a period of each."""
    x = modes.point
    parts = [x, *(modes.motion(k, amplitude, samples) for k in shown)]
    t = np.concatenate([[0.0], *(_begin(n) + np.linspace(0.0, PERIOD, samples) for n in range(len(shown)))])
    q, v, states, vdot, lam = (
        np.concatenate([getattr(p, name) for p in parts]) for name in ("q", "v", "states", "vdot", "multipliers")
    )
    return Result(x.model, x.values, t, q, v, states, vdot, lam, parts[1].health)


def _mode(modes: Modes, k: int, n: int) -> RecordedMode:
    units = dict(zip(modes.names, modes.units, strict=True))
    parts = list(modes.shape(k, TELLING).items())[:MOST]
    return RecordedMode(
        name=str(k),
        begin=_begin(n),
        end=_begin(n) + PERIOD,
        frequency=float(modes.frequency[k]),
        omega=float(modes.omega[k]),
        damping_ratio=float(modes.damping_ratio[k]),
        kind=modes.kinds[k],
        shape=tuple((n, units[n], abs(z), float(np.degrees(np.angle(z)))) for n, z in parts),
    )


def _notes(modes: Modes, shown: int) -> dict[str, str]:
    """The summary beside the picture."""
    grow = [str(k) for k, kind in enumerate(modes.kinds) if kind == "unstable"]
    some = f": {', '.join(grow[:12])}{' ...' if len(grow) > 12 else ''}"
    out = {
        "modes": f"{len(modes)}" if shown == len(modes) else f"{len(modes)}; {shown} are shown, slowest first",
        "stability": "no mode grows" if not grow else f"{len(grow)} unstable{some}",
        "about": f"{'steady motion' if np.abs(modes.point.v).max(initial=0.0) > 0.0 else 'rest'}, "
        f"t = {modes.point.t[0]:g} s",
    }
    if modes.seen_from:
        out["seen from"] = modes.seen_from
    return out
