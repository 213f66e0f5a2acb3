"""Where a mechanism rests with its controllers: a copy with bodies in their place rests there (`sliders`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import ModelError, SingularityError
from ...model.model import Model
from ...model.touching import holds_at_times
from ..assembly.start import Assembly
from ..compiled import Compiled
from .balance import acting, rounding
from .derivatives import State
from .free import free
from .natural import natural_scales
from .own_words import in_own_words, refusal, told
from .rest import Rest
from .search import newton_to
from .sliders import Scale, Slid, slid, states, there

ROUNDED = np.finfo(float).eps  # of a large change of a state: less is none
PASSES = 4  # searches, each in the natural sizes of where the one before ended
FLAT = 1e-8  # singular values below this part of the largest are none
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


def found_rest(model: Model, c: Compiled, t: float, q: np.ndarray, at: dict[str, float]) -> np.ndarray:
    """Positions at rest near some; the states there are left in ``c``.

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
    scales, still = None, False
    for _ in range(PASSES):
        c.z[: len(at)] = [*at.values()]
        x = State.resting(c, t, q)
        before, scales = scales, natural_scales(model, at, x, places=True)
        if before is not None and (still or _alike(before, scales)):
            break
        other, begin = resting_copy(model, at, x, scales)
        with in_own_words(other):
            found, last = newton_to(begin)
        if found is None:
            raise refusal(last, other)
        q, _ = c.take(found.c, found.t, found.q, np.zeros(found.c.structure.nv))
        now = dict(zip(at, states(other, at, found), strict=True))
        at = {name: z if abs(z) > ROUNDED * scales[name].size else 0.0 for name, z in now.items()}
        still = bool((acting(found.equations) <= rounding(found.equations)).all())  # sizes by rounding would be none
    return q


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
