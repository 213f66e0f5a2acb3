"""In which order operations are written down, so that a processor has enough to do and enough registers."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Any

from ..node import Node
from ..operations import ADD, MULTIPLY, NUMBER

ABREAST = 4  # of a long chain of comparisons, how many go on side by side


def arguments(x: Node) -> tuple[Node, ...]:
    """What an operation is written with."""
    return (x.op == "choose" and compared(x)) or x.args


def compared(x: Node) -> tuple[Node, Node] | None:
    """The two of which ``choose(a - b, a, b)`` is the larger; None if x is something else."""
    by, a, b = x.args
    if by.op != ADD:
        return None
    for first, second in (by.args, by.args[::-1]):
        less = second.op == MULTIPLY and second.args[0].op == NUMBER and second.args[0].value == -1.0
        if first is a and (
            (less and second.args[1] is b) or (b.op == NUMBER == second.op and second.value == -b.value)
        ):
            return a, b
    return None


def operations(nodes: Iterable[Any], reads: Collection[int]) -> list[Node]:
    """What has to be reckoned, or read, for these expressions, in the order in which it was made."""
    found: dict[int, Node] = {}
    to_see = [x for x in nodes if isinstance(x, Node)]
    while to_see:
        x = to_see.pop()
        if x.index not in found:
            found[x.index] = x
            if x.index not in reads:
                to_see.extend(arguments(x))
    return [found[k] for k in sorted(found)]


def depth_first(nodes: Iterable[Any], reads: Collection[int]) -> list[Node]:
    """The same, each right before it is needed: values wait for less time, in registers."""
    seen: set[int] = set()
    order: list[Node] = []
    for root in sorted({x.index: x for x in nodes if isinstance(x, Node)}.values(), key=lambda x: x.index):
        stack = [(root, 0)]
        while stack:
            x, k = stack.pop()
            if x.index in seen:
                continue
            args = () if x.index in reads else arguments(x)
            if k < len(args):
                stack += [(x, k + 1), (args[k], 0)]
            else:
                seen.add(x.index)
                order.append(x)
    return order


def chains(order: Sequence[Node], reads: Collection[int]) -> dict[int, tuple[Node | None, list[Node]]]:
    """Comparisons one after the other, as several chains abreast.

    For each of ``order`` that is the larger of two: an earlier one of its chain, or None, and what it is compared with.
    """
    larger = {x.index for x in order if x.index not in reads and x.op == "choose" and compared(x)}
    uses: dict[int, int] = {}
    for x in order:
        for a in () if x.index in reads else arguments(x):
            uses[a.index] = uses.get(a.index, 0) + 1
    behind: dict[int, list[Node]] = {}  # of each, the chain that it ends
    out: dict[int, tuple[Node | None, list[Node]]] = {}
    follows: set[int] = set()
    for x in order:
        if x.index in larger:
            first, second = arguments(x)
            chain = behind.get(first.index, []) if first.index in larger and uses[first.index] == 1 else []
            follows |= {first.index} if chain else set()
            behind[x.index] = [*chain, x]
            out[x.index] = (None, [first, second])
    for end in [k for k in behind if k not in follows]:
        chain = behind[end]
        for k, x in enumerate(chain[1:-1], 1):
            begun = chain[k - ABREAST] if k >= ABREAST else None
            out[x.index] = (begun, [arguments(x)[1]])
        if len(chain) > 1:
            others = chain[-1 - ABREAST : -1]
            out[end] = (None, [*others, arguments(chain[-1])[1]])
    return out
