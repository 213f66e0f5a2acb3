"""Random numbers as mechanisms need them, all from one seed."""

from __future__ import annotations

import math
import random


class Dice:
    """A seeded source of directions, points, sizes and choices."""

    def __init__(self, seed: int, planar: bool) -> None:
        self.random = random.Random(seed)
        self.planar = planar

    def chance(self, p: float) -> bool:
        return self.random.random() < p

    def pick(self, options):
        return self.random.choice(list(options))

    def whole(self, low: int, high: int) -> int:
        return self.random.randint(low, high)

    def number(self, low: float, high: float) -> float:
        return self.random.uniform(low, high)

    def size(self, low: float, high: float) -> float:
        """Evenly spread over the orders of magnitude."""
        return math.exp(self.random.uniform(math.log(low), math.log(high)))

    def vector(self, size: float) -> tuple[float, ...]:
        return tuple(self.random.uniform(-size, size) for _ in range(2 if self.planar else 3))

    def near(self, p, size: float) -> tuple[float, ...]:
        return tuple(x + d for x, d in zip(p, self.vector(size), strict=True))

    def direction(self) -> tuple[float, ...]:
        """Any, or one along an axis of the world: special positions are as likely as general ones."""
        n = 2 if self.planar else 3
        if self.chance(0.5):
            k = self.random.randrange(n)
            return tuple(float(i == k) for i in range(n))
        while True:
            d = [self.random.gauss(0.0, 1.0) for _ in range(n)]
            length = math.sqrt(sum(x * x for x in d))
            if length > 1e-3:
                return tuple(x / length for x in d)

    def square_to(self, d) -> tuple[float, ...]:
        """A direction at right angles to another."""
        if self.planar:
            return -d[1], d[0]
        while True:
            x = cross(d, self.direction())
            length = math.sqrt(sum(c * c for c in x))
            if length > 1e-2:
                return tuple(c / length for c in x)


def cross(a, b) -> tuple[float, float, float]:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def plus(p, s: float, d) -> tuple[float, ...]:
    """P + s d."""
    return tuple(x + s * y for x, y in zip(p, d, strict=True))
