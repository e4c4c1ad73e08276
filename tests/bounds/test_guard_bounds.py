"""Bounds that depend on other keys, held to figures that were worked out by hand."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.daq.guards.kinds.channel import ChannelGuard
from bufferstand.foundation.errors import BadInput
from bufferstand.protocols.campaign_file.guard_bounds import kept_text
from tests.bounds.files import Files, Table, base_campaign, base_stand, guards_of, with_key

# The sample stand: 600 kN, 250 mm, 800 mm/s, thermometers read once a second; specimen 105 mm; air 21 °C.
BY_HAND = [
    ("limits", "force_trip_kN", 600.0, 630.0),
    ("limits", "stroke_trip_mm", None, 110.25),
    ("limits", "temperature_stop_C", 31.0, 85.0),
    ("limits", "temperature_stale_s", 2.0, 30.0),
    ("limits", "following_error_max_mm", 0.5, 25.0),
    ("guards", "force_below_kN", 1.0, 30.0),
    ("guards", "agreement_kN", 0.5, 30.0),
    ("guards", "tilt_max_mm", 0.1, 12.5),
    ("zero", "wires_apart_max_mm", 0.1, 12.5),
    ("guards", "speed_trip_mm_per_s", 1.0, 1200.0),
    ("motion", "release_speed_mm_per_s", 2.1, 800.0),
]


@pytest.mark.parametrize(("table", "key", "low", "high"), BY_HAND)
def test_at_its_bound_it_is_taken_and_beyond_refused_with_the_bound(
    tmp_path: Path, table: str, key: str, low: float | None, high: float
) -> None:
    files = Files(tmp_path)
    for bound, beyond in ((low, 0.999), (high, 1.001)):
        if bound is None:
            continue
        if (table, key) != ("limits", "temperature_stop_C") or bound == high:
            campaign = with_key(base_campaign(), (table, key), bound)
            files.prepare(campaign=campaign)
        value = bound * beyond if key != "temperature_stop_C" or bound == high else 21.5
        campaign = with_key(base_campaign(), (table, key), value)
        if key == "temperature_stop_C":
            campaign[table]["temperature_resume_C"] = 20.0
        with pytest.raises(BadInput) as caught:
            files.prepare(campaign=campaign)
        said = caught.value.message()
        assert key in said
        assert "campaign.toml: line " in said
        assert f"{22.0 if key == 'temperature_stop_C' and bound == low else bound:g}" in said
        assert repr(value) in said


@pytest.mark.parametrize(
    ("table", "key", "value", "bound"),
    [
        ("limits", "force_trip_kN", 618000.0, "630"),
        ("limits", "stroke_trip_mm", 10000.0, "110.25"),
        ("limits", "temperature_stop_C", 1000.0, "85"),
        ("limits", "temperature_stale_s", 1e9, "30"),
    ],
)
def test_what_switched_a_guard_off_without_a_word_is_refused(
    tmp_path: Path, table: str, key: str, value: float, bound: str
) -> None:
    with pytest.raises(BadInput, match=rf"line 11: limits\.{key}.*{bound}"):
        Files(tmp_path).prepare(campaign=with_key(base_campaign(), (table, key), value))


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        (
            {"limits": {"speed_max_mm_per_s": 0.8}},
            (
                "line 11: limits.speed_max_mm_per_s: release_speed_mm_per_s, which is 20 mm/s where",
                "above its bound of 0.8 mm/s (speed_max_mm_per_s = 0.8 mm/s ([limits] of the campaign))",
                "write release_speed_mm_per_s = 0.8 or less under [motion], or a larger speed_max_mm_per_s",
            ),
        ),
        (
            {"limits": {"speed_max_mm_per_s": 3.0}, "motion": {"release_speed_mm_per_s": 3.0}},
            (
                "line 11: limits.speed_max_mm_per_s: ramp_speed_mm_per_s = 20 mm/s is above",
                "(so fast where ramp_speed_mm_per_s is not written)",
                "nearest admissible: ramp_speed_mm_per_s = 3, under [motion]",
            ),
        ),
        (
            {"conditions": {"ambient_C": 45.0}},
            (
                "line 11: conditions.ambient_C: temperature_stop_C, which is 40 °C where it is not written",
                "below its bound of 46 °C (1 K above [conditions] ambient_C = 45 °C)",
                "write temperature_stop_C = 46 or more under [limits], or a smaller ambient_C",
            ),
        ),
        (
            {"limits": {"force_max_kN": 300.0, "force_trip_kN": 200.0}},
            (
                "line 12: limits.force_trip_kN: force_trip_kN = 200.0 must not be below force_max_kN = 300.0",
                "write force_trip_kN = 300 or more, or a smaller force_max_kN",
            ),
        ),
        (
            {"limits": {"temperature_stop_C": 25.0}},
            (
                "line 11: limits.temperature_stop_C: temperature_resume_C = 30.0 must be below",
                "write temperature_resume_C below 25, or a higher temperature_stop_C",
            ),
        ),
        (
            {"motion": {"release_speed_mm_per_s": 1.0 / 3.0}},
            (
                "line 11: motion.release_speed_mm_per_s: release_speed_mm_per_s = 0.3333333333333333",
                "is below its bound of 2.1 mm/s (stroke_max_mm = 105 mm (max_stroke_mm of the specimen))",
                "write release_speed_mm_per_s = 2.1 or more",
            ),
        ),
    ],
)
def test_a_bound_is_said_at_the_key_that_was_written_with_what_to_write(
    tmp_path: Path, tables: Table, said: tuple[str, ...]
) -> None:
    with pytest.raises(BadInput) as caught:
        Files(tmp_path).prepare(campaign=base_campaign() | tables)
    for part in said:
        assert part in caught.value.message()


@given(st.floats(1e-6, 1e6))
def test_what_is_proposed_keeps_the_bound(bound: float) -> None:
    for up in (True, False):
        proposed = float(kept_text(bound, up=up))
        assert math.isclose(proposed, bound, rel_tol=2e-5)
        assert proposed >= bound * (1.0 - 1e-9) if up else proposed <= bound * (1.0 + 1e-9)


def test_a_step_has_no_higher_stop_than_the_campaign_may_have(tmp_path: Path) -> None:
    own: Table = base_campaign()
    own["step"][0] |= {"temperature_stop_C": 84.0, "temperature_resume_C": 60.0}
    Files(tmp_path).prepare(campaign=own)
    own["step"][0]["temperature_stop_C"] = 20.0
    own["step"][0]["temperature_resume_C"] = 15.0
    with pytest.raises(BadInput, match=r"_stop_C = 20.0 is below its bound of 22 °C .*ambient_C = 21"):
        Files(tmp_path).prepare(campaign=own)


def test_the_stop_lies_below_what_a_corrected_thermometer_shows_without_supply(tmp_path: Path) -> None:
    """A correction by −1 K makes 84 °C of the power-on value: a stop at 84.5 °C would never see it."""
    stand = base_stand()
    stand["temperature"]["sensor"][0]["calibration"] = {"coefficients": [-1.0, 0.0625]}
    campaign = with_key(base_campaign(), ("limits", "temperature_stop_C"), 84.5)
    Files(tmp_path).prepare(campaign=campaign)
    with pytest.raises(BadInput, match="above its bound of 84 °C"):
        Files(tmp_path).prepare(campaign=campaign, stand=stand)


def test_a_silence_is_as_long_as_the_planned_heating_allows(tmp_path: Path) -> None:
    """80 ± 15 mm at 1 Hz: the bound is 5 K over the rate, which here comes from the curve's own energy."""
    step = {"kind": "harmonic", "prestress_mm": 60.0, "amplitude_mm": 30.0, "frequency_Hz": 1.0, "cycles": 20}
    campaign = base_campaign() | {"step": [step]}
    plan = Files(tmp_path).prepare(campaign=campaign).plan
    motion = max(plan.steps[0].estimates, key=lambda one: one.heat_J)
    by_energy = motion.heat_J / motion.duration_s / 15000.0  # W over J/K; nothing is lost to the air
    most_s = 5.0 / by_energy
    assert 5.0 < most_s < 30.0
    Files(tmp_path).prepare(campaign=with_key(campaign, ("limits", "temperature_stale_s"), 0.9 * most_s))
    with pytest.raises(BadInput, match=r"heats the specimen by .* K/s"):
        Files(tmp_path).prepare(campaign=with_key(campaign, ("limits", "temperature_stale_s"), 1.1 * most_s))


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("stand", "tilt_max_mm"), 13.0, "outside 0.1 to 12.5 mm"),
        (("controller", "channel", "[0]", "calibration", "coefficients"), [0.0, 1e-9], "shows at most"),
        (
            ("controller", "channel", "[0]", "calibration", "coefficients"),
            [0.0, 10.0],
            "one count of",
        ),
        (("controller", "channel", "[1]", "calibration", "coefficients"), [-400.0, 0.0076], "shows at most"),
        (("controller", "channel", "[0]", "calibration", "tare"), 9999.0, ""),
        (("temperature", "sensor", "[0]", "calibration", "coefficients"), [0.0, 0.03], "would show"),
        (("temperature", "sensor", "[0]", "calibration", "coefficients"), [-20.0, 0.0625], "would show"),
        (("amplifier", "channel", "calibration", "coefficients"), [0.0, 1e-12], "shows at most"),
        (  # the full scale of a GSV-2, 24 bits, is 580 kN then, and the trip may be 630 kN
            ("amplifier", "channel", "calibration", "coefficients"),
            [0.0, 580.0 / 0x7FFFFF],
            "at most 580 kN",
        ),
        (("amplifier", "channel", "calibration", "coefficients"), [0.0, 630.0 / 0x7FFFFF], ""),
        (("controller", "channel", "[0]", "plausible", "overload"), 1801.0, "above its bound of 1800 kN"),
        (("controller", "watchdog_s"), 60.0, "its bound is 10"),
    ],
)
def test_a_stand_whose_scale_switches_a_guard_off_is_refused(
    tmp_path: Path, path: tuple[str, ...], value: object, said: str
) -> None:
    stand = with_key(base_stand(), path, value)
    if not said:  # a tare is a zero: judged at rest, before anything moves
        Files(tmp_path).prepare(stand=stand)
        return
    with pytest.raises(BadInput, match=said):
        Files(tmp_path).prepare(stand=stand)


def test_what_bounds_a_setting_bounds_the_guard_that_is_made_of_it(tmp_path: Path) -> None:
    campaign = with_key(base_campaign(), ("limits", "force_trip_kN"), 630.0)
    guards = guards_of(Files(tmp_path).prepare(campaign=campaign))
    force = next(one for one in guards.of(ChannelGuard) if one.name == "force")
    assert force.upper is not None
    assert math.isclose(force.upper, 630.0)
