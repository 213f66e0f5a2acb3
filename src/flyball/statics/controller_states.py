"""Controllers in the linear equations: states as velocities of auxiliary bodies; sampled controllers.

A controller state z with the rate f is represented by the velocity v of an auxiliary body of mass m. The body moves on
its own slide, touches nothing, and carries the force p f. Laws that name z name z_0 + s v instead, so that all
auxiliary bodies rest at the operating point; with s m = p this gives z' = f. The position of such a body has no
meaning: its rows and columns are left out of the results. For an equilibrium the position x represents the state,
z = z_0 + s x: the body is at rest where f = 0.

The scales s and p bring states and rates to the size of the quantities they are compared with, whatever their units. A
change of a state is large if the forces that it causes are as large as the forces in the mechanism; a rate is large if
large changes cause it (equilibration: van der Sluis 1969). Errors about the auxiliary model are rewritten in the terms
of the user's model.

Between sampling instants x' = A x + B u, with the held signals among the states. At an instant signals are updated one
after the other, then all states at once. Over one period this is the zero-order-hold model (Astrom and Wittenmark,
*Computer-Controlled Systems*, 1997, sections 2.3 and 8.4).
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
    """Scales of the auxiliary body of a controller state.

    Attributes
    ----------
    stride : float
        Change of the state per metre of displacement, or per metre per second of speed, of its body.
    push : float [N]
        Force on the body per unit rate of the state.
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
    """A copy of a model in which auxiliary bodies replace controllers.

    Attributes
    ----------
    model : Model
    slides : dict
        Name of the body of each state -> the state's name.
    added : tuple of str
        Names of these bodies, and of the fixed body for output curves if there is one.
    outputs : dict
        Requested signal -> curve of the copy with its value.
    laws : dict
        Sampled state or signal -> curve of the copy with its value from the next instant on.
    at : dict
        State -> its value at the reference positions of the bodies, a number or a formula.
    held : frozenset of str
        Sampled states and signals.
    scales : dict
        State -> scales of its body.
    words : dict
        Text in messages about the copy -> text of the user's model.
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
    """Refuse sampled controllers, whose signals are constant between sampling instants.

    Raises
    ------
    ModelError
        With their names.
    """
    held = [e.title for e in model.controllers if e.sampled]
    if held:
        raise ModelError(
            f"{model.name!r} has {', '.join(held)}, sampled, and {analysis} is about continuous time; linearize gives "
            f"the equations from one instant to the next, and their eigenvalues"
        )


def initial_state_formulas(model: Model) -> dict[str, str]:
    """Initial values of the controller states, as formulas of the parameters."""
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
    """Build a copy of a model in which auxiliary bodies replace controllers.

    Parameters
    ----------
    model : Model
    at : mapping
        Controller state -> its value at the operating point, a number or a formula of parameters.
    outputs : sequence of str
        Requested signals and states of controllers; curves of other parts are ignored.
    places : bool
        Whether positions represent the states; else velocities.
    scales : mapping, optional
        State -> scales of its body; by default all scales are 1.
    board : float [kg]
        Mass of the fixed body for output curves, if there is one.
    """
    return _AuxiliaryModelBuilder(model, at, places, scales or {}).made(outputs, board)


class _AuxiliaryModelBuilder:
    """Builder of an auxiliary model."""

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
        """An unused name that begins with ``name``."""
        while any(k.startswith(name) for k in (*self.new.by_name, *self.new.parameters)):
            name += "_"
        return name

    def made(self, outputs: Sequence[str], board: float) -> AuxiliaryModel:
        """Build the copy, with curves for these signals."""
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
        """Factor of the sensor of a state, as text."""
        return _factor(self.scales[name].stride)

    def _solid(self, name: str, mass: float) -> Body:
        """Auxiliary body, placed at an existing body so that the mechanism's length does not change."""
        return Body(name, mass=mass, position=self._place(), inertia=mass if self.new.planar else (mass,) * 3)

    def _push(self, x: ConnectedState) -> str:
        """Force on a state's body: its rate; for sampled states 0, or for an equilibrium the next change."""
        if not x.controller.sampled:
            return self.text(x.law)
        return f"({self.text(x.law)}) - {self.known[x.name]}" if self.places else "0"

    def _place(self) -> Any:
        """Reference position of the auxiliary bodies."""
        first = self.old.bodies[0].position
        return first if any(isinstance(x, str) for x in first) else tuple(np.array(first, float).tolist())

    def _held(self, mass: float) -> str:
        """Term of a force that balances the weight of a body along its slide, as text."""
        g = self.old.gravity[0]
        if isinstance(g, str) and not is_number_text(g):
            return f" - {_factor(mass)}({g})"
        weight = mass * float(self.old.gravity_vector()[0])
        return f" - ({weight!r})" if weight else ""

    def text(self, law: Expression) -> str:
        """Translate a law of the model to the copy."""
        for name in sorted(law.names):
            if "." in name and name not in self.known:
                sensor = self._free(name.replace(".", "_"))
                self.new.add(Sensor(sensor, name))
                self.known[name] = sensor
                self.words |= {f"{sensor}.value": name, sensor: name}
        return expression_text(law.tree, self.known)

    def _laws(self) -> None:
        """Replace laws that name controllers by formulas of auxiliary bodies."""
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
        """Whether a curve belongs to a controller."""
        e = self.old.find(name.partition(".")[0])
        if isinstance(e, Sensor):
            return self._own(e.of)
        return isinstance(e, Controller)

    def _output(self, name: str, k: int) -> str:
        """Curve of the copy for a signal of a controller."""
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
        """Curve of the copy with the value of a formula: a force on the fixed body, cancelled by an opposite force."""
        if not self.board:
            self.board = self._free("board")
            self.new.add(
                self._solid(self.board, self.heavy), weld_to_ground(f"{self.board}_weld", self.board, self._place())
            )
        told, along = self._free(name), f"{self.board}.x"
        self.new.add(law_actuator(told, along, text), law_actuator(f"{told}back", along, f"-{text}"))
        return f"{told}.force"


def _factor(x: float) -> str:
    """Factor in front of a formula, as text."""
    return "" if x == 1.0 else f"{x!r}*"


def states_by_positions(other: AuxiliaryModel, at: Mapping[str, float], x: RestState) -> list[float]:
    """Controller states represented by positions, from the displacements of the auxiliary bodies."""
    now = x.c.moving(x.t, x.q, np.zeros(x.c.structure.nv))
    way = [float(now[body].p[0] - x.c.values.bodies[body].c[0]) for body in other.slides]
    return [at[name] + other.scales[name].stride * w for name, w in zip(other.slides.values(), way, strict=True)]


def auxiliary_state(other: AuxiliaryModel, x: MechanismState, coordinates: str) -> MechanismState:
    """State of the copy: bodies of the model as in ``x``, auxiliary bodies at rest in their reference positions."""
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
    """Linear equations in the controller states, by their own names, and their eigenvalues.

    Parameters
    ----------
    dense : StateSpace
        State space of the copy.
    uncertainty : MatrixUncertainty
        Uncertainty of its matrix A.
    other : AuxiliaryModel
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
    """Reduced equations without inputs and without the positions of auxiliary bodies."""
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
    """Uncertainty of the equations that remain."""
    return MatrixUncertainty(uncertainty.by[indices], uncertainty.size[:, indices])


def auxiliary_velocities(other: AuxiliaryModel, s: Structure) -> list[int]:
    """Index of the velocity along the slide of each state."""
    where = {n.name: k for k, n in enumerate(velocity_names(s))}
    return [where[f"{b}.x" if f"{b}.x" in where else f"{b}_slide.displacement"] for b in other.slides]


def is_auxiliary(name: str, slides: Mapping[str, str]) -> bool:
    """Whether a velocity of the copy belongs to an auxiliary body."""
    return any(_belongs_to(name, body) for body in slides)


def _belongs_to(name: str, body: str) -> bool:
    """Whether a state of the linear equations belongs to a body or its slide."""
    return name.startswith((f"{body}.", f"{body}_slide."))


# Stride of a position relative to the natural size of the state per length: steps are limited in length.
POSITION_RANGE = 100.0


def state_scales(model: Model, at: Mapping[str, float], x: MechanismState, *, places: bool) -> dict[str, StateScale]:
    """Scales of the auxiliary bodies that represent controller states (see `auxiliary_model`).

    Parameters
    ----------
    model : Model
        The model with controllers.
    at : mapping
        State -> its value.
    x : MechanismState
        State of the model at which its Jacobian is taken.
    places : bool
        Whether positions represent the states; else velocities.

    Raises
    ------
    AnalysisError
        If the lower limit of a controller exceeds the upper one.
    """
    x.c.at(x.t, x.q, x.v)
    refuse_contradicting_limits(x.c, x.t)
    other = auxiliary_model(model, {name: repr(z) for name, z in at.items()}, places=True)
    e = EquationDerivatives(auxiliary_state(other, x, "absolute"))
    return _StateSizes(other, e, np.array([*at.values()], float)).scales(places)


class _StateSizes:
    """Natural sizes of n controller states, from the Jacobian of a copy in which positions represent states.

    In this copy all scales are 1 (a metre per unit of a state, a newton per unit of a rate). All in units of energy.
    """

    def __init__(self, other: AuxiliaryModel, e: EquationDerivatives, z: np.ndarray) -> None:
        c = e.state.c
        at, size = auxiliary_velocities(other, c.structure), c.sizes
        own = np.array([not is_auxiliary(n.name, other.slides) for n in velocity_names(c.structure)])
        K, M = e.by_position[e.at["r"]].tocsr(), e.by_acceleration[e.at["r"]].diagonal()
        self.names, self.z, self.length = list(other.slides.values()), z, c.values.length
        self.rate = np.abs(e.state.vdot[at])  # acceleration of 1 kg by 1 N
        among = abs(K[own][:, own]).multiply(size[own]).multiply(size[own][:, None])
        inertia = float((size**2 * M)[own].max(initial=0.0))
        pace = float(c.work.options.rate)
        self.energy = _energy_scale(e, float(among.max() if among.nnz else 0.0), size * own) or inertia * pace**2 or 1.0
        self.speed = np.sqrt(self.energy / inertia) if inertia > 0.0 else 1.0  # [1/s]
        self.forces = _largest_entries(abs(K[own][:, at]).multiply(size[own][:, None]), 0)  # forces per unit state
        self.moved = _largest_entries(
            abs(K[at][:, own]).multiply(size[own]), 1
        )  # rates by large steps of the mechanism
        self.between = np.abs(K[at][:, at].toarray())
        model = c.structure.model
        weight = np.abs(model.gravity_vector(model.environment(c.parameters))).max(initial=0.0)
        self.heaviest = self.energy / (self.length * weight) if weight > 0.0 else np.inf

    def scales(self, places: bool) -> dict[str, StateScale]:
        """Scales of all states."""
        state = self._states()
        rate = self._rates(state)
        push = self.energy / (self.length * np.where(rate > 0.0, rate, 1.0))
        stride = state / (self.length * self.speed)
        push = np.minimum(push, self.heaviest / stride)  # keeps weights small beside the other forces
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
        """Large changes of states that act on states with known changes; NaN if they act on none."""
        for _ in range(len(out)):
            rate = self._rates(out)[:, None]
            most = np.where(rate > 0.0, self.between / np.where(rate > 0.0, rate, 1.0), 0.0).max(axis=0, initial=0.0)
            found = np.isnan(out) & (most > 0.0)
            if not found.any():
                break
            out[found] = 1.0 / most[found]
        return out

    def _rates(self, state: np.ndarray) -> np.ndarray:
        """Large rates caused by the mechanism and by states with known large changes, (n,)."""
        by_states = self.between * np.where(np.isnan(state), 0.0, state)
        return np.maximum(self.moved, by_states.max(axis=1, initial=0.0))

    def _isolated(self) -> np.ndarray:
        """Large changes of states that do not act on the mechanism: value plus distance to rest; NaN if zero."""
        itself = np.diag(self.between)
        lack = np.where(itself > 0.0, self.rate / np.where(itself > 0.0, itself, 1.0), 0.0)
        size = np.abs(self.z) + lack
        return np.where(size > 0.0, size, np.nan)


def _energy_scale(e: EquationDerivatives, stiff: float, size: np.ndarray) -> float:
    """Energy scale [J] of forces and stiffness ``stiff``; 0 if they are rounding."""
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
    """Context manager that rewrites errors about the copy in the terms of the user's model.

    Parameters
    ----------
    other : AuxiliaryModel
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
    """Rewrite a text about the copy in the terms of the model."""
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
    """The error for a failed search of an equilibrium with controllers, with the residuals.

    Parameters
    ----------
    x : RestState
        State of the copy at the end of the search.
    other : AuxiliaryModel
        The copy.
    """
    best = RestState.at(x.c, x.t, x.q)
    error, rates = search_failure(best), remaining_rates(best.equations, other)
    rows = auxiliary_velocities(other, x.c.structure)
    left = np.abs(best.r)
    own = {name: value for name, value in error.residuals.items() if not is_auxiliary(name, other.slides)} | rates
    if not rows or left[rows].max() < left.max():  # controllers without states have no residuals
        return NotConverged(in_user_terms(error.args[0], other), own)
    k = int(np.argmax(left[rows]))
    return NotConverged(
        f"no equilibrium of {x.c.structure.model.name!r} was found: where the search ended, "
        f"{rate_description(other, rates, [*rates][k])}, and nothing brings that to rest. Give a better guess, or look "
        f"whether the controller can change what it measures, its limits considered",
        own,
    )


def remaining_rates(e: EquationDerivatives, other: AuxiliaryModel) -> dict[str, float]:
    """State -> its rate; for sampled states the change at the next sample."""
    left = e.block("r")[auxiliary_velocities(other, e.state.c.structure)]
    return {name: -float(r) / other.scales[name].push for name, r in zip(other.slides.values(), left, strict=True)}


def rate_description(other: AuxiliaryModel, rates: Mapping[str, float], name: str) -> str:
    """Text that describes how a state changes."""
    if name in other.held:
        return f"the next sample changes {name!r} by {rates[name]:.3g}"
    return f"{name!r} changes by {rates[name]:.3g} in a second"


@dataclass
class AuxiliaryInstant:
    """A model and its auxiliary model at one time.

    Attributes
    ----------
    here : MechanismState
        State of the model.
    other : AuxiliaryModel
        The copy, in which velocities represent the states.
    state : MechanismState
        State of the copy.
    at : dict
        State -> its value.
    off : ndarray (nv,)
        Large speeds of the auxiliary bodies, 0 for all other velocities.
    """

    here: MechanismState
    other: AuxiliaryModel
    state: MechanismState
    at: dict[str, float]
    off: np.ndarray

    def errors_in_user_terms(self) -> AbstractContextManager[None]:
        """Context manager that rewrites errors in the terms of the user's model."""
        return errors_in_user_terms(self.other)


def auxiliary_instant(
    model: Model, here: MechanismState, coordinates: str, outputs: Sequence[str], *, frozen: bool
) -> AuxiliaryInstant:
    """Build the auxiliary model at the time of a state.

    Parameters
    ----------
    model : Model
        The model with controllers.
    here : MechanismState
    coordinates : str
        Coordinates of the copy.
    outputs : sequence of str
        Requested curves.
    frozen : bool
        Whether controller states may change with time.

    Raises
    ------
    ModelError
        If the model has switching elements, too.
    AnalysisError
        If a controller state is not constant and ``frozen`` is false.
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
    """Refuse a mechanism at rest whose controller states change."""
    e = EquationDerivatives(x)
    own = auxiliary_velocities(other, x.c.structure)
    left = remaining_accelerations(x, e, off)[own]
    if not left.any():
        return
    rates = remaining_rates(static_equations(e), other)
    name = [*rates][int(np.argmax(left))]
    raise AnalysisError(
        f"the controllers are not in equilibrium where the mechanism is: {rate_description(other, rates, name)}. Find "
        f"an equilibrium first and linearise about it: about=m.equilibrium(); or ask about the end of a motion that "
        f"has settled"
    )


PERIOD_TOLERANCE = 1e-9  # relative deviation allowed from a common period
MAX_INSTANTS = 10_000  # largest denominator of a ratio of periods, and largest number of instants in a cycle
# Largest deviation of a held value from its law at rest, relative to its size or a large change of it.
SETTLED_TOLERANCE = 1e-6

EXPONENTIAL_ROUNDING = (
    4.0 * np.finfo(float).eps
)  # uncertainty of matrix exponentials, relative to the largest entry of a row


class SampledSignal(NamedTuple):
    """A sampled signal or state.

    Attributes
    ----------
    name : str
        Name of the state of the linear equations that stores its held value.
    output : int
        Index of the output of the linear equations with the value of its law.
    clock : tuple of float
        Period and offset [s].
    signal : bool
        Whether it is a signal, which is updated before the states of the same instant.
    """

    name: str
    output: int
    clock: tuple[float, float]
    signal: bool


def sampling_instants(
    clocks: Sequence[tuple[float, float]],
) -> tuple[float, list[tuple[float, list[tuple[float, float]]]]]:
    """Length of the cycle [s], and its instants with the clocks that sample at each.

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
        else:  # equal to the start of the cycle, within rounding
            found[0][1].append(clock)
    return cycle, found


def refuse_unsettled(
    samples: Sequence[SampledSignal], at: np.ndarray, law: np.ndarray, sizes: np.ndarray, name: str
) -> None:
    """Refuse a state in which a held value changes at the next sample; ``sizes`` are its large changes."""
    for s, held, next_one, size in zip(samples, at.tolist(), law.tolist(), sizes.tolist(), strict=True):
        if not abs(next_one - held) <= SETTLED_TOLERANCE * max(size, abs(held)):
            raise ModelError(
                f"{name!r} does not rest there: {s.name!r} is {held:.6g}, and {next_one:.6g} when it is sampled next; "
                f"ask about an equilibrium, about=m.equilibrium(), or about the end of a motion that has settled"
            )


def cycle_equations(
    space: StateSpace, samples: Sequence[SampledSignal], outputs: int
) -> tuple[StateSpace, Spectrum, float]:
    """Difference equations over one cycle, their eigenvalues (multipliers), and the length of the cycle [s].

    The state is that just before the first instant of the cycle; outputs and inputs are those just after it. See
    `SampledSignal`.
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
    """Groups that are updated together: each signal by itself, then all states."""
    yield from ([s] for s in due if s.signal)
    yield [s for s in due if not s.signal]


def _advanced_by_exponential(space: StateSpace, h: float, X: np.ndarray, U: np.ndarray) -> np.ndarray:
    """Advance the state by a time ``h`` with constant inputs."""
    from scipy.linalg import expm

    n, m = space.B.shape
    E = expm(h * np.block([[space.A, space.B], [np.zeros((m, n + m))]]))
    return np.asarray(E[:n, :n] @ X + E[:n, n:] @ U)


def _needed_states(A: np.ndarray, C: np.ndarray, held: Sequence[int]) -> np.ndarray:
    """Indices of states without unused held ones: signals that are sampled anew at the start of the cycle."""
    left = np.ones(len(A), bool)
    while True:
        gone = [i for i in held if left[i] and not A[left, i].any() and not C[:, i].any()]
        if not gone:
            return np.flatnonzero(left)
        left[gone] = False
