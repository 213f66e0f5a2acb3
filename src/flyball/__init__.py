"""flyball: rigid-body mechanisms, described once, analysed in every way an engineer asks for."""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.4.0"

_HOME = {
    "Mechanism": "mechanism",
    "Body": "model.body",
    "Frame": "model.body",
    "Driver": "model.body",
    "Initial": "model.body",
    "Sensor": "model.sensor",
    "IMU": "model.sensor",
    "Table": "model.table",
    "load": "files",
    "PerformanceNotice": "errors",
    "StartWarning": "errors",
    "load_result": "files",
    "Result": "results.result",
    "FlyballError": "errors",
    "ModelError": "errors",
    "UnitError": "errors",
    "ExpressionError": "errors",
    "SingularOrientationError": "errors",
    "SingularOrientationWarning": "errors",
    "AnalysisError": "errors",
    "AssemblyError": "errors",
    "SimulationError": "errors",
    "MobilityError": "errors",
    "SingularityError": "errors",
    "NotConverged": "errors",
}
_ROOMS = ("model.shapes", "joints", "forces")
_MODULES = ("rotations",)


def __getattr__(name: str) -> Any:
    """Public names are imported when first asked for: shapes, joints and forces from the folders that hold them."""
    if name in _HOME:
        return getattr(importlib.import_module(f".{_HOME[name]}", __name__), name)
    if name in _MODULES:
        return importlib.import_module(f".{name}", __name__)
    if not name.startswith("_"):
        for room in _ROOMS:
            module = importlib.import_module(f".{room}", __name__)
            if hasattr(module, name) and isinstance(getattr(module, name), type):
                return getattr(module, name)
    raise AttributeError(f"module 'flyball' has no attribute {name!r}")


def __dir__() -> list[str]:
    from .model.element import Element

    for room in _ROOMS:
        importlib.import_module(f".{room}", __name__)
    rooms = tuple(f"{__name__}.{room}." for room in _ROOMS)
    elements = [k for k, c in Element.registry.items() if c.__module__.startswith(rooms)]
    return sorted({*_HOME, *_MODULES, *elements, "__version__"} - {"Solid"})
