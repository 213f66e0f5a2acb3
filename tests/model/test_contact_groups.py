"""Who may touch whom, against the rules told one pair at a time, for models made by the dice."""

from __future__ import annotations

import random

import pytest

import flyball as fb
from flyball.errors import ModelError
from tests.model.test_contact import BOX, pairs, tables


def scene(dice: random.Random) -> fb.Mechanism:
    m = fb.Mechanism("dice")
    for k in range(dice.randint(0, 3)):
        m.add(fb.Ground(f"g{k}", shape=BOX))
    for k in range(dice.randint(1, 5)):
        m.add(fb.Body(f"b{k}", shape=BOX, density=1))
    for k in range(dice.randint(0, 2)):
        m.add(fb.Bodies(f"n{k}", shape=BOX, density=1, position=[(0, 0, 0)] * dice.randint(1, 2)))
    names = ["ground", *(b.name for b in m.bodies)]
    for k in range(dice.randint(0, 4)):
        a, b = dice.sample(names, 2) if len(names) > 1 else ("ground", "b0")
        m.add(fb.Distance(f"j{k}", a, b, at=((0, 0, 0), (1, 0, 0))))
    every = [*(g.name for g in m.ground), *(b.name for b in m.bodies), *(b.name for b in m.bulk)]
    every += ["ground"] * bool(m.ground)

    def some() -> list[str]:
        return dice.sample(every, dice.randint(1, len(every)))

    if dice.random() < 0.7:
        m.add(fb.Contact("all", friction=0.1, joined=dice.random() < 0.5, exclude=excluded(dice, every)))
    for k in range(dice.randint(0, 3)):
        others = some() if dice.random() < 0.5 else None
        try:
            m.add(fb.Contact(f"c{k}", between=some(), others=others, friction=0.2 + k, joined=dice.random() < 0.5,
                             exclude=excluded(dice, every)))  # fmt: skip
        except ModelError as error:
            assert "; two contacts that name bodies" in str(error)
    return m


def excluded(dice: random.Random, every: list[str]) -> list[tuple[str, ...]]:
    return [tuple(dice.sample(every, 2)) for _ in range(dice.randint(0, 2))] if len(every) > 1 else []


def told(m: fb.Mechanism, a: str, b: str) -> fb.Contact | None:
    """The contact that holds for two parts, by the words of the documentation."""
    kinds = [type(m[x]) for x in (a, b)]
    if kinds == [fb.Ground, fb.Ground] or (a == b and (kinds[0] is not fb.Bodies or m[a].count == 1)):
        return None

    def among(name: str, names: tuple[str, ...]) -> bool:
        return name in names or ("ground" in names and isinstance(m[name], fb.Ground))

    for c in m.contacts:
        for x, y in c.exclude:
            if (among(a, (x,)) and among(b, (y,))) or (among(a, (y,)) and among(b, (x,))):
                return None
    found = None
    for c in m.contacts:
        if c.between is None:
            found = found or c
            continue
        others = c.others or c.between
        if (among(a, c.between) and among(b, others)) or (among(b, c.between) and among(a, others)):
            found = c
    if found and not found.joined and any({j.body_i, j.body_j} == {a, b} for j in m.joints):
        return None
    return found


@pytest.mark.parametrize("seed", range(60))
def test_groups_are_what_is_told(seed: int) -> None:
    m = scene(random.Random(seed))
    every = [*(g.name for g in m.ground), *(b.name for b in m.bodies), *(b.name for b in m.bulk)]
    if not m.contacts:
        m.add(fb.Contact(friction=0.1))
    t = tables(m)
    found = {frozenset((x.partition("[")[0], y.partition("[")[0])) for x, y in pairs(t)}
    wanted = {frozenset((a, b)): c for k, a in enumerate(every) for b in every[k:] if (c := told(m, a, b))}
    assert found == set(wanted)
    names = [t.parts[k] for k in t.part]
    for pair, c in wanted.items():
        i, j = (names.index(x) for x in sorted(pair) * (3 - len(pair)))
        row = t.surfaces.pair[t.geometry.shape[i, 8], t.geometry.shape[j, 8]]
        assert row[0] == c.friction


def test_too_many_groups() -> None:
    m = fb.Mechanism("crowd")
    for k in range(130):
        m.add(fb.Body(f"b{k}", shape=BOX, density=1))
    for k in range(65):
        m.add(fb.Contact(f"c{k}", between=[f"b{2 * k}", f"b{2 * k + 1}"], friction=0.1))
    with pytest.raises(
        fb.ModelError, match=r"the contacts of 'crowd' distinguish 65 groups of bodies; 62 are possible"
    ):
        tables(m)
