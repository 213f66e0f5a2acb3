"""``flyball inverse-dynamics``: what drives have to do, and what joints carry, for a given motion."""

from __future__ import annotations

from ..methods.motion import Motions
from .asking import Asked, command
from .common import Out
from .flags import Flag, assigned
from .kinematics import TIMES, to_the_end

MOTION = Flag(
    type=list[str], read=assigned, help='How a coordinate moves: --motion "A.angle=0.3*sin(2*t)"; may be repeated.'
)


@command(Motions.inverse_dynamics, own={**TIMES, "motion": MOTION})
def inverse_dynamics(asked: Asked, *, out: Out = None) -> None:
    """Write inverse_dynamics.csv, inverse_dynamics.png and result.nc."""
    to_the_end(asked)
    found = asked.answer()
    folder = asked.folder(out, "inverse-dynamics")
    asked.write(folder / "inverse_dynamics.csv", found.to_csv)
    asked.write(folder / "inverse_dynamics.png", found.plot)
    asked.write(folder / "result.nc", found.result.save)
    asked.say(found)
