"""From polynomials in a ring to coefficients that people read: common factors cancelled, few sines and cosines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .ring import Ring


def cancelled(ring: Ring, num: Any, den: Any) -> tuple[Any, Any, Any]:
    """(numerator, denominator, what they had in common as a SymPy expression in s, without factors that have none)."""
    common = num.gcd(den) if num else den
    num, den = num.exquo(common), den.exquo(common)
    _, s_part = common.as_expr(), ring.sympy.Integer(1)
    for factor, k in common.factor_list()[1]:
        if any(m[0] for m in factor.itermonoms()):
            s_part *= factor.as_expr() ** k
    return num, den, s_part


def coefficients(ring: Ring, p: Any) -> list[Any]:
    """Of the powers of s, the highest first, factored, as SymPy expressions."""
    return [readable(ring, x) for x in ring.by_powers(p)]


def readable(ring: Ring, p: Any) -> Any:
    """A polynomial as a SymPy expression: whichever of its forms with sines or cosines has fewer terms, factored."""
    sp = ring.sympy
    forms = [ring.ring.one * x for x in ring.forms(p)]
    fewest = min(forms, key=lambda x: (len(x.factor_list()[1][-1][0]) if x.factor_list()[1] else 0, len(x)))
    found = sp.factor_terms(_product(sp, fewest))
    for e in {e.args[0] for e in found.atoms(sp.sin, sp.cos)}:
        c, s = sp.cos(e), sp.sin(e)
        for a, b in ((c, s), (s, c)):
            found = found.subs((a - 1) * (a + 1), -(b**2))
    return _numbers(sp, found)


def _product(sp: Any, p: Any) -> Any:
    """Its factors, each with a positive first term."""
    constant, factors = p.factor_list()
    out = []
    for f, k in factors:
        if k % 2 and sum(1 if c > 0 else -1 for c in f.itercoeffs()) < 0:
            f, constant = -f, -constant
        out.append(f.as_expr() ** k)
    number = sp.Rational(int(constant.numerator), int(constant.denominator))
    return sp.Mul(number, *out)


def _numbers(sp: Any, x: Any) -> Any:
    """Long fractions as decimals."""
    long = {k for k in x.atoms(sp.Rational) if k.q > 1000 or abs(k.p) > 10**6}
    return x.xreplace({k: sp.Float(float(k), 17) for k in long})


def scaled(ring: Ring, num: Any, den: Any) -> tuple[Any, Any]:
    """Without the common rational factor, and the denominator's highest coefficient positive with the own values."""
    first = ring.by_powers(den)[0]
    lead = first.LC
    sign = 1 if ring.number(first) > 0.0 else -1
    whole = _content([*num.itercoeffs(), *den.itercoeffs()])
    by = sign / (whole if whole else abs(lead))
    return num.mul_ground(by), den.mul_ground(by)


def _content(numbers: Sequence[Any]) -> Any:
    """The greatest common divisor of fractions that makes them short whole numbers; 0 if there is none."""
    from math import gcd, lcm

    above, below = 0, 1
    for c in numbers:
        above, below = gcd(above, int(c.numerator)), lcm(below, int(c.denominator))
    largest = max((abs(int(c.numerator)) * below // int(c.denominator) for c in numbers), default=0)
    if not above or largest // above > 10**4:
        return 0
    return type(next(iter(numbers)))(above) / below
