"""The gallery: a page for each file of ``examples/`` with its picture, first comment and source, and an overview."""

from __future__ import annotations

import ast
import json
import re
import warnings
from pathlib import Path

from flyball import Body, Mechanism, load
from flyball.view.animation import record_motion
from flyball.view.reference_picture import reference_result
from flyball.view.still_picture import still_svg

EXAMPLES = Path(__file__).parents[1] / "examples"
_PHOTOS = {"pile_in_a_box": "pile.png"}  # of docs/images: its box hides what lies in it


def _description(path: Path, text: str) -> str:
    """Return the comment or docstring at the beginning of a file as Markdown."""
    if path.suffix == ".py":
        return ast.get_docstring(ast.parse(text)) or ""
    if path.suffix == ".ipynb":
        return "".join(json.loads(text)["cells"][0]["source"]).partition("\n\n")[2]  # without its title
    lines = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.removeprefix("#").strip())
    return "\n".join(lines)


def _title(path: Path) -> str:
    return path.stem.replace("_", " ").capitalize()


def _code(path: Path, text: str) -> str:
    if path.suffix == ".ipynb":
        cells = [c for c in json.loads(text)["cells"] if c["cell_type"] == "code"]
        text = "\n\n".join("".join(c["source"]) for c in cells)
    kind = "toml" if path.suffix == ".toml" else "python"
    return f"```{kind}\n{text}\n```\n"


def _without_sets(m: Mechanism) -> Mechanism:
    """Return a mechanism with a body for each member of a set of bodies: line drawings show bodies only."""
    out = m.changed({s.name: None for s in m.bulk})
    for s in m.bulk:
        for k, position in enumerate(s.position):
            turn = (
                {} if s.orientation is None else {"orientation": tuple(s.orientation[min(k, len(s.orientation) - 1)])}
            )
            out.add(
                Body(f"{s.name} {k}", shape=s.shape, density=s.density, position=tuple(position), color=s.color, **turn)
            )
    return out


def picture(path: Path) -> str:
    """Return a line drawing of the reference configuration as SVG, empty if there is none. Nothing is compiled."""
    if path.suffix == ".ipynb":
        return ""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        m = _without_sets(load(path))
        return still_svg(record_motion(reference_result(m), curves=False, with_notes=False))


def pages() -> dict[str, str]:
    """Return the text of each page and picture of the gallery by its path."""
    out, cards = {}, []
    for path in sorted(p for p in EXAMPLES.iterdir() if p.suffix in (".toml", ".py", ".ipynb")):
        text = path.read_text(encoding="utf-8")
        description = re.sub(r"``([^`]+)``", r"`\1`", _description(path, text))
        first = re.split(r"(?<=[.!?])\s", description.replace("\n", " "))[0]
        image, drawing = "", picture(path)
        if path.stem in _PHOTOS:
            image = f"../images/{_PHOTOS[path.stem]}"
        elif "<svg" in drawing:
            out[f"gallery/{path.stem}.svg"], image = drawing, f"{path.stem}.svg"
        shown = f"![{_title(path)}]({image})\n\n" if image else ""
        out[f"gallery/{path.stem}.md"] = (
            f"# {_title(path)}\n\n{shown}{description}\n\n## examples/{path.name}\n\n{_code(path, text)}"
        )
        link = f"[![{_title(path)}]({image})]({path.stem}.md)" if image else ""
        cards.append(f"<div markdown>\n{link}\n\n**[{_title(path)}]({path.stem}.md)**\n\n{first}\n</div>\n")
    head = "# Gallery\n\nThe files of `examples/`. Each says what it shows and what it is checked against.\n\n"
    out["gallery/index.md"] = head + '<div class="gallery" markdown>\n' + "\n".join(cards) + "</div>\n"
    return out
