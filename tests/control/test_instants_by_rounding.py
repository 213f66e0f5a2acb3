"""Instants offset + k period that rounding parts from the times that they stand for."""

from __future__ import annotations

from decimal import Decimal

import pytest

import flyball as fb
from tests.control.slide import slide


@pytest.mark.parametrize(("offset", "period"), [("0", "0.03"), ("0.02", "0.01"), ("0.1", "0.1"), ("0.013", "0.05")])
def test_a_law_that_jumps_at_an_instant_is_there_what_it_is_from_then_on(offset, period):
    """11 * 0.03 is a bit less than 0.33: what jumps then was seen a whole period late."""
    for k in (1, 3, 7, 11, 12, 15, 22, 23, 27):
        jump = float(Decimal(offset) + k * Decimal(period))
        held = {"period": float(period), "offset": float(offset)}
        m = slide(fb.StateSpace("s", inputs=[f"where(t < {jump!r}, 0, 1)"], D=[[1]], **held), force="s")
        half = 0.5 * float(period)
        r = m.simulate(jump + float(period), outputs=[0.0, jump - half, jump + half])
        assert r["s.output"].tolist() == [0.0, 0.0, 1.0], (k, jump)
