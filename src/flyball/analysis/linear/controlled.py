"""Where a mechanism rests with its controllers: a copy with bodies in their place rests there (`sliders`)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import AnalysisError, ModelError, NotConverged, SingularityError
from ...model.model import Model
from ...model.touching import holds_at_times
from ..assembly.start import Assembly
from ..compiled import Compiled
from .curves import snapshot
from .derivatives import State
from .free import free
from .natural import natural_scales
from .own_words import in_own_words, refusal, told
from .rest import Rest
from .search import led, newton_to
from .sliders import Scale, Slid, slid, states, there

PASSES = 4  # searches, each in the natural sizes of where the one before ended
FLAT = 1e-8  # singular values below this part of the largest are none
NEWTON, LED = "Newton's method", "following the forces and the controllers"
ALIKE = 30.0  # times that natural sizes may differ from those that were searched in


def resting_copy(
    model: Model, at: dict[str, float], x: State, scales: dict[str, Scale], outputs: Sequence[str] = ()
) -> tuple[Slid, Rest]:
    """The copy in which places stand for states, with curves for signals that are asked for, and where it is.

    Raises
    ------
    ModelError
        If something holds at times, too.
    """
    other = slid(model, {name: repr(z) for name, z in at.items()}, outputs, places=True, scales=scales)
    if holds_at_times(other.model):
        raise ModelError(
            f"{model.name!r} has controllers and parts that hold at times, and equilibrium knows only one of the two; "
            f"leave what holds out, m.changed({{...: None}}), or simulate until it rests"
        )
    b = there(other, x, "absolute")
    return other, Rest.at(b.c, b.t, b.q)


def found_rest(model: Model, c: Compiled, t: float, q: np.ndarray, at: dict[str, float]) -> tuple[np.ndarray, str]:
    """Positions at rest near some, and what found them; the states there are left in ``c``.

    A controller whose output is at a limit tells Newton's method nothing. Then limits are left out until it is where
    they do not matter, and where they do the forces and the controllers lead.

    Parameters
    ----------
    model : Model
    c : Compiled
        Of it, in absolute coordinates.
    t, q : float, ndarray
    at : dict
        State -> its value where the search begins.

    Raises
    ------
    NotConverged
        With what is left.
    """
    begin = _Place(c, t, q, at)
    try:
        return _rests(model, begin, newton_to).q, NEWTON
    except AnalysisError as error:
        why = error
    wide = without_limits(model)
    if wide is not None:
        try:
            return _rests(model, _rests(wide, begin, newton_to), newton_to).q, f"{NEWTON}, at first without limits"
        except AnalysisError:
            pass
    try:
        return _rests(model, _rests(model, begin, led), newton_to).q, LED
    except AnalysisError:
        raise why from None


def without_limits(model: Model) -> Model | None:
    """A copy whose controllers have no limits; None if they have none anyway."""
    freed = [(e, e.unlimited()) for e in model.controllers]
    if all(a is b for a, b in freed):
        return None
    other = model.copy()
    for a, b in freed:
        if a is not b:
            other.replace(b)
    return other


@dataclass(frozen=True)
class _Place:
    """Where a search begins or ends: positions, and states of controllers."""

    c: Compiled
    t: float
    q: np.ndarray
    at: dict[str, float]

    def state(self) -> State:
        """Of the model, the states written."""
        self.c.z[: len(self.at)] = [*self.at.values()]
        return State.resting(self.c, self.t, self.q)

    def moved(self, other: Slid, x: Rest) -> _Place:
        """Where a place of a copy with bodies for states is in the model."""
        q, _ = self.c.take(x.c, x.t, x.q, np.zeros(x.c.structure.nv))
        return _Place(self.c, self.t, q, dict(zip(self.at, states(other, self.at, x), strict=True)))


def _rests(model: Model, place: _Place, search: Callable[[Rest], tuple[Rest | None, Rest]]) -> _Place:
    """Where a search ends, in the natural sizes of that place."""
    scales = None
    for _ in range(PASSES):
        x = place.state()
        before, scales = scales, natural_scales(model, place.at, x, places=True)
        if before is not None and _alike(before, scales):
            break
        other, begin = resting_copy(model, place.at, x, scales)
        with in_own_words(other):
            found, last = search(begin)
        if found is None:
            raise _at_limits(refusal(last, other), model, place.moved(other, last))
        place = place.moved(other, found)
    return place


def _at_limits(error: NotConverged, model: Model, place: _Place) -> NotConverged:
    """The error, with whose output is at a limit where a search ended."""
    shot = snapshot(place.state())
    held = [
        e.title
        for e in model.controllers
        if e.unlimited() is not e and shot.curve(f"{e.name}.output")[1][0] != shot.curve(f"{e.name}.unlimited")[1][0]
    ]
    if held:
        error.args = (f"{error.args[0]}. There the output of {' and of '.join(held)} is at a limit", *error.args[1:])
    return error


def determined_copy(model: Model, at_rest: Assembly, outputs: Sequence[str]) -> tuple[Slid, Rest]:
    """The copy where a mechanism rests, its states at rest as unknowns beside the positions.

    Raises
    ------
    SingularityError
        If something may be elsewhere and rest there too.
    """
    c = at_rest.compiled
    at = dict(zip((x.name for x in c.structure.controls), c.z.tolist(), strict=False))
    x = State.resting(c, at_rest.t, at_rest.q)
    scales = natural_scales(model, at, x, places=True)
    other, rest = resting_copy(model, at, x, scales, outputs)
    f = free(rest.equations)
    V = f.Zv / rest.scale[:, None] * rest.scale[f.chosen_v]
    S = V.T @ (rest.K @ V)
    for axis in (1, 0):
        size = np.abs(S).max(axis=axis, keepdims=True, initial=0.0)
        S = S / np.where(size > 0.0, size, 1.0)
    _, d, Vt = np.linalg.svd(S)
    if len(d) and not d[-1] > FLAT * d[0]:
        weak = told(f.names[f.chosen_v[int(np.argmax(np.abs(Vt[-1])))]].name, other)
        raise SingularityError(
            f"the equilibrium of {model.name!r} is not determined along {weak!r}: it may rest elsewhere too, so it has "
            f"no derivatives; have a spring, a driver or a controller hold it there",
            at_rest.t,
            (weak,),
        )
    return other, rest


def _alike(a: dict[str, Scale], b: dict[str, Scale]) -> bool:
    """Whether states and rates are as large here as there."""
    ratios = np.array([(a[k].stride / b[k].stride, a[k].push / b[k].push) for k in a])
    return bool((np.abs(np.log(ratios)) <= np.log(ALIKE)).all())
