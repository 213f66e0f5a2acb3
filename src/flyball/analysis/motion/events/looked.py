"""What the watched loop saw, and how closely it looked."""

from __future__ import annotations

from ....equations.watched import Loop
from ....numerics.integrators.watching import CHECKS, NODES
from ....tables.system import G_LOWER, G_UPPER

PLACES = NODES - 1 + CHECKS  # of a step at which guards are looked at, at least
DISTANCES = (G_LOWER, G_UPPER)  # guards of what is open


def told(loop: Loop) -> str:
    """How closely a motion was looked for events: what may have come and gone in between was not seen."""
    count = loop.desk.count
    guards, steps = len(loop.desk.way), max(int(count.steps), 1)
    what = "1 guard" if guards == 1 else f"{guards} guards"
    most = max(count.looks / steps + 1, PLACES)  # its end, where they are known, stands for one place more
    return (
        f"{what} at {most:.0f} places a step on average, {PLACES} at least: what passes zero and comes "
        f"back between two of them is not seen"
    )
