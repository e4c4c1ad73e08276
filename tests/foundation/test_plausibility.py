"""Readings that cannot be true, and the words in which the engineer hears of them."""

from __future__ import annotations

import numpy as np

from bufferstand.foundation.channels.calibration import Calibration
from bufferstand.foundation.channels.channel import Channel, Plausibility
from bufferstand.foundation.channels.plausibility import PlausibilityWatch

WIRE = Channel(
    name="stroke_1",
    quantity="stroke",
    unit="mm",
    calibration=Calibration(coefficients=(-50.0, 0.01)),
    plausible=Plausibility(counts=(16, 65519), rate_per_s=1500.0),
)
FORCE = Channel(
    name="force",
    quantity="force",
    unit="kN",
    calibration=Calibration(coefficients=(0.0, 1e-4)),
    plausible=Plausibility(counts=(-8388607, 8388607), overload=700.0),
)


def look(
    channel: Channel, counts: list[int], first_us: int = 0, watch: PlausibilityWatch | None = None
) -> list[str]:
    raw = np.array(counts)
    time_us = first_us + 1000 * np.arange(len(counts))
    found = (watch or PlausibilityWatch(channel)).look(time_us, raw, channel.calibration.apply(raw))
    return [f"{item.kind} {item.first} {item.samples}: {item.what}" for item in found]


def test_a_believable_signal_is_left_in_peace() -> None:
    assert look(WIRE, [5000, 5050, 5150, 5290]) == []
    assert look(Channel(name="a", quantity="force", unit="kN"), [10**9]) == []
    assert look(WIRE, []) == []


def test_a_broken_wire_is_named() -> None:
    found = look(WIRE, [20, 0, 0, 0])
    assert len(found) == 1
    assert found[0] == (
        "counts 1 3: stroke_1 reads 0 counts (≤ 16), an end of its converter: a draw wire at its end, or its "
        "cable broken; look at the wire, its plug and its supply"
    )
    assert "(≥ 65519)" in look(WIRE, [65520])[0]


def test_a_wire_that_snaps_is_named_also_between_two_blocks() -> None:
    watch = PlausibilityWatch(WIRE)
    assert look(WIRE, [5000, 5010], 0, watch) == []
    found = look(WIRE, [5210, 5220], 2000, watch)
    assert len(found) == 1
    assert found[0] == (
        "rate 0 1: stroke_1 jumps by +2 mm in 1 ms, faster than 1500 mm/s: a draw wire that snapped, went "
        "slack or snagged, or a loose contact; look at it"
    )


def test_time_that_passed_without_samples_is_no_jump() -> None:
    watch = PlausibilityWatch(WIRE)
    look(WIRE, [5000], 0, watch)
    assert look(WIRE, [9000], 1_000_000, watch) == []


def test_a_saturated_amplifier_and_an_overloaded_transducer_are_told_apart() -> None:
    saturated = look(FORCE, [8388607])
    assert saturated[0].startswith("counts 0 1: force reads 8388607 counts (≥ 8388607)")
    assert "the amplifier is saturated or the bridge open" in saturated[0]
    assert saturated[1].startswith("overload 0 1: force is overloaded: 838.9 kN, the transducer bears 700;")
    overloaded = look(FORCE, [7_100_000, 0])
    assert len(overloaded) == 1
    assert overloaded[0] == (
        "overload 0 1: force is overloaded: 710 kN, the transducer bears 700; "
        "unload, and check its zero afterwards"
    )
