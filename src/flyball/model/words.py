"""Parts of messages: what may have been meant, and what there is."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def suggest(name: object, known: Iterable[str]) -> str:
    """' (did you mean ...?)' where something close is known; what is no text is close to nothing."""
    if not isinstance(name, str):
        return ""
    names = list(known)
    same = [k for k in names if k.lower() == name.lower() and k != name]
    close = same or difflib.get_close_matches(name, names, 1)
    return f" (did you mean {close[0]!r}?)" if close else ""


def listing(names: list[str]) -> str:
    """What there is, for messages."""
    if not names:
        return "there is none yet; add it first"
    shown = ", ".join(names[:12]) + (", ..." if len(names) > 12 else "")
    return f"known: {shown}"


def shortened(names: Iterable[str], most: int = 60) -> str:
    """Names with commas between them, in about so many letters: the last one too where three or more are left out."""
    every = list(names)
    if len(", ".join(every)) <= most or len(every) < 4:
        return ", ".join(every)
    kept: list[str] = []
    for name in every[:-1]:
        if kept and len(", ".join([*kept, name, every[-1]])) > most - 5:
            break
        kept.append(name)
    if len(every) - len(kept) <= 3:
        return ", ".join(every)
    return f"{', '.join(kept)}, ... {every[-1]}"


def brief(text: str, most: int = 200) -> str:
    """A text, of a long one the beginning and the end."""
    return text if len(text) <= most else f"{text[: 2 * most // 3]} ... {text[-most // 4 :]}"
