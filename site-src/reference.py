"""The reference: one page for each kind of public name, made from ``dir(flyball)``; MkDocs calls it by `hooks`.

A page is a title, an introduction and the names that `_page_of` gives to it. Signatures and docstrings are those of the
source. A public name without a page is an error.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any

from uses import SIGNS, USES

import flyball as fb
from flyball.mechanism_methods import DesignMethods, MobilityMethods, MotionMethods, StaticsMethods, SymbolicMethods

PAGES = {  # name of the page: title, introduction
    "mechanism": (
        "Mechanism and files",
        "A mechanism holds the description. Its [analyses](analyses.md) are methods, listed on a page of their own.",
    ),
    "analyses": (
        "Analyses",
        "Methods of [`Mechanism`](mechanism.md). Most have a subcommand of `flyball` with the same options.",
    ),
    "bodies": (
        "Bodies, frames, drivers, sensors",
        "Points and axes are in world axes of the reference configuration, numbers in SI units and radians. Every "
        'number may also be a quantity such as `"5 mm"` or an expression of parameters. `"ground"` is the world.',
    ),
    "joints": (
        "Joints and couplings",
        "`body_i` and `body_j` are bodies or frames. A joint has a frame F on `body_i` and a frame M on `body_j`, with "
        "z along its axis; coordinates are those of M relative to F, zero in the reference configuration. Reactions "
        "act on `body_j`.",
    ),
    "forces": (
        "Forces",
        "Positive tension pulls two points together. A positive torque turns `body_j` about the joint's axis. A law is "
        "a number, an expression of time, coordinates, sensors and parameters, a table, or a Python function.",
    ),
    "stops": (
        "Stops, play and latches",
        "Elements that act on one side only or change their state at an instant. [Events](../events.md) shows how such "
        "instants are located and recorded.",
    ),
    "events": ("Events and actions", "What is done when a quantity crosses zero. See [events](../events.md)."),
    "contact": ("Contact", "Contact between the shapes of bodies. See [contact and friction](../contact.md)."),
    "controllers": (
        "Controllers",
        "They have states and signals that laws name. See [controllers](../controllers.md).",
    ),
    "vehicles": ("Vehicles", "Running gear by one call. See [tracked vehicles](../tracks.md)."),
    "shapes": (
        "Shapes",
        "Shapes give bodies their mass properties, collision geometry and look. Every shape takes the arguments of the "
        "base class as well:\n\n::: flyball.model.shapes.solid.Solid\n    options: {members: false, heading_level: 3}",
    ),
    "results": (
        "Results",
        "What analyses return. Values are in SI units and radians; times run along the first axis. Every result has "
        "`lines()`, `as_dict()` and a readable `print`.",
    ),
    "equations": (
        "Symbolic equations and code",
        "What `m.symbolic()` and `m.export()` return. See [equations as expressions](../symbolic.md).",
    ),
    "stepping": (
        "Array functions and stepper",
        "The equations of motion as functions of arrays, and a mechanism that another program advances.",
    ),
    "errors": (
        "Errors and warnings",
        "Every error is a `FlyballError`. `ModelError` and its kinds concern the description, `AnalysisError` and its "
        "kinds what was computed.",
    ),
    "modules": (
        "Modules and version",
        "`flyball.elements`, `flyball.rotations`, `flyball.testing`, `flyball.__version__`.",
    ),
}
_BY_MODULE = {  # the beginning of a module's name: page
    "flyball.mechanism": "mechanism",
    "flyball.studies": "mechanism",
    "flyball.model.body": "bodies",
    "flyball.model.controller": "bodies",
    "flyball.model.table": "bodies",
    "flyball.model.contact": "contact",
    "flyball.model.event": "events",
    "flyball.model.shapes": "shapes",
    "flyball.simulation.integration_options": "contact",
    "flyball.simulation.stepper": "stepping",
    "flyball.kinematics.prepared": "stepping",
    "flyball.joints": "joints",
    "flyball.model.roads.road": "bodies",
    "flyball.model.roads.random_road": "bodies",
    "flyball.model.roads.opencrg": "bodies",
    "flyball.controllers": "controllers",
    "flyball.results": "results",
    "flyball.vehicles": "vehicles",
    "flyball.assembly": "results",
    "flyball.symbolic": "equations",
    "flyball.errors": "errors",
}
_MEMBERS = {"results", "equations", "stepping", "errors"}  # pages of classes whose methods are listed, not their making
_OF_MECHANISM = "[save, add, replace, changed, copy, elements, find, names, gravity_vector]"
_FAMILIES = {  # mixin of Mechanism: heading
    MobilityMethods: "Freedoms, assembly, masses",
    MotionMethods: "Motion",
    StaticsMethods: "Equilibria, linear models, modes",
    DesignMethods: "What a number changes",
    SymbolicMethods: "Equations",
}


def _page_of(name: str) -> str:
    value = getattr(fb, name)
    if inspect.ismodule(value) or name == "__version__":
        return "modules"
    if value.__module__.startswith("flyball.forces"):
        return "stops" if value in fb.forces.LIMITS else "forces"
    return next(page for module, page in _BY_MODULE.items() if value.__module__.startswith(module))


def _first_line(value: Any) -> str:
    return (inspect.getdoc(value) or "").split("\n\n")[0].replace("\n", " ").split(". ")[0].rstrip(".")


def _entry(value: Any, level: int = 2, name: str = "", **options: Any) -> str:
    """Return the directive for an object, by the place where it is defined; ``name`` is an anchor besides."""
    path = value.__name__ if inspect.ismodule(value) else f"{value.__module__}.{value.__qualname__}"
    said = "".join(f"        {k}: {str(v).lower() if isinstance(v, bool) else v}\n" for k, v in options.items())
    anchor = f"[](){{ #flyball.{name} }}\n\n" if name else ""
    return f"{anchor}::: {path}\n    options:\n        heading_level: {level}\n{said}"


def _use(name: str) -> str:
    """Return a line of use, and signs, to stand below an entry."""
    signs = f"\n**Signs.** {SIGNS[name]}\n" if name in SIGNS else ""
    return f"{signs}\n```python\n{USES[name]}\n```\n" if name in USES else ""


def _methods() -> Iterator[tuple[type, str]]:
    for family in _FAMILIES:
        yield from ((family, name) for name in vars(family) if not name.startswith("_"))


def _method_rows() -> Iterator[str]:
    for family, name in _methods():
        anchor = f"analyses.md#flyball.mechanism_methods.{family.__name__}.{name}"
        yield f"| [`m.{name}`]({anchor}) | {_first_line(getattr(family, name))} |\n"


def _analyses() -> Iterator[str]:
    for family, heading in _FAMILIES.items():
        yield f"## {heading}\n"
        for name in (name for f, name in _methods() if f is family):
            yield f"::: flyball.mechanism_methods.{family.__name__}.{name}\n    options: {{heading_level: 3}}\n"


def _modules() -> Iterator[str]:
    yield f'<a id="flyball.__version__"></a>\n\n## Version\n\n`flyball.__version__`, here `{fb.__version__}`.\n'
    for module in (fb.elements, fb.rotations, fb.testing):
        yield _entry(module, show_root_full_path=True, members=False)
        names = [k for k in dir(module) if not k.startswith("_") and not inspect.ismodule(getattr(module, k))]
        values = {k: getattr(module, k) for k in names if k != "annotations"}
        documented = {k: v for k, v in values.items() if str(getattr(v, "__module__", "")).startswith("flyball.")}
        if plain := [f"`{k}`" for k in values if k not in documented]:
            yield f"Types of fields and constants: {', '.join(plain)}.\n"
        for v in documented.values():
            if inspect.isclass(v) or inspect.isfunction(v):
                options = {} if module is fb.elements and inspect.isclass(v) else {"members": False}
                yield _entry(v, 3, **options)


def pages() -> dict[str, str]:
    """Return the text of each page of the reference by its path."""
    names: dict[str, list[str]] = {page: [] for page in PAGES}
    for name in dir(fb):
        names[_page_of(name)].append(name)
    out, contents = {}, []
    for page, (title, introduction) in PAGES.items():
        parts = [f"# {title}\n\n{introduction}\n"]
        if page == "analyses":
            parts += _analyses()
        elif page == "modules":
            parts += _modules()
        else:
            listed = (
                {"inherited_members": True, "merge_init_into_class": False} if page in _MEMBERS else {"members": False}
            )
            for name in names[page]:
                more = {"members": _OF_MECHANISM, "inherited_members": True} if name == "Mechanism" else dict(listed)
                if page == "errors":
                    more["show_bases"] = True
                parts.append(_entry(getattr(fb, name), name=name, **more) + _use(name))
        out[f"reference/{page}.md"] = "\n".join(parts)
        rows = "".join(f"| [`{k}`]({page}.md#flyball.{k}) | {_first_line(getattr(fb, k))} |\n" for k in names[page])
        if page == "analyses":
            rows = "".join(_method_rows())
        contents.append(f"## [{title}]({page}.md)\n" + (f"\n| name | |\n|---|---|\n{rows}" if rows else ""))
    out["reference/index.md"] = "# Reference\n\nEvery public name of `import flyball as fb`.\n\n" + "\n".join(contents)
    return out
