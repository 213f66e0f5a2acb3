"""Pages of the documentation whose snippets are run, in order, as a reader would."""

from __future__ import annotations

import doctest
import io
import os
import re
import shlex
import shutil
import tomllib
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


class Snippet(NamedTuple):
    """A fenced block: language, what stands behind it, text, line of its first line."""

    language: str
    options: str
    text: str
    line: int


def page(name: str) -> str:
    """The text of a page."""
    return (DOCS / name).read_text(encoding="utf-8")


def snippets(path: Path) -> list[Snippet]:
    """Every fenced block of a page."""
    out, text = [], path.read_text(encoding="utf-8")
    for m in re.finditer(r"^```(\w*)([^\n]*)\n(.*?)^```$", text, flags=re.M | re.S):
        out.append(Snippet(m[1], m[2], m[3], text[: m.start(3)].count("\n") + 1))
    return out


def run_page(path: Path, folder: Path) -> int:
    """Run every snippet of a page in a folder with ``examples/``, and return how many.

    Python with ``>>>`` is a doctest. Other Python is executed; if the next block is text, it is what was printed. Lines
    of a shell that begin with ``flyball`` are run, but for those with a placeholder in capitals. TOML is parsed. A block
    with a ``title`` is a file of that name.
    """
    shutil.copytree(ROOT / "examples", folder / "examples")
    names: dict[str, Any] = {"__name__": "__main__"}
    count, blocks = 0, snippets(path)
    with inside(folder):
        for k, s in enumerate(blocks):
            where = f"{path.name}, line {s.line}"
            if title := re.search(r'title="([^"]+)"', s.options):
                (folder / title[1]).write_text(s.text, encoding="utf-8")
            following = blocks[k + 1] if k + 1 < len(blocks) and blocks[k + 1].language == "text" else None
            if s.language == "python" and ">>>" in s.text:
                _doctest(s, names, path.name)
            elif s.language == "python":
                printed = execute(s, names, path)
                if following:
                    right = doctest.OutputChecker().check_output(following.text, printed, OPTIONS)
                    assert right, f"{where} prints\n{printed}\nand the page says\n{following.text}"
            elif s.language == "sh":
                _shell(s, where)
            elif s.language == "toml":
                tomllib.loads(s.text)
            count += s.language in ("python", "sh", "toml")
    return count


def execute(s: Snippet, names: dict[str, Any], path: Path) -> str:
    """Execute plain Python with line numbers of the page, and return what it prints."""
    said = io.StringIO()
    with redirect_stdout(said):
        exec(compile("\n" * (s.line - 1) + s.text, str(path), "exec"), names)
    return said.getvalue()


def _doctest(s: Snippet, names: dict[str, Any], name: str) -> None:
    test = doctest.DocTestParser().get_doctest(s.text, names, name, name, s.line - 1)
    said: list[str] = []
    runner = doctest.DocTestRunner(optionflags=OPTIONS, verbose=False)
    failed, _ = runner.run(test, out=said.append, clear_globs=False)
    names.update(test.globs)
    assert failed == 0, "".join(said)


def _shell(s: Snippet, where: str) -> None:
    from typer.testing import CliRunner

    from flyball.cli import app

    for line in s.text.splitlines():
        words = shlex.split(line, comments=True)
        if words[:1] == ["flyball"] and not re.search(r"\b[A-Z]{3,}\b", line):
            answer = CliRunner().invoke(app, words[1:])
            assert answer.exit_code == 0, f"{where}: {line}\n{answer.output}"


@contextmanager
def inside(folder: Path):
    """Work in a folder for a while."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)
