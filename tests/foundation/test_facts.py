"""Units, hashes, calibrations, specimens and stand time."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bufferstand.foundation.channels.calibration import Calibration
from bufferstand.foundation.channels.channel import Channel
from bufferstand.foundation.clock import WallClock
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.files.hashes import canonical_json, content_hash, file_hash
from bufferstand.foundation.specimen.file import load_specimen
from bufferstand.foundation.units import FACTORS, INSIDE_UNIT, conversion, to_inside


@pytest.mark.parametrize(
    ("quantity", "unit", "given_value", "inside"),
    [
        ("force", "lbf", 1.0, 0.0044482216152605),
        ("force", "kip", 1.0, 4.4482216152605),
        ("force", "N", 250.0, 0.25),
        ("stroke", "in", 1.0, 25.4),
        ("stroke", "m", 0.105, 105.0),
        ("time", "min", 1.5, 90.0),
        ("temperature", "K", 313.15, 40.0),
        ("temperature", "°F", 104.0, 40.0),
        ("temperature", "°F", -40.0, -40.0),
        ("speed", "m/s", 0.05, 50.0),
    ],
)
def test_known_conversions(quantity: str, unit: str, given_value: float, inside: float) -> None:
    assert to_inside(given_value, quantity, unit) == pytest.approx(inside, rel=1e-12, abs=1e-12)


@given(st.floats(-1e6, 1e6), st.sampled_from([(q, u) for q, units in FACTORS.items() for u in units]))
def test_every_conversion_can_be_undone(value: float, which: tuple[str, str]) -> None:
    factor, offset = conversion(*which)
    assert (to_inside(value, *which) - offset) / factor == pytest.approx(value, rel=1e-9, abs=1e-6)


def test_inside_units_are_converted_by_nothing() -> None:
    assert all(FACTORS[quantity][unit] == (1.0, 0.0) for quantity, unit in INSIDE_UNIT.items())


def test_unknown_unit_lists_the_known() -> None:
    with pytest.raises(BadInput, match="“furlong” is not understood for stroke; use one of mm, m, in"):
        to_inside(1.0, "stroke", "furlong")


def test_hash_does_not_depend_on_order_and_refuses_nan() -> None:
    assert content_hash({"a": 1, "b": [1.5, "é"]}) == content_hash({"b": [1.5, "é"], "a": 1})
    assert content_hash({"a": 1}) != content_hash({"a": 2})
    assert json.loads(canonical_json({"b": None})) == {"b": None}
    with pytest.raises(ValueError, match="not JSON compliant"):
        canonical_json({"a": float("nan")})


def test_file_hash_of_known_bytes(tmp_path: Path) -> None:
    (tmp_path / "f").write_bytes(b"abc")
    assert file_hash(tmp_path / "f").startswith("ba7816bf8f01cfea")  # FIPS 180-4 example


@given(
    st.lists(st.floats(-10, 10), min_size=1, max_size=5),
    st.lists(st.integers(-1000, 1000), min_size=1, max_size=20),
)
def test_calibration_is_the_polynomial(coefficients: list[float], counts: list[int]) -> None:
    value = Calibration(coefficients=tuple(coefficients)).apply(np.array(counts, dtype=np.int32))
    expected = np.polynomial.polynomial.polyval(np.array(counts, dtype=float), coefficients)
    np.testing.assert_allclose(value, expected, rtol=1e-12, atol=1e-9)


def test_linear_calibration_can_be_inverted_and_others_cannot() -> None:
    calibration = Calibration(coefficients=(2.0, 0.5))
    assert calibration.apply(calibration.invert_linear(7.0)) == 7.0
    with pytest.raises(ValueError, match="not linear"):
        Calibration(coefficients=(0.0, 1.0, 2.0)).invert_linear(1.0)


def test_channel_survives_json() -> None:
    channel = Channel.model_validate(
        {
            "name": "force",
            "quantity": "force",
            "unit": "kN",
            "calibration": {"coefficients": [0, 2.0], "date": "2026-01-02"},
        }
    )
    assert Channel.model_validate_json(channel.model_dump_json()) == channel
    assert Channel.model_validate(channel.model_dump(mode="json")) == channel


def test_specimen_file(tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text('[specimen]\nid = "B-7"\nkind = "buffer"\nelastic_sistem = "elastomer"\n')
    with pytest.raises(BadInput, match=r"line 4: specimen.elastic_sistem: .*did you mean “elastic_system”"):
        load_specimen(path)
    path.write_text('[specimen]\nid = "B-7"\nassembled = "2026-01-01T08:00"\n[test]\nkind = "static"\n')
    loaded = load_specimen(path)
    assert loaded.specimen.kind == "buffer"
    assert loaded.test.kind == "static"


def test_stand_time_runs_at_its_speed() -> None:
    clock = WallClock(speed=50.0)
    before, wall = clock.now_s(), clock.wall_s()
    time.sleep(0.01)
    after, wall_after = clock.now_s(), clock.wall_s()
    # the two readings of each pair are taken one after the other, so the ratio is bounded, not exact
    assert after - before >= 50.0 * 0.01
    assert after >= before
    assert wall_after > wall
    with pytest.raises(ValueError, match="positive"):
        WallClock(speed=0.0)
