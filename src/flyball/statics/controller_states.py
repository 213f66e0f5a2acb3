"""Controllers in the linear equations: states as velocities of auxiliary bodies; sampled controllers.

A state z with the rate f is the velocity v of an auxiliary body of mass m on a slide of its own, which nothing else
touches, under the force p f. Where laws name z they name z_0 + s v, so that all bodies rest where small motions are
asked about, and s m = p: then z' = f. The position of such a body has no meaning: its rows and columns are left out
of what is reported. For an equilibrium the position stands for z = z_0 + s x: the body is at rest where f = 0.

The scales s and p make states and rates as large as what they are compared with, whatever their units: a change of
a state is large if the forces that it makes are as large as what acts in the mechanism; a rate is large if large
changes make it (equilibration: van der Sluis 1969). Errors about the auxiliary model are put in the terms of the
user's model.

Between sampling instants x' = A x + B u with held signals among the states; at an instant signals take their values
one after the other, then states all at once. Over one period that is the zero-order-hold model (Astrom and
Wittenmark, *Computer-Controlled Systems*, 1997, sections 2.3 and 8.4).
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from ..assembly.assembled_state import Assembly
from ..assembly.compiled_mechanism import compile_mechanism
from ..derivatives.eigenvalues import Spectrum, spectrum
from ..derivatives.equation_derivatives import EquationDerivatives, MechanismState
from ..derivatives.reduced_equations import (
    FreeCoordinates,
    MatrixUncertainty,
    ReducedEquations,
    force_magnitudes,
    force_rounding,
    static_equations,
)
from ..derivatives.steady_motion import is_still, remaining_accelerations
from ..engine.kinematics import joint_velocities
from ..errors import AnalysisError, FlyballError, ModelError, NotConverged
from ..forces.coordinate_spring import law_actuator
from ..joints.fixed import weld_to_ground
from ..joints.prismatic import slide_from_ground
from ..model.body import Body
from ..model.contact import has_switching_elements
from ..model.controller import Controller, Sensor
from ..model.controller_signals import ConnectedState, controller_names, controller_states, signal_law
from ..model.element import LawOf, fields_with, resolve
from ..model.expression_parser import expression_text
from ..model.expressions import Expression, is_number_text
from ..model.model import Model
from ..results.linear_model import StateSpace
from ..simulation.diagnosis import refuse_contradicting_limits
from ..simulation.initial_state import choose_coordinates
from ..tables.reference_configuration import BodyState, positions
from ..tables.structure_definition import Structure, velocity_names
from .equilibrium_search import search_failure
from .stability import RestState


class StateScale(NamedTuple):
    """What stands for a state and its rate.

    Attributes
    ----------
    stride : float
        Of the state, for a metre of its body's way or a metre per second of its speed.
    push : float [N]
        Force on the body for a rate of one.
    mass : float [kg]
    size : float
        A large change of the state.
    """

    stride: float = 1.0
    push: float = 1.0
    mass: float = 1.0
    size: float = 1.0


@dataclass(frozen=True)
class AuxiliaryModel:
    """A copy of a model with bodies in place of controllers.

    Attributes
    ----------
    model : Model
    slides : dict
        Name of the body of each state -> the state's name.
    added : tuple of str
        These bodies, and one that stands still, if there is one.
    outputs : dict
        Signal that was asked for -> curve of the copy that it is.
    laws : dict
        State or signal that is sampled -> curve of the copy that its value from the next instant on is.
    at : dict
        State -> its value where the bodies are drawn, a number or a formula.
    held : frozenset of str
        States and signals that are sampled.
    scales : dict
        State -> what stands for it.
    words : dict
        Texts that messages about the copy have -> what the user wrote in their place.
    """

    model: Model
    slides: dict[str, str]
    added: tuple[str, ...]
    outputs: dict[str, str]
    laws: dict[str, str]
    at: Mapping[str, float | str]
    held: frozenset[str]
    scales: dict[str, StateScale]
    words: dict[str, str]


def refuse_sampled_controllers(model: Model, analysis: str) -> None:
    """Refuse controllers whose signals are held between instants.

    Raises
    ------
    ModelError
        Naming them.
    """
    held = [e.title for e in model.controllers if e.sampled]
    if held:
        raise ModelError(
            f"{model.name!r} has {', '.join(held)}, sampled, and {analysis} is about continuous time; linearize gives "
            f"the equations from one instant to the next, and their eigenvalues"
        )


def initial_state_formulas(model: Model) -> dict[str, str]:
    """What the states begin with, as formulas of the parameters."""
    out = {}
    for e in model.controllers:
        n = resolve(e, model.environment())
        raw = SimpleNamespace(**{f.name: getattr(e, f.name) for f in dataclasses.fields(e)})
        for told, known in zip(e.states(raw), e.states(n), strict=True):
            formula = isinstance(told.initial, str) and not is_number_text(told.initial)
            out[f"{e.name}.{told.name}"] = told.initial if formula else repr(float(known.initial))
    return out


def auxiliary_model(
    model: Model,
    at: Mapping[str, float | str],
    outputs: Sequence[str] = (),
    *,
    places: bool = False,
    scales: Mapping[str, StateScale] | None = None,
    board: float = 1.0,
) -> AuxiliaryModel:
    """The copy.

    Parameters
    ----------
    model : Model
    at : mapping
        State of a controller -> its value where small motions are asked about, a number or a formula of parameters.
    outputs : sequence of str
        Signals and states of controllers that are asked for, besides curves of other parts.
    places : bool
        Whether places stand for states; else velocities.
    scales : mapping, optional
        State -> what stands for it; if not given, a metre or a metre per second for one, a newton for a rate of one.
    board : float [kg]
        Mass of the body that stands still, if there is one.
    """
    return _AuxiliaryModelBuilder(model, at, places, scales or {}).made(outputs, board)


class _AuxiliaryModelBuilder:
    """A copy in the making."""

    def __init__(
        self, model: Model, at: Mapping[str, float | str], places: bool, scales: Mapping[str, StateScale]
    ) -> None:
        self.old, self.what, self.places = model, "displacement" if places else "displacement_rate", places
        self.new = model.copy()
        self.new.controllers, self.new.events = [], []
        self.new.by_name = {k: e for k, e in model.by_name.items() if e.category not in ("controllers", "events")}
        self.states = controller_states(model)
        self.body = {x.name: self._free(x.name.replace(".", "_")) for x in self.states}
        self.at = at
        self.scales = {x.name: scales.get(x.name, StateScale()) for x in self.states}
        self.known = {name: f"(({at[name]}) + {self._stride(name)}{b}_now)" for name, b in self.body.items()}
        self.words = {self.known[name]: name for name in self.body}
        self.board = ""

    def _free(self, name: str) -> str:
        """A name that nothing has."""
        while any(k.startswith(name) for k in (*self.new.by_name, *self.new.parameters)):
            name += "_"
        return name

    def made(self, outputs: Sequence[str], board: float) -> AuxiliaryModel:
        """The copy, with curves for these signals."""
        self.heavy = board
        for name, body in self.body.items():
            self.new.add(
                self._solid(body, self.scales[name].mass),
                slide_from_ground(f"{body}_slide", body, self._place(), self.new.planar),
                Sensor(f"{body}_now", f"{body}_slide.{self.what}"),
            )
        for x, body in zip(self.states, self.body.values(), strict=True):
            scale = self.scales[x.name]
            force = f"{_factor(scale.push)}({self._push(x)}){self._held(scale.mass)}"
            self.words[force] = str(x.controller.given().get(x.law.text, x.law.text))
            self.new.add(law_actuator(f"{body}_push", f"{body}_slide.displacement", force))
        self._laws()
        found = {name: self._output(name, k) for k, name in enumerate(outputs) if self._own(name)}
        sampled = [] if self.places else [x for x in self.states if x.controller.sampled]
        laws = {x.name: self._curve(f"law_{k}_", self.text(x.law)) for k, x in enumerate(sampled)}
        self.new.sensors = [e for e in self.new.sensors if not self._own(getattr(e, "of", ""))]
        slides = {body: name for name, body in self.body.items()}
        self.new.aside = frozenset(self.new.by_name) - frozenset(self.old.by_name)
        added = (*slides, self.board) if self.board else tuple(slides)
        held = frozenset(x.name for x in self.states if x.controller.sampled)
        return AuxiliaryModel(self.new, slides, added, found, laws, self.at, held, self.scales, self.words)

    def _stride(self, name: str) -> str:
        """What the sensor of a state is multiplied by."""
        return _factor(self.scales[name].stride)

    def _solid(self, name: str, mass: float) -> Body:
        """A body where one is already, so that the mechanism is as large as before."""
        return Body(name, mass=mass, position=self._place(), inertia=mass if self.new.planar else (mass,) * 3)

    def _push(self, x: ConnectedState) -> str:
        """The force on a state's body: its rate. What is held stays, and rests where a sample changes nothing."""
        if not x.controller.sampled:
            return self.text(x.law)
        return f"({self.text(x.law)}) - {self.known[x.name]}" if self.places else "0"

    def _place(self) -> Any:
        """Where bodies are drawn."""
        first = self.old.bodies[0].position
        return first if any(isinstance(x, str) for x in first) else tuple(np.array(first, float).tolist())

    def _held(self, mass: float) -> str:
        """What keeps the weight of a body along its slide."""
        g = self.old.gravity[0]
        if isinstance(g, str) and not is_number_text(g):
            return f" - {_factor(mass)}({g})"
        weight = mass * float(self.old.gravity_vector()[0])
        return f" - ({weight!r})" if weight else ""

    def text(self, law: Expression) -> str:
        """A law of the model's as one of the copy."""
        for name in sorted(law.names):
            if "." in name and name not in self.known:
                sensor = self._free(name.replace(".", "_"))
                self.new.add(Sensor(sensor, name))
                self.known[name] = sensor
                self.words |= {f"{sensor}.value": name, sensor: name}
        return expression_text(law.tree, self.known)

    def _laws(self) -> None:
        """Formulas in the laws that name controllers."""
        for e in [*self.old.forces, *self.old.limits]:
            changed: dict[str, Any] = {}
            for field, of in fields_with(e.__class__, LawOf).items():
                value = getattr(e, field)
                several = isinstance(value, tuple)
                laws = [self._law(e, x, of) for x in (value if several else (value,))]
                changed[field] = tuple(laws) if several else laws[0]
            if any(changed[k] is not getattr(e, k) and changed[k] != getattr(e, k) for k in changed):
                self.new.replace(dataclasses.replace(e, **changed))

    def _law(self, e: Any, value: Any, of: LawOf) -> Any:
        if value is None or isinstance(value, float):
            return value
        named = self.old.law(value, of, e.title, whole=False)
        if not any(k.partition(".")[0] in {c.name for c in self.old.controllers} for k in named.names):
            return value
        text = self.text(self.old.law(value, of, e.title))
        self.words[text] = str(value)
        return text

    def _own(self, name: str) -> bool:
        """Whether a curve is of a controller."""
        e = self.old.find(name.partition(".")[0])
        if isinstance(e, Sensor):
            return self._own(e.of)
        return isinstance(e, Controller)

    def _output(self, name: str, k: int) -> str:
        """A curve of the copy for a signal."""
        e = self.old.find(name.partition(".")[0])
        if isinstance(e, Sensor):
            return self._output(e.of, k)
        assert isinstance(e, Controller)
        owner, dot, what = name.partition(".")
        what = what if dot else e.bare
        if what not in controller_names(self.old, e):
            raise ModelError(f"{owner!r} has no signal {what!r}; it has {', '.join(controller_names(self.old, e))}")
        return self._curve(f"output_{k}_", self.text(signal_law(self.old, e, what)))

    def _curve(self, name: str, text: str) -> str:
        """A formula as a curve of the copy: a force on a body that stands still, which another one takes away again."""
        if not self.board:
            self.board = self._free("board")
            self.new.add(
                self._solid(self.board, self.heavy), weld_to_ground(f"{self.board}_weld", self.board, self._place())
            )
        told, along = self._free(name), f"{self.board}.x"
        self.new.add(law_actuator(told, along, text), law_actuator(f"{told}back", along, f"-{text}"))
        return f"{told}.force"


def _factor(x: float) -> str:
    """What a formula is multiplied by, as a text."""
    return "" if x == 1.0 else f"{x!r}*"


def states_by_positions(other: AuxiliaryModel, at: Mapping[str, float], x: RestState) -> list[float]:
    """The states where places stand for them, by how far the added bodies are from where they are drawn."""
    now = x.c.moving(x.t, x.q, np.zeros(x.c.structure.nv))
    way = [float(now[body].p[0] - x.c.values.bodies[body].c[0]) for body in other.slides]
    return [at[name] + other.scales[name].stride * w for name, w in zip(other.slides.values(), way, strict=True)]


def auxiliary_state(other: AuxiliaryModel, x: MechanismState, coordinates: str) -> MechanismState:
    """The state of the copy in which its bodies are as those of the model are, and the added ones at rest as drawn."""
    c = compile_mechanism(other.model, parameters=x.c.parameters)
    bodies, hints = x.c.moving(x.t, x.q, x.v), x.c.hints | x.c.turned(x.q)
    for name in other.added:
        d = c.values.bodies[name]
        bodies[name] = BodyState(d.c, d.R, np.zeros(3), np.zeros(3), d.angle)
    c.follow(hints)
    q = positions(c.values, bodies, hints)
    c.at(x.t, q, np.zeros(c.structure.nv))
    base = Assembly(c, x.t, q, joint_velocities(c.values, bodies, c.work))
    a, _ = choose_coordinates(base, coordinates, x.c.parameters)
    return MechanismState.moving(a.compiled, a.t, a.q, a.v)


def without_auxiliary_positions(
    dense: StateSpace, uncertainty: MatrixUncertainty, other: AuxiliaryModel
) -> tuple[StateSpace, Spectrum]:
    """The equations of the states themselves, called by their own names, and their eigenvalues.

    Parameters
    ----------
    dense : StateSpace
        Of the copy.
    uncertainty : Doubt
        What is uncertain of it.
    other : Slid
        The copy.
    """
    slides = other.slides
    owner = {k: body for k, name in enumerate(dense.states) for body in slides if _belongs_to(name, body)}
    left = [k for k, name in enumerate(dense.states) if k not in owner or name.endswith(" rate")]
    names = tuple(slides[owner[k]] if k in owner else dense.states[k] for k in left)
    units = tuple("" if k in owner else dense.state_units[k] for k in left)
    own = spectrum(dense.A[np.ix_(left, left)], _remaining_uncertainty(uncertainty, left))
    one = np.array([other.scales[slides[owner[k]]].stride if k in owner else 1.0 for k in left])
    space = StateSpace(
        A=one[:, None] * dense.A[np.ix_(left, left)] / one,
        B=one[:, None] * dense.B[left],
        C=dense.C[:, left] / one,
        D=dense.D,
        states=names,
        state_units=units,
        mass=None,
        damping=None,
        stiffness=None,
        eigenvalues=own.values,
        motion=dense.motion[:, left] / one,
    )
    return space, own


def without_auxiliary_coordinates(
    r: ReducedEquations, f: FreeCoordinates, slides: Mapping[str, str]
) -> ReducedEquations:
    """Reduced equations without inputs and without the places of bodies that stand for states."""
    left = [k for k, name in enumerate(f.labels) if not is_auxiliary(name, slides)]
    left += range(len(f.labels), len(r.rate))
    assert r.uncertainty is not None
    parts = {k: getattr(r, k)[:, left] for k in ("position", "velocity", "acceleration", "multipliers")}
    return dataclasses.replace(
        r,
        rate=r.rate[np.ix_(left, left)],
        uncertainty=_remaining_uncertainty(r.uncertainty, left),
        M=None,
        D=None,
        K=None,
        **parts,
    )


def _remaining_uncertainty(uncertainty: MatrixUncertainty, indices: Sequence[int]) -> MatrixUncertainty:
    """The same of the equations that are left."""
    return MatrixUncertainty(uncertainty.by[indices], uncertainty.size[:, indices])


def auxiliary_velocities(other: AuxiliaryModel, s: Structure) -> list[int]:
    """Which velocity of the copy is that along each state's slide."""
    where = {n.name: k for k, n in enumerate(velocity_names(s))}
    return [where[f"{b}.x" if f"{b}.x" in where else f"{b}_slide.displacement"] for b in other.slides]


def is_auxiliary(name: str, slides: Mapping[str, str]) -> bool:
    """Whether a velocity of the copy is of a body that stands for a state."""
    return any(_belongs_to(name, body) for body in slides)


def _belongs_to(name: str, body: str) -> bool:
    """Whether a state of the linear equations is of a body, or of its slide."""
    return name.startswith((f"{body}.", f"{body}_slide."))


POSITION_RANGE = 100.0  # natural sizes of a state for a large step of its place: these are limited in length


def state_scales(model: Model, at: Mapping[str, float], x: MechanismState, *, places: bool) -> dict[str, StateScale]:
    """What stands for states of controllers in a copy with bodies in their place (`controller_states.auxiliary_model`).

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
    refuse_contradicting_limits(x.c, x.t)
    other = auxiliary_model(model, {name: repr(z) for name, z in at.items()}, places=True)
    e = EquationDerivatives(auxiliary_state(other, x, "absolute"))
    return _StateSizes(other, e, np.array([*at.values()], float)).scales(places)


class _StateSizes:
    """Sizes by the Jacobian of a copy in which places stand for states, a metre for one and a newton for a rate of one.

    Everything is in units of energy; n states.
    """

    def __init__(self, other: AuxiliaryModel, e: EquationDerivatives, z: np.ndarray) -> None:
        c = e.state.c
        at, size = auxiliary_velocities(other, c.structure), c.sizes
        own = np.array([not is_auxiliary(n.name, other.slides) for n in velocity_names(c.structure)])
        K, M = e.by_position[e.at["r"]].tocsr(), e.by_acceleration[e.at["r"]].diagonal()
        self.names, self.z, self.length = list(other.slides.values()), z, c.values.length
        self.rate = np.abs(e.state.vdot[at])  # of a newton on 1 kg
        among = abs(K[own][:, own]).multiply(size[own]).multiply(size[own][:, None])
        inertia = float((size**2 * M)[own].max(initial=0.0))
        pace = float(c.values.system.scales.rate.real)
        self.energy = _energy_scale(e, float(among.max() if among.nnz else 0.0), size * own) or inertia * pace**2 or 1.0
        self.speed = np.sqrt(self.energy / inertia) if inertia > 0.0 else 1.0  # [1/s]
        self.forces = _largest_entries(abs(K[own][:, at]).multiply(size[own][:, None]), 0)  # by each state
        self.moved = _largest_entries(
            abs(K[at][:, own]).multiply(size[own]), 1
        )  # rates by large steps of the mechanism
        self.between = np.abs(K[at][:, at].toarray())
        model = c.structure.model
        weight = np.abs(model.gravity_vector(model.environment(c.parameters))).max(initial=0.0)
        self.heaviest = self.energy / (self.length * weight) if weight > 0.0 else np.inf

    def scales(self, places: bool) -> dict[str, StateScale]:
        """What stands for the states."""
        state = self._states()
        rate = self._rates(state)
        push = self.energy / (self.length * np.where(rate > 0.0, rate, 1.0))
        stride = state / (self.length * self.speed)
        push = np.minimum(push, self.heaviest / stride)  # a weight that no other is lost beside
        mass = push * stride
        if places:
            stride = POSITION_RANGE * state / self.length
        every = (x.tolist() for x in (stride, push, mass, state))
        return {name: StateScale(*parts) for name, *parts in zip(self.names, *every, strict=True)}

    def _states(self) -> np.ndarray:
        """Large changes of the states, (n,)."""
        pushes = self.forces > 0.0
        out = self._propagated(np.where(pushes, self.energy / np.where(pushes, self.forces, 1.0), np.nan))
        out = self._propagated(np.where(np.isnan(out), self._isolated(), out))
        return np.where(np.isnan(out), 1.0, out)

    def _propagated(self, out: np.ndarray) -> np.ndarray:
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

    def _isolated(self) -> np.ndarray:
        """The same of states that have nothing to do with the mechanism: what they are, and lack; nan if nothing."""
        itself = np.diag(self.between)
        lack = np.where(itself > 0.0, self.rate / np.where(itself > 0.0, itself, 1.0), 0.0)
        size = np.abs(self.z) + lack
        return np.where(size > 0.0, size, np.nan)


def _energy_scale(e: EquationDerivatives, stiff: float, size: np.ndarray) -> float:
    """What acts or resists [J], 0 if what there is of it is rounding; ``stiff`` is what resists a large step."""
    acts = force_magnitudes(e)
    loads = float((size * acts).max(initial=0.0))
    if loads > stiff:
        loads = float((size * np.where(acts > force_rounding(e), acts, 0.0)).max(initial=0.0))
    return max(loads, stiff)


def _largest_entries(A, axis: int) -> np.ndarray:
    """The largest entry of each column (axis 0) or row of a sparse matrix."""
    return A.tocsr().max(axis=axis).toarray().ravel() if A.shape[axis] else np.zeros(A.shape[1 - axis])


NUMBER_PATTERN = r"[-+]?(?:\d[\d.]*(?:e[-+]?\d+)?|inf|nan)"


@contextmanager
def errors_in_user_terms(other: AuxiliaryModel) -> Iterator[None]:
    """Have errors that are raised within name states and signals as the user does.

    Parameters
    ----------
    other : Slid
        The copy.
    """
    try:
        yield
    except FlyballError as error:
        if error.args and isinstance(error.args[0], str):
            error.args = (in_user_terms(error.args[0], other), *error.args[1:])
        if isinstance(getattr(error, "elements", None), tuple):
            error.elements = tuple(in_user_terms(name, other) for name in error.elements)  # type: ignore[attr-defined]
        raise


def in_user_terms(text: str, other: AuxiliaryModel) -> str:
    """A text about the copy as one about the model."""
    for theirs, own in sorted(other.words.items(), key=lambda x: -len(x[0])):
        text = text.replace(theirs, own)
    for body, name in other.slides.items():
        stride = other.scales[name].stride

        def value(found: re.Match[str], name: str = name, stride: float = stride) -> str:
            return f"{name} = {float(other.at[name]) + stride * float(found[1]) + 0.0:.6g}"

        text = re.sub(rf"\b{body}_now\.value = ({NUMBER_PATTERN})(?: m/s| m)?", value, text)
        text = re.sub(rf"Actuator '{body}_push'(?:: its law)?", f"the law of {name!r}:", text)
        text = re.sub(rf"\b{body}(?:_slide|_push|_now)?(?:\.\w+)?\b", name, text)
    return text


def controlled_search_failure(x: RestState, other: AuxiliaryModel) -> NotConverged:
    """What remains where the search for a position at rest ended.

    Parameters
    ----------
    x : Rest
        Of the copy.
    other : Slid
        The copy.
    """
    best = RestState.at(x.c, x.t, x.q)
    error, rates = search_failure(best), remaining_rates(best.equations, other)
    rows = auxiliary_velocities(other, x.c.structure)
    left = np.abs(best.r)
    own = {name: value for name, value in error.residuals.items() if not is_auxiliary(name, other.slides)} | rates
    if not rows or left[rows].max() < left.max():  # controllers without states are at rest by themselves
        return NotConverged(in_user_terms(error.args[0], other), own)
    k = int(np.argmax(left[rows]))
    return NotConverged(
        f"no equilibrium of {x.c.structure.model.name!r} was found: where the search ended, "
        f"{rate_description(other, rates, [*rates][k])}, and nothing brings that to rest. Give a better guess, or look whether "
        f"the controller can change what it measures, its limits considered",
        own,
    )


def remaining_rates(e: EquationDerivatives, other: AuxiliaryModel) -> dict[str, float]:
    """State -> its rate; of what is sampled by how much the next sample changes it."""
    left = e.block("r")[auxiliary_velocities(other, e.state.c.structure)]
    return {name: -float(r) / other.scales[name].push for name, r in zip(other.slides.values(), left, strict=True)}


def rate_description(other: AuxiliaryModel, rates: Mapping[str, float], name: str) -> str:
    """What a state does that does not rest, in words."""
    if name in other.held:
        return f"the next sample changes {name!r} by {rates[name]:.3g}"
    return f"{name!r} changes by {rates[name]:.3g} in a second"


@dataclass
class AuxiliaryInstant:
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

    here: MechanismState
    other: AuxiliaryModel
    state: MechanismState
    at: dict[str, float]
    off: np.ndarray

    def errors_in_user_terms(self) -> AbstractContextManager[None]:
        """Have errors that are raised within name states and signals as the user does."""
        return errors_in_user_terms(self.other)


def auxiliary_instant(
    model: Model, here: MechanismState, coordinates: str, outputs: Sequence[str], *, frozen: bool
) -> AuxiliaryInstant:
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
    scales = state_scales(model, at, here, places=False)
    other = auxiliary_model(model, {name: repr(z) for name, z in at.items()}, outputs, scales=scales)
    if has_switching_elements(other.model):
        raise ModelError(
            f"{model.name!r} has controllers and parts that hold at times, and small motions know only one of the two; "
            f"leave what holds out, m.changed({{...: None}}), or put joints in its place"
        )
    x = auxiliary_state(other, here, coordinates)
    off = np.zeros(len(x.v))
    own = auxiliary_velocities(other, x.c.structure)
    off[own] = [other.scales[name].size / other.scales[name].stride for name in other.slides.values()]
    if not frozen and is_still(x):
        _refuse_changing_states(other, x, off)
    return AuxiliaryInstant(here, other, x, at, off)


def _refuse_changing_states(other: AuxiliaryModel, x: MechanismState, off: np.ndarray) -> None:
    """Refuse a mechanism at rest whose controllers are not."""
    e = EquationDerivatives(x)
    own = auxiliary_velocities(other, x.c.structure)
    left = remaining_accelerations(x, e, off)[own]
    if not left.any():
        return
    rates = remaining_rates(static_equations(e), other)
    name = [*rates][int(np.argmax(left))]
    raise AnalysisError(
        f"the controllers are not in equilibrium where the mechanism is: {rate_description(other, rates, name)}. Find an "
        f"equilibrium first and linearise about it: about=m.equilibrium(); or ask about the end of a motion that has "
        f"settled"
    )


PERIOD_TOLERANCE = 1e-9  # of a period: what periods may be off a common one
MAX_INSTANTS = 10_000  # common parts of a period, and instants of a cycle, at most
SETTLED_TOLERANCE = 1e-6  # part of its size, or of a large change of it, by which what is held is what its law says

EXPONENTIAL_ROUNDING = (
    4.0 * np.finfo(float).eps
)  # of the largest number of an equation: what exponentials leave uncertain


class SampledSignal(NamedTuple):
    """A signal or a state that is taken at instants.

    Attributes
    ----------
    name : str
        Of the state of the linear equations that holds it.
    output : int
        Which output of the linear equations its law is.
    clock : tuple of float
        Period and offset [s].
    signal : bool
        Whether it is known before others of the same instant are.
    """

    name: str
    output: int
    clock: tuple[float, float]
    signal: bool


def sampling_instants(
    clocks: Sequence[tuple[float, float]],
) -> tuple[float, list[tuple[float, list[tuple[float, float]]]]]:
    """Length of the cycle [s], and its instants from the first on, with the clocks that are due at each.

    Raises
    ------
    ModelError
        If periods have no common multiple.
    """
    clocks = sorted(set(clocks))
    least = min(period for period, _ in clocks)
    parts = [Fraction(period / least).limit_denominator(MAX_INSTANTS) for period, _ in clocks]
    for (period, _), part in zip(clocks, parts, strict=True):
        if abs(float(part) * least - period) > PERIOD_TOLERANCE * least:
            raise ModelError(
                f"periods {least:g} s and {period:g} s of sampled controllers have no common multiple, so that there "
                f"is no cycle from which to tell small motions; give one that is a simple multiple of the other"
            )
    whole = math.lcm(*(p.numerator for p in parts)) // math.gcd(*(p.denominator for p in parts))
    whole = next(n for n in (whole * k for k in range(1, MAX_INSTANTS)) if all((n / p).denominator == 1 for p in parts))
    cycle = least * whole
    if sum(round(cycle / period) for period, _ in clocks) > MAX_INSTANTS:
        raise ModelError(
            f"the cycle of the sampled controllers is {cycle:g} s long, with more than {MAX_INSTANTS} instants"
        )
    first = min(offset for _, offset in clocks)
    due = sorted(
        ((offset - first) % period + k * period, clock)
        for clock in clocks
        for period, offset in [clock]
        for k in range(round(cycle / period))
    )
    found: list[tuple[float, list[tuple[float, float]]]] = []
    for t, clock in due:
        if found and t - found[-1][0] <= PERIOD_TOLERANCE * least:
            found[-1][1].append(clock)
        elif cycle - t > PERIOD_TOLERANCE * least:
            found.append((t, [clock]))
        else:  # it begins the cycle but for rounding
            found[0][1].append(clock)
    return cycle, found


def refuse_unsettled(
    samples: Sequence[SampledSignal], at: np.ndarray, law: np.ndarray, sizes: np.ndarray, name: str
) -> None:
    """Refuse a state in which what is held is not what it will be; ``sizes`` are large changes of it."""
    for s, held, next_one, size in zip(samples, at.tolist(), law.tolist(), sizes.tolist(), strict=True):
        if not abs(next_one - held) <= SETTLED_TOLERANCE * max(size, abs(held)):
            raise ModelError(
                f"{name!r} does not rest there: {s.name!r} is {held:.6g}, and {next_one:.6g} when it is sampled next; "
                f"ask about an equilibrium, about=m.equilibrium(), or about the end of a motion that has settled"
            )


def cycle_equations(
    space: StateSpace, samples: Sequence[SampledSignal], outputs: int
) -> tuple[StateSpace, Spectrum, float]:
    """The equations from the begin of one cycle to that of the next, their multipliers, its length [s]; see `SampledSignal`.

    The state is that just before the first instant, outputs and inputs are those from this instant on.
    """
    cycle, due = sampling_instants([s.clock for s in samples])
    n, m = len(space.A), space.B.shape[1]
    X = np.hstack([np.eye(n), np.zeros((n, m))])
    U = np.hstack([np.zeros((m, n)), np.eye(m)])
    C = np.hstack([space.C[:outputs], space.D[:outputs]])
    for k, (t, clocks) in enumerate(due):
        for own in _update_groups([s for s in samples if s.clock in clocks]):
            at = [space.states.index(s.name) for s in own]
            laws = [s.output for s in own]
            X[at] = space.C[laws] @ X + space.D[laws] @ U
        if k == 0:
            Y = C[:, :n] @ X + C[:, n:] @ U
        X = _advanced_by_exponential(space, (due[k + 1][0] if k + 1 < len(due) else cycle) - t, X, U)
    A, B = X[:, :n], X[:, n:]
    left = _needed_states(A, Y[:, :n], [space.states.index(s.name) for s in samples])
    names = tuple(space.states[i] for i in left)
    out = replace(
        space, A=A[np.ix_(left, left)], B=B[left], C=Y[:, left], D=Y[:, n:], states=names,
        state_units=tuple(space.state_units[i] for i in left), motion=space.motion[:, left],
    )  # fmt: skip
    rounded = EXPONENTIAL_ROUNDING * np.abs(out.A).max(axis=1, keepdims=True, initial=0.0) * np.ones(len(left))
    found = spectrum(out.A, MatrixUncertainty(np.eye(len(left)), rounded))
    return replace(out, eigenvalues=found.values), found, cycle


def _update_groups(due: list[SampledSignal]) -> Iterator[list[SampledSignal]]:
    """Signals each for itself, then all states at once."""
    yield from ([s] for s in due if s.signal)
    yield [s for s in due if not s.signal]


def _advanced_by_exponential(space: StateSpace, h: float, X: np.ndarray, U: np.ndarray) -> np.ndarray:
    """The state a time later, inputs being held."""
    from scipy.linalg import expm

    n, m = space.B.shape
    E = expm(h * np.block([[space.A, space.B], [np.zeros((m, n + m))]]))
    return np.asarray(E[:n, :n] @ X + E[:n, n:] @ U)


def _needed_states(A: np.ndarray, C: np.ndarray, held: Sequence[int]) -> np.ndarray:
    """States without those held ones that nothing depends on: signals that are taken anew as the cycle begins."""
    left = np.ones(len(A), bool)
    while True:
        gone = [i for i in held if left[i] and not A[left, i].any() and not C[:, i].any()]
        if not gone:
            return np.flatnonzero(left)
        left[gone] = False
