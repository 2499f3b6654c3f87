"""Reading, converting and writing quantities."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from railui.io.number_format import format_quantity, scale_to_prefix
from railui.io.units import UnitError, convert, parse_unit, quantity, split_quantity
from railui.io.yaml_document import parse_yaml
from railui.io.yaml_nodes import parse_scalar
from railui.io.yaml_writer import number_text, scalar_text, text_in_unit_of

SI = [
    "m",
    "kg",
    "s",
    "N",
    "N/m",
    "N*m/rad",
    "N*s/m",
    "N*m*s/rad",
    "kg*m^2",
    "rad",
    "rad/s",
    "m/s",
    "m/s^2",
    "Hz",
    "1",
    "1/m",
    "1/m^2",
    "N*s^2/m^2",
]
finite = st.floats(min_value=1e-12, max_value=1e12) | st.floats(min_value=-1e12, max_value=-1e-12)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("30 kN*s/m", "N*s/m", 30e3),
        ("144 km/h", "m/s", 40.0),
        ("0.3 Hz", "Hz", 0.3),
        ("2.5 m", "m", 2.5),
        ("4 h", "s", 14400.0),
        ("200 kN*m*s/rad", "N*m*s/rad", 200e3),
        ("0.05 mm", "m", 0.05e-3),
        ("-15 1/m", "1/m", -15.0),
        ("-15/m", "1/m", -15.0),
        ("2e4 1/m^2", "1/m^2", 2e4),
        ("0.3 mrad/s", "rad/s", 0.3e-3),
        ("0.05 m/s²", "m/s^2", 0.05),
        ("0.05 m/s2", "m/s^2", 0.05),
        ("0.05 m s-2", "m/s^2", 0.05),
        ("3 kg*m2", "kg*m^2", 3.0),
        ("20 kN/(m/s)", "N*s/m", 20e3),
        ("5 daN", "N", 50.0),
        ("3 deg", "rad", math.radians(3.0)),
        ("5 %", "1", 0.05),
        ("2.9 t", "kg", 2900.0),
        ("3 kN·m", "N*m", 3000.0),
        (1e6, "N/m", 1e6),
        (7, "m", 7.0),
    ],
)
def test_a_quantity_reads_as_its_value_in_si(text: object, unit: str, value: float) -> None:
    assert quantity(text, unit) == pytest.approx(value, rel=1e-15)


def test_a_yaw_stiffness_may_leave_the_radian_out() -> None:
    assert quantity("0.2 MN*m", "N*m/rad") == quantity("0.2 MN*m/rad", "N*m/rad") == 2e5


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("3 kN", "N*m"),
        ("3 N*m/rad", "N*m"),
        ("2 rad/s", "Hz"),
        ("2 Hz", "rad/s"),
        ("5 kg", "N"),
        ("1 m", "1"),
    ],
)
def test_another_dimension_is_rejected_with_an_example(text: str, unit: str) -> None:
    with pytest.raises(UnitError) as caught:
        quantity(text, unit)
    assert "expected" in caught.value.message
    quantity(caught.value.remedy.split("'")[1], unit)  # what it proposes can be read


@pytest.mark.parametrize(
    "text", ["3 m/", "3 (m", "3 m^", "3 m^99", "3 *m", "3 m*", "3 foo", "7,5 mm", "x", "", "1e999 m"]
)
def test_text_that_is_not_a_quantity_is_rejected(text: str) -> None:
    with pytest.raises(UnitError):
        quantity(text, "m")


@pytest.mark.parametrize("value", [None, True, [1], {"a": 1}, math.inf, math.nan])
def test_text_that_is_not_a_number_is_rejected(value: object) -> None:
    with pytest.raises(UnitError):
        quantity(value, "m")


def test_a_decimal_comma_is_reported_with_the_right_text() -> None:
    with pytest.raises(UnitError, match=r"7\.5 mm"):
        quantity("7,5 mm", "m")


def test_seven_millimetres_are_exactly_the_decimal_number() -> None:
    assert quantity("7 mm", "m") == 0.007
    assert quantity("0.2 MN*m/rad", "N*m/rad") == 200000.0


@given(finite, st.sampled_from(SI))
def test_a_displayed_value_reads_back(value: float, unit: str) -> None:
    assert quantity(format_quantity(value, unit, digits=17), unit) == pytest.approx(value, rel=1e-14)


@given(finite, st.sampled_from(SI))
def test_a_prefix_does_not_change_the_quantity(value: float, unit: str) -> None:
    number, name = scale_to_prefix(value, unit)
    assert parse_unit(name).is_compatible(parse_unit(unit))
    assert convert(number, name, unit) == pytest.approx(value, rel=1e-14)


# from the least prefix that is usual with a unit to a thousand of the largest
REACH = {"N": (1.0, 1e12), "N*s/m": (1.0, 1e12), "Hz": (1.0, 1e6), "m": (1e-6, 1e6), "rad/s": (1e-6, 1e3)}


@given(st.floats(0.0, 1.0), st.sampled_from(list(REACH)), st.sampled_from([1.0, -1.0]))
def test_a_prefix_scales_the_number_between_1_and_1000(share: float, unit: str, sign: float) -> None:
    low, high = REACH[unit]
    value = min(max(low * (high / low) ** share, low), math.nextafter(high, 0.0))
    assert 1.0 <= abs(scale_to_prefix(sign * value, unit)[0]) <= 1000.0


@given(finite, st.sampled_from(["mm", "km/h", "kN*s/m", "MN*m/rad", "mrad/s", "t", "min", "deg"]))
def test_a_value_converted_there_and_back_is_the_same(value: float, unit: str) -> None:
    si = {
        "mm": "m",
        "km/h": "m/s",
        "kN*s/m": "N*s/m",
        "MN*m/rad": "N*m/rad",
        "mrad/s": "rad/s",
        "t": "kg",
    }.get(unit)
    target = si or {"min": "s", "deg": "rad"}[unit]
    assert convert(convert(value, target, unit), unit, target) == pytest.approx(value, rel=1e-14)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_is_written_so_that_it_reads_back_the_same(value: float) -> None:
    assert float(parse_scalar(number_text(value))) == value


@given(finite, st.sampled_from(["3.0 MN/m", "7 mm", "2 kN*s/m", 5.0, "9"]))
def test_a_number_in_the_old_unit_reads_back_the_same(value: float, before: object) -> None:
    text = text_in_unit_of(value, before)
    number, unit = split_quantity(text)
    assert (quantity(text, unit) if unit else number) == value


LETTERS = st.characters(
    max_codepoint=0xFFFD, exclude_categories=["Cc", "Cs"], exclude_characters="\x85\u2028\u2029\ufeff"
)


@given(st.text(LETTERS, max_size=30))
def test_a_word_is_written_so_that_yaml_reads_it_back(text: str) -> None:
    assert parse_yaml(f"a: {scalar_text(text)}\nb: [{scalar_text(text)}]\n").value == {"a": text, "b": [text]}
