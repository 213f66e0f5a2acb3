"""`Mechanism.symbolic` and `Mechanism.export`: options, choice of coordinates, and what each call returns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ..analysis_options import Options
from ..errors import ModelError
from ..expression_graph.graph import Symbol
from ..model.element_laws import with_inputs
from ..model.model import Model, suggest
from ..model.unsupported_elements import acts_while_sliding, refuse_sampled_controllers, refuse_unsupported
from .coordinates import choose_coordinates
from .equations import Equations, SymbolicOptions
from .export.code import Code
from .parametrized_model import ParametrizedModel

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
class ExportOptions(Options):
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
