"""Natural sizes of controllers' states and of their rates: nothing is judged by the units that they are in.

A change of a state is large if the forces that it makes are as large as what acts in the mechanism; where it makes
none, if it changes the rate of another as much as such changes do. A rate is large if it is what a large step of the
mechanism, or large changes of the states, make of it. So the largest entries of the
Jacobian's rows and columns become one (equilibration: van der Sluis 1969), whatever units states are in.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...model.model import Model
from ...tables.names import velocity_names
from ..motion.crossed import refuse_crossed
from .balance import acting, rounding
from .derivatives import Equations, State
from .sliders import Scale, Slid, of_slides, of_states, slid, there

REACH = 100.0  # natural sizes of a state for a large step of its place: these are limited in length


def natural_scales(model: Model, at: Mapping[str, float], x: State, *, places: bool) -> dict[str, Scale]:
    """What stands for states of controllers in a copy with bodies in their place (`sliders.slid`).

    Parameters
    ----------
    model : Model
        With controllers.
    at : mapping
        State -> its value.
    x : State
        Of the model, where its Jacobian is looked at.
    places : bool
        Whether places of bodies are to stand for states, or velocities.

    Raises
    ------
    AnalysisError
        If limits of a controller cross there.
    """
    x.c.at(x.t, x.q, x.v)
    refuse_crossed(x.c, x.t)
    other = slid(model, {name: repr(z) for name, z in at.items()}, places=True)
    e = Equations(there(other, x, "absolute"))
    return _Sizes(other, e, np.array([*at.values()], float)).scales(places)


class _Sizes:
    """Sizes by the Jacobian of a copy in which places stand for states, a metre for one and a newton for a rate of one.

    Everything is in units of energy; n states.
    """

    def __init__(self, other: Slid, e: Equations, z: np.ndarray) -> None:
        c = e.state.c
        at, size = of_states(other, c.structure), c.sizes
        own = np.array([not of_slides(n.name, other.slides) for n in velocity_names(c.structure)])
        K, M = e.by_position[e.at["r"]].tocsr(), e.by_acceleration[e.at["r"]].diagonal()
        self.names, self.z, self.length = list(other.slides.values()), z, c.values.length
        self.rate = np.abs(e.state.vdot[at])  # of a newton on 1 kg
        among = abs(K[own][:, own]).multiply(size[own]).multiply(size[own][:, None])
        inertia = float((size**2 * M)[own].max(initial=0.0))
        pace = float(c.values.system.scales.rate.real)
        self.energy = _energy(e, float(among.max() if among.nnz else 0.0), size * own) or inertia * pace**2 or 1.0
        self.speed = np.sqrt(self.energy / inertia) if inertia > 0.0 else 1.0  # [1/s]
        self.forces = _largest(abs(K[own][:, at]).multiply(size[own][:, None]), 0)  # by each state
        self.moved = _largest(abs(K[at][:, own]).multiply(size[own]), 1)  # rates by large steps of the mechanism
        self.between = np.abs(K[at][:, at].toarray())
        model = c.structure.model
        weight = np.abs(model.gravity_vector(model.environment(c.parameters))).max(initial=0.0)
        self.heaviest = self.energy / (self.length * weight) if weight > 0.0 else np.inf

    def scales(self, places: bool) -> dict[str, Scale]:
        """What stands for the states."""
        state = self._states()
        rate = self._rates(state)
        push = self.energy / (self.length * np.where(rate > 0.0, rate, 1.0))
        stride = state / (self.length * self.speed)
        push = np.minimum(push, self.heaviest / stride)  # a weight that no other is lost beside
        mass = push * stride
        if places:
            stride = REACH * state / self.length
        every = (x.tolist() for x in (stride, push, mass, state))
        return {name: Scale(*parts) for name, *parts in zip(self.names, *every, strict=True)}

    def _states(self) -> np.ndarray:
        """Large changes of the states, (n,)."""
        pushes = self.forces > 0.0
        out = self._led_on(np.where(pushes, self.energy / np.where(pushes, self.forces, 1.0), np.nan))
        out = self._led_on(np.where(np.isnan(out), self._alone(), out))
        return np.where(np.isnan(out), 1.0, out)

    def _led_on(self, out: np.ndarray) -> np.ndarray:
        """Large changes of states by those that are known; nan of those that have nothing to do with them."""
        for _ in range(len(out)):
            rate = self._rates(out)[:, None]
            most = np.where(rate > 0.0, self.between / np.where(rate > 0.0, rate, 1.0), 0.0).max(axis=0, initial=0.0)
            found = np.isnan(out) & (most > 0.0)
            if not found.any():
                break
            out[found] = 1.0 / most[found]
        return out

    def _rates(self, state: np.ndarray) -> np.ndarray:
        """Large rates, by the states of which large changes are known, (n,)."""
        by_states = self.between * np.where(np.isnan(state), 0.0, state)
        return np.maximum(self.moved, by_states.max(axis=1, initial=0.0))

    def _alone(self) -> np.ndarray:
        """The same of states that have nothing to do with the mechanism: what they are, and lack; nan if nothing."""
        itself = np.diag(self.between)
        lack = np.where(itself > 0.0, self.rate / np.where(itself > 0.0, itself, 1.0), 0.0)
        size = np.abs(self.z) + lack
        return np.where(size > 0.0, size, np.nan)


def _energy(e: Equations, stiff: float, size: np.ndarray) -> float:
    """What acts or resists [J], 0 if what there is of it is rounding; ``stiff`` is what resists a large step."""
    acts = acting(e)
    loads = float((size * acts).max(initial=0.0))
    if loads > stiff:
        loads = float((size * np.where(acts > rounding(e), acts, 0.0)).max(initial=0.0))
    return max(loads, stiff)


def _largest(A, axis: int) -> np.ndarray:
    """The largest entry of each column (axis 0) or row of a sparse matrix."""
    return A.tocsr().max(axis=axis).toarray().ravel() if A.shape[axis] else np.zeros(A.shape[1 - axis])
