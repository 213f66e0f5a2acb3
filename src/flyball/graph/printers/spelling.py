"""Names as they are written in formulas: ``m_1``, ``l2``, ``alpha``, ``J_wheel`` in LaTeX."""

from __future__ import annotations

import re

from ..node import Symbol

GREEK = frozenset(
    (  # noqa: SIM905
        "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau upsilon phi chi psi "
        "omega Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega"
    ).split()
)
SPELT = {"phi": r"\varphi", "epsilon": r"\varepsilon", "lam": r"\lambda"}
SPECIAL = {c: rf"\{c}" for c in "_%#&${}"} | {"~": r"\sim ", "^": r"\wedge ", "\\": ""}


def spelt(symbol: Symbol) -> str:
    """A symbol in LaTeX: as it says itself, or by its name."""
    return symbol.latex or name(symbol.name)


def name(text: str) -> str:
    """A name in LaTeX: its first part with the others as subscripts."""
    head, *rest = [p for p in re.split(r"[_.\[\]\s]+", text) if p] or [text]
    letters = re.fullmatch(r"([A-Za-z]+?)(\d*)", head)
    below = []
    if letters:
        word, digits = letters.groups()
        if word in GREEK or word in SPELT or len(word) == 1:
            head, below = letter(word), [digits] if digits else []
        elif len(word) == 2:
            head, below = word[0], [word[1] + digits]
        else:
            head = rf"\mathrm{{{word}{digits}}}"
    else:
        head = rf"\mathrm{{{escaped(head)}}}"
    below += [subscript(p) for p in rest]
    return f"{head}_{{{','.join(below)}}}" if below else head


def letter(word: str) -> str:
    """A letter, Greek if it is called so."""
    return SPELT.get(word) or (f"\\{word}" if word in GREEK else word)


def subscript(text: str) -> str:
    """A part of a subscript: a number or letter as it is, a word upright."""
    if text.isdigit() or len(text) == 1:
        return escaped(text)
    return letter(text) if text in GREEK or text in SPELT else rf"\mathrm{{{escaped(text)}}}"


def escaped(text: str) -> str:
    """Text between other LaTeX."""
    return "".join(SPECIAL.get(c, c) for c in text)
