"""Who may touch whom: owners of shapes in groups that behave alike, and the contact that holds for each two groups."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from ...errors import ModelError
from ...model.body import GROUND, Body
from ...model.contact import Contact
from ...model.model import Model
from ...model.touching import Owner

MOST = 62  # groups, a bit of a whole number each


@dataclass(frozen=True)
class Groups:
    """Owners of shapes by what they may touch.

    Attributes
    ----------
    of : dict
        Owner -> its group.
    holds : dict
        Pair of groups -> the contact that holds for them; pairs that do not touch are not in it.
    apart : set
        Pairs of single bodies, the first the smaller, that do not touch for all that.
    """

    of: Mapping[str, int]
    holds: Mapping[tuple[int, int], Contact]
    apart: frozenset[tuple[str, str]]

    def meets(self, group: int) -> int:
        """Groups that a group touches, as bits."""
        return sum(1 << b for a, b in self.holds if a == group)


def groups(model: Model, owners: Iterable[Owner]) -> Groups:
    """Groups of owners.

    Raises
    ------
    ModelError
        If there are too many.
    """
    owners = list(owners)
    out = _Excluded(model)
    every = {g.name for g in model.ground}
    lists = [(c, _expanded(c.between, every), _expanded(c.others, every)) for c in model.contacts]
    signature = {
        e.name: (
            tuple((b is None or e.name in b, o is not None and e.name in o) for _, b, o in lists),
            e.name if e.name in out.coarse and not isinstance(e, Body) else "",
            out.met_by(e.name) if isinstance(e, Body) else frozenset(),
        )
        for e in owners
    }
    number = {s: k for k, s in enumerate(dict.fromkeys(signature.values()))}
    if len(number) > MOST:
        raise ModelError(
            f"the contacts of {model.name!r} tell {len(number)} groups of bodies apart; {MOST} are possible. Name "
            f"fewer bodies in between=, others= and exclude=, and give them materials where only friction differs"
        )
    holds = {}
    for s, a in number.items():
        for t, b in number.items():
            c = _holding(lists, s[0], t[0])
            if c is not None and t[1] not in out.of(s[1]) and not (t[1] in s[2] or s[1] in t[2]):
                holds[a, b] = c
    of = {name: number[s] for name, s in signature.items()}
    return Groups(of, holds, _apart(model, of, holds, out))


def _expanded(names: tuple[str, ...] | None, every: set[str]) -> set[str] | None:
    """Names, with the parts of ground in place of ground."""
    if names is None:
        return None
    return set(names) - {GROUND} | (every if GROUND in names else set())


def _holding(lists: list, s: tuple, t: tuple) -> Contact | None:
    """The contact that holds for two signatures: one that names them before one for everything."""
    found = None
    for k, (c, between, others) in enumerate(lists):
        if between is None:
            found = found or c
        elif others is None:
            if s[k][0] and t[k][0]:
                return c
        elif (s[k][0] and t[k][1]) or (s[k][1] and t[k][0]):
            return c
    return found


class _Excluded:
    """Exclusions: between single bodies one by one, of ground and many bodies by groups."""

    def __init__(self, model: Model) -> None:
        every = [g.name for g in model.ground]
        self.single: set[tuple[str, str]] = set()
        self._with: dict[str, set[str]] = {}
        for c in model.contacts:
            for pair in c.exclude:
                first, second = (every if x == GROUND else [x] for x in pair)
                for a in first:
                    for b in second:
                        if isinstance(model.find(a), Body) and isinstance(model.find(b), Body):
                            self.single.add((min(a, b), max(a, b)))
                        else:
                            self._with.setdefault(a, set()).add(b)
                            self._with.setdefault(b, set()).add(a)
        self.coarse = set(self._with)

    def of(self, name: str) -> set[str]:
        """What it does not touch."""
        return self._with.get(name, set())

    def met_by(self, name: str) -> frozenset[str]:
        """The same, as part of a signature."""
        return frozenset(self.of(name))


def _apart(model: Model, of: Mapping[str, int], holds: Mapping, out: _Excluded) -> frozenset[tuple[str, str]]:
    """Single bodies that are excluded, or that a joint connects where the contact leaves such out."""
    found = set(out.single)
    for j in model.joints:
        a, b = sorted((model.carrier(j.body_i, j), model.carrier(j.body_j, j)))
        if a in of and b in of:
            c = holds.get((of[a], of[b]))
            if c is not None and not c.joined:
                found.add((a, b))
    return frozenset(p for p in found if p[0] in of and p[1] in of)
