"""Tuples of arrays that are laid out once and copied for each run: as new, of one's own, and as compiled code has them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from flyball.compiler.kernels import JoinedBuffer, StructBuffer, StructPool
from flyball.compiler.struct_layout import Column, Complex1, Float1, Float2, Int1, Record, Vector3


class Inner(NamedTuple):
    n: Int1
    x: Complex1


class Outer(NamedTuple):
    a: Float2
    inner: Inner
    none: Float2
    table: Float1


def outer() -> Outer:
    return Outer(
        np.arange(6.0).reshape(2, 3), Inner(np.arange(3), np.full(2, 1j)), np.zeros((0, 4)), np.arange(4.0)
    )  # fmt: skip


def leaves(fields):
    return [y for x in fields for y in (leaves(x) if isinstance(x, tuple) else [x])]


def test_each_is_as_new_and_its_own():
    new = outer()
    pool = StructPool(new, [new.table])
    first = pool.new()
    for mine, at_first in zip(leaves(first.fields), leaves(outer()), strict=True):
        assert mine.dtype == at_first.dtype
        assert mine.shape == at_first.shape
        assert mine.flags.c_contiguous
        assert mine.flags.aligned
        assert np.array_equal(mine, at_first)
    for x in leaves(first.fields)[:-1]:
        x[...] = 7
    new.a[...] = 9  # what it was made of has no say any more
    second = pool.new()
    for mine, at_first in zip(leaves(second.fields), leaves(outer()), strict=True):
        assert np.array_equal(mine, at_first)
    assert first.fields.table is second.fields.table is new.table
    first.array("a")[0, 0] = 5.0
    assert first.fields.a[0, 0] == 5.0
    assert second.fields.a[0, 0] == 0.0


def test_compiled_code_is_told_where_they_are():
    """The same numbers as of the arrays themselves, looked at one by one."""
    new = outer()
    made = StructPool(new, [new.table]).new()
    seen = StructBuffer(made.fields)
    assert np.array_equal(made.words, seen.words)
    assert made.layout == seen.layout


class Both(NamedTuple):
    left: Inner
    right: Outer


def test_joined_are_as_if_written_together():
    left, right = StructPool(outer().inner).new(), StructPool(outer()).new()
    both = JoinedBuffer(Both, left, right)
    seen = StructBuffer(Both(left.fields, right.fields), left)
    assert np.array_equal(both.words, seen.words)
    assert both.layout == seen.layout
    assert both.fields.right is right.fields


class Widths(Record, kind="Float"):
    least: float
    most: float


class WithRecord(NamedTuple):
    table: Float1
    widths: Widths


def test_entries_of_a_record_have_names_in_every_copy():
    new = WithRecord(np.zeros(3), Widths.blank())
    new.widths.most = 2.0
    pool = StructPool(new)
    one, other = pool.new(), pool.new()
    one.fields.widths.least, one.array("widths").most = 1.0, 3.0
    assert one.fields.widths.tolist() == [1.0, 3.0]
    assert (other.fields.widths.least, other.fields.widths.copy().most) == (0.0, 2.0)


class Points(Record, kind="Float", rows=True):
    mass: Column
    place: Vector3


class WithRows(NamedTuple):
    points: Points


def test_a_record_by_rows_has_columns_that_are_views():
    new = WithRows(Points.blank(4))
    new.points.mass[2], new.points.place[2] = 5.0, (1.0, 2.0, 3.0)
    assert new.points[2].tolist() == [5.0, 1.0, 2.0, 3.0]
    made = StructPool(new).new().fields.points
    assert made.mass.shape == (4,)
    assert made.place[2].tolist() == [1.0, 2.0, 3.0]
    new.points.mass = 7.0
    assert new.points[:, 0].tolist() == [7.0] * 4
    with pytest.raises(TypeError, match=r"WithRows\.points: 4 numbers"):
        StructBuffer(WithRows(np.zeros((4, 3)).view(Points)))


def test_names_that_arrays_have_are_refused():
    with pytest.raises(TypeError, match="Sizes: arrays have an attribute 'shape'"):
        type("Sizes", (Record,), {"__annotations__": {"shape": float}}, kind="Float")


CHANGES = {
    "nothing": lambda new: new,
    "an array": lambda new: new._replace(table=np.zeros(9)),
    "an array of an inner tuple": lambda new: new._replace(inner=new.inner._replace(x=np.zeros(5, complex))),
    "all": lambda new: outer(),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_changed_tuple_is_described_as_if_it_were_new(change):
    new = outer()
    first = StructBuffer(new)
    before = first.words.copy()
    changed = CHANGES[change](new)
    again = first.of(changed)
    assert again.words.tolist() == StructBuffer(changed).words.tolist()
    assert again.fields is changed
    assert again.address != first.address
    assert first.words.tolist() == before.tolist()


def test_a_changed_tuple_is_refused_with_an_array_of_another_type():
    new = outer()
    with pytest.raises(TypeError, match=r"Inner\.n: an array of int64"):
        StructBuffer(new).of(new._replace(inner=new.inner._replace(n=np.zeros(3))))
