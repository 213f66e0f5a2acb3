"""The layout of model files: order of the tables, spaces, indentation, columns of comments.

Values keep their spelling. Every comment is kept: it moves with the line on which it stands, or with the field or table
below it. Comments after values stay in their columns, and move together where a value reaches that far. Lists over
several lines keep their lines; a list of tables that is too long for one line gets a line for each.
"""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import dataclass, field

from ..errors import ModelError
from .assembly_tables import DEFINITIONS
from .model_files import ORDER as TABLES
from .model_files import PARAMETERS, SETTINGS, WIDTH, parsed

TOKENS = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}'  # a string over several lines; its last characters may be quotation marks, too
    r"|'''.*?'{3,5}"
    r'|"(?:\\.|[^"\\])*"'
    r"|'[^']*'"
    r"|#[^\n]*"
    r"|[\[\]{},=\n]"
    r"|[^\s\[\]{},=#\"']+",  # a number, a word, or a part of a key
    re.DOTALL,
)
OPENING, CLOSING = ("[", "{"), ("]", "}")
ORDER = ("", PARAMETERS, DEFINITIONS, *TABLES)
"""The order of the tables; the first are the settings, before all headers."""
FIRST = ("type", "name")
"""The first fields of a table."""
GAP = 2  # spaces before a comment, at least


@dataclass
class _Line:
    """A line: its code with normal spaces, its indentation, its comment and the column where that stood."""

    code: str = ""
    indent: int = 0
    comment: str = ""
    column: int = 0

    def __str__(self) -> str:
        return " " * self.indent + self.code if self.code else ""

    @property
    def empty(self) -> bool:
        return not self.code and not self.comment

    @property
    def width(self) -> int:
        """Number of characters; of a string over several lines, those of its last."""
        return len(str(self).rpartition("\n")[2])


Statement = list[_Line]
"""The lines of a header or a field; or one without code."""


@dataclass
class _Table:
    """Statements of a table: above its header (``lead``), the header, and the fields with comments among them."""

    key: str = ""
    lead: list[Statement] = field(default_factory=list)
    header: Statement = field(default_factory=list)
    body: list[Statement] = field(default_factory=list)


def formatted(text: str, source: str = "model") -> str:
    """Return the text of a model file in the layout of ``flyball new``; it describes the same model.

    Raises
    ------
    ModelError
        If the text is not TOML; the message names ``source`` and the line.
    """
    text = text.replace("\r\n", "\n")
    data = parsed(text, source)
    tables = sorted(_tables(text), key=lambda t: ORDER.index(t.key) if t.key in ORDER else len(ORDER))
    out = "\n\n".join(x for x in ("\n".join(_aligned(_lines(t))) for t in tables) if x) + "\n"
    if _content(parsed(out, source)) != _content(data):
        raise ModelError(f"{source}: another layout would change the model; please report this file")
    return out


def _content(data: object) -> str:
    """Return the data of a file as a text that does not depend on the order of tables and fields."""
    return json.dumps(data, sort_keys=True, default=str)


def _statements(text: str) -> list[Statement]:
    """Divide a text at the ends of lines outside brackets; a comment goes on in the same column of the next line."""
    found: list[Statement] = []
    made: Statement = []
    tokens: list[str] = []
    comment, column, depth = "", 0, 0
    for match in TOKENS.finditer(text + "\n" * (not text.endswith("\n"))):
        token = match[0]
        if token.startswith("#"):
            comment, column = token.rstrip(), match.start() - text.rfind("\n", 0, match.start()) - 1
        elif token != "\n":
            tokens.append(token)
        else:
            closed = next((k for k, x in enumerate(tokens) if x not in CLOSING), len(tokens))
            made += _broken(tokens, _Line(_spaced(tokens), 4 * (depth - min(depth, closed)), comment, column))
            depth += sum((x in OPENING) - (x in CLOSING) for x in tokens)
            tokens, comment, column = [], "", 0
            if depth == 0:
                if found and _continues_comment(found[-1][-1], made[0]):
                    found[-1] += made
                else:
                    found.append(made)
                made = []
    return found


def _continues_comment(last: _Line, line: _Line) -> bool:
    """Return whether a line continues the comment of the line before."""
    return bool(last.comment and line.comment and not line.code and line.column == last.column > 0)


def _spaced(tokens: list[str]) -> str:
    """Return code with one space between tokens, none inside brackets and before commas."""
    text, last = "", ""
    for token, following in zip(tokens, [*tokens[1:], ""], strict=False):
        if token == "," and following in CLOSING:
            continue
        text += " " if last and last not in OPENING and token not in (*CLOSING, ",") else ""
        text += token
        last = token
    return text


def _broken(tokens: list[str], line: _Line) -> list[_Line]:
    """Return the line; or, if it is too long and a list of tables, several."""
    at = tokens.index("=") + 1 if "=" in tokens else len(tokens)
    if line.indent or tokens[at : at + 2] != ["[", "{"] or tokens[-1] != "]":
        return [line]
    items: list[list[str]] = [[]]
    depth = 0
    for token in tokens[at + 1 : -1]:
        depth += (token in OPENING) - (token in CLOSING)
        if token == "," and depth == 0:
            items.append([])
        else:
            items[-1].append(token)
    texts = [_spaced(x) for x in items if x]
    if depth or sum(map(len, texts)) <= WIDTH:
        return [line]
    return [_Line(_spaced(tokens[: at + 1])), *(_Line(f"{x},", 4) for x in texts), _Line("]", 0, line.comment)]


def _tables(text: str) -> list[_Table]:
    """Divide a text at its headers; comments right above a header belong to it."""
    tables = [_Table()]
    for statement in _statements(text):
        if not statement[0].code.startswith("["):
            tables[-1].body.append(statement)
            continue
        body = tables[-1].body
        end = max((k + 1 for k, x in enumerate(body) if x[0].code), default=0)
        blank = next((k for k in range(end, len(body)) if body[k][0].empty), end)
        key = next(iter(tomllib.loads(statement[0].code)))
        tables.append(_Table(key, body[blank:], statement))
        del body[blank:]
    return tables


def _lines(table: _Table) -> list[_Line]:
    """Return the lines of a table in order: not more than one empty line in a place, none at the ends."""
    lines = [line for part in (table.lead, [table.header], _in_order(table)) for x in part for line in x]
    kept = [x for last, x in zip([_Line(), *lines], lines, strict=False) if not (last.empty and x.empty)]
    while kept and kept[-1].empty:
        kept.pop()
    return kept


def _in_order(table: _Table) -> list[Statement]:
    """Return the fields of a table, the usual first ones first; each with the comments above it."""
    first = FIRST if table.key else SETTINGS
    entries: list[tuple[str, list[Statement]]] = []
    above: list[Statement] = []
    for statement in table.body:
        above.append(statement)
        if statement[0].code:
            entries.append((statement[0].code.partition(" = ")[0], above))
            above = []
    head: list[Statement] = []
    if not table.key and entries:  # what stands at the top of the file remains there
        head, entries[0] = entries[0][1][:-1], (entries[0][0], entries[0][1][-1:])
    entries.sort(key=lambda e: first.index(e[0]) if e[0] in first else len(first))
    return [*head, *(x for _, statements in entries for x in statements), *above]


def _aligned(lines: list[_Line]) -> list[str]:
    """Return the text of each line; comments that stood in one column, one below the other, still do."""
    out: list[str] = []
    while len(out) < len(lines):
        first = lines[len(out)]
        if not first.comment or not first.code:
            out.append(str(first) or (" " * first.indent + first.comment).rstrip())
            continue
        run = [first]
        for line in lines[len(out) + 1 :]:
            if not line.comment or line.column != first.column:
                break
            run.append(line)
        column = max(first.column, *(x.width + GAP for x in run))
        out += [str(x) + " " * (column - x.width) + x.comment for x in run]
    return out
