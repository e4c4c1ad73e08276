"""Transducers: delay, counts, noise, wires, resampling, ring."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.drivers.simulated.machine.ring import SampleRing
from bufferstand.drivers.simulated.transducers import Converter, Converters, Delay, DrawWires, Resampler
from bufferstand.foundation.channels.calibration import Calibration, Divider
from bufferstand.foundation.channels.channel import Channel
from bufferstand.foundation.errors import BadInput


def channel(zero: float = 0.0, slope: float = 0.01, *more: float) -> Channel:
    return Channel(
        name="force", quantity="force", unit="kN", calibration=Calibration(coefficients=(zero, slope, *more))
    )


@pytest.mark.parametrize("delay_s", [0.0, 0.0003, 0.0008, 0.001, 0.0042])
def test_pure_delay_is_exact_on_a_ramp(delay_s: float) -> None:
    path = Delay(delay_s, 0.001)
    out = [path.push(0.001 * n) for n in range(50)]
    assert out[20:] == pytest.approx([0.001 * n - delay_s for n in range(20, 50)], abs=1e-12)


def test_low_pass_lags_a_ramp_by_its_time_constant() -> None:
    path = Delay(0.0, 1e-5, low_pass_Hz=100.0)
    out = [path.push(1e-5 * n) for n in range(3000)]
    assert 2999e-5 - out[-1] == pytest.approx(1.0 / (2 * np.pi * 100.0), rel=0.01)


def test_settled_path_gives_the_value() -> None:
    path = Delay(0.003, 0.001, low_pass_Hz=50.0)
    path.settle(7.0)
    assert path.push(7.0) == 7.0


def test_negative_delay_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot be negative"):
        Delay(-1e-3, 1e-3)


@given(
    value=st.floats(-300.0, 300.0), zero=st.floats(-50.0, 50.0), slope=st.sampled_from([0.01, -0.007, 1e-4])
)
def test_counts_invert_the_calibration_to_half_a_count(value: float, zero: float, slope: float) -> None:
    converters = Converters(
        (Converter(channel(zero, slope), -(10**9), 10**9, 0.0),), np.random.SeedSequence(1)
    )
    counts = converters.counts(np.array([[value]]))
    assert counts[0, 0] == round(counts[0, 0])
    assert channel(zero, slope).calibration.apply(counts)[0, 0] == pytest.approx(value, abs=0.51 * abs(slope))
    assert converters.values(counts)[0, 0] == pytest.approx(value, abs=0.51 * abs(slope))


def test_converter_saturates() -> None:
    converters = Converters((Converter(channel(), 0, 65535, 0.0),), np.random.SeedSequence(1))
    assert converters.counts(np.array([[-5.0], [1e6]]))[:, 0].tolist() == [0.0, 65535.0]


def test_noise_has_its_size_and_does_not_depend_on_slices() -> None:
    def make() -> Converters:
        pair = (
            Converter(channel(0.0, 1e-5), -(2**31), 2**31 - 1, 0.15),
            Converter(channel(0.0, 1e-5), -(2**31), 2**31 - 1, 0.0),
        )
        return Converters(pair, np.random.SeedSequence(7))

    whole = make().counts(np.zeros((5000, 2)))
    pieces = make()
    parts = np.concatenate([pieces.counts(np.zeros((n, 2))) for n in (1, 999, 17, 3983)])
    assert np.array_equal(whole, parts)
    assert np.std(whole[:, 0]) * 1e-5 == pytest.approx(0.15, rel=0.05)
    assert not whole[:, 1].any()


def test_calibration_of_higher_degree_is_refused() -> None:
    with pytest.raises(BadInput, match="not of first degree"):
        Converters((Converter(channel(0.0, 1.0, 0.1), 0, 1, 0.0),), np.random.SeedSequence(1))


def test_wires_agree_at_zero_tilt_apart_and_average_to_the_stroke() -> None:
    pair = DrawWires(0.03, 0.001)
    felt = pair.feel(np.array([0.0, 50.0, 100.0]))
    assert felt[0] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert felt[:, 0] - felt[:, 1] == pytest.approx([0.0, 0.1, 0.2], abs=0.13)
    assert felt.mean(axis=1) == pytest.approx([0.0, 50.0, 100.0], abs=0.06)
    straight = DrawWires(0.0, 0.002).feel(np.array([80.0]))
    assert straight[0] == pytest.approx([80.16, 79.84])


def test_resampler_gives_each_instant_once_and_is_exact_on_a_line() -> None:
    resampler = Resampler(250.0, 0.002)
    dues, values = [], []
    rng = np.random.default_rng(3)
    at = 0
    while at < 4000:
        n = int(rng.integers(1, 90))
        time_s = np.arange(at + 1, at + n + 1) / 1000.0
        due, value = resampler.take(time_s, 5.0 * time_s)
        dues.append(due)
        values.append(value)
        at += n
    due_s, value_kN = np.concatenate(dues), np.concatenate(values)
    assert np.allclose(np.diff(due_s), 0.004)
    assert due_s.size >= 4000 / 4 - 10
    assert value_kN[2:] == pytest.approx(5.0 * (due_s[2:] - 0.002), abs=1e-9)


def rows(first: int, count: int) -> np.ndarray:
    n = np.arange(first, first + count)
    return np.stack([n * 1000 % 2**32, -n, n % 65536, n % 65536, n % 3000, -(n % 3000)], axis=1)


def test_ring_gives_back_what_went_in_across_its_end() -> None:
    ring = SampleRing(100)
    for first in range(0, 230, 23):
        ring.append(rows(first, 23))
    assert (ring.total, ring.oldest) == (230, 130)
    first, columns = ring.window(190, 30)
    assert first == 190
    assert columns["force"].tolist() == [-n for n in range(190, 220)]
    assert columns["tick"].dtype == np.uint32
    assert columns["position"].tolist() == [n % 3000 for n in range(190, 220)]
    assert ring.overruns == 0


def test_ring_counts_overruns_and_answers_with_the_oldest() -> None:
    ring = SampleRing(100)
    for first in range(0, 300, 50):
        ring.append(rows(first, 50))
    first, columns = ring.window(10, 15)
    assert (first, ring.overruns) == (200, 1)
    assert columns["force"][0] == -200


def test_ring_answers_a_wish_for_the_future_with_nothing() -> None:
    ring = SampleRing(100)
    ring.append(rows(0, 40))
    first, columns = ring.window(40, 15)
    assert (first, columns["tick"].size) == (40, 0)
    assert ring.window(1000, 15)[0] == 40


@given(total=st.integers(0, 2**40), behind=st.integers(0, 2**31 - 1))
def test_32_bits_mean_the_sequence_closest_to_the_newest(total: int, behind: int) -> None:
    ring = SampleRing(4)
    ring.total = total
    assert ring.absolute((total - behind) % 2**32) == total - behind


def test_a_curved_calibration_is_inverted_too() -> None:
    """A draw wire behind a loaded converter, calibrated in place by a table."""
    wire = Channel(
        name="stroke_1",
        quantity="stroke",
        unit="mm",
        calibration=Calibration(
            table=((0.1, -50.0), (0.3, 52.0), (0.9, 355.0)),
            divider=Divider(potentiometer_ohm=1000.0, input_ohm=100e3),
            input_per_count=2.0**-16,
        ),
    )
    pair = Converters(
        (Converter(wire, 0, 65535, 0.0), Converter(channel(), 0, 65535, 0.0)), np.random.SeedSequence(1)
    )
    stroke_mm = np.array([[-20.0, 1.0], [0.0, 2.0], [100.0, 3.0], [250.0, 4.0]])
    counts = pair.counts(stroke_mm)
    assert np.array_equal(counts, np.rint(counts))
    assert pair.values(counts) == pytest.approx(stroke_mm, abs=0.006)
    assert wire.calibration.apply(counts[:, 0]) == pytest.approx(pair.values(counts)[:, 0])
