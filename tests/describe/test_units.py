"""Quantities as people write them."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from microslip.describe import units


@pytest.mark.parametrize(
    ("kind", "text", "value"),
    [
        (units.LENGTH, "12.5 mm", 0.0125),
        (units.LENGTH, "12.5mm", 0.0125),
        (units.LENGTH, 0.0125, 0.0125),
        (units.LENGTH, "0.0125", 0.0125),
        (units.LENGTH, "1 inch", 0.0254),
        (units.MODULUS, "70 GPa", 70e9),
        (units.MODULUS, "70e3 N/mm^2", 70e9),
        (units.TIME, "0.73 us", 0.73e-6),
        (units.TIME, "0.73 µs", 0.73e-6),
        (units.DENSITY, "2 g/cm^3", 2000.0),
        (units.DENSITY, "2 g/cm³", 2000.0),
        (units.LINE_FORCE, "1 MN/m", 1e6),
        (units.LINE_STIFFNESS, "1e5 N/m/m", 1e5),
        (units.AREA_STIFFNESS, "1e13 Pa/m", 1e13),
        (units.FREQUENCY, "165 Hz", 165.0),
        (units.LINE_MOMENT, "150 N*m/m", 150.0),
        (units.LINE_MOMENT, "150 N·m/m", 150.0),
        (units.RATE, "5 1/s", 5.0),
        (units.NUMBER, "25 %", 0.25),
    ],
)
def test_quantities_as_people_write_them(kind, text, value):
    assert kind.parse(text) == value


@given(st.floats(1e-9, 1e9))
def test_millimetres_equal_metres(metres):
    # a decimal shift of the text, exact, so the two floats must be the same
    digits, exponent = f"{metres:.16e}".split("e")
    in_mm = f"{digits}e{int(exponent) + 3} mm"
    assert units.LENGTH.parse(in_mm) == units.LENGTH.parse(f"{metres:.16e} m") == metres


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_plain_numbers_are_si(value):
    for kind in (units.LENGTH, units.MODULUS, units.FREQUENCY):
        assert kind.parse(value) == value
        assert kind.parse(repr(value)) == value


@given(st.text(max_size=30))
def test_any_text_parses_to_a_finite_number_or_is_refused(text):
    try:
        value = units.LENGTH.parse(text)
    except ValueError:
        return
    assert math.isfinite(value)


@pytest.mark.parametrize(
    "text",
    ["nan", "nan mm", "inf", "-inf m", "1e999 m", "", "mm", "1,5 mm", "5 m/", "5 m**9**9**9"],
)
def test_not_a_quantity(text):
    with pytest.raises(ValueError, match=r'a length, for example "12.5 mm"'):
        units.LENGTH.parse(text)


@pytest.mark.parametrize("value", [True, None, [1.0], {}, float("nan"), float("inf"), 10**400])
def test_not_a_number(value):
    with pytest.raises(ValueError, match="a length"):
        units.LENGTH.parse(value)


@pytest.mark.parametrize("text", ["60 rpm", "1000 rad/s"])
def test_angular_frequency_is_not_taken_for_hertz(text):
    with pytest.raises(ValueError, match=r"angular frequency.*165 Hz"):
        units.FREQUENCY.parse(text)
