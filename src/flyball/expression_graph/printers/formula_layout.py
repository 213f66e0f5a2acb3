"""Layout of formulas for reading: signed terms in reading order, fractions, powers, names and line breaks."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from ..graph import ADD, DIVIDE, MULTIPLY, NUMBER, SYMBOL, Node, Symbol
from ..simplification.factors import ExactNumber, exact_number, reading_cost


def wrap_fragments(fragments: list[str], most: int, width: Callable[[str], int] = len) -> list[str]:
    """Join fragments to lines of at most ``most`` characters where possible.

    Parameters
    ----------
    fragments : list of str
        Lines may be broken before each fragment.
    most : int
    width : callable
        Width of a fragment in characters.
    """
    depths = [0]
    for piece in fragments[:-1]:
        depths.append(depths[-1] + piece.count("(") - piece.count(")"))
    lines, start = [], 0
    while start < len(fragments):
        used, end = 0, start
        while end < len(fragments) and (end == start or used + width(fragments[end]) <= most):
            used += width(fragments[end])
            end += 1
        if end < len(fragments):
            end = _best_break(fragments[start : end + 1], depths[start : end + 1], most, width) + start
        lines.append("".join(fragments[start:end]))
        start = end
    return lines


def _best_break(fragments: list[str], depths: list[int], most: int, width: Callable[[str], int]) -> int:
    """Index of the best break: of those that do not leave a short line, the last in the fewest parentheses."""
    used, best, found = 0, (10**6, 0), len(fragments) - 1
    for k in range(1, len(fragments)):
        used += width(fragments[k - 1])
        rank = (depths[k] + (8 if 3 * used < most else 0), -k)
        if rank < best:
            best, found = rank, k
    return found


GREEK = frozenset(
    (  # noqa: SIM905
        "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi pi rho sigma tau upsilon phi chi psi "
        "omega Gamma Delta Theta Lambda Xi Pi Sigma Upsilon Phi Psi Omega"
    ).split()
)
LATEX_LETTERS = {"phi": r"\varphi", "epsilon": r"\varepsilon", "lam": r"\lambda"}
LATEX_ESCAPES = {c: rf"\{c}" for c in "_%#&${}"} | {"~": r"\sim ", "^": r"\wedge ", "\\": ""}


def latex_symbol(symbol: Symbol) -> str:
    """A symbol in LaTeX: its own LaTeX text, or its name."""
    return symbol.latex or latex_name(symbol.name)


def latex_name(text: str) -> str:
    """A name in LaTeX: its first part with the others as subscripts."""
    head, *rest = [p for p in re.split(r"[_.\[\]\s]+", text) if p] or [text]
    letters = re.fullmatch(r"([A-Za-z]+?)(\d*)", head)
    below = []
    if letters:
        word, digits = letters.groups()
        if word in GREEK or word in LATEX_LETTERS or len(word) == 1:
            head, below = latex_letter(word), [digits] if digits else []
        elif len(word) == 2:
            head, below = word[0], [word[1] + digits]
        else:
            head = rf"\mathrm{{{word}{digits}}}"
    else:
        head = rf"\mathrm{{{latex_escaped(head)}}}"
    below += [latex_subscript(p) for p in rest]
    return f"{head}_{{{','.join(below)}}}" if below else head


def latex_letter(word: str) -> str:
    """A letter; Greek if the word is the name of a Greek letter."""
    return LATEX_LETTERS.get(word) or (f"\\{word}" if word in GREEK else word)


def latex_subscript(text: str) -> str:
    """A part of a subscript: a number or letter as it is, a word upright."""
    if text.isdigit() or len(text) == 1:
        return latex_escaped(text)
    return latex_letter(text) if text in GREEK or text in LATEX_LETTERS else rf"\mathrm{{{latex_escaped(text)}}}"


def latex_escaped(text: str) -> str:
    """Escape text for LaTeX."""
    return "".join(LATEX_ESCAPES.get(c, c) for c in text)


Power = tuple[Node, int]
FUNCTION, SECOND, SUM, OTHER_FACTOR = 6, 5, 4, 3
KNOWN = 10  # decimals with fewer digits count as exact
ROUNDED = 1e-14  # relative rounding error of a number


@dataclass(frozen=True)
class Term:
    """One term of a sum: a sign, a number, powers in numerator and denominator."""

    negative: bool
    number: ExactNumber | float
    above: tuple[Power, ...]
    below: tuple[Power, ...]

    @property
    def one(self) -> bool:
        """Whether the number is one, which is not written before other factors."""
        return self.number == ExactNumber(1, 1)

    @property
    def is_number(self) -> bool:
        """Whether the term is a number only."""
        return not self.above and not self.below


class Layout:
    """Converts expressions to terms for printing.

    Parameters
    ----------
    names : mapping of int to str
        Names of nodes that are not written out, by node index.
    """

    def __init__(self, names: Mapping[int, str] | None = None) -> None:
        self.names = dict(names or {})
        self.costs: dict[int, float] = dict.fromkeys(self.names, 1.0)

    def sum(self, x: Node, top: bool = False) -> list[Term]:
        """Terms of an expression in reading order; ``top``: written out even if it has a name."""
        out: list[tuple[Node, bool]] = []
        to_see = [(x, False)]
        while to_see:
            y, turned = to_see.pop()
            named = y.index in self.names and not (top and y is x)
            if y.op == ADD and not named:
                to_see += [(a, turned) for a in reversed(y.args)]
            elif is_negated_sum(y) and not named:
                to_see.append((y.args[1], not turned))
            else:
                out.append((y, turned))
        terms = [self.turned(self.term(y, top and y is x), turned) for y, turned in sorted(out, key=self.place)]
        first = next((i for i, t in enumerate(terms) if not t.negative), 0)
        return [terms[first], *terms[:first], *terms[first + 1 :]]

    @staticmethod
    def turned(term: Term, turned: bool) -> Term:
        """The term, negated if ``turned``."""
        return replace(term, negative=not term.negative) if turned else term

    def place(self, signed: tuple[Node, bool]) -> tuple:
        """Sort key of a term in a sum: numbers, then constant terms, short ones first."""
        x, turned = signed
        if x.op == NUMBER:
            return (0 if (x.value > 0.0) is not turned else 3, 0.0, ())
        term = self.term(x)
        powers = (*term.above, *term.below)
        length = sum(reading_cost(y, self.costs) + 0.4 * (n - 1) for y, n in powers)
        return (1 + x.moving, math.floor(length), tuple((y.index, -n) for y, n in powers))

    def term(self, x: Node, top: bool = False) -> Term:
        """One term, with numbers multiplied and equal factors joined."""
        c = 1.0
        powers: dict[int, Power] = {}
        to_see = [(x, 1)]
        while to_see:
            y, n = to_see.pop()
            named = y.index in self.names and not (top and y is x)
            if y.op == NUMBER:
                c = c * y.value if n > 0 else c / y.value
            elif y.op in (MULTIPLY, DIVIDE) and not named:
                to_see += [(y.args[0], n), (y.args[1], n if y.op == MULTIPLY else -n)]
            else:
                powers[y.index] = (y, powers.get(y.index, (y, 0))[1] + n)
        ordered = sorted((p for p in powers.values() if p[1]), key=self.rank)
        found = exact_number(abs(c))
        return Term(
            c < 0.0,
            abs(c) if found is None else found,
            tuple((y, n) for y, n in ordered if n > 0),
            tuple((y, -n) for y, n in ordered if n < 0),
        )

    def rank(self, power: Power) -> tuple[int, int]:
        """Sort key of a factor: masses, other parameters, moving quantities, sums, functions."""
        x = power[0]
        if x.index in self.names:
            return (2 if not x.moving else OTHER_FACTOR, x.index)
        if x.op == SYMBOL and x.data.kind in ("acceleration", "multiplier"):
            return (SECOND, x.index)
        if x.op == SYMBOL:
            mass = x.data.unit == "kg" or (not x.data.unit and x.data.name.startswith("m"))
            return ((0 if mass else 1) if not x.moving else OTHER_FACTOR, x.index)
        if x.op == ADD:
            return (SUM, x.index)
        return (2 if x.op == "sqrt" and not x.moving else FUNCTION, x.index)


def is_negated_sum(x: Node) -> bool:
    """Whether an expression is minus a sum."""
    return x.op == MULTIPLY and x.args[0].op == NUMBER and x.args[0].value == -1.0 and x.args[1].op == ADD


def number_text(x: float) -> str:
    """A decimal of up to twelve digits; more where twelve would suggest another exact number."""
    short = f"{x:.12g}"
    digits = short.partition("e")[0].lstrip("-0.").replace(".", "")
    if len(digits) < KNOWN and abs(float(short) - x) > ROUNDED * abs(x):
        return f"{x:.15g}"
    return short
