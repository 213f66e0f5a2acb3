"""Expressions as MathML, which browsers draw without a library: from the LaTeX that the printers here write."""

from __future__ import annotations

import re
from collections.abc import Mapping
from html import escape
from typing import Any

from .latex import latex

TOKEN = re.compile(r"\\[A-Za-z]+|\\.|[0-9]+(?:\.[0-9]+)?|\s+|.", re.S)
LETTERS = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ϵ", "varepsilon": "ε", "zeta": "ζ", "eta": "η",
    "theta": "θ", "vartheta": "ϑ", "iota": "ι", "kappa": "κ", "lambda": "λ", "mu": "μ", "nu": "ν", "xi": "ξ", "pi": "π",
    "rho": "ρ", "sigma": "σ", "tau": "τ", "upsilon": "υ", "phi": "ϕ", "varphi": "φ", "chi": "χ", "psi": "ψ",
    "omega": "ω", "Gamma": "Γ", "Delta": "Δ", "Theta": "Θ", "Lambda": "Λ", "Xi": "Ξ", "Pi": "Π", "Sigma": "Σ",
    "Upsilon": "Υ", "Phi": "Φ", "Psi": "Ψ", "Omega": "Ω", "infty": "∞", "ell": "ℓ", "partial": "∂",
}  # fmt: skip
SIGNS = {
    "cdot": "⋅", "times": "×", "le": "≤", "leq": "≤", "ge": "≥", "geq": "≥", "ne": "≠", "neq": "≠", "approx": "≈",
    "to": "→", "sim": "∼", "wedge": "∧", "pm": "±", "in": "∈", "ldots": "…", "dots": "…", "cdots": "⋯", "vdots": "⋮",
    "|": "∥", "lVert": "∥", "rVert": "∥", "lvert": "|", "rvert": "|", "top": "⊤", "_": "_", "%": "%", "#": "#",
    "&": "&", "$": "$", "{": "{", "}": "}", "circ": "∘",
}  # fmt: skip
SPACES = {",": "0.17em", ";": "0.28em", ":": "0.22em", "quad": "1em", "qquad": "2em", " ": "0.25em"}
NOTHING = ("!", "displaystyle", "textstyle", "big", "Big", "bigl", "bigr", "limits", "nolimits")
NAMED = {
    "sin", "cos", "tan", "arcsin", "arccos", "arctan", "exp", "ln", "log", "sinh", "cosh", "tanh", "min", "max", "det",
}  # fmt: skip
THIN = '<mspace width="0.17em"/>'
ACCENTS = {"dot": "˙", "ddot": "¨", "hat": "^", "bar": "¯", "tilde": "~", "vec": "→"}
STYLES = {"mathrm": "normal", "operatorname": "normal", "mathbf": "bold", "boldsymbol": "bold", "mathit": "italic"}
TEXTS = ("text", "textrm", "textit", "mbox")


def mathml(x: Any, names: Mapping[int, str] | None = None, display: bool = False) -> str:
    """One expression as a ``math`` element; ``names`` in LaTeX, as for `latex`."""
    return formula(latex(x, names), display)


def formula(tex: str, display: bool = False) -> str:
    """LaTeX as a ``math`` element; supports the LaTeX of formulas written here, not all of LaTeX."""
    kind = ' display="block"' if display else ""
    return f"<math{kind}>{Converter(tex).row()}</math>"


def heavy(letter: str) -> str:
    """A letter in bold type: upright Latin, slanted Greek."""
    for first, last, bold in (("A", "Z", 0x1D400), ("a", "z", 0x1D41A), ("α", "ω", 0x1D736), ("0", "9", 0x1D7CE)):
        if first <= letter <= last:
            return chr(bold + ord(letter) - ord(first))
    return letter


class Converter:
    """Converter from LaTeX to MathML."""

    def __init__(self, tex: str) -> None:
        self.tokens = [t for t in TOKEN.findall(tex) if not t.isspace()] if r"\text" not in tex else TOKEN.findall(tex)
        self.at = 0

    def row(self, *ends: str) -> str:
        """Elements up to a token of ``ends``, which is not consumed, as one element."""
        out: list[str] = []
        while self.at < len(self.tokens) and self.tokens[self.at] not in ends:
            made = self.scripted(self.element())
            if made:
                out.append(made)
        return out[0] if len(out) == 1 else f"<mrow>{''.join(out)}</mrow>"

    def next(self) -> str:
        """The next token."""
        token = self.tokens[self.at] if self.at < len(self.tokens) else ""
        self.at += 1
        return token

    def skipped(self) -> str:
        """The next token that is no space, without consuming it."""
        while self.at < len(self.tokens) and self.tokens[self.at].isspace():
            self.at += 1
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def argument(self) -> str:
        """An argument: a group or one element."""
        if self.skipped() == "{":
            self.at += 1
            made = self.row("}")
            self.at += 1
            return made
        return self.element()

    def text_argument(self) -> str:
        """An argument as text."""
        if self.skipped() != "{":
            return self.next()
        self.at += 1
        out, depth = "", 1
        while depth and self.at < len(self.tokens):
            token = self.next()
            depth += (token == "{") - (token == "}")
            if depth:
                out += token if len(token) == 1 or token[0] != "\\" else token[1:]
        return out

    def scripted(self, base: str) -> str:
        """An element with its subscript and superscript."""
        below, above, count = "", "", 0
        while (token := self.skipped()) in ("_", "^", "'"):
            self.at += 1
            if token == "_":
                below = self.argument()
            else:
                above += "<mo>′</mo>" if token == "'" else self.argument()
                count += 1
        if count > 1:
            above = f"<mrow>{above}</mrow>"
        if below and above:
            return f"<msubsup>{base}{below}{above}</msubsup>"
        if below:
            return f"<msub>{base}{below}</msub>"
        return f"<msup>{base}{above}</msup>" if above else base

    def element(self) -> str:
        """One element."""
        token = self.next()
        if token == "{":
            made = self.row("}")
            self.at += 1
            return made
        if token.startswith("\\"):
            return self.command(token[1:])
        if token.isspace() or not token:
            return ""
        if token[0].isdigit():
            return f"<mn>{token}</mn>"
        if token.isalpha():
            return f"<mi>{token}</mi>"
        sign = "−" if token == "-" else escape(token)
        flat = ' stretchy="false"' if token in "()[]|" else ""
        return f"<mo{flat}>{sign}</mo>"

    def command(self, name: str) -> str:
        """Element of a command."""
        if name in LETTERS:
            upright = ' mathvariant="normal"' if name[0].isupper() else ""
            return f"<mi{upright}>{LETTERS[name]}</mi>"
        if name in SPACES:
            return f'<mspace width="{SPACES[name]}"/>'
        if name in SIGNS:
            return f"<mo>{escape(SIGNS[name])}</mo>"
        if name in NAMED:
            return THIN + self.named(f"<mi>{name}</mi>")
        if name in ACCENTS:
            return f'<mover accent="true">{self.argument()}<mo stretchy="false">{ACCENTS[name]}</mo></mover>'
        if name == "operatorname":
            return THIN + self.named(f"<mi>{escape(self.text_argument())}</mi>")
        if name in STYLES:
            return self.styled(STYLES[name])
        if name in TEXTS:
            return f"<mtext>{escape(self.text_argument())}</mtext>"
        return "" if name in NOTHING else self.structure(name)

    def named(self, base: str) -> str:
        """A function's name, with an exponent if it has one."""
        made = self.scripted(base)
        return made if self.skipped() in ("(", r"\left", "") else made + THIN

    def styled(self, style: str) -> str:
        """Letters in another style."""
        if style != "bold":
            return f'<mi style="font-style:{style}">{escape(self.text_argument())}</mi>'
        return re.sub(r"<mi[^>]*>(.)</mi>|<mn>(\d)</mn>", lambda m: f"<mi>{heavy(m[1] or m[2])}</mi>", self.argument())

    def structure(self, name: str) -> str:
        """Fractions, roots, parentheses, tables."""
        if name in ("frac", "tfrac", "dfrac"):
            return f"<mfrac>{self.argument()}{self.argument()}</mfrac>"
        if name == "sqrt":
            return f"<msqrt>{self.argument()}</msqrt>"
        if name == "left":
            left = self.sign(self.next())
            inner = self.row(r"\right")
            self.at += 1
            return f"<mrow>{left}{inner}{self.sign(self.next())}</mrow>"
        if name in ("Bigl", "Bigr"):
            return f'<mo minsize="1.9em" maxsize="1.9em" stretchy="true">{escape(self.next())}</mo>'
        if name == "begin":
            return self.table(self.text_argument())
        return f"<mtext>{escape(name)}</mtext>"

    @staticmethod
    def sign(token: str) -> str:
        """A parenthesis with the height of its content."""
        sign = SIGNS.get(token[1:], token[1:]) if token.startswith("\\") else token
        return "" if sign == "." else f'<mo stretchy="true">{escape(sign)}</mo>'

    def table(self, kind: str) -> str:
        """An environment of cells."""
        if kind == "array":
            self.text_argument()  # column alignment
        rows, cells = [], []
        while self.at < len(self.tokens):
            cells.append(f"<mtd>{self.row('&', chr(92) * 2, chr(92) + 'end')}</mtd>")
            token = self.next()
            if token != "&":
                rows.append(f"<mtr>{''.join(cells)}</mtr>")
                cells = []
            if token == r"\end":
                break
        self.text_argument()
        if rows and re.fullmatch(r"<mtr><mtd><mrow></mrow></mtd></mtr>", rows[-1]):
            rows.pop()
        made = f'<mtable class="{escape(kind)}">{"".join(rows)}</mtable>'
        around = {"cases": ("{", ""), "bmatrix": ("[", "]"), "pmatrix": ("(", ")")}.get(kind)
        if around is None:
            return made
        left, right = (f'<mo stretchy="true">{c}</mo>' if c else "" for c in around)
        return f"<mrow>{left}{made}{right}</mrow>"
