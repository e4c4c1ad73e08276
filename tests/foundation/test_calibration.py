"""Calibrations: branches, tables, loaded dividers, temperature, tare, and what old records still say."""

from __future__ import annotations

import datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from bufferstand.foundation.channels.calibration import Branch, Calibration, Divider, TemperatureEffect
from bufferstand.foundation.channels.channel import Channel, Plausibility

RISING, FALLING = (0.0, 2.0), (1.0, 2.0)
BRANCHED = Calibration(coefficients=RISING, falling=FALLING, turn_counts=10.0)
WIRE_TABLE = ((0.1, -50.0), (0.3, 52.0), (0.5, 149.0), (0.9, 355.0))


def test_a_load_of_100_kohm_on_1_kohm_costs_0_148_percent_of_full_scale_at_two_thirds_of_travel() -> None:
    """docs/facts/devices.md: 0.148 % at 67 % of travel; 0.015 % with 1 MΩ."""
    travel = np.linspace(0.0, 1.0, 100_001)
    lost = travel - Divider(potentiometer_ohm=1000.0, input_ohm=100e3).load(travel)
    assert lost.max() == pytest.approx(0.00148, abs=5e-6)
    assert travel[lost.argmax()] == pytest.approx(0.67, abs=0.005)
    small = travel - Divider(potentiometer_ohm=1000.0, input_ohm=1e6).load(travel)
    assert small.max() == pytest.approx(0.00015, abs=3e-6)


@given(st.floats(0.0, 1.0), st.floats(100.0, 10e3), st.floats(1e3, 1e7))
def test_the_loaded_divider_is_undone_exactly(wiper: float, pot_ohm: float, input_ohm: float) -> None:
    divider = Divider(potentiometer_ohm=pot_ohm, input_ohm=input_ohm)
    lower, upper = wiper * pot_ohm, (1.0 - wiper) * pot_ohm
    parallel = lower * input_ohm / (lower + input_ohm)  # Kirchhoff, without the formula of the code
    assert float(divider.load(wiper)) == pytest.approx(parallel / (parallel + upper), abs=1e-13)
    assert float(divider.unload(divider.load(wiper))) == pytest.approx(wiper, abs=1e-12)


@pytest.mark.slow
def test_a_ratiometric_reading_does_not_depend_on_the_supply() -> None:
    """The input is a share of the reference: counts of full scale, whatever the volts are."""
    calibration = Calibration(
        input_per_count=1.0 / 65536.0,
        table=WIRE_TABLE,
        divider=Divider(potentiometer_ohm=1000.0, input_ohm=100e3),
    )
    stroke_mm = np.array([-50.0, 0.0, 100.0, 149.0, 355.0, 400.0, -60.0])
    assert calibration.apply(calibration.counts_of(stroke_mm)) == pytest.approx(stroke_mm, abs=1e-6)


@given(st.floats(0.0, 1.0))
def test_a_table_goes_through_its_points_and_stays_monotone(share: float) -> None:
    calibration = Calibration(table=WIRE_TABLE)
    inputs, values = np.array(WIRE_TABLE).T
    assert calibration.apply(inputs) == pytest.approx(values, abs=1e-12)
    assert float(calibration.apply(share + 1e-3)) > float(calibration.apply(share))
    downwards = Calibration(table=tuple((x, -y) for x, y in WIRE_TABLE))  # a wire mounted the other way round
    assert float(downwards.apply(share)) == pytest.approx(-float(calibration.apply(share)), abs=1e-9)


def test_beyond_the_table_the_last_chord_goes_on() -> None:
    calibration = Calibration(table=((0.0, 0.0), (1.0, 10.0), (2.0, 30.0)))
    assert calibration.apply([-1.0, 3.0]) == pytest.approx([-10.0, 50.0])


def test_loading_runs_on_the_rising_branch_and_unloading_on_the_falling_one_without_a_jump() -> None:
    counts = np.concatenate([np.arange(0, 101), np.arange(99, -1, -1)])
    value = BRANCHED.apply(counts)
    assert value[:101] == pytest.approx(2.0 * counts[:101])
    assert value[111:] == pytest.approx(2.0 * counts[111:] + 1.0)
    assert np.abs(np.diff(value)).max() < 2.2  # a jump would be 3
    assert float(BRANCHED.apply([100])[0]) == 200.0


def test_noise_smaller_than_the_turn_does_not_leave_the_branch() -> None:
    counts = np.arange(0, 1000, 10) + np.tile([0, -4], 50)
    assert BRANCHED.apply(counts) == pytest.approx(2.0 * counts, abs=1e-12)


@given(
    st.lists(st.integers(-(2**23), 2**23), min_size=1, max_size=60),
    st.lists(st.integers(1, 20), min_size=1, max_size=60),
)
def test_blocks_of_any_length_scale_to_the_same_bits_as_the_whole(counts: list[int], cuts: list[int]) -> None:
    whole = np.array(counts)
    branch, parts, at = Branch(), [], 0
    for cut in cuts:
        if at < len(whole):
            parts.append(BRANCHED.apply(whole[at : at + cut], branch))
            at += cut
    if at < len(whole):
        parts.append(BRANCHED.apply(whole[at:], branch))
    assert np.array_equal(np.concatenate(parts), BRANCHED.apply(whole))


def test_a_missing_value_does_not_turn_the_branch() -> None:
    value = BRANCHED.apply(np.array([0.0, 50.0, np.nan, 60.0, 30.0, np.nan, 40.0]))
    assert value[[0, 1, 3, 4]].tolist() == [0.0, 100.0, 120.0, 61.0]
    assert np.isnan(value[[2, 5]]).all()
    assert value[6] == 80.0


def test_temperature_moves_zero_by_the_nominal_and_sensitivity_by_the_value() -> None:
    """TK0 0.05 %/10 K of 630 kN is 315 N (docs/facts/devices.md); TKc acts on the value."""
    effect = TemperatureEffect(
        tk0_percent_per_10K=0.05, tkc_percent_per_10K=0.1, nominal=630.0, reference_C=23.0, at_C=43.0
    )
    calibration = Calibration(temperature=effect)
    assert float(calibration.apply(0.63)) == pytest.approx(0.0, abs=1e-12)
    assert float(calibration.apply(500.0 * 1.002 + 0.63)) == pytest.approx(500.0)
    assert float(calibration.apply(500.0, temperature_C=23.0)) == 500.0
    assert float(calibration.apply(calibration.counts_of(123.0))) == pytest.approx(123.0)


def test_the_chain_of_a_force_transducer_counts_to_millivolts_per_volt_to_kilonewton() -> None:
    """24 bit about 0x800000 at 1.05 × 2 mV/V; 2 mV/V are 630 kN; 40 counts of zero; 1 kN of tare."""
    calibration = Calibration(
        zero_counts=40.0,
        input_per_count=2.1 / 0x7FFFFF,
        input_unit="mV/V",
        coefficients=(0.0, 315.0),
        tare=1.0,
    )
    assert float(calibration.apply(40)) == -1.0
    assert float(calibration.apply(0x7FFFFF + 40)) == pytest.approx(1.05 * 630.0 - 1.0)
    assert float(calibration.counts_of(-1.0)) == pytest.approx(40.0)


def test_an_old_record_reads_as_before_and_a_plain_one_is_written_as_before() -> None:
    old = {"id": "a", "coefficients": [0.25, 1e-4], "certificate": "", "date": None, "valid_until": None}
    calibration = Calibration.model_validate(old)
    assert calibration.model_dump(mode="json") == old
    channel = Channel(name="force", quantity="force", unit="kN", calibration=calibration)
    assert "plausible" not in channel.model_dump(mode="json")


def test_a_rich_channel_survives_its_record() -> None:
    channel = Channel(
        name="stroke_1",
        quantity="stroke",
        unit="mm",
        plausible=Plausibility(counts=(16, 65519), rate_per_s=2000.0),
        calibration=Calibration(
            id="in place",
            date=datetime.date(2026, 11, 1),
            table=WIRE_TABLE,
            divider=Divider(potentiometer_ohm=1000.0, input_ohm=1e6),
            input_per_count=2.0**-16,
        ),
    )
    assert Channel.model_validate(channel.model_dump(mode="json")) == channel


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"falling": (0.0, 1.0)}, "a falling branch needs turn_counts"),
        ({"table": ((0.0, 0.0),)}, "two points at least"),
        ({"table": ((0.0, 0.0), (0.0, 1.0))}, "inputs of a calibration table must rise"),
        ({"table": ((0.0, 0.0), (1.0, 1.0), (2.0, 0.5))}, "values of a calibration table must rise, or fall"),
        ({"table": WIRE_TABLE, "coefficients": (1.0, 2.0)}, "either a table or polynomials"),
        ({"input_per_count": 0.0}, "input_per_count = 0"),
        (
            {"date": datetime.date(2026, 1, 2), "valid_until": datetime.date(2026, 1, 1)},
            "valid_until lies before date",
        ),
    ],
)
def test_what_cannot_be_is_refused(wrong: dict[str, object], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        Calibration.model_validate(wrong)


def test_validity_ends_after_its_last_day() -> None:
    calibration = Calibration(valid_until=datetime.date(2026, 11, 20))
    assert not calibration.expired(datetime.date(2026, 11, 20))
    assert calibration.expired(datetime.date(2026, 11, 21))
    assert not Calibration().expired(datetime.date(2026, 11, 21))
