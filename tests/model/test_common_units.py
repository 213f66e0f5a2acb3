"""The table of common units: what pint says of them, and nothing but them."""

import pytest

from flyball.model import units
from flyball.model.units import COMMON, KINDS, common_unit


def by_pint(unit):
    registry = units._registry()
    base = registry.Quantity(1.0, unit).to_base_units()
    powers = tuple(sorted((k, p) for k, p in base.unit_items() if p))
    return base.magnitude, powers, dict(registry.Quantity(1.0, unit).unit_items())


@pytest.mark.parametrize("symbol", COMMON)
def test_each_symbol_is_pints(symbol):
    name, factor, powers = COMMON[symbol]
    size, base, written = by_pint(symbol)
    assert (factor, tuple(sorted(powers.items()))) == (size, base)
    assert written == {name: 1}
    assert units._registry().get_name(symbol) == name


PRODUCTS = [*(k for k in KINDS if k != "1"), "kN/m", "N*mm", "kg*cm^2", "1/s", "rev/s^2", "N/mm*s", "kg*m**2", "m/m"]
PRODUCTS += ["N * s / m", "mm^-1", "N*m/deg", "g/cm^3", "1/min", "deg/s/s", "m*m", "rpm/rpm^2"]


@pytest.mark.parametrize("unit", PRODUCTS)
def test_products_are_pints(unit):
    made = common_unit(unit)
    size, base, written = by_pint(unit)
    assert made.factor == pytest.approx(size, rel=4e-16)
    assert (made.powers, made.written) == (base, written)


@pytest.mark.parametrize("unit", ["furlong", "m m", "m^0.5", "m^12", "(m)", "m^", "*m", "m/", "degC", "m²", "", "2*m"])
def test_another_spelling_is_left_to_pint(unit):
    assert common_unit(unit) is None


def test_a_common_model_reads_without_pint():
    import subprocess
    import sys

    code = (
        "import sys; from flyball.model.units import to_si; to_si('120 rpm', 'rad/s'); assert 'pint' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
