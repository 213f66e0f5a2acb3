"""What is greater than zero because all that is in it is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .quotient import readable
from .ring import Ring


class Signs:
    """Which polynomials are greater than zero because all that is in them is."""

    def __init__(self, ring: Ring, positive: Sequence[str] | None) -> None:
        self.ring, sp = ring, ring.sympy
        self.known = []
        for g in ring.ring.gens[1:]:
            x = g.as_expr()
            own = positive is None or str(x) in positive or (x.is_Pow and x.exp == sp.Rational(1, 2))
            self.known.append(bool(own and (x == sp.pi or ring.value(x) > 0.0)))
        self.used: dict[Any, None] = {}

    def split(self, p: Any) -> tuple[int, list[Any]]:
        """(sign, factors whose sign is not known) of a polynomial; (0, []) of zero."""
        if not p:
            return 0, []
        constant, factors = p.factor_list()
        sign, rest = 1 if constant > 0 else -1, []
        for f, k in factors:
            own = self.sign(f)
            if own:
                sign *= own**k
            elif k % 2:
                rest.append(f)
            else:
                rest.append(f * f)
        return sign, rest

    def known_of(self, p: Any) -> int:
        """1 or -1 if the product of its factors is known to be greater or less than zero; else 0."""
        sign, rest = self.split(p)
        return 0 if rest else sign

    def sign(self, p: Any) -> int:
        """1 or -1 if all terms have it, with sines or with cosines of the same angle; else 0."""
        if self._within_one(p):
            return 1 if p.evaluate([(g, 0) for g in self.ring.ring.gens]) > 0 else -1
        for x in self.ring.forms(p):
            found = self._of_terms(x)
            if found:
                return found
        return 0

    def _of_terms(self, p: Any) -> int:
        signs = {1 if c > 0 else -1 for c in p.itercoeffs()}
        used = {k for m in p.itermonoms() for k, e in enumerate(m[1:]) if e % 2}
        if len(signs) > 1 or not all(self.known[k] for k in used):
            return 0
        if all(any(e and not e % 2 and not self.known[k] for k, e in enumerate(m[1:])) for m in p.itermonoms()):
            return 0  # squares of what may be zero, and nothing else
        self.used |= {self.ring.ring.gens[k + 1].as_expr(): None for k in used}
        return signs.pop()

    def _within_one(self, p: Any) -> bool:
        """Whether it is 1 + cos or 1 - cos, or the reverse, of an angle whose sine is not zero."""
        sp, x = self.ring.sympy, p.as_expr()
        angles = [c for c in x.atoms(sp.cos) if sp.expand(x - c) in (1, -1) or sp.expand(x + c) in (1, -1)]
        gens = [g.as_expr() for g in self.ring.ring.gens[1:]]
        for c in angles:
            sine = sp.sin(c.args[0])
            if sine in gens and self.known[gens.index(sine)]:
                self.used[sine] = None
                return True
        return False


def sides(ring: Ring, signs: Signs, p: Any) -> tuple[Any, Any]:
    """p > 0 as (what is greater, what is smaller), both greater than zero where that is known of them; else (p, 0)."""
    gens = ring.ring.gens
    for k in range(1, len(gens)):
        if max(m[k] for m in p.itermonoms()) == 1:
            own = ring.ring.from_dict({m: c for m, c in p.iterterms() if m[k]})
            rest = p - own
            a, b = signs.known_of(own), signs.known_of(rest)
            if a * b < 0:
                left, right = (own, -rest) if a > 0 else (rest, -own)
                return readable(ring, left), readable(ring, right)
    return readable(ring, p), ring.sympy.Integer(0)
