"""A mechanism with controllers at an instant, as one that has bodies in their place (`sliders`): for small motions."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass

import numpy as np

from ...errors import AnalysisError, ModelError
from ...model.model import Model
from ...model.touching import holds_at_times
from .balance import at_rest
from .derivatives import Equations, State
from .natural import natural_scales
from .own_words import changing, in_own_words, rates_left
from .sliders import Slid, of_states, slid, there
from .steady import left_over, still


@dataclass
class InBodies:
    """The model and its copy at an instant.

    Attributes
    ----------
    here : State
        Of the model.
    other : Slid
        The copy, in which velocities stand for states.
    state : State
        Of the copy.
    at : dict
        State -> its value.
    off : ndarray (nv,)
        Speeds that are large, of the bodies that stand for states.
    """

    here: State
    other: Slid
    state: State
    at: dict[str, float]
    off: np.ndarray

    def in_own_words(self) -> AbstractContextManager[None]:
        """Have errors that are raised within name states and signals as the user does."""
        return in_own_words(self.other)


def in_bodies(model: Model, here: State, coordinates: str, outputs: Sequence[str], *, frozen: bool) -> InBodies:
    """The copy at an instant.

    Parameters
    ----------
    model : Model
        With controllers.
    here : State
    coordinates : str
        That the copy is to be in.
    outputs : sequence of str
        Curves that are asked for.
    frozen : bool
        Whether states that do not rest will do.

    Raises
    ------
    ModelError
        If something holds at times, too.
    AnalysisError
        If a state changes.
    """
    at = dict(zip((x.name for x in here.c.structure.controls), here.z.tolist(), strict=False))
    scales = natural_scales(model, at, here, places=False)
    other = slid(model, {name: repr(z) for name, z in at.items()}, outputs, scales=scales)
    if holds_at_times(other.model):
        raise ModelError(
            f"{model.name!r} has controllers and parts that hold at times, and small motions know only one of the two; "
            f"leave what holds out, m.changed({{...: None}}), or put joints in its place"
        )
    x = there(other, here, coordinates)
    off = np.zeros(len(x.v))
    own = of_states(other, x.c.structure)
    off[own] = [other.scales[name].size / other.scales[name].stride for name in other.slides.values()]
    if not frozen and still(x):
        _refuse_changing(other, x, off)
    return InBodies(here, other, x, at, off)


def _refuse_changing(other: Slid, x: State, off: np.ndarray) -> None:
    """Refuse a mechanism at rest whose controllers are not."""
    e = Equations(x)
    own = of_states(other, x.c.structure)
    left = left_over(x, e, off)[own]
    if not left.any():
        return
    rates = rates_left(at_rest(e), other)
    name = [*rates][int(np.argmax(left))]
    raise AnalysisError(
        f"the controllers are not in equilibrium where the mechanism is: {changing(other, rates, name)}. Find an "
        f"equilibrium first and linearise about it: about=m.equilibrium(); or ask about the end of a motion that has "
        f"settled"
    )
