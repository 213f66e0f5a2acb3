"""Files that pages are made of, and templates filled in."""

from __future__ import annotations

import re
from functools import cache
from importlib.resources import files


def filled(template: str, parts: dict[str, str]) -> str:
    """The template with its marks replaced, once: what is put in is not looked at again."""
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts.get(match[1], match[0]), template)


@cache
def static(name: str) -> str:
    """The text of a file in ``static/``."""
    return files(__package__).joinpath("static", name).read_text(encoding="utf-8")
