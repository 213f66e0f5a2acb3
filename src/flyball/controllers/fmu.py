"""FMU: a functional mock-up unit of another program as a sampled controller."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import KW_ONLY, field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator

from ..errors import ModelError
from ..model.controller import Controller, ControlState, refuse_equal
from ..model.element import LawOf, NamedLaws, Number, Unit, element, nonnegative, python_data
from ..model.expression_parser import FunctionCall, SyntaxNode
from ..model.linked_files import FilePath, LinkedFile
from ..model.quantities import refuse_other_unit
from .unit_instance import GROUP, Given, Read, Time, UnitCoupling, UnitDescription, described

if TYPE_CHECKING:
    from ..model.model import Model


def _plain(name: str) -> str:
    """Return the name of a unit's variable as a plain word."""
    return re.sub(r"^(?=\d)|\W", "_", name)


def _named(value: Any) -> Any:
    """Return names of signals with variables of the unit, as pairs."""
    if isinstance(value, str):
        value = (value,)
    if isinstance(value, Mapping):
        return tuple(value.items())
    value = python_data(value)
    return tuple((_plain(x), x) if isinstance(x, str) else x for x in value) if isinstance(value, tuple) else value


Names = Annotated[
    tuple[tuple[str, str], ...],
    BeforeValidator(_named, json_schema_input_type=str | tuple[str, ...] | dict[str, str]),
]


@element
class FMU(LinkedFile, Controller):
    """A functional mock-up unit (FMI 2 or 3, co-simulation) as a sampled controller: a model of another program.

    At each instant the unit has been integrated from the instant before with the inputs of that instant; then it gets
    the present inputs, and its outputs are read, which laws name: ``"engine.torque"``. Every motion has an instance of
    its own.

    Parameters
    ----------
    name : str
    path : str
        The unit, a ``.fmu`` file. A relative path refers to the folder of the model file, or to the current folder.
    inputs : mapping
        Expressions by the unit's input variables: of ``t``, parameters, sensors, curves such as ``A.rate``, and
        controllers. In SI units, converted to those that the unit states. Inputs that are left out keep the unit's
        start values.
    outputs : list of str, or mapping, optional
        Variables of the unit that laws and results name; by default its outputs. Names are those of the variables,
        with ``_`` in place of other characters; or given: ``{"torque": "shaft.tau"}``.
    parameters : mapping
        Values, in SI units, of the unit's parameters and of other variables that have a start value: numbers or
        expressions of parameters of the mechanism.
    period, offset : number [s]
        Communication points: offset, offset + period, ...; outputs are constant in between.
    tolerance : number, optional
        Relative tolerance of the unit's own integrator; the unit's default if not given.

    Notes
    -----
    Signals are the outputs and the inputs; the state ``time`` is the unit's time. Outputs that do not depend on inputs
    by the unit's description do not depend on them at the same instant here either, so that units may form loops.
    """

    path: FilePath = field(kw_only=False)
    _: KW_ONLY
    inputs: NamedLaws = ()
    outputs: Names = ()
    parameters: NamedLaws = ()
    tolerance: Annotated[Number | None, Unit("1")] = None

    __eq__, __hash__ = LinkedFile.__eq__, LinkedFile.__hash__

    @property
    def unit(self) -> UnitDescription:
        """Return the unit's description."""
        return described(str(self.file), self.title)

    @property
    def named(self) -> tuple[tuple[str, str], ...]:
        """Return outputs: names of signals with variables of the unit."""
        return self.outputs or tuple((_plain(x), x) for x in self.unit.names("output"))

    @property
    def output_names(self) -> tuple[str, ...]:
        """Return the names of the outputs."""
        return tuple(name for name, _ in self.named)

    @property
    def coupling(self) -> UnitCoupling:
        """Return how the unit takes part in a motion."""
        parameters, inputs = (tuple(name for name, _ in x) for x in (self.parameters, self.inputs))
        tolerance = None if self.tolerance is None else float(self.tolerance)
        return UnitCoupling(self.title, str(self.file), parameters, inputs, tuple(x for _, x in self.named), tolerance)

    def check(self, n: SimpleNamespace) -> None:
        """Refuse a unit that cannot be used, and variables that it does not have."""
        super().check(n)
        nonnegative(self, n, "tolerance")
        if not self.path:
            raise ModelError(f"{self.title}: give the path of an FMU (.fmu)")
        if self.period is None:
            raise ModelError(f"{self.title}: give period=..., the time between two communication points")
        if isinstance(self.tolerance, str):
            raise ModelError(f"{self.title}: tolerance is {self.tolerance!r}; give a number")
        for role, pairs in (("input", self.inputs), ("parameter", self.parameters)):
            for name, count in Counter(name for name, _ in pairs).items():
                if count > 1:
                    raise ModelError(f"{self.title}: {role} {name!r} is given twice; leave one out")
                self._check_use(name, role)
        for name, variable in self.outputs:
            if self.unit.variable(variable, "output", self.title).causality == "input":
                raise ModelError(f"{self.title}: output {name!r} is the input {variable!r} of the unit; leave it out")
        if not self.named:
            raise ModelError(f"{self.title}: the unit has no real outputs; name variables of it in outputs=")
        refuse_equal(self, (*self.output_names, *(_plain(name) for name, _ in self.inputs), "time"))

    def _check_use(self, name: str, role: str) -> None:
        """Refuse a variable of the unit that is no input, or no parameter or start value."""
        v = self.unit.variable(name, role, self.title)
        if role == "input" and v.causality != "input":
            use = "give it in parameters=" if v.causality == "parameter" else "name it in outputs="
            raise ModelError(
                f"{self.title}: {name!r} is no input of the unit: its causality is {v.causality or 'local'}; {use}"
            )
        start = v.causality == "parameter" or (v.causality != "input" and v.initial in ("exact", "approx"))
        if role == "parameter" and (not start or v.variability == "constant"):
            what = "an input: give it in inputs=" if v.causality == "input" else "computed by the unit: leave it out"
            raise ModelError(f"{self.title}: {name!r} has no start value that can be set; it is {what}")

    def examine(self, model: Model) -> None:
        """Refuse inputs and parameters in other units than those of the unit."""
        for pairs in (self.inputs, self.parameters):
            for name, law in pairs:
                unit = self.unit.variables[name].unit
                where = f"{name} of {self.title}"
                model.law(law, LawOf(unit or None, curves=True), where)
                refuse_other_unit(model, law, unit, where)
        for name, law in self.parameters:
            found = model.law(law, LawOf(None, curves=True), f"{name} of {self.title}")
            if extra := sorted(found.names - set(model.parameters)):
                raise ModelError(
                    f"{self.title}: parameter {name!r} depends on {extra[0]!r}; it may depend on parameters of the "
                    f"mechanism only: give a variable quantity as an input"
                )

    def signal_units(self) -> dict[str, str]:
        """Return the SI units of outputs, inputs and the time."""
        pairs = (*self.named, *((_plain(x), x) for x, _ in self.inputs))
        return {name: self.unit.variables[x].unit for name, x in pairs} | {"time": "s"}

    def given(self) -> dict[str, Any]:
        """Return period, parameters and inputs."""
        out: dict[str, Any] = {"value_0": self.period}
        pairs = (*self.parameters, *self.inputs)
        return out | {f"value_{k}": law for k, (_, law) in enumerate(pairs, 1)}

    def called(self, given: str) -> str:
        """Return the name of an input or parameter."""
        k = int(given.rpartition("_")[2])
        names = ("period", *(name for name, _ in (*self.parameters, *self.inputs)))
        return names[k]

    def signals(self) -> dict[str, str]:
        """Return outputs and inputs."""
        first = 1 + len(self.parameters)
        out = {name: f"unit_output_{k}" for k, name in enumerate(self.output_names)}
        return out | {_plain(name): f"value_{first + k}" for k, (name, _) in enumerate(self.inputs)}

    def states(self, n: SimpleNamespace) -> tuple[ControlState, ...]:
        """Return the unit's time, which changes when the unit has all inputs of an instant."""
        return (ControlState("time", "unit_time"),)

    def derived(self, name: str, wiring: Any) -> SyntaxNode | None:
        """Return a call of the unit: it gets parameters and inputs, and returns an output."""
        what, _, k = name.rpartition("_")
        if name == "unit_time":
            return self._called(Time(self.coupling), wiring, True, "time")
        if what == "unit_output":
            variable = self.named[int(k)][1]
            independent = variable in self.unit.known_first
            return self._called(Read(self.coupling, int(k)), wiring, not independent, f"output {variable!r}")
        return None

    def _called(self, function: Any, wiring: Any, with_inputs: bool, what: str) -> SyntaxNode:
        """Return a call with the time, after calls that pass the values."""
        where = f"{what} of {self.title}"
        known = 1 + len(self.parameters)
        own = [_plain(name) for name, _ in self.inputs] if with_inputs else []
        texts = [*(f"value_{k}" for k in range(known)), *own]
        at = SyntaxNode("name", (), "t")
        for first in range(0, len(texts), GROUP):
            part = texts[first : first + GROUP]
            names = ("t", *(self.called(x) if x.startswith("value_") else x for x in part))
            values = (wiring.template(self, text) for text in part)
            call = FunctionCall(Given(function.memory, first), names, self.path or "", where)
            at = SyntaxNode("called", (at, *values), call)
        return SyntaxNode("called", (at,), FunctionCall(function, ("t",), self.path or "", where))
