"""Controllers as bodies: a mechanism without controllers that moves as one with them, for what asks small motions.

A state z with the rate f is the velocity v of a body of the mass m on a slide of its own, which nothing else touches,
under the force p f. Where laws name z they name z_0 + s v, so that all bodies rest where small motions are asked about,
and s m = p: then z' = f. The place x of such a body is nobody's concern: its rows and columns are left out of what is
told. For an equilibrium it is the place that stands for z = z_0 + s x: the body is at rest where f = 0. Natural strides
s and pushes p (``natural``) make states and rates as large as what they are compared with, whatever their units are.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from ...equations.velocities import velocities
from ...errors import ModelError
from ...forces.coordinate_spring import pushing
from ...joints.fixed import welded
from ...joints.prismatic import slide
from ...model.body import Body
from ...model.controller import Controller
from ...model.element import LawOf, fields_with, resolve
from ...model.expressions import Expression, is_number_text
from ...model.model import Model
from ...model.sensor import Sensor
from ...model.texts import text_of
from ...model.wiring import Wired, signal, wired, wiring_of
from ...results.linear import StateSpace
from ...tables.coordinates import BodyState, positions
from ...tables.names import velocity_names
from ...tables.specs import Structure
from ..assembly.start import Assembly
from ..compiled import compiled
from ..motion.layer import in_coordinates
from .derivatives import State
from .free import Free
from .reduced import Reduced
from .rest import Rest
from .rounding import Doubt
from .spectrum import Spectrum, spectrum


class Scale(NamedTuple):
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
class Slid:
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
    scales: dict[str, Scale]
    words: dict[str, str]


def refuse_sampled(model: Model, analysis: str) -> None:
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


def beginnings(model: Model) -> dict[str, str]:
    """What the states begin with, as formulas of the parameters."""
    out = {}
    for e in model.controllers:
        n = resolve(e, model.environment())
        raw = SimpleNamespace(**{f.name: getattr(e, f.name) for f in dataclasses.fields(e)})
        for told, known in zip(e.states(raw), e.states(n), strict=True):
            formula = isinstance(told.initial, str) and not is_number_text(told.initial)
            out[f"{e.name}.{told.name}"] = told.initial if formula else repr(float(known.initial))
    return out


def slid(
    model: Model,
    at: Mapping[str, float | str],
    outputs: Sequence[str] = (),
    *,
    places: bool = False,
    scales: Mapping[str, Scale] | None = None,
    board: float = 1.0,
) -> Slid:
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
    return _Sliding(model, at, places, scales or {}).made(outputs, board)


class _Sliding:
    """A copy in the making."""

    def __init__(self, model: Model, at: Mapping[str, float | str], places: bool, scales: Mapping[str, Scale]) -> None:
        self.old, self.what, self.places = model, "displacement" if places else "displacement_rate", places
        self.new = model.copy()
        self.new.controllers, self.new.events = [], []
        self.new.by_name = {k: e for k, e in model.by_name.items() if e.category not in ("controllers", "events")}
        self.states = wired(model)
        self.body = {x.name: self._free(x.name.replace(".", "_")) for x in self.states}
        self.at = at
        self.scales = {x.name: scales.get(x.name, Scale()) for x in self.states}
        self.known = {name: f"(({at[name]}) + {self._stride(name)}{b}_now)" for name, b in self.body.items()}
        self.words = {self.known[name]: name for name in self.body}
        self.board = ""

    def _free(self, name: str) -> str:
        """A name that nothing has."""
        while any(k.startswith(name) for k in (*self.new.by_name, *self.new.parameters)):
            name += "_"
        return name

    def made(self, outputs: Sequence[str], board: float) -> Slid:
        """The copy, with curves for these signals."""
        self.heavy = board
        for name, body in self.body.items():
            self.new.add(
                self._solid(body, self.scales[name].mass),
                slide(f"{body}_slide", body, self._place(), self.new.planar),
                Sensor(f"{body}_now", f"{body}_slide.{self.what}"),
            )
        for x, body in zip(self.states, self.body.values(), strict=True):
            scale = self.scales[x.name]
            force = f"{_factor(scale.push)}({self._push(x)}){self._held(scale.mass)}"
            self.words[force] = str(x.controller.given().get(x.law.text, x.law.text))
            self.new.add(pushing(f"{body}_push", f"{body}_slide.displacement", force))
        self._laws()
        found = {name: self._output(name, k) for k, name in enumerate(outputs) if self._own(name)}
        sampled = [] if self.places else [x for x in self.states if x.controller.sampled]
        laws = {x.name: self._curve(f"law_{k}_", self.text(x.law)) for k, x in enumerate(sampled)}
        self.new.sensors = [e for e in self.new.sensors if not self._own(getattr(e, "of", ""))]
        slides = {body: name for name, body in self.body.items()}
        self.new.aside = frozenset(self.new.by_name) - frozenset(self.old.by_name)
        added = (*slides, self.board) if self.board else tuple(slides)
        held = frozenset(x.name for x in self.states if x.controller.sampled)
        return Slid(self.new, slides, added, found, laws, self.at, held, self.scales, self.words)

    def _stride(self, name: str) -> str:
        """What the sensor of a state is multiplied by."""
        return _factor(self.scales[name].stride)

    def _solid(self, name: str, mass: float) -> Body:
        """A body where one is already, so that the mechanism is as large as before."""
        return Body(name, mass=mass, position=self._place(), inertia=mass if self.new.planar else (mass,) * 3)

    def _push(self, x: Wired) -> str:
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
        return text_of(law.tree, self.known)

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
        if what not in wiring_of(self.old, e):
            raise ModelError(f"{owner!r} has no signal {what!r}; it has {', '.join(wiring_of(self.old, e))}")
        return self._curve(f"output_{k}_", self.text(signal(self.old, e, what)))

    def _curve(self, name: str, text: str) -> str:
        """A formula as a curve of the copy: a force on a body that stands still, which another one takes away again."""
        if not self.board:
            self.board = self._free("board")
            self.new.add(self._solid(self.board, self.heavy), welded(f"{self.board}_weld", self.board, self._place()))
        told, along = self._free(name), f"{self.board}.x"
        self.new.add(pushing(told, along, text), pushing(f"{told}back", along, f"-{text}"))
        return f"{told}.force"


def _factor(x: float) -> str:
    """What a formula is multiplied by, as a text."""
    return "" if x == 1.0 else f"{x!r}*"


def states(other: Slid, at: Mapping[str, float], x: Rest) -> list[float]:
    """The states where places stand for them, by how far the added bodies are from where they are drawn."""
    now = x.c.moving(x.t, x.q, np.zeros(x.c.structure.nv))
    way = [float(now[body].p[0] - x.c.values.bodies[body].c[0]) for body in other.slides]
    return [at[name] + other.scales[name].stride * w for name, w in zip(other.slides.values(), way, strict=True)]


def there(other: Slid, x: State, coordinates: str) -> State:
    """The state of the copy in which its bodies are as those of the model are, and the added ones at rest as drawn."""
    c = compiled(other.model, parameters=x.c.parameters)
    bodies, hints = x.c.moving(x.t, x.q, x.v), x.c.hints | x.c.turned(x.q)
    for name in other.added:
        d = c.values.bodies[name]
        bodies[name] = BodyState(d.c, d.R, np.zeros(3), np.zeros(3), d.angle)
    c.follow(hints)
    q = positions(c.values, bodies, hints)
    c.at(x.t, q, np.zeros(c.structure.nv))
    base = Assembly(c, x.t, q, velocities(c.values, bodies, c.work))
    a, _ = in_coordinates(base, coordinates, x.c.parameters)
    return State.moving(a.compiled, a.t, a.q, a.v)


def without_places(dense: StateSpace, doubt: Doubt, other: Slid) -> tuple[StateSpace, Spectrum]:
    """The equations of the states themselves, called by their own names, and their eigenvalues.

    Parameters
    ----------
    dense : StateSpace
        Of the copy.
    doubt : Doubt
        What is uncertain of it.
    other : Slid
        The copy.
    """
    slides = other.slides
    owner = {k: body for k, name in enumerate(dense.states) for body in slides if _of(name, body)}
    left = [k for k, name in enumerate(dense.states) if k not in owner or name.endswith(" rate")]
    names = tuple(slides[owner[k]] if k in owner else dense.states[k] for k in left)
    units = tuple("" if k in owner else dense.state_units[k] for k in left)
    own = spectrum(dense.A[np.ix_(left, left)], _of_left(doubt, left))
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


def of_states_only(r: Reduced, f: Free, slides: Mapping[str, str]) -> Reduced:
    """Reduced equations without inputs and without the places of bodies that stand for states."""
    left = [k for k, name in enumerate(f.labels) if not of_slides(name, slides)]
    left += range(len(f.labels), len(r.rate))
    assert r.doubt is not None
    parts = {k: getattr(r, k)[:, left] for k in ("position", "velocity", "acceleration", "multipliers")}
    return dataclasses.replace(
        r, rate=r.rate[np.ix_(left, left)], doubt=_of_left(r.doubt, left), M=None, D=None, K=None, **parts
    )


def _of_left(doubt: Doubt, left: Sequence[int]) -> Doubt:
    """The same of the equations that are left."""
    return Doubt(doubt.by[left], doubt.size[:, left])


def of_states(other: Slid, s: Structure) -> list[int]:
    """Which velocity of the copy is that along each state's slide."""
    where = {n.name: k for k, n in enumerate(velocity_names(s))}
    return [where[f"{b}.x" if f"{b}.x" in where else f"{b}_slide.displacement"] for b in other.slides]


def of_slides(name: str, slides: Mapping[str, str]) -> bool:
    """Whether a velocity of the copy is of a body that stands for a state."""
    return any(_of(name, body) for body in slides)


def _of(name: str, body: str) -> bool:
    """Whether a state of the linear equations is of a body, or of its slide."""
    return name.startswith((f"{body}.", f"{body}_slide."))
