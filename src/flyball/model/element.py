"""Base class of all described elements: a name, frozen validated fields, numbers with units or expressions.

Field types carry their dimension, so that one function converts whatever the user wrote (number, unit string,
expression of parameters) to SI floats, with messages that name the element and the field.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
import sys
import typing
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field
from functools import cache
from types import SimpleNamespace
from typing import Annotated, Any, ClassVar, TypeVar, dataclass_transform

from pydantic import BeforeValidator, ConfigDict, TypeAdapter, ValidationError
from pydantic_core import ArgsKwargs

from ..errors import ModelError
from .expressions import number
from .messages import FIELDS_ELSEWHERE

T = TypeVar("T", bound=type)
LARGEST_NUMBER = 1e50  # largest numbers of elements; products of several of them must stay finite
LONG_TEXT = 300  # characters of a value in a message


@dataclass(frozen=True)
class Unit:
    """Dimension of a field, as an SI unit; None: any."""

    dimension: str | None


@dataclass(frozen=True)
class Vector:
    """Marker of a field that is a vector of the plane or of space, or several of them."""


@dataclass(frozen=True)
class LawOf:
    """Marker of a field that is an expression of time and measured inputs; its value has this dimension (None: any)."""

    dimension: str | None
    inputs: tuple[str, ...] = ()
    curves: bool = False  # whether it may name curves of parts, such as A.angle
    forces: bool = False  # whether it may name forces of parts, such as A.force


def python_data(value: Any) -> Any:
    """Convert NumPy scalars and arrays to Python numbers and lists; refuse bool as a number."""
    if isinstance(value, bool):
        raise ValueError("a truth value is not a number")
    if isinstance(value, bytes):
        raise ValueError("bytes are no text")
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return tuple(python_data(v) for v in value)
    return value


def _list(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def _flag(value: Any) -> Any:
    """Accept only true and false: no "yes", no 1."""
    if hasattr(value, "item"):
        value = value.item()
    if not isinstance(value, bool):
        raise ValueError("give true or false")
    return value


def _name(value: Any) -> Any:
    """Require a string that is not empty."""
    if not isinstance(value, str) or not value:
        raise ValueError("give a name")
    return value


Flag = Annotated[bool, BeforeValidator(_flag)]
Name = Annotated[str, BeforeValidator(_name)]
"""The name of another part."""
Number = Annotated[float | str, BeforeValidator(python_data)]
"""A number, a unit string such as ``"30 deg"``, or an expression of named parameters."""
Numbers = Annotated[tuple[float | str, ...], BeforeValidator(python_data)]


def _pairs(value: Any) -> Any:
    """Return names with values as pairs."""
    return tuple((k, python_data(x)) for k, x in value.items()) if isinstance(value, Mapping) else python_data(value)


NamedNumbers = Annotated[
    tuple[tuple[str, Number], ...],
    BeforeValidator(_pairs, json_schema_input_type=dict[str, Number] | tuple[tuple[str, Number], ...]),
]
"""Numbers by names, kept as pairs."""


@dataclass(frozen=True)
class Named:
    """Marker of a field with pairs whose first members are names in another program, not names of parts."""


NamedLaws = Annotated[
    tuple[tuple[str, float | str | Callable[..., Any]], ...],
    BeforeValidator(_pairs, json_schema_input_type=dict[str, float | str] | tuple[tuple[str, float | str], ...]),
    Named(),
]
"""Laws by names of another program, kept as pairs."""
Coordinates = Annotated[str | tuple[str, ...], BeforeValidator(_list)]
"""A coordinate such as ``"A.angle"``, or several."""
Function = Callable[..., Any]
Law = Annotated[float | str | Function, BeforeValidator(python_data)]
"""A number, a unit string, an expression of time, inputs, sensors and parameters, or a Python function of these."""
Laws = Annotated[tuple[float | str | Function, ...], BeforeValidator(python_data)]

Length = Annotated[Number, Unit("m")]
Ratio = Annotated[Number, Unit("1")]
Angle = Annotated[Number, Unit("rad")]
Mass = Annotated[Number, Unit("kg")]
Density = Annotated[Number, Unit("kg/m^3")]
Stiffness = Annotated[Number, Unit("N/m")]
Damping = Annotated[Number, Unit("N*s/m")]
Point = Annotated[Numbers, Unit("m"), Vector()]
Points = Annotated[tuple[Numbers, ...], BeforeValidator(_list), Unit("m")]
PointPair = Annotated[tuple[Numbers, Numbers], Unit("m"), Vector()]
Direction = Annotated[Numbers, Unit(""), Vector()]
Directions = Annotated[tuple[Numbers, Numbers], Unit(""), Vector()]
Velocity = Annotated[Numbers, Unit("m/s"), Vector()]
AngularVelocity = Annotated[float | str | tuple[float | str, ...], BeforeValidator(python_data), Unit("rad/s")]


class ElementType(type):
    """Type of element classes: it holds their pydantic configuration, which `help` of a class then does not list."""

    __pydantic_config__ = ConfigDict(extra="forbid", arbitrary_types_allowed=True)


@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(field,))
def element(cls: T) -> T:
    """Class decorator for frozen, validated fields; the class's own fields are keyword-only."""
    if not isinstance(cls, ElementType):
        raise TypeError(f"{cls.__name__} has no base class whose type is ElementType, such as Element")
    if not _is_built_in(cls):  # names of its types may be gone when a first instance is made
        frame = sys._getframe(1)
        cls.__annotations__ = inspect.get_annotations(
            cls, globals=frame.f_globals, locals={**frame.f_locals, **vars(cls)}, eval_str=True
        )
    made: Any = dataclass(init=False, frozen=True, kw_only=True)(cls)
    signature = _signature(made)

    def __init__(self: Any, *args: Any, **kwargs: Any) -> None:
        try:
            _validator(made).validate_python(ArgsKwargs(args, kwargs), self_instance=self)
        except ValidationError as error:
            raise ModelError(_explain(cls.__name__, made, args, kwargs, error)) from None
        except TypeError as error:
            raise ModelError(f"{cls.__name__}: {error}") from None

    __init__.__doc__ = "The fields; those behind the star by name."
    own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    __init__.__signature__ = signature.replace(parameters=[own, *signature.parameters.values()])  # type: ignore[attr-defined]
    made.__init__, made.__signature__ = __init__, signature
    return typing.cast(T, made)


@cache
def _validator(cls: Any) -> Any:
    """Return pydantic's validator of a class, created with its first instance: many classes never have one."""
    return TypeAdapter(cls).validator


class _Type(str):
    """A type as it is written, without quotation marks."""

    __repr__ = str.__str__
    __slots__ = ()


def _signature(cls: Any) -> inspect.Signature:
    """Return the signature with positional fields first, as editors and ``help`` show it."""
    parameters = []
    for f in dataclasses.fields(cls):
        kind = inspect.Parameter.KEYWORD_ONLY if f.kw_only else inspect.Parameter.POSITIONAL_OR_KEYWORD
        default = inspect.Parameter.empty if f.default is dataclasses.MISSING else f.default
        told = f.type if isinstance(f.type, str) else getattr(f.type, "__name__", str(f.type))
        told = _Type(re.sub(r"^Annotated\[([^,\[]*(?:\[[^]]*\])?[^,]*),.*$", r"\1", told))
        parameters.append(inspect.Parameter(f.name, kind, default=default, annotation=told))
    return inspect.Signature(sorted(parameters, key=lambda p: p.kind))


def _explain(kind: str, cls: type, args: tuple, kwargs: Mapping[str, Any], error: ValidationError) -> str:
    """Return one line for each invalid field: element, field, value, rule, and the available fields."""
    known = [f.name for f in dataclasses.fields(cls)]
    name = kwargs.get("name", args[0] if args else None)
    who = f"{kind} {name!r}" if isinstance(name, str) else kind
    lines = []
    late = [int(e["loc"][0]) for e in error.errors() if e["type"] == "unexpected_positional_argument"]
    by_place = {known[k] for k in late if k < len(known)}
    if any(k >= len(known) for k in late):
        has = f"it has {len(known)}: {', '.join(known)}" if known else "it has none"
        return f"{kind}: {len(args)} values are given for its fields; {has}"
    short: dict[str, int] = {}  # field -> length of the list that it must be
    wrong: dict[str, list[str]] = {}  # field -> permitted types: a union reports one error for each member
    for e in error.errors():
        place = [str(p) for p in e["loc"] if not _is_branch(str(p))]
        where = place[0] if place else ""
        where = known[int(where)] if where.isdigit() and int(where) < len(known) else where
        if e["type"] == "unexpected_keyword_argument":
            hint = getattr(cls, "hints", {}).get(where) or f"its fields are {', '.join(known)}"
            lines.append(f"unknown field {where!r}{_did_you_mean(where, known)}; {hint}")
        elif e["type"] == "missing" and isinstance(e["loc"][-1], int) and len(e["loc"]) > 1:  # the end of a list
            short[where] = max(short.get(where, 0), e["loc"][-1] + 1)
        elif e["type"] in ("missing", "missing_argument", "missing_keyword_only_argument"):
            if where not in by_place:
                lines.append(f"field {where!r} is missing{_without_name(where, known, args, kwargs)}")
        elif e["type"] == "unexpected_positional_argument":
            lines.append(f"give field {where!r} by its name: {where}=...")
        elif e["type"] in ("too_long", "too_short"):
            wanted = e["ctx"].get("max_length", e["ctx"].get("min_length"))
            wrong.setdefault(where, []).append(f"a list of {wanted}")
        elif e["type"] in _TYPES:
            kind = _TYPES[e["type"]]
            texts = kind == "a text" and "tuple[str, ...]" in str(cls.__dataclass_fields__[where].type)  # type: ignore[attr-defined]
            wrong.setdefault(where, []).append("a list of texts" if texts else kind)
        else:
            message = e["msg"].removeprefix("Value error, ")
            lines.append(f"field {where!r}: {message} (got {_short(e['input'])})")
    for where, wanted in [*wrong.items(), *((k, [f"a list of {n}"]) for k, n in short.items() if k not in wrong)]:
        value = kwargs.get(where, dict(zip(known, args, strict=False)).get(where))
        lines.append(f"field {where!r} must be {' or '.join(dict.fromkeys(wanted))}, got {value!r}")
    return f"{who}: " + "; ".join(dict.fromkeys(lines))


def _without_name(missing: str, known: list[str], args: tuple, kwargs: Mapping[str, Any]) -> str:
    """Return a hint where the first argument, the name, was left out, so that the last body seems to be missing."""
    first = known[: known.index(missing)]
    if missing != "body_j" or "name" in kwargs or len(args) != len(first) or not all(isinstance(x, str) for x in args):
        return ""
    return f"; the name comes first: ('a name', {', '.join(map(repr, args))}, ...)"


_TYPES = {
    "float_type": "a number",
    "float_parsing": "a number",
    "string_type": "a text",
    "callable_type": "a function",
    "tuple_type": "a list",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
}


def _is_branch(place: str) -> bool:
    """Return whether this is a name that pydantic gives to a member of a union."""
    return "[" in place or place in ("float", "str", "tuple", "constrained-str", "none", "callable")


def _short(value: Any) -> str:
    """Return a value as written, shortened if it is long (vertices of a mesh, for instance)."""
    text = repr(value)
    return text if len(text) <= LONG_TEXT else text[:LONG_TEXT] + "..."


def _did_you_mean(word: str, known: list[str]) -> str:
    import difflib

    usual = FIELDS_ELSEWHERE.get(word.lower())
    close = [usual] if usual in known else difflib.get_close_matches(word, known, 1)
    return f" (did you mean {close[0]!r}?)" if close else ""


@dataclass(frozen=True)
class Element(metaclass=ElementType):
    """A named part of a mechanism.

    Parameters
    ----------
    name : str
        Its name, by which other parts, laws and results refer to it.
    """

    name: str
    _: KW_ONLY

    category: ClassVar[str] = "elements"
    in_files: ClassVar[bool] = True  # whether model files may name it; its name is then in the registry
    shows_parts: ClassVar[bool] = True  # whether pictures show the elements that belong to it
    registry: ClassVar[dict[str, type[Element]]] = {}
    modules: ClassVar[dict[str, set[str]]] = {}  # class name -> modules that have defined a class of that name
    in_own_axes: ClassVar[tuple[str, ...]] = ()  # points that its other fields place, and that copies keep
    local: ClassVar[tuple[str, ...]] = ()  # vectors and orientations along its own or its body's axes, not the world's
    handed: ClassVar[tuple[str, ...]] = ()  # numbers whose signs are senses of rotation in the plane
    mirrors: ClassVar[bool] = False  # of an own element: whether its formulas hold for it turned or reflected as well

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if not cls.in_files:
            return
        other = Element.registry.get(cls.__name__) if _is_built_in(cls) else _registered(cls.__name__)
        if other is not None and _is_built_in(other) != _is_built_in(cls):
            raise ModelError(
                f"the class {cls.__name__} of {cls.__module__} and that of {other.__module__} have the same name, and "
                "model files identify elements by it; give your own class another name"
            )
        Element.registry[cls.__name__] = cls
        Element.modules.setdefault(cls.__name__, set()).add(cls.__module__)

    @staticmethod
    def of_type(name: str, where: str = "") -> type[Element]:
        """Return the class named by a ``type`` in a model file.

        Raises
        ------
        ModelError
            If several modules define a class of that name; the message begins with ``where``.
        """
        _registered(name)
        if len(modules := Element.modules[name]) > 1:
            raise ModelError(
                f"{where}type {name!r} is defined by several modules, {', '.join(sorted(modules))}; a file identifies "
                "a type by its name: give the classes different names, or import one of the modules only"
            )
        return Element.registry[name]

    @property
    def title(self) -> str:
        """Return kind and name, for messages."""
        return f"{type(self).__name__} {self.name!r}"

    def check(self, n: SimpleNamespace) -> None:
        """Refuse invalid numbers; ``n`` contains the resolved fields."""

    def derive(self, n: SimpleNamespace, env: Mapping[str, Any]) -> None:
        """Add numbers that follow from its fields and the parameters to the resolved fields."""

    def bound(self, model: Any) -> Element:
        """Return the element with properties that depend on the model's other elements; by default itself."""
        return self

    def reversed_factors(self, signs: tuple[float, ...]) -> dict[str, Any]:
        """Return factors of its fields if the directions of its coordinates are multiplied by these signs.

        A tuple has a factor for each component of a field.

        Raises
        ------
        ModelError
            If it cannot act along a reversed coordinate.
        """
        raise ModelError(f"{self.title}: a {type(self).__name__} cannot act along a coordinate that is reversed")

    def parts(self, model: Any) -> tuple[Element, ...]:
        """Return the elements that belong to it: added and replaced with it, and left out of model files."""
        return ()

    def acts(self) -> bool:
        """Return whether it acts by a formula; if not, it only has rows that are active at times (`switches`)."""
        return True

    def switches(self) -> tuple[Any, ...]:
        """Return its rows with modes in a motion (`model.force.Switch`)."""
        return ()

    def switched(self, n: SimpleNamespace, label: str, separation: float) -> tuple[float, ...]:
        """Return the numbers of such a row: least and greatest value of its quantity, restitution, more by its kind.

        ``separation`` is the distance of its points in the reference configuration.
        """
        return ()

    def switch_weights(self, n: SimpleNamespace, label: str) -> tuple[float, ...]:
        """Return the weights of the coordinates in the sum along which such a row acts; 1 each if not given."""
        return ()


def _registered(name: str) -> type[Element] | None:
    """Return the class of that name, even if it is one of flyball that has not been imported yet."""
    if name not in Element.registry:
        getattr(sys.modules["flyball"], name, None)  # imports the module that defines it
    return Element.registry.get(name)


def _is_built_in(cls: type) -> bool:
    return cls.__module__.partition(".")[0] == "flyball"


_MARKED: dict[tuple[Any, Any], dict[str, Any]] = {}


def fields_with(cls: Any, marker: Any) -> dict[str, Any]:
    """Return the fields whose type carries a marker (``Unit`` or ``LawOf``), with that marker."""
    if (cls, marker) not in _MARKED:
        hints = typing.get_type_hints(cls, include_extras=True)
        found = {}
        for f in dataclasses.fields(cls):
            for m in _markers(hints[f.name]):
                if isinstance(m, marker):
                    found[f.name] = m
        _MARKED[cls, marker] = found
    return _MARKED[cls, marker]


def _markers(hint: Any) -> list[Any]:
    out = list(getattr(hint, "__metadata__", ()))
    for a in typing.get_args(hint):
        out += _markers(a) if not isinstance(a, (str, Unit, LawOf)) else []
    return out


def resolve(e: Element, env: Mapping[str, float]) -> SimpleNamespace:
    """Return the element's fields with every number in SI floats; laws and other fields as written."""
    n = SimpleNamespace(**{f.name: getattr(e, f.name) for f in dataclasses.fields(e)})
    for name, unit in fields_with(e.__class__, Unit).items():
        setattr(n, name, si_numbers(getattr(e, name), env, unit.dimension, f"{name} of {e.title}"))
    if isinstance(e, Element):
        e.derive(n, env)
    return n


def si_numbers(value: Any, env: Mapping[str, float], dimension: str | None, where: str) -> Any:
    """Convert a number or nested lists of numbers to SI units; ``where`` describes it in messages."""
    if value is None:
        return None
    if isinstance(value, (tuple, list)):
        return tuple(si_numbers(v, env, dimension, where) for v in value)
    if type(value) is not float or value - value != 0.0:
        value = number(value, env, dimension, where)
    return checked_size(value, dimension, where)


def checked_size(value: Any, dimension: str | None, where: str) -> Any:
    """Return the number; refuse one too large to compute with."""
    if not abs(value) <= LARGEST_NUMBER:
        unit = f" {dimension}" if dimension not in (None, "", "1") else ""
        raise ModelError(
            f"{where}: {value:g}{unit} is beyond {LARGEST_NUMBER:g}, where squares and products "
            f"overflow; is its unit right?"
        )
    return value


def described_part(base: type[Element] | tuple[type[Element], ...], example: str) -> BeforeValidator:
    """Return the validator of a field whose value is an element of its own kind, or its table with a ``type``."""

    def convert(value: Any) -> Any:
        if isinstance(value, Mapping):
            kind = value.get("type")
            known = [k for k, c in Element.registry.items() if issubclass(c, base) and "__signature__" in vars(c)]
            if kind is not None:
                _registered(str(kind))
            if kind not in known:
                problem = "it has no type" if kind is None else f"unknown type {kind!r}"
                raise ModelError(f"{problem}; there are {', '.join(sorted(known))}")
            return Element.of_type(str(kind))(**{k: v for k, v in value.items() if k != "type"})
        if value is not None and not isinstance(value, base):
            raise ValueError(f"give {example}")
        return value

    return BeforeValidator(convert)


def written_fields(e: Any) -> dict[str, Any]:
    """Return the fields that differ from their defaults, as plain data for a model file."""
    out: dict[str, Any] = {}
    for f in dataclasses.fields(e):
        value = getattr(e, f.name)
        if hasattr(value, "tolist"):
            value = value.tolist()
        if value == f.default and repr(value) == repr(f.default):  # -0.0 equals 0.0, but is written differently
            continue
        if value is not None:
            out[f.name] = _data(value)
    return out


def _data(value: Any) -> Any:
    if isinstance(value, (tuple, list)):
        return [_data(v) for v in value]
    if dataclasses.is_dataclass(value):
        return {"type": type(value).__name__, **written_fields(value)}
    return value


def field_with(e: Element, *values: str) -> str:
    """Return the field that contains one of these texts, for messages: "body_i: "; empty if there is none."""
    for f in dataclasses.fields(e):
        given = getattr(e, f.name)
        texts = given if isinstance(given, tuple) else (given,)
        if f.name != "name" and any(isinstance(x, str) and x in values for x in texts):
            return f"{f.name}: "
    return ""


def positive(e: Element, n: SimpleNamespace, *names: str, why: str = "") -> None:
    """Refuse resolved fields that are not greater than zero."""
    _compare(e, n, names, lambda x: x > 0, "greater than 0", why)


def nonnegative(e: Element, n: SimpleNamespace, *names: str, why: str = "") -> None:
    """Refuse resolved fields that are negative."""
    _compare(e, n, names, lambda x: x >= 0, "zero or greater", why)


def _compare(e: Element, n: SimpleNamespace, names: tuple[str, ...], good: Callable, rule: str, why: str) -> None:
    units = fields_with(e.__class__, Unit)
    for name in names:
        x = getattr(n, name)
        if x is not None and not good(x.real):
            unit = "" if units[name].dimension in (None, "1") else f" {units[name].dimension}"
            raise ModelError(f"{e.title}: {name} is {x:g}{unit}; it must be {rule}{'. ' + why if why else ''}")
