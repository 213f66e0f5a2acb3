"""The house keeps its plan (docs/architecture.md): imports point one way, files stay small, elements are one file."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import inspect
import re
import statistics
import sys
from pathlib import Path

import pytest

import flyball as fb
from flyball.compiler.formulas import compiled_files
from flyball.model.element import Element
from tests.program.copied import PACKAGE

FILES = sorted(PACKAGE.rglob("*.py"))


class Trees(dict[Path, ast.Module]):
    """Each file read when it is asked for: a process that only collects the tests reads none."""

    def __missing__(self, path: Path) -> ast.Module:
        self[path] = ast.parse(path.read_text(encoding="utf-8"))
        return self[path]


TREES = Trees()
LEAF = {"errors", "__version__"}  # may be used anywhere
LAYERS = (  # from the foundation up: a package imports, when it is imported, only those in lines above its own
    "compiler docstrings",
    "math",
    "numerics rotations collision",
    "constraints",
    "model",
    "joints forces controllers elements laws analysis_options progress",
    "tables",
    "engine",
    "results expression_graph robots",
    "assembly codegen",
    "mobility",
    "derivatives",
    "simulation",
    "kinematics check statics singularities",
    "linear",
    "sensitivity studies symbolic",
    "view",
    "live",
    "mechanism_methods",
    "mechanism cli",
    "vehicles",
    "testing __init__ __main__",
)
LAYER = {name: k for k, line in enumerate(LAYERS) for name in line.split()}
STANDS_ALONE = {  # these import no more than this of what is below them
    "math": {"compiler"},
    "numerics": {"compiler", "math"},
    "collision": {"compiler", "math"},
    "constraints": {"compiler", "math", "numerics"},
    "rotations": {"math"},
    "model": {"docstrings", "math", "constraints", "rotations"},
    "joints": {"compiler", "math", "constraints", "model"},
    "forces": {"compiler", "math", "numerics", "constraints", "model"},
    "controllers": {"compiler", "math", "model"},
    "laws": {"compiler", "math", "model"},
    "cli": {"docstrings", "mechanism_methods"},
    "mechanism": {"mechanism_methods", "model"},
}
LATER = {  # imports inside functions of what stands above: methods that lead from a thing to what is done with it
    "__init__": {"model"},
    "assembly": {"mobility"},
    "cli": {"compiler", "live", "mechanism", "model", "simulation", "view"},
    "controllers": {"expression_graph"},
    "derivatives": {"simulation"},
    "mechanism": {"results", "robots", "view"},
    "mechanism_methods": set(LAYER),
    "results": {"view"},
    "statics": {"linear"},
    "symbolic": {"view"},
}


def imports(path: Path, tree: ast.Module):
    """(room, line, whether inside a function) of every import of the house; those for type checkers are left out."""
    package = path.relative_to(PACKAGE).parts[:-1]

    def walk(node: ast.AST, later: bool):
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
                continue
            if isinstance(child, ast.ImportFrom) and child.level:
                base = package[: len(package) - child.level + 1]
                module = tuple(child.module.split(".")) if child.module else ()
                for name in [module] if module else [(a.name,) for a in child.names]:
                    yield (*base, *name)[0], child.lineno, later
            elif isinstance(child, (ast.Import, ast.ImportFrom)):
                names = [child.module] if isinstance(child, ast.ImportFrom) else [a.name for a in child.names]
                assert not any((n or "").split(".")[0] == "flyball" for n in names), f"{path}: use relative imports"
            yield from walk(child, later or isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef)))

    return walk(tree, False)


def room(path: Path) -> str:
    first = path.relative_to(PACKAGE).parts[0]
    return first.removesuffix(".py")


@pytest.mark.parametrize("own", sorted({room(p) for p in FILES} - LEAF))
def test_imports_point_one_way(own):
    assert own in LAYER, f"a new package {own!r}: say here on which layer it stands"
    below = {name for name, k in LAYER.items() if k < LAYER[own]}
    allowed = {own} | LEAF | STANDS_ALONE.get(own, below)
    for path in (p for p in FILES if room(p) == own):
        for target, line, later in imports(path, TREES[path]):
            known = allowed | (LATER.get(own, set()) | below if later and own not in STANDS_ALONE else set())
            known |= LATER.get(own, set()) if later else set()
            assert target in known, f"{path}, line {line}: {own} must not import {target}"


def test_every_package_is_in_the_documentation():
    """Each stands in the table of docs/architecture.md, below all that it imports at once."""
    text = (PACKAGE.parents[1] / "docs" / "architecture.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1] for line in text.splitlines() if line.startswith("| `")]
    order = [name.removesuffix("/").removesuffix(".py") for row in rows for name in re.findall(r"`([\w./]+)`", row)]
    packages = {room(p) for p in FILES} - LEAF - {"__init__", "__main__"}
    assert packages <= set(order)
    layers = [LAYER[name] for name in order if name in packages]
    assert layers == sorted(layers)


MODULES = {".".join(p.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__"): p for p in FILES}


def named_imports(module: str):
    """(file, name or None) of every import of the house, those inside functions too, those for type checkers not."""
    path = MODULES[module]
    package = path.relative_to(PACKAGE).parts[:-1]
    hints = [n for n in ast.walk(TREES[path]) if isinstance(n, ast.If) and "TYPE_CHECKING" in ast.unparse(n.test)]
    skipped = {id(n) for h in hints for branch in h.body for n in ast.walk(branch)}
    for node in ast.walk(TREES[path]):
        if isinstance(node, ast.ImportFrom) and node.level and id(node) not in skipped:
            base = ".".join([*package[: len(package) - node.level + 1], *(node.module or "").split(".")]).strip(".")
            for alias in node.names:
                inner = f"{base}.{alias.name}".strip(".")
                if inner in MODULES:
                    yield inner, None
                elif base in MODULES:
                    yield base, alias.name


def circles(arrows: dict[str, set[str]]) -> list[set[str]]:
    """Sets of files that lead to one another."""
    reached: dict[str, set[str]] = {}
    for start in arrows:
        seen, left = set(), [start]
        while left:
            new = arrows[left.pop()] - seen
            seen |= new
            left += new
        reached[start] = seen
    found = [{b for b in reached[a] if a in reached[b]} for a in arrows if a in reached[a]]
    return [c for k, c in enumerate(found) if c not in found[:k]]


def test_imports_make_no_circle():
    """Those inside functions count as well: a circle hides that two files are one."""
    arrows = {m: {target for target, _ in named_imports(m)} - {m, ""} for m in MODULES}
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == [{"b", "c"}]
    assert circles(arrows) == []


def test_private_names_stay_in_their_file():
    taken = {(m, name) for m in MODULES for _, name in named_imports(m) if (name or "").startswith("_")}
    assert {x for x in taken if not x[1].startswith("__")} == set()


def test_private_members_stay_in_their_file():
    """What a class of another file keeps to itself is not reached through its objects."""

    def private(name: str) -> bool:
        return name.startswith("_") and not name.startswith("__")

    def made(tree: ast.AST) -> set[str]:
        """Private names that a file gives: functions, and attributes set on objects of its own."""
        functions = {n.name for n in ast.walk(tree) if isinstance(n, (ast.FunctionDef, ast.ClassDef))}
        own = {
            n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute) and ast.unparse(n.value) in ("self", "cls")
        }
        fields = {
            n.target.id for n in ast.walk(tree) if isinstance(n, ast.AnnAssign) and isinstance(n.target, ast.Name)
        }
        return {x for x in functions | own | fields if private(x)}

    made_in = {p: made(TREES[p]) for p in FILES}
    ours = set().union(*made_in.values()) - {"_replace", "_asdict"}  # those of named tuples are public
    for path in FILES:
        for node in ast.walk(TREES[path]):
            if (
                isinstance(node, ast.Attribute)
                and private(node.attr)
                and ast.unparse(node.value) not in ("self", "cls")
            ):
                foreign = node.attr in ours - made_in[path]
                assert not foreign, f"{path.name}, line {node.lineno}: {ast.unparse(node)} is private to another file"


@pytest.mark.parametrize("own", ["math", "numerics", "constraints", "rotations"])
def test_formulas_and_solvers_stand_on_numpy_alone(own):
    """What they import at once is the standard library and NumPy; SciPy and Numba come when something asks for them."""
    for path in FILES:
        if room(path) == own:
            for node in TREES[path].body:
                if isinstance(node, (ast.Import, ast.ImportFrom)) and not getattr(node, "level", 0):
                    names = [node.module] if isinstance(node, ast.ImportFrom) else [a.name for a in node.names]
                    for name in names:
                        assert name.split(".")[0] in {*sys.stdlib_module_names, "numpy"}, f"{path.name} imports {name}"


def test_compiled_code_is_made_of_stamped_files():
    """What formulas and kernels name comes from files whose edits the cache notices."""
    known = compiled_files() | set((PACKAGE / "compiler").glob("*.py"))
    for path in FILES:
        tree = TREES[path]
        marked = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)]
        marked = [n for n in marked if {ast.unparse(d) for d in n.decorator_list} & {"formula", "kernel"}]
        if not marked:
            continue
        assert path in known, f"{path} holds compiled code: add it to sources.COMPILED"
        used = {n.id for f in marked for n in ast.walk(f) if isinstance(n, ast.Name)}
        for node in tree.body:
            if isinstance(node, ast.ImportFrom) and node.level and used & {a.asname or a.name for a in node.names}:
                base = path.parents[node.level - 1].joinpath(*(node.module or "").split("."))
                named = [base / a.name for a in node.names if (a.asname or a.name) in used]
                for place in (base, *(n for n in named if not base.with_suffix(".py").is_file())):
                    file = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
                    told = not file.is_file() or file in known or file == PACKAGE / "__init__.py"
                    assert told, f"{path}: {sorted(used)} of {file}"


def test_only_dispatch_lists_kinds():
    """Elements are found by registry: no other file names one but formats, vehicles and the live page, which add some."""
    names = {c.__name__ for c in fb.Body.registry.values() if c.category in ("joints", "forces")}
    names = {n for n in names if Element.registry[n].__module__.startswith(("flyball.joints.", "flyball.forces."))}
    for path in FILES:
        if (
            room(path)
            not in (
                "joints",
                "forces",
                "constraints",
                "model",
                "elements",
                "robots",
                "vehicles",
                "testing",
                "view",
                "live",
                "__init__",
            )
            and path.name != "element_dispatch.py"
        ):
            used = {n.id for n in ast.walk(TREES[path]) if isinstance(n, ast.Name)}
            assert not used & names, f"{path.name} names {used & names}"


def code_lines(tree: ast.Module) -> int:
    """Lines of code, without comments and docstrings."""
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef)
    docs = [n.body[0] for n in ast.walk(tree) if isinstance(n, documented) and ast.get_docstring(n)]
    lines = {k for n in ast.walk(tree) if hasattr(n, "lineno") for k in (n.lineno, n.end_lineno)}
    return len(lines - {k for d in docs for k in range(d.lineno, d.end_lineno + 1)})


def test_files_stay_small():
    """Of what is read together; and few of them are crumbs."""
    lines = {p: code_lines(TREES[p]) for p in FILES}
    assert {str(p.relative_to(PACKAGE)): n for p, n in lines.items() if n > 600} == {}
    assert 80 < statistics.median(lines.values()) < 200
    one_element_each = {"joints", "forces", "controllers", "constraints", "shapes", "special_pairs", "tyres", "roads"}
    assert sum(not one_element_each & set(p.parts) for p in FILES) < 400


def own_lines(function: ast.FunctionDef) -> int:
    """Lines of a function, its docstring and functions inside it not counted."""
    inner: list[ast.stmt] = [n for n in ast.walk(function) if isinstance(n, ast.FunctionDef) and n is not function]
    if ast.get_docstring(function):
        inner.append(function.body[0])
    taken = {line for n in inner for line in range(n.lineno, n.end_lineno + 1)}
    return len(set(range(function.lineno, function.end_lineno + 1)) - taken)


def test_functions_stay_small():
    long = {
        f"{p.name}: {n.name}": own_lines(n)
        for p in FILES
        for n in ast.walk(TREES[p])
        if isinstance(n, ast.FunctionDef) and own_lines(n) > 60
    }
    assert long == {}


def test_public_names():
    """Every public name is there, says what it is, and is found by completion; heavy imports come when needed."""
    names = [n for n in dir(fb) if not n.startswith("_")]
    assert {"Mechanism", "Body", "Revolute", "SpringDamper", "Driver", "load", "AssemblyError"} <= set(names)
    for name in names:
        doc = inspect.getdoc(getattr(fb, name))
        assert doc, f"fb.{name} has no docstring"
        assert doc[0].isupper() or doc.startswith("``"), f"fb.{name}: {doc!r}"
    with pytest.raises(AttributeError, match="has no attribute 'Revolut'"):
        fb.Revolut  # noqa: B018


def test_everything_public_is_documented():
    """Modules, and what they and their classes offer under a name without an underscore."""
    missing = []
    for path in FILES:
        tree = TREES[path]
        parts: list[ast.AST] = [tree]
        for node in tree.body:
            if isinstance(node, (ast.ClassDef, ast.FunctionDef)) and not node.name.startswith("_"):
                parts.append(node)
                if isinstance(node, ast.ClassDef):
                    parts += [n for n in node.body if isinstance(n, ast.FunctionDef) and not n.name.startswith("_")]
        missing += [f"{path.name}: {getattr(n, 'name', 'the module')}" for n in parts if not ast.get_docstring(n)]
    assert missing == []


def test_parameters_of_elements_are_documented():
    """Every field that a user may give stands in the docstring of its element, or of the one that it extends."""
    missing = []
    for name in dir(fb):
        cls = getattr(fb, name)
        if isinstance(cls, type) and dataclasses.is_dataclass(cls) and hasattr(cls, "category"):
            text = " ".join(c.__doc__ or "" for c in cls.__mro__[:-1])
            shared = {"at", "axis"} if cls.category == "joints" else {"name"}  # of all joints, needed by some
            missing += [
                f"{name}.{f.name}"
                for f in dataclasses.fields(cls)
                if not re.search(rf"\b{f.name}\b", text) and f.name not in shared
            ]
    assert missing == []


def test_every_joint_is_one_file_and_one_export():
    joints = importlib.import_module("flyball.joints")
    lines = [
        x for x in (PACKAGE / "joints" / "__init__.py").read_text(encoding="utf-8").splitlines() if x.startswith("from")
    ]
    files = {p.stem for p in (PACKAGE / "joints").glob("*.py")} - {"__init__"}
    assert {x.split()[1].removeprefix(".") for x in lines} == files
    assert all(hasattr(joints, x.split()[-1]) for x in lines)


def test_every_element_is_in_the_reference():
    """docs/elements.md names every element a user can add, and none that does not exist."""
    text = (PACKAGE.parents[1] / "docs" / "elements.md").read_text(encoding="utf-8")
    told = set(re.findall(r"`([A-Z]\w+)", text))
    elements = {n for n in dir(fb) if isinstance(getattr(fb, n), type) and issubclass(getattr(fb, n), Element)}
    assert elements - told == {"Body", "Frame", "Initial", "Driver"} - told
    assert {n for n in told if not hasattr(fb, n)} == set()
