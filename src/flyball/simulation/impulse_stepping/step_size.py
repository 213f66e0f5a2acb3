"""Step and tolerance of impulse time stepping where they are not given: from the size and the speed of the scene."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from ...collision.tables import Movers
from ...engine.entry_point import MOTION
from ...results.health import Health
from ...tables.contact_tables import ContactTables
from ...tables.values import Values
from ..initial_state import InitialState
from ..integration_options import Stepping

# The scene has a size, the median radius of its bodies, and a speed, sqrt(g size): that of a body that has fallen by
# half its size. Steps are proportional to size / speed, tolerances to the speed, so that a scene drawn in another size,
# or in other units, is stepped alike. At 0.1 m and 9.81 m/s^2 the speed is 0.99 m/s: steps of 5 ms, and 1e-5 m/s.
STEP_FRACTION = 0.05  # step relative to size / speed
TOLERANCE_FRACTION = 1e-5  # tolerance relative to the speed
MOVING_FRACTION = 0.5  # speed of a scene relative to that of its fastest body: it moves a tenth of the size in a step
RADIUS_OF_MECHANISM = 0.1  # size of a mechanism without shapes, relative to its length
UNKNOWN_STEP, UNKNOWN_TOLERANCE = 5e-3, 1e-5  # [s], [m/s], of a scene at rest without gravity and forces


@dataclass(frozen=True)
class StepSize:
    """Longest step and tolerance of impulse time stepping.

    Attributes
    ----------
    step : float [s]
    tolerance : float [m/s]
    reason : str
        Why this step.
    """

    step: float
    tolerance: float
    reason: str

    @property
    def text(self) -> str:
        """The step and its reason, for people."""
        return f"at most {self.step:.3g} s, {self.reason}"


@dataclass(frozen=True)
class SceneScale:
    """Size [m] and speed [m/s] of a scene (0: at rest without gravity and forces), and both in words."""

    size: float
    speed: float
    text: str


def smallest_radius(scene: ContactTables, values: Values) -> float:
    """Return the radius [m] of the smallest shape; the mechanism's length if all are unbounded."""
    sizes = scene.geometry.dimensions.radius[:]
    bounded = sizes[np.isfinite(sizes)]
    return float(bounded.min() if len(bounded) else values.length)


def body_radii(scene: ContactTables) -> np.ndarray:
    """Return the radius of each mover's bounding sphere about its mass centre, (n,); 0 without shapes, or unbounded."""
    shapes = scene.geometry.dimensions
    out = np.zeros(len(scene.carriers.mass))
    mover = scene.geometry.shape.mover[:]
    reach = np.sqrt((shapes.place[:] ** 2).sum(axis=1)) + shapes.radius[:]
    known = (mover >= 0) & np.isfinite(reach)
    np.maximum.at(out, mover[known], reach[known])
    return out


def scene_scale(scene: ContactTables, M: Movers, values: Values, held: InitialState | None) -> SceneScale:
    """Return the size and the speed of a scene at its start; ``held`` is the start of its jointed mechanism."""
    radii = body_radii(scene)
    if (radii > 0.0).any():
        size = float(np.median(radii[radii > 0.0]))
        what = f"bodies of radius {size:.3g} m"
    else:
        size = RADIUS_OF_MECHANISM * values.length
        what = f"a mechanism of {values.length:.3g} m"
    v, w = (np.sqrt((x**2).sum(axis=1)) for x in (M.twist[:, :3], M.twist[:, 3:]))
    fastest = float((v + w * radii).max(initial=0.0))
    g, cause = float(np.linalg.norm(values.system.gravity)), "under gravity"
    if held is not None:
        fastest = max(fastest, _largest(held, held.assembly.v))
        if g == 0.0 and (g := _initial_acceleration(held)) > 0.0:
            cause = f"at {g:.3g} m/s^2 at the start"
    falling, moving = math.sqrt(g * size), MOVING_FRACTION * fastest
    return SceneScale(
        size, max(falling, moving), f"{what} {cause if falling >= moving else f'at {fastest:.3g} m/s at the start'}"
    )


def _largest(start: InitialState, rates: np.ndarray) -> float:
    """Return the largest of velocities or accelerations; angular ones times the mechanism's length."""
    c = start.assembly.compiled
    return float(np.abs(rates * c.values.length / c.sizes).max(initial=0.0))


def _initial_acceleration(start: InitialState) -> float:
    """Return the largest acceleration of a mechanism at its start; 0 if the equations have no solution there."""
    a = start.assembly
    c = a.compiled
    solved = c.at(a.t, a.q, a.v, MOTION)[0] == 0
    return _largest(start, c.work.velocities.solved) if solved else 0.0


def choose_step(
    o: Stepping,
    scene: ContactTables,
    M: Movers,
    values: Values,
    held: InitialState | None = None,
    before: Health | None = None,
) -> StepSize:
    """Return the longest step and the tolerance: as given, of the earlier motion, or by the scale of the scene.

    Parameters
    ----------
    o : Stepping
    scene : ContactTables
    M : Movers
        At the start.
    values : Values
    held : InitialState, optional
        Start of the jointed mechanism.
    before : Health, optional
        Of the motion that this one continues.
    """
    found = _earlier_choice(before) or _choice_by_scale(scene_scale(scene, M, values, held))
    if o.step is not None:
        found = dataclasses.replace(found, step=float(o.step), reason="as given")
    elif o.limit < found.step:
        found = dataclasses.replace(found, step=o.limit, reason="by max_step")
    return found if o.tolerance is None else dataclasses.replace(found, tolerance=o.tolerance)


def _choice_by_scale(x: SceneScale) -> StepSize:
    if x.speed == 0.0:
        why = "the usual step, since without gravity and motion at the start the scene has no duration"
        return StepSize(UNKNOWN_STEP, UNKNOWN_TOLERANCE, why)
    return StepSize(STEP_FRACTION * x.size / x.speed, TOLERANCE_FRACTION * x.speed, f"for {x.text}")


def _earlier_choice(before: Health | None) -> StepSize | None:
    """Return the choice of the earlier motion if that made one."""
    if before is None or before.contact is None or not before.contact.step:
        return None
    given = before.options["method"]
    if given["step"] is not None or given["tolerance"] is not None:
        return None
    return StepSize(before.contact.step, before.contact.tolerance, "as in the motion that this one continues")
