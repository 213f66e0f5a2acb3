"""Subcommands made from methods of `Mechanism`: options, types, defaults and help are those of the method's arguments.

The model file is loaded, parameters are changed (``--set``) and parts are left out (``--without``). The function of a
subcommand only prints and writes results. It takes the `Request`; its keyword-only arguments are the options that the
method does not have.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_type_hints

from ..docstrings import argument_help, first_doc_line
from ..errors import ModelError
from .application import (
    AsJson,
    ExcludedParts,
    ModelFile,
    ParameterChanges,
    app,
    make_folder,
    print_json,
    print_table,
    report_errors,
    show_notices,
)
from .options import Option, OptionOverride, make_options, refuse_duplicate

if TYPE_CHECKING:
    from ..mechanism import Mechanism


def load_mechanism(path: Path) -> Mechanism:
    """Load the mechanism of a model file."""
    from ..mechanism import load

    return load(path)


def set_parameters(mechanism: Mechanism, changes: Sequence[str]) -> None:
    """Set new values of parameters, and repeat all checks that depend on them."""
    from ..model.model import listing, suggest

    given: dict[str, str] = {}
    for text in changes:
        name, equals, value = (x.strip() for x in text.partition("="))
        if not equals or not value:
            raise ModelError(f"--set {text!r}: write name=value, for instance --set mass=2 or --set speed='120 rpm'")
        refuse_duplicate(given, name, "--set", text)
        given[name] = value
        known = list(mechanism.parameters)
        if name not in known:
            problem = f"{mechanism.name!r} has no parameter {name!r}{suggest(name, known)}"
            raise ModelError(f"--set {text!r}: {problem}; {listing(known) if known else 'it has none'}")
        try:
            new: float | str = float(value)
        except ValueError:
            new = value
        try:
            mechanism.environment({name: new})
        except ModelError as error:
            raise type(error)(f"--set {text!r}: {error}") from None
        mechanism.parameters[name] = new
    if changes:
        env = mechanism.environment()
        for e in mechanism.elements():
            mechanism.validate(e, env)


def leave_out_parts(mechanism: Mechanism, names: Sequence[str]) -> Mechanism:
    """Return the mechanism without the parts of these names, or of these kinds (``events``, ``limits``, ...).

    Raises
    ------
    ModelError
        If there is no part of that name, or a remaining part refers to one that is left out.
    """
    from ..model.model import CATEGORIES, suggest

    if not names:
        return mechanism
    kinds = [k for k in CATEGORIES if getattr(mechanism, k)]
    parts = {e.name: None for name in names if name in kinds for e in getattr(mechanism, name)}
    for name in (n for n in names if n not in kinds):
        if name not in mechanism.by_name:
            known = suggest(name, [*mechanism.by_name, *kinds])
            raise ModelError(
                f"--without {name!r}: {mechanism.name!r} has no such part{known}; kinds: {', '.join(kinds)}"
            )
        parts[name] = None
    left = mechanism.changed(parts)
    env = left.environment()
    for e in left.elements():
        left.validate(e, env)
    return left


COMMON_ARGUMENTS = ("self", "parameters", "progress")  # parameters are set by --set


@dataclass
class Request:
    """One call of a subcommand: the mechanism, the method, its arguments, and where the output goes."""

    mechanism: Mechanism
    method: str
    given: dict[str, Any]
    source: Path
    as_json: bool
    load: Callable[[], Mechanism]  # reads the mechanism again, with the same changes
    files: list[str] = field(default_factory=list)

    def run_analysis(self, **more: Any) -> Any:
        """Run the analysis and return its result, with additional or changed arguments if given."""
        return getattr(self.mechanism, self.method)(**self.given | more)

    def rest(self, equilibrium: bool, turning: Sequence[str] | None) -> None:
        """Return the equilibrium, or the steady motion, nearest to the reference configuration."""
        if equilibrium or turning:
            t = self.given.pop("t", 0.0)
            self.given["about"] = self.mechanism.equilibrium(t=t, turning=turning or ())

    def folder(self, out: Path | None, suffix: str) -> Path:
        """Create and return the output folder: as given, or named after the model."""
        found = out if out is not None else Path(f"{self.source.stem}-{suffix}")
        make_folder(found)
        return found

    def write(self, path: Path | None, write: Callable[[Path], Any]) -> None:
        """Write a file if its path was given."""
        if path is not None:
            write(path)
            self.files.append(str(path))

    def print_result(self, found: Any, data: Mapping[str, Any] | None = None) -> None:
        """Print a result and the list of written files, as lines or as one JSON object."""
        if self.as_json:
            told = dict(found.as_dict() if data is None else data)
            print_json(told | {"files": self.files})
        else:
            print_table([*found.lines(), *(("written", f) for f in self.files)])


Conclusion = Callable[..., None]


def command(
    method: Callable,
    *,
    name: str = "",
    overrides: Mapping[str, OptionOverride] | None = None,
    without: Sequence[str] = (),
) -> Callable[[Conclusion], Conclusion]:
    """Make a subcommand of a method. The decorated function gets the `Request`; it prints and writes the result.

    Parameters
    ----------
    method : function
        Of a class of `flyball.mechanism_methods`.
    name : str
        Of the subcommand; the method's if not given.
    overrides : mapping of str to OptionOverride
        Arguments whose option differs from what their type implies.
    without : sequence of str
        Arguments that are not options.
    """

    def register(conclude: Conclusion) -> Conclusion:
        arguments = inspect.signature(method).parameters
        asked = {k: p for k, p in arguments.items() if k not in (*COMMON_ARGUMENTS, *without)}
        known = make_options(asked, argument_help(method), overrides or {})
        extra = _extra_options(conclude)

        def run(**words: Any) -> None:
            with report_errors(words["as_json"]):
                load = partial(_load_changed, words["model"], words["without"] or [], words["change"] or [])
                mechanism = load()
                given = {o.name: o.read(words[o.name]) for o in known if _is_given(words[o.name], o)}
                if "progress" in arguments:
                    given["progress"] = not words["as_json"]
                show_notices(not words["as_json"])
                question = Request(mechanism, method.__name__, given, words["model"], words["as_json"], load)
                conclude(question, **{p.name: words[p.name] for p in extra})

        shared = [_keyword_parameter("model", ModelFile), _keyword_parameter("change", ParameterChanges, None)]
        shared += [_keyword_parameter("without", ExcludedParts, None), _keyword_parameter("as_json", AsJson, False)]
        own_options = [o.parameter for o in known]
        first = [p for p in own_options if p.default is p.empty]
        rest = [p for p in own_options if p.default is not p.empty]
        run.__signature__ = inspect.Signature([shared[0], *first, *rest, *extra, *shared[1:]])  # type: ignore[attr-defined]
        run.__annotations__ = {p.name: p.annotation for p in run.__signature__.parameters.values()}  # type: ignore[attr-defined]
        run.__doc__ = f"{first_doc_line(method)}\n\n{inspect.getdoc(conclude) or ''}".strip()
        app.command(name or method.__name__.replace("_", "-"), short_help=first_doc_line(method))(run)
        return conclude

    return register


def _load_changed(path: Path, without: Sequence[str], changes: Sequence[str]) -> Mechanism:
    """Load a mechanism, leave out parts, and set parameters."""
    mechanism = leave_out_parts(load_mechanism(path), without)
    set_parameters(mechanism, changes)
    return mechanism


def _is_given(value: Any, of: Option) -> bool:
    """Return whether an option was given; otherwise the method's default applies."""
    return value is not None and value != [] and (value is not False or of.parameter.default is None)


def _extra_options(conclude: Conclusion) -> list[inspect.Parameter]:
    """Return the options that the command has in addition to the method's."""
    hints = get_type_hints(conclude, include_extras=True)
    return [
        p.replace(annotation=hints[p.name])
        for p in inspect.signature(conclude).parameters.values()
        if p.kind is p.KEYWORD_ONLY
    ]


def _keyword_parameter(name: str, annotation: Any, default: Any = inspect.Parameter.empty) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
