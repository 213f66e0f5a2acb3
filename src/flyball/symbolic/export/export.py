"""`Mechanism.export`: equations of a mechanism as code."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ...analysis_options import Options
from ...errors import ModelError
from ...model.model import Model
from ..derivation import symbolic
from ..equations import SymbolicOptions
from .code import Code


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
