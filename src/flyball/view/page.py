"""The animation page: one recording as one self-contained HTML document that needs no network."""

from __future__ import annotations

import base64
import gzip
import html
import re
from functools import cache

from .payload import payload
from .recording import Recording
from .static_files import filled, static

# The player's modules, each after those it imports.
MODULES = (
    "data",
    "format",
    "theme",
    "packed",
    "solids",
    "flats",
    "look",
    "coil",
    "tube",
    "lines",
    "travel",
    "gearshape",
    "joints3d",
    "parts2d",
    "joints2d",
    "framing",
    "ground",
    "touches",
    "arrows",
    "triads",
    "trails",
    "crowdshapes",
    "crowd",
    "mechanism",
    "stage",
    "marks",
    "plots",
    "report",
    "panels",
    "names",
    "select",
    "shown",
    "keys",
    "clock",
    "bar",
    "swing",
    "modes",
    "overlay",
    "main",
)


def page(recording: Recording) -> str:
    """Write a recording as a web page with the moving mechanism, linked plots and a summary.

    Parameters
    ----------
    recording : Recording
        The motion to show.

    Returns
    -------
    str
        One HTML document with everything in it: it can be opened from a file, mailed, or embedded, and asks for
        nothing else. ``#t=5`` after its address opens it paused at 5 s, ``#t=5&theme=dark`` in the dark theme too.

    Raises
    ------
    ValueError
        If the recording is not complete and consistent; the message names the guilty element.
    """
    return document(recording, f"<h1>{html.escape(recording.name)}</h1>")


def document(recording: Recording, heading: str, before: str = "", after: str = "") -> str:
    """Put a recording and its player into a page.

    Parameters
    ----------
    recording : Recording
    heading : str
        Markup of the line above the picture.
    before, after : str
        Markup before and after the player.
    """
    title = html.escape(recording.name)
    stage = filled(static("player.html"), {"heading": heading, "title": title})
    parts = {
        "title": title,
        "licences": static("licences.txt").replace("--", "- -"),
        "style": static("uplot.min.css") + static("page.css"),
        "content": before + stage + after,
        "player": _player(),
        "recording": _packed(payload(recording)),
        "boot": static("boot.js"),
    }
    return filled(static("page.html"), parts)


def _packed(data: bytes) -> str:
    # level 9 would take twice the time, for very many bodies ten times, and save less than a hundredth
    return base64.b64encode(gzip.compress(data, 6, mtime=0)).decode()


@cache
def _player() -> str:
    """The libraries and the player as one gzipped script."""
    modules = "\n".join(_scoped(name, static(f"player/{name}.js")) for name in MODULES)
    head = '"use strict";\nconst THREE = LIB, uPlot = LIB.uPlot;\n'
    script = f"{static('libraries.min.js')}\n(() => {{\n{head}{modules}\nwindow.startPlayer = $main.start;\n}})();\n"
    return _packed(script.encode())


def _scoped(name: str, module: str) -> str:
    """A module as a function of its own that returns what it exports; only its named imports are understood."""
    exported = ", ".join(re.findall(r"^export (?:class|const|function) (\w+)", module, flags=re.M))
    body = re.sub(r'^import (\{[^}]*\}) from "\./(\w+)\.js";', r"const \1 = $\2;", module, flags=re.M)
    body = re.sub(r"^import .*;\n", "", body, flags=re.M)
    body = re.sub(r"^export ", "", body, flags=re.M)
    return f"const ${name} = (() => {{\n{body}\nreturn {{ {exported} }};\n}})();"
