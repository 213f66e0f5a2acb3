"""`Mechanism.symbolic` and `Mechanism.export`: options, choice of coordinates, and what each call returns.

With parameters, the equations are those of a copy of the model in which every number is a parameter, named after its
field.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..analysis_options import AnalysisOptions
from ..errors import ModelError
from ..expression_graph.graph import Symbol
from ..model.body import Body
from ..model.element import Unit, fields_with
from ..model.element_laws import with_inputs
from ..model.expressions import number
from ..model.joint import Joint
from ..model.model import Model, suggest
from ..model.unsupported_elements import acts_while_sliding, refuse_sampled_controllers, refuse_unsupported
from .equations import Equations, SymbolicOptions
from .export import Code
from .named_equations import choose_coordinates, latex_part_name

AXES = "xyz"
FIELD_LETTERS = {"mass": "m", "inertia": "J", "stiffness": "k", "damping": "d", "length": "l", "radius": "r"}
CATEGORIES = ("bodies", "frames", "joints", "couplings", "forces")  # categories whose numbers occur in the equations
OWNER_SUFFIX = "_of_"  # suffix of generated parameter names
EXCLUDED_FIELDS = ("velocity", "angular_velocity")  # fields of the initial state only
MAX_COMPONENTS = 3  # longest field; longer lists are profiles and outlines


class ParametrizedModel:
    """A copy of a model in which numbers are parameters.

    Names are ``"rod.mass"``, ``"A.at_x"``. ``"rod.offset_x"`` is the position of the centre of mass on the body,
    ``"A.angle_drawn"`` the reference value of a coordinate, and ``"g"`` gravity that acts along one axis.

    Zeros and directions stay numbers: symbols would hide simple formulas. Laws, tables, profiles of cams, outlines of
    shapes and data of the initial state are not changed.

    Attributes
    ----------
    model : Model
        The copy.
    symbols : dict of str to Symbol
        Parameter of the copy -> its symbol.
    """

    def __init__(self, model: Model) -> None:
        self.model = model.copy()
        self.symbols: dict[str, Symbol] = {}
        for category in CATEGORIES:
            for e in list(getattr(self.model, category)):
                new = self._replaced(e, e.name)
                if isinstance(e, Body) and e.shape is not None:
                    new["shape"] = self._shapes(e)
                if new:
                    self.model.replace(dataclasses.replace(e, **new))
        self._gravity()

    def _replaced(self, e: Any, owner: str) -> dict[str, Any]:
        """Fields of an element, or of a body's shape, with parameters in place of numbers."""
        out = {}
        for field, unit in fields_with(type(e), Unit).items():
            value = getattr(e, field)
            if value is None or unit.dimension == "" or field in EXCLUDED_FIELDS:
                continue
            if isinstance(value, tuple) and len(value) > MAX_COMPONENTS:
                continue
            name = field_symbol_name(e, field)
            if isinstance(value, tuple) and all(isinstance(row, tuple) for row in value):
                new: Any = self._matrix(value, owner, name, unit.dimension)
            else:
                new = self._value(value, owner, name, unit.dimension)
            if new != value:
                out[field] = new
        return out

    def _matrix(self, rows: tuple, owner: str, field: str, dimension: str | None) -> tuple:
        """Points, or a symmetric matrix, whose mirrored entries are one parameter."""
        if field != "inertia":
            return tuple(self._value(row, owner, f"{field}_{k + 1}", dimension) for k, row in enumerate(rows))
        upper = {
            (i, j): self._value(rows[i][j], owner, f"{field}_{AXES[i]}{AXES[j]}", dimension)
            for i in range(3)
            for j in range(i, 3)
        }
        return tuple(tuple(upper[min(i, j), max(i, j)] for j in range(3)) for i in range(3))

    def _value(self, value: Any, owner: str, field: str, dimension: str | None) -> Any:
        if isinstance(value, tuple):
            names = [f"{field}_{AXES[k]}" for k in range(len(value))]
            return tuple(self._value(x, owner, n, dimension) for x, n in zip(value, names, strict=True))
        try:
            found = number(value, {}, dimension, field)
        except ModelError:  # an expression of parameters
            return value
        return self._parameter(f"{owner}.{field}", float(found), owner, dimension or "") if found != 0.0 else value

    def _parameter(self, name: str, value: float, owner: str, unit: str) -> str:
        parameter = "".join(c if c.isalnum() and c.isascii() else "_" for c in name) + OWNER_SUFFIX
        while parameter in self.model.parameters:
            parameter += "_"
        parameter = parameter if parameter[0].isalpha() else f"n_{parameter}"
        self.model.parameters[parameter] = value
        self.symbols[parameter] = Symbol(name, "parameter", _latex(name, owner), unit, owner)
        return parameter

    def _shapes(self, body: Body) -> Any:
        shapes = []
        for k, shape in enumerate(body.shapes()):
            owner = body.name if len(body.shapes()) == 1 else f"{body.name}.shape_{k + 1}"
            shapes.append(dataclasses.replace(shape, **self._replaced(shape, owner)))
        return tuple(shapes) if isinstance(body.shape, tuple) else shapes[0]

    def _gravity(self) -> None:
        """Gravity with one component: g, along or against the axis."""
        given = self.model.gravity
        if not isinstance(given, tuple):
            return
        values = []
        for x in given:
            try:
                values.append(float(number(x, {}, "m/s^2", "gravity")))
            except ModelError:
                return
        acting = [k for k, x in enumerate(values) if x != 0.0]
        new: list[Any] = list(given)
        for k in acting:
            single = len(acting) == 1
            size = abs(values[k]) if single else values[k]
            parameter = self._parameter("g" if single else f"g_{AXES[k]}", size, "", "m/s^2")
            new[k] = f"-{parameter}" if single and values[k] < 0.0 else parameter
        self.model.gravity = tuple(new)


def field_symbol_name(e: Any, field: str) -> str:
    """Symbol name of a field; a field named like a coordinate gets ``_drawn``."""
    if isinstance(e, Joint) and field in {c.offset for c in e.coordinates.values()}:
        return f"{field}_drawn"
    if isinstance(e, Body):
        return {"angle": "angle_drawn", "com": "offset"}.get(field, field)
    return field


def _latex(name: str, owner: str) -> str:
    if not owner:
        return name
    field = name.removeprefix(f"{owner}.")
    base, _, index = field.partition("_")
    letter = FIELD_LETTERS.get(base)
    if letter is None:
        return rf"\mathrm{{{field.replace('_', ' ')}}}_{{{latex_part_name(owner)}}}"
    return f"{letter}_{{{index + ',' if index else ''}{latex_part_name(owner)}}}"


NAME_CHOICES = ("parameters", "all", "none")


def symbolic(model: Model, o: SymbolicOptions) -> Equations:
    """Equations of motion as expressions: see `Mechanism.symbolic`."""
    refuse_unsupported(model, "symbolic", acts_while_sliding, controlled=True)
    refuse_sampled_controllers(model, "symbolic")
    if o.names not in NAME_CHOICES:
        raise ModelError(
            f"names is {o.names!r}{suggest(o.names, NAME_CHOICES)}; must be one of {', '.join(NAME_CHOICES)}"
        )
    plain: Model = model.snapshot()
    told: dict[str, Symbol] = {}
    if o.names == "all":
        numbered = ParametrizedModel(plain)
        plain, told = numbered.model, numbered.symbols
    if o.inputs:
        plain, inputs = with_inputs(plain, o.inputs)
        told |= {i.parameter: Symbol(i.name, "input", unit=i.unit) for i in inputs if i.parameter != i.name}
    plain = plain.snapshot()
    out = Equations(plain, choose_coordinates(plain, o.parameters, o.coordinates), o, told)
    out.described = model.snapshot()
    return out


@dataclass(frozen=True, kw_only=True)
class ExportOptions(AnalysisOptions):
    """Arguments of `Mechanism.export`."""

    folder: str | Path | None
    language: str
    functions: tuple[str, ...]
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    coordinates: str
    parameters: Mapping[str, float] | None
    name: str

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (self.folder is None or isinstance(self.folder, str | Path)):
            raise ModelError(f"folder is a path, not {self.folder!r}")


def export(model: Model, o: ExportOptions) -> Code:
    """Functions of a mechanism as code: see `Mechanism.export`."""
    asked = SymbolicOptions(coordinates=o.coordinates, inputs=o.inputs, parameters=o.parameters, names="parameters")
    return symbolic(model, asked).export(
        o.folder, language=o.language, functions=o.functions, outputs=o.outputs, name=o.name
    )
