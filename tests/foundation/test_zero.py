"""The zero as data: what it makes of a channel, and what is refused."""

from __future__ import annotations

import math
from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from bufferstand.foundation.channels.calibration import Calibration
from bufferstand.foundation.channels.channel import Channel, ChannelUncertainty
from bufferstand.foundation.channels.zero import ChannelZero, Zero, rounded_up

WIRE = Channel(
    name="stroke_1",
    quantity="stroke",
    unit="mm",
    calibration=Calibration(coefficients=(-50.0, 0.0076), tare=0.25),
    uncertainty=ChannelUncertainty(linearity=0.25, zero=0.05),
)


def zero_of(value: float, u: float = 0.03, name: str = "stroke_1") -> Zero:
    one = ChannelZero(name=name, unit="mm", value=value, u=u)
    return Zero(how="tare", found=datetime(2026, 3, 5, tzinfo=UTC), channel=(one,))


@given(st.floats(-10.0, 10.0), st.sampled_from([0.0, 1e-4, 0.029, 0.5]))
def test_a_channel_counts_from_its_zero_and_states_its_limit(value: float, u: float) -> None:
    counts = np.array([0.0, 6578.0, 9000.0])
    channel = zero_of(value, u).apply(WIRE)
    assert channel.calibration.apply(counts) == pytest.approx(
        WIRE.calibration.apply(counts) - value, abs=1e-9
    )
    limit = channel.uncertainty.zero
    assert limit is not None
    assert math.sqrt(3.0) * u <= limit * (1.0 + 1e-9) <= 1.11 * math.sqrt(3.0) * u + 1e-12
    assert channel.uncertainty.linearity == 0.25


def test_other_channels_stay_as_they_are() -> None:
    assert zero_of(1.5, name="force").apply(WIRE) is WIRE


def test_it_survives_its_document() -> None:
    zero = zero_of(1.5)
    assert Zero.model_validate(zero.document()) == zero
    assert "touch" not in zero.document()


def test_two_zeros_of_one_channel_or_a_touch_without_facts_are_none() -> None:
    one = ChannelZero(name="force", unit="kN", value=0.1, u=0.1)
    with pytest.raises(ValidationError, match="two zeros"):
        Zero(how="tare", found=datetime.now(UTC), channel=(one, one))
    with pytest.raises(ValidationError, match="how the touch went"):
        Zero(how="touch", found=datetime.now(UTC), channel=(one,))


@given(st.floats(1e-6, 1e4))
def test_a_limit_is_never_rounded_down(value: float) -> None:
    assert value * (1.0 - 1e-9) <= rounded_up(value) <= value * 1.1 + 1e-12
