"""A subcommand from a method of `Mechanism`: options, types, defaults and help are those of its arguments.

A command of its own file says only what it prints and writes, as a function of what was `Asked`; its keyword-only
arguments are the options that the method does not have.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_type_hints

from .common import Changes, Json, Model, Without, app, make_folder, print_json, reported, table
from .docs import described, summary
from .flags import Flag, Option, options
from .loading import leave_out, load_mechanism, set_parameters
from .notices import show_notices

if TYPE_CHECKING:
    from ..mechanism import Mechanism

EVERYWHERE = ("self", "parameters", "progress")  # parameters are given by --set


@dataclass
class Asked:
    """A question from the command line, ready to be asked, and how to answer."""

    mechanism: Mechanism
    method: str
    given: dict[str, Any]
    source: Path
    as_json: bool
    files: list[str] = field(default_factory=list)

    def answer(self, **more: Any) -> Any:
        """What the mechanism answers, to more or other arguments if given."""
        return getattr(self.mechanism, self.method)(**self.given | more)

    def rest(self, equilibrium: bool, turning: Sequence[str] | None) -> None:
        """Ask about the equilibrium, or the steady motion, that is next to the mechanism as drawn."""
        if equilibrium or turning:
            t = self.given.pop("t", 0.0)
            self.given["about"] = self.mechanism.equilibrium(t=t, turning=turning or ())

    def folder(self, out: Path | None, suffix: str) -> Path:
        """The folder for results, made: as told, or named after the model."""
        found = out if out is not None else Path(f"{self.source.stem}-{suffix}")
        make_folder(found)
        return found

    def write(self, path: Path | None, write: Callable[[Path], Any]) -> None:
        """Write a file, if it is wanted."""
        if path is not None:
            write(path)
            self.files.append(str(path))

    def say(self, found: Any, data: Mapping[str, Any] | None = None) -> None:
        """Print a result and the files written: its lines, or one JSON object."""
        if self.as_json:
            told = dict(found.as_dict() if data is None else data)
            print_json(told | {"files": self.files})
        else:
            table([*found.lines(), *(("written", f) for f in self.files)])


Conclusion = Callable[..., None]


def command(
    method: Callable,
    *,
    name: str = "",
    own: Mapping[str, Flag] | None = None,
    without: Sequence[str] = (),
) -> Callable[[Conclusion], Conclusion]:
    """Make a subcommand of a method; what it decorates is called with what was asked, and prints and writes.

    Parameters
    ----------
    method : function
        Of a class of `flyball.methods`.
    name : str
        Of the subcommand; the method's if not given.
    own : mapping of str to Flag
        Arguments that stand otherwise on the command line than their type says.
    without : sequence of str
        Arguments that it does not have.
    """

    def register(conclude: Conclusion) -> Conclusion:
        arguments = inspect.signature(method).parameters
        asked = {k: p for k, p in arguments.items() if k not in (*EVERYWHERE, *without)}
        known = options(asked, described(method), own or {})
        extra = _extra(conclude)

        def run(**words: Any) -> None:
            with reported(words["as_json"]):
                mechanism = load_mechanism(words["model"])
                mechanism = leave_out(mechanism, words["without"] or [])
                set_parameters(mechanism, words["change"] or [])
                given = {o.name: o.read(words[o.name]) for o in known if _told(words[o.name], o)}
                if "progress" in arguments:
                    given["progress"] = not words["as_json"]
                show_notices(not words["as_json"])
                question = Asked(mechanism, method.__name__, given, words["model"], words["as_json"])
                conclude(question, **{p.name: words[p.name] for p in extra})

        shared = [_parameter("model", Model), _parameter("change", Changes, None)]
        shared += [_parameter("without", Without, None), _parameter("as_json", Json, False)]
        own_options = [o.parameter for o in known]
        first = [p for p in own_options if p.default is p.empty]
        rest = [p for p in own_options if p.default is not p.empty]
        run.__signature__ = inspect.Signature([shared[0], *first, *rest, *extra, *shared[1:]])  # type: ignore[attr-defined]
        run.__annotations__ = {p.name: p.annotation for p in run.__signature__.parameters.values()}  # type: ignore[attr-defined]
        run.__doc__ = f"{summary(method)}\n\n{inspect.getdoc(conclude) or ''}".strip()
        app.command(name or method.__name__.replace("_", "-"))(run)
        return conclude

    return register


def _told(value: Any, of: Option) -> bool:
    """Whether an option was given; else the method's own default holds."""
    return value is not None and value != [] and (value is not False or of.parameter.default is None)


def _extra(conclude: Conclusion) -> list[inspect.Parameter]:
    """Options that the command has besides the method's."""
    hints = get_type_hints(conclude, include_extras=True)
    return [
        p.replace(annotation=hints[p.name])
        for p in inspect.signature(conclude).parameters.values()
        if p.kind is p.KEYWORD_ONLY
    ]


def _parameter(name: str, annotation: Any, default: Any = inspect.Parameter.empty) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
