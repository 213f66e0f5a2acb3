"""The description of a mechanism: named parts, checked as they are added. No numerics."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from numbers import Real
from typing import Any, ClassVar

import numpy as np

from ..errors import ModelError
from . import controller_signals
from .body import GROUND, RATE, Bodies, Body, Driver, Frame, Ground, Initial
from .contact import Contact, Material, MaterialPair
from .controller import IMU, Controller, Sensor
from .element import Element, LawOf, Number, field_with, fields_with, python_data, resolve
from .event import Event
from .expressions import Expression, ParameterValues, number, parameter_formulas, resolve_changed, resolve_parameters
from .force import Force, Unilateral
from .geometry import vector
from .joint import Coupling, Joint
from .messages import listing as listing
from .messages import suggest as suggest
from .messages import summary
from .names import curve_parts, groups_of
from .quantities import actual_kind, carrier_names, check_units, measured_quantity
from .snapshot import (
    CATEGORIES,
    ResultCache,
    changed_copy,
    model_copy,
    picklable_state,
    put_parts,
    refuse_changes,
    same_values,
    snapshot,
)
from .subassembly import add_subassembly
from .table import Table
from .table_2d import Table2D
from .units import same_kind
from .validation import check_kind, check_name, check_references, check_vectors, checked_law, gravity_as_written


class Model:
    """The description of a mechanism, without its analyses; `flyball.Mechanism` documents the arguments."""

    frozen: ClassVar[bool] = False  # whether it is a snapshot
    cache: ResultCache  # of a snapshot: cached results

    def __init__(
        self,
        name: str = "mechanism",
        *,
        planar: bool = False,
        gravity: Any = None,
        parameters: dict[str, Number] | None = None,
    ) -> None:
        if not isinstance(name, str):
            raise ModelError(f"the name of a mechanism is a text, not {name!r}")
        self.name = name
        self.planar = bool(planar)
        self._resolved: tuple[dict, ParameterValues, dict[str, Expression]] | None = None
        if not isinstance(parameters, Mapping | None):
            raise ModelError(
                f"parameters of {name!r} maps names to values, for instance {{'mass': 2}}, not {parameters!r}"
            )
        try:
            self.parameters = {k: python_data(v) for k, v in (parameters or {}).items()}
        except (ValueError, TypeError, AttributeError) as error:
            raise ModelError(f"parameters of {name!r}: {error}") from None
        self.environment()
        self.gravity = tuple(gravity_as_written(self, (0.0,) * (2 if planar else 3) if gravity is None else gravity))
        self.gravity_told = gravity is not None
        self.bodies: list[Body] = []
        self.frames: list[Frame] = []
        self.joints: list[Joint] = []
        self.couplings: list[Coupling] = []
        self.tables: list[Table | Table2D] = []
        self.sensors: list[Sensor | IMU] = []
        self.controllers: list[Controller] = []
        self.forces: list[Force] = []
        self.drivers: list[Driver] = []
        self.initial: list[Initial] = []
        self.materials: list[Material] = []
        self.material_pairs: list[MaterialPair] = []
        self.ground: list[Ground] = []
        self.bulk: list[Bodies] = []
        self.contacts: list[Contact] = []
        self.limits: list[Unilateral] = []
        self.events: list[Event] = []
        self.by_name: dict[str, Element] = {}
        self.groups: set[str] = {g for name in self.parameters for g in groups_of(name)}
        self.gravity_vector()

    def environment(self, changed: Mapping[str, Number | complex] | None = None) -> ParameterValues:
        """Return the values of the parameters in SI units, with some of them changed.

        Raises
        ------
        ModelError
            If a changed parameter does not exist, or has an incompatible unit.
        """
        for name in changed or {}:
            if name not in self.parameters:
                known = list(self.parameters)
                raise ModelError(f"{self.name!r} has no parameter {name!r}{suggest(name, known)}; {listing(known)}")
        for name, value in (changed or {}).items():
            old = self.parameters[name]
            if isinstance(old, str) and isinstance(value, str):
                same_kind(old, value, f"parameter {name!r} of {self.name!r}")
        if not all(isinstance(value, Real) for value in (changed or {}).values()):
            return resolve_parameters({**self.parameters, **(changed or {})})
        if self._resolved is None or not same_values(self._resolved[0], self.parameters):
            try:
                values = resolve_parameters(self.parameters)
            except ModelError:  # the changed value may be the invalid one
                return resolve_parameters({**self.parameters, **(changed or {})})
            vars(self)["_resolved"] = dict(self.parameters), values, parameter_formulas(self.parameters)
        _, values, formulas = self._resolved  # type: ignore[misc]
        return resolve_changed(values, formulas, changed or {})

    def copy(self) -> Any:
        """Return a mechanism of the same parts that can be changed independently."""
        return model_copy(self)

    __copy__ = copy

    def snapshot(self) -> Any:
        """Return an immutable copy; the same object again as long as nothing was changed.

        Results that analyses compute from it are cached on it (`snapshot.ResultCache`), so that they are computed once.
        """
        return snapshot(self)

    def changed(self, parts: Mapping[str, Element | None]) -> Any:
        """Return a copy with other parts under these names, or without them (None); nothing is checked."""
        return changed_copy(self, parts)

    def __getstate__(self) -> dict[str, Any]:
        return picklable_state(vars(self))

    def __setattr__(self, name: str, value: Any) -> None:
        refuse_changes(self, f"{name!r} cannot be set")
        if name == "gravity":  # copy of the caller's list
            value = gravity_as_written(self, value)
        super().__setattr__(name, value)

    def gravity_vector(self, env: Mapping[str, float] | None = None) -> np.ndarray:
        """Acceleration of gravity [m/s^2], three components; where it is a law of time, at t = 0."""
        env = self.environment() if env is None else env
        what = f"gravity of {self.name!r}"
        laws = (*self.gravity_laws(), *(None,) * len(self.gravity))
        at_start = {**env, "t": 0.0}
        given = [
            number(x if law is None else law, env if law is None else at_start, "m/s^2", what)
            for x, law in zip(self.gravity, laws, strict=False)
        ]
        return vector(given, self.planar, what)

    def gravity_laws(self) -> tuple[Expression | None, ...]:
        """Return the three components of gravity as laws of time; None: the component is constant."""
        where = f"gravity of {self.name!r}"
        texts = [x for x in self.gravity[:3] if isinstance(x, str) and re.search(r"\bt\b", x)]
        if not texts:
            return (None, None, None)
        laws = [self.law(x, LawOf("m/s^2"), where) if x in texts else None for x in self.gravity[:3]]
        for law in laws:
            if law is not None and (others := sorted(law.names - {"t", *self.parameters})):
                raise ModelError(f"{where}: {law.text!r} names {others[0]!r}; it is a law of t and parameters only")
        laws = [law if law is not None and "t" in law.names else None for law in laws]
        return (*laws, *(None,) * (3 - len(laws)))

    def elements(self) -> Iterator[Element]:
        """Return all parts, category by category, in the order they were added."""
        for category in CATEGORIES:
            yield from getattr(self, category)

    def with_states(self) -> list[Element]:
        """Return controllers, and forces with states of their own."""
        return [*self.controllers, *(f for f in self.forces if f.states())]

    def acting(self) -> list[Force]:
        """Return all elements that act by a formula: forces, and elastic limits."""
        return [e for e in (*self.forces, *self.limits) if isinstance(e, Force) and e.acts()]

    def __eq__(self, other: object) -> bool:
        """Return whether every part, parameter and setting is equal."""
        if not isinstance(other, Model):
            return NotImplemented
        same = ("name", "planar", "gravity", "parameters", *CATEGORIES)
        mine, its = picklable_state(vars(self)), picklable_state(vars(other))
        return all(mine[k] == its[k] for k in same)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return summary(self)

    def find(self, name: str) -> Element | None:
        """Return the part with that name, or None."""
        return self.by_name.get(name)

    def names(self) -> list[str]:
        """Return the names of all parts, in the order they were added."""
        return list(self.by_name)

    def __contains__(self, name: object) -> bool:
        """Return whether there is a part of that name."""
        return name in self.by_name

    def __getitem__(self, name: str) -> Any:
        """Return the part with that name."""
        if name in self.groups:
            inner = [x.removeprefix(f"{name}.") for x in self.by_name if x.startswith(f"{name}.")]
            raise ModelError(
                f"{self.name!r}: {name!r} is a group of parts; name one: {name}.{inner[0]}, ...; {listing(inner)}"
            )
        if name not in self.by_name:
            known = self.names()
            raise ModelError(f"{self.name!r} has no part named {name!r}{suggest(str(name), known)}; {listing(known)}")
        return self.by_name[name]

    def add(
        self,
        *elements: Element | Model,
        prefix: str | None = None,
        at: Any = None,
        orientation: Any = None,
        angle: Any = None,
        mirror: str | None = None,
        on: str = GROUND,
        parameters: Mapping[str, Any] | None = None,
    ) -> Any:
        """Add parts and check them against the existing ones, or a copy of another mechanism. Return the (last) part.

        ``m.add(corner, prefix="left", at=(0, 0.7, 0))`` adds all parts of the mechanism ``corner``: its body ``arm`` is
        ``left.arm``. They are ordinary parts; a later change of ``corner`` has no effect.

        Parameters
        ----------
        elements : parts, or one mechanism
        prefix : str
            Of the names of all its parts and parameters: plain words, with dots between for groups in groups.
        at : point [m]
            Where the origin of its world comes to be; numbers, quantities or expressions of parameters.
        orientation : quaternion, Bryant angles [rad], rotation object or matrix
            In space: axes of its world. They do not depend on parameters.
        angle : number [rad]
            In the plane.
        mirror : {"x", "y", "z"}
            The coordinate of its world that changes its sign before that. Laws and values of coordinates are adapted.
        on : str
            The body to which it is attached with all that stands on ground in it.
        parameters : dict
            Values of its parameters in the copy, or expressions of this mechanism's; its own where not given.

        Raises
        ------
        ModelError
            If a name is taken, a body or joint it refers to is unknown, or a number is invalid; if a part of the
            mechanism cannot be turned or reflected. Nothing of it is then added.
        """
        refuse_changes(self, "nothing can be added")
        placed = (prefix, at, orientation, angle, mirror, on, parameters)
        given = any(x is not None for x in placed if x is not on) or on != GROUND
        if given or any(isinstance(e, Model) for e in elements):
            if len(elements) != 1 or not isinstance(elements[0], Model):
                raise ModelError("prefix=, at=, mirror= and the like are for one mechanism: m.add(part, prefix='left')")
            return add_subassembly(self, elements[0], *placed)
        return self._add(*elements)  # type: ignore[arg-type]

    def _add(self, *elements: Element) -> Any:
        """Add elements; controllers among them may name each other in any order."""
        before = vars(self).get("_adding", ())
        vars(self)["_adding"] = (*before, *(e for e in elements if isinstance(e, Controller)))
        try:
            return self._add_each(*elements)
        finally:
            vars(self)["_adding"] = before
            if not before:
                vars(self).pop("_adding")

    def _add_each(self, *elements: Element) -> Any:
        last = None
        for e in elements:
            if not isinstance(e, Element) or e.category not in CATEGORIES:
                raise ModelError(
                    f"cannot add {e!r}: it is no body, frame, joint, coupling, force, driver, sensor, table, initial "
                    f"condition, part of ground, material, contact, limit, controller or event"
                )
            check_name(self, e)
            e = e.bound(self)
            check_references(self, e)
            self.validate(e, self.environment())
            getattr(self, e.category).append(e)
            if not isinstance(e, Initial):
                self.by_name[e.name] = e
                self.groups.update(groups_of(e.name))
            self._add_parts(e)
            last = e
        return last

    def _add_parts(self, e: Element) -> None:
        """Add the elements that belong to e; if one is invalid, e is not added either."""
        parts = e.parts(self)
        try:
            self._add(*parts)
        except ModelError as error:
            put_parts(self, {x.name: None for x in (e, *parts) if x is self.find(x.name)})
            raise type(error)(f"{e.title}: {error}") from None

    def replace(self, e: Element) -> Any:
        """Replace the part of the same name and kind, and check the new one. Return the new part.

        Raises
        ------
        ModelError
            If there is no such part, or a number is invalid.
        """
        refuse_changes(self, f"{e.title} cannot be put in")
        old = self[e.name]
        if old.category != e.category:
            raise ModelError(f"{e.title} cannot take the place of {old.title}")
        e = e.bound(self)
        check_references(self, e)
        self.validate(e, self.environment())
        put_parts(self, {x.name: None for x in old.parts(self)} | {e.name: e})
        self._add_parts(e)
        for force in [f for f in self.forces if f.bound(self) is not f]:
            self.replace(force)
        return e

    def body(self, name: str, e: Element) -> Body:
        """Return the body of that name, which e refers to."""
        found = self.by_name.get(name)
        if not isinstance(found, Body):
            names = [b.name for b in self.bodies]
            raise ModelError(
                f"{e.title}: {field_with(e, name)}there is no body named {name!r}{suggest(name, names)}; "
                f"{listing(names)}"
            )
        return found

    def carrier(self, name: str, e: Element) -> str:
        """Return the body (or ground) that carries the point to which e attaches."""
        found = self.by_name.get(name)
        if isinstance(found, Frame):
            return found.body
        if name != GROUND and not isinstance(found, Body):
            names = carrier_names(self)
            raise ModelError(
                f"{e.title}: {field_with(e, name)}there is no body or frame named {name!r}"
                f"{actual_kind(self, name, 'body or frame')}"
                f"{suggest(name, names)}; {listing(names)}"
            )
        return name

    def joint(self, name: str, e: Element, coordinate: str) -> Joint:
        """Return the joint of that name, which e refers to and which must have the coordinate."""
        found = self.by_name.get(name)
        if not isinstance(found, Joint):
            names = [j.name for j in self.joints]
            raise ModelError(
                f"{e.title}: {field_with(e, f'{name}.{coordinate}', name)}there is no joint named {name!r}"
                f"{actual_kind(self, name, 'joint')}{suggest(name, names)}; {listing(names)}"
            )
        has = found.measured(self.planar)
        if coordinate not in has:
            raise ModelError(
                f"{e.title}: {field_with(e, f'{name}.{coordinate}', name)}{found.title} has no coordinate "
                f"{coordinate!r}{suggest(coordinate, has)}; it has {', '.join(has) or 'none'}"
                f"{_initial_rate(e, name, coordinate, has)}"
            )
        return found

    def coordinate(self, text: str, e: Element) -> tuple[Any, str]:
        """Return (joint, coordinate name) or (body or frame, axis) for ``"A.angle"`` or ``"slider.x"``."""
        owner, what = curve_parts(text, self.by_name)
        found = self.by_name.get(owner)
        if isinstance(e, Driver) and isinstance(found, Joint):
            what = what.removesuffix(RATE)
        if isinstance(found, (Body, Frame)):
            axes = found.measured(self.planar)
            if what not in axes:
                raise ModelError(
                    f"{e.title}: {field_with(e, text)}{owner!r} has the coordinates {', '.join(axes)}, not {what!r}"
                )
            return found, what
        if not what:
            raise ModelError(
                f"{e.title}: {field_with(e, text)}{text!r} is no coordinate; write joint.coordinate, for instance "
                f"'A.angle'"
            )
        return self.joint(owner, e, what), what

    def measured(self, e: Sensor) -> tuple[str, str, int] | None:
        """Return what a sensor measures, as (kind, coordinate or name, order): order 0 the value, 1 its rate.

        The kind is ``"coordinate"``, ``"force"`` (the quantity along which a force acts), ``"spin"`` (angular velocity
        in space), or None for an output that laws cannot use.

        Raises
        ------
        ModelError
            If there is no such part, or it has no such curve.
        """
        return measured_quantity(self, e)

    def validate(self, e: Element, env: dict[str, float]) -> None:
        """Convert the element's numbers to SI units and refuse invalid ones."""
        n = resolve(e, env)
        e.check(n)
        check_vectors(e, n, self.planar)
        self._check_laws(e)
        if isinstance(e, Controller):
            controller_signals.check_controller(self, e)
        check_units(self, e, env)
        check_kind(self, e, n, env)

    def _check_laws(self, e: Element) -> None:
        for name, of in fields_with(e.__class__, LawOf).items():
            value = getattr(e, name)
            for law in value if isinstance(value, tuple) else (value,):
                self.law(law, of, f"{name} of {e.title}")
        if isinstance(e, Driver):
            followed = [x for x in self.sensors if isinstance(x, Sensor) and x.of == e.coordinate]
            if isinstance(e.law, str) and any(re.search(rf"\b{re.escape(x.name)}\b", e.law) for x in followed):
                raise ModelError(
                    f"{e.title}: its law names sensor {followed[0].name!r}, which measures {e.coordinate!r} itself; a "
                    f"driver cannot follow what it drives"
                )
            self.law(e.law, LawOf(self.unit(e.coordinate, e)), f"law of {e.title}", driver=True)

    def unit(self, text: str, e: Element) -> str:
        """Return the unit of a coordinate, or of the rate that a driver prescribes."""
        owner, what = self.coordinate(text, e)
        unit: str = owner.coordinates[what].unit
        return f"{unit}/s" if isinstance(e, Driver) and e.of_rate else unit

    def law(self, value: Any, of: LawOf, where: str, driver: bool = False, whole: bool = True) -> Any:
        """Return a law as an expression of t, its inputs, sensors, tables and parameters; refuse other names.

        If ``whole``, signals of controllers are replaced by their formulas.
        """
        return checked_law(self, value, of, where, driver, whole)

    def law_tables(self) -> dict[str, Table]:
        """Return all tables of one argument by name: also those that tables of two arguments are composed of."""
        return {name: table for x in self.tables for name, table in x.curves().items()}

    def names_in_laws(self, of: LawOf) -> set[str]:
        """Return all names that such a law may use; also curves, if it may use these."""
        sensors = (x.name for x in self.sensors if isinstance(x, Sensor))
        return {"t", *of.inputs, *self.parameters, *sensors, *controller_signals.signal_names(self)}


def _initial_rate(e: Element, joint: str, what: str, has: Collection[str]) -> str:
    """How an `Initial` gives the rate of a joint's coordinate, for messages; empty where no rate was meant."""
    rates = [c for c in has if what in ("rate", f"{c}_rate")] if isinstance(e, Initial) else []
    return f"; the initial rate of a coordinate is Initial('{joint}.{rates[0]}', rate=...)" if rates else ""
