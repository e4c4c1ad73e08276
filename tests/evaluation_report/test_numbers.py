from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.evaluation.report.content import numbers
from bufferstand.evaluation.report.content.content import DASH
from bufferstand.foundation.durations import duration_text


@pytest.mark.parametrize(
    ("value", "expanded", "text"),
    [
        (0.23216, 0.0071, "0.2322 ± 0.0071"),
        (14623.4, 131.0, "14620 ± 130"),
        (18161.0, 134.0, "18160 ± 130"),
        (2.0, 0.0996, "2.00 ± 0.10"),
        (250.0, 99.7, "250 ± 100"),
        (84.317, 1.26, "84.3 ± 1.3"),
        (-3.14159, 0.25, "−3.14 ± 0.25"),
        (5.0, 0.0, "5"),
        (1234.5, 10.0, "1234 ± 10"),
    ],
)
def test_uncertainty_sets_the_digits(value: float, expanded: float, text: str) -> None:
    assert numbers.with_uncertainty(value, expanded) == text


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e5))
def test_a_rounded_value_is_off_by_less_than_a_tenth_of_its_uncertainty(
    value: float, expanded: float
) -> None:
    shown, spread = (
        float(p.replace("−", "-")) for p in numbers.with_uncertainty(value, expanded).split(" ± ")
    )
    assert abs(shown - value) <= max(0.0501 * expanded, 1e-9 * abs(value))
    assert abs(spread - expanded) <= 0.0501 * expanded


@given(st.floats(-1e7, 1e7).filter(lambda v: v == 0 or abs(v) > 1e-6))
def test_significant_digits_lose_at_most_half_of_the_last(value: float) -> None:
    text = numbers.significant(value)
    assert "e" not in text
    assert "-" not in text
    assert float(text.replace("−", "-")) == pytest.approx(value, rel=5.001e-4)


def test_zero_has_no_sign() -> None:
    assert numbers.fixed(-0.0001, 2) == "0.00"


@pytest.mark.parametrize("value", [None, math.nan, math.inf, -math.inf, "12", True])
def test_what_is_no_finite_number_is_a_dash_with_a_reason(value: object) -> None:
    for cell in (
        numbers.quantity_cell("force_max_kN", value, "no samples"),
        numbers.measured_cell(value, 1.0, "no samples"),
    ):
        assert (cell.text, cell.tone, cell.why) == (DASH, "missing", "no samples")


def test_an_unknown_uncertainty_is_left_out_and_not_zero() -> None:
    assert numbers.measured_cell(12.0, None, "").text == "12"
    assert numbers.measured_cell(12.0, math.nan, "").text == "12"


@given(st.floats(1e-6, 1e6), st.integers(2, 4), st.sampled_from([1.0, -1.0]))
def test_just_so_many_digits_are_printed(size: float, digits: int, sign: float) -> None:
    text = numbers.to_digits(sign * size, digits)
    shown = text.lstrip("−0.").replace(".", "")
    assert len(shown) == digits or (len(shown) > digits and "." not in text)
    assert float(text.replace("−", "-")) == pytest.approx(sign * size, rel=0.51 * 10.0 ** (1 - digits))


def test_zeros_at_the_end_are_digits_in_a_column() -> None:
    assert [numbers.to_digits(x, 2) for x in (2.0, 1.1, 0.4, 0.0996, 37.0, 0.0)] == [
        "2.0", "1.1", "0.40", "0.10", "37", "0",
    ]  # fmt: skip


def test_limits_read_as_ranges() -> None:
    assert numbers.limits_text(10.0, 50.0) == "10 … 50"
    assert numbers.limits_text(12500.0, None) == "≥ 12500"
    assert numbers.limits_text(None, 50.0) == "≤ 50"
    assert numbers.limits_text(None, None) == DASH


@pytest.mark.parametrize(
    ("ends", "expanded", "text"),
    [
        ((4.95, 4.953), None, "4.950 … 4.953"),
        ((-0.01, -0.001), None, "−0.010 … −0.001"),
        ((-0.0124, 0.0), None, "−0.012 … 0.000"),
        ((2.025, 2.026), None, "2.025 … 2.026"),
        ((3.0, 3.0), None, "3"),
        ((94.2177, 94.58), 0.24, "94.22 … 94.58"),
        ((18070.0, 18144.0), 130.0, "18070 … 18140"),
    ],
)
def test_both_ends_of_a_range_have_the_same_decimals(
    ends: tuple[float, float], expanded: float | None, text: str
) -> None:
    assert numbers.span_text(*ends, expanded) == text


def test_a_probability_is_never_rounded_to_certainty() -> None:
    assert numbers.probability_text(1.0) == "> 99.9 %"
    assert numbers.probability_text(0.0) == "< 0.1 %"
    assert numbers.probability_text(0.6626) == "66.3 %"


def test_moments_and_durations_read_as_people_write_them() -> None:
    assert numbers.moment_text("2026-03-05T09:00:00+00:00") == "2026-03-05 09:00:00 UTC"
    assert numbers.moment_text("2026-03-05T09:00:00+01:00") == "2026-03-05 09:00:00 UTC+01:00"
    assert numbers.moment_text("yesterday") is None
    assert numbers.moment_text(None) is None
    assert duration_text(42.46) == "42.5 s"
    assert duration_text(725.0) == "12 min 05 s"
    assert duration_text(10_920.0) == "3 h 02 min"
