"""Controllers as bodies: a mechanism without controllers that moves as one with them, for what asks small motions.

A state z with the rate f is the velocity of a body of 1 kg on a slide of its own, which nothing else touches, under
the force f: v' = f. Where laws name z they name z_0 + v, so that all bodies rest where small motions are asked about.
The place of such a body is nobody's concern: its rows and columns are left out of what is told. For an equilibrium it
is the place that stands for z: the body is at rest where f = 0.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from ...equations.velocities import velocities
from ...errors import ModelError
from ...forces.coordinate_spring import pushing
from ...joints.prismatic import slide
from ...model.body import Body
from ...model.controller import OUTPUT, Controller
from ...model.element import LawOf, fields_with, resolve
from ...model.expressions import Expression, is_number_text
from ...model.model import Model
from ...model.sensor import Sensor
from ...model.texts import text_of
from ...model.wiring import Wired, signal, wired, wiring_of
from ...results.linear import StateSpace
from ...tables.coordinates import BodyState, positions
from ..assembly.start import Assembly
from ..compiled import compiled
from ..motion.layer import in_coordinates
from .derivatives import State
from .rest import Rest


@dataclass(frozen=True)
class Slid:
    """A copy of a model with bodies in place of controllers.

    Attributes
    ----------
    model : Model
    slides : dict
        Name of the body of each state -> the state's name.
    outputs : dict
        Signal that was asked for -> curve of the copy that it is.
    laws : dict
        State or signal that is sampled -> curve of the copy that its value from the next instant on is.
    """

    model: Model
    slides: dict[str, str]
    outputs: dict[str, str]
    laws: dict[str, str]


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


STRIDE = 1e4  # of a state, for a metre of its body: positions are looked for with steps of limited length


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


def slid(model: Model, at: Mapping[str, float | str], outputs: Sequence[str] = (), *, places: bool = False) -> Slid:
    """The copy.

    Parameters
    ----------
    model : Model
    at : mapping
        State of a controller -> its value where small motions are asked about, a number or a formula of parameters.
    outputs : sequence of str
        Signals and states of controllers that are asked for, besides curves of other parts.
    places : bool
        Whether places stand for states, z_0 + `STRIDE` x; else velocities, z_0 + v.
    """
    return _Sliding(model, at, places).made(outputs)


class _Sliding:
    """A copy in the making."""

    def __init__(self, model: Model, at: Mapping[str, float | str], places: bool) -> None:
        self.old, self.what, self.places = model, "displacement" if places else "displacement_rate", places
        self.new = model.copy()
        self.new.controllers, self.new.events = [], []
        self.new.by_name = {k: e for k, e in model.by_name.items() if e.category not in ("controllers", "events")}
        self.states = wired(model)
        self.body = {x.name: self._free(x.name.replace(".", "_")) for x in self.states}
        stride = f"{STRIDE!r}*" if places else ""
        self.known = {name: f"(({at[name]}) + {stride}{b}_now)" for name, b in self.body.items()}

    def _free(self, name: str) -> str:
        """A name that nothing has."""
        while any(k.startswith(name) for k in (*self.new.by_name, *self.new.parameters)):
            name += "_"
        return name

    def made(self, outputs: Sequence[str]) -> Slid:
        """The copy, with curves for these signals."""
        planar = self.new.planar
        for body in self.body.values():
            still = {"inertia": 1.0} if planar else {"inertia": (1.0, 1.0, 1.0)}
            self.new.add(
                Body(body, mass=1.0, position=self._place(), **still),
                slide(f"{body}_slide", body, self._place(), planar),
                Sensor(f"{body}_now", f"{body}_slide.{self.what}"),
            )
        for x, body in zip(self.states, self.body.values(), strict=True):
            force = f"{self._push(x)}{self._held()}"
            self.new.add(pushing(f"{body}_push", f"{body}_slide.displacement", force))
        self._laws()
        found = {name: self._output(name, k) for k, name in enumerate(outputs) if self._own(name)}
        sampled = [] if self.places else [x for x in self.states if x.controller.sampled]
        laws = {x.name: self._curve(f"law_{k}_", self.text(x.law)) for k, x in enumerate(sampled)}
        self.new.sensors = [e for e in self.new.sensors if not self._own(getattr(e, "of", ""))]
        return Slid(self.new, {b: name for name, b in self.body.items()}, found, laws)

    def _push(self, x: Wired) -> str:
        """The force on a state's body: its rate. What is held stays, and rests where a sample changes nothing."""
        if not x.controller.sampled:
            return self.text(x.law)
        return f"({self.text(x.law)}) - {self.known[x.name]}" if self.places else "0"

    def _place(self) -> Any:
        """Where bodies are drawn: where one is already, so that the mechanism is as large as before."""
        first = self.old.bodies[0].position
        return first if any(isinstance(x, str) for x in first) else tuple(np.array(first, float).tolist())

    def _held(self) -> str:
        """What keeps the weight of 1 kg along the slide."""
        g = self.old.gravity[0]
        if isinstance(g, str) and not is_number_text(g):
            return f" - ({g})"
        weight = float(self.old.gravity_vector()[0])
        return f" - ({weight!r})" if weight else ""

    def text(self, law: Expression) -> str:
        """A law of the model's as one of the copy."""
        for name in sorted(law.names):
            if "." in name and name not in self.known:
                sensor = self._free(name.replace(".", "_"))
                self.new.add(Sensor(sensor, name))
                self.known[name] = sensor
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
        return self.text(self.old.law(value, of, e.title))

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
        what = what if dot else OUTPUT
        if what not in wiring_of(self.old, e):
            raise ModelError(f"{owner!r} has no signal {what!r}; it has {', '.join(wiring_of(self.old, e))}")
        return self._curve(f"output_{k}_", self.text(signal(self.old, e, what)))

    def _curve(self, name: str, text: str) -> str:
        """A formula as a curve of the copy: a force that another one takes away again."""
        told, along = self._free(name), f"{self.old.bodies[0].name}.x"
        self.new.add(pushing(told, along, text), pushing(f"{told}back", along, f"-{text}"))
        return f"{told}.force"


def places(other: Slid, x: Rest) -> list[float]:
    """How far the added bodies are from where they are drawn, along their slides [m]."""
    now = x.c.moving(x.t, x.q, np.zeros(x.c.structure.nv))
    return [float(now[name].p[0] - x.c.values.bodies[name].c[0]) for name in other.slides]


def there(other: Slid, x: State, coordinates: str) -> State:
    """The state of the copy in which its bodies are as those of the model are, and the added ones at rest as drawn."""
    c = compiled(other.model, parameters=x.c.parameters)
    bodies, hints = x.c.moving(x.t, x.q, x.v), x.c.hints | x.c.turned(x.q)
    for name in other.slides:
        d = c.values.bodies[name]
        bodies[name] = BodyState(d.c, d.R, np.zeros(3), np.zeros(3), d.angle)
    c.follow(hints)
    q = positions(c.values, bodies, hints)
    c.at(x.t, q, np.zeros(c.structure.nv))
    base = Assembly(c, x.t, q, velocities(c.values, bodies, c.work))
    a, _ = in_coordinates(base, coordinates, x.c.parameters)
    return State.moving(a.compiled, a.t, a.q, a.v)


def without_places(dense: StateSpace, slides: Mapping[str, str]) -> StateSpace:
    """The equations without the places of bodies that stand for states; these are called by their own names."""
    owner = {k: body for k, name in enumerate(dense.states) for body in slides if _of(name, body)}
    gone = [k for k in owner if not dense.states[k].endswith(" rate")]
    left = np.setdiff1d(np.arange(len(dense.states)), gone)
    names = tuple(slides[owner[k]] if k in owner else dense.states[k] for k in left)
    units = tuple("" if k in owner else dense.state_units[k] for k in left)
    A = dense.A[np.ix_(left, left)]
    return StateSpace(
        A=A,
        B=dense.B[left],
        C=dense.C[:, left],
        D=dense.D,
        states=names,
        state_units=units,
        mass=None,
        damping=None,
        stiffness=None,
        eigenvalues=np.linalg.eigvals(A),
        motion=dense.motion[:, left],
    )


def of_slides(name: str, slides: Mapping[str, str]) -> bool:
    """Whether a velocity of the copy is of a body that stands for a state."""
    return any(_of(name, body) for body in slides)


def _of(name: str, body: str) -> bool:
    """Whether a state of the linear equations is of a body, or of its slide."""
    return name.startswith((f"{body}.", f"{body}_slide."))
