"""Every number of a stand file for record-only mode: at its bounds, beyond them, and as nonsense."""

from __future__ import annotations

from pathlib import Path

import pytest

from bufferstand.drivers.stand_file.recording_stand import RecordingStand, load_recording_stand
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.settings.bounds import numeric_keys
from tests.bounds.files import Table, toml_text, with_key
from tests.bounds.test_matrix import Case, inside, judge_refusal, values

pytestmark = pytest.mark.filterwarnings("error")

SCALE: Table = {"calibration": {"id": "a", "coefficients": [0.0, 50.0]}}
BASE: Table = {
    "stand": {"id": "hall-2", "name": "Stand of hall 2"},
    "acquisition": [
        {
            "kind": "modbus-io",
            "description": "wago-750-10v",
            "answers": {"first_word": 0},
            "host": "127.0.0.1",
            "rate_Hz": 50.0,
            "input": [
                {"point": "AI1", "channel": {"name": "force", "quantity": "force", "unit": "kN"} | SCALE},
                {"point": "AI2", "channel": {"name": "stroke_1", "quantity": "stroke", "unit": "mm"} | SCALE},
            ],
        }
    ],
    "limits": {},
}
CASES = [
    Case("recording stand", key, key.path, value, inside(key, value))
    for key in numeric_keys(RecordingStand)
    if key.path[0] == "limits" or key.path[:3] == ("acquisition", "[]", "kind=modbus-io")
    for value in values(key)
]


def document(case: Case) -> Table:
    """Return the stand file of a case: ``input`` and ``channel`` are there, whatever the key."""
    path = ("device", *case.path[2:]) if case.path[0] == "acquisition" else case.path
    wrapped = with_key({"device": BASE["acquisition"][0], "limits": {}}, path, case.value)
    return {"stand": BASE["stand"], "acquisition": [wrapped["device"]], "limits": wrapped["limits"]}


@pytest.mark.parametrize("part", range(4))
def test_a_number_is_taken_within_its_bounds_and_refused_by_name_beyond(part: int, tmp_path: Path) -> None:
    path = tmp_path / "stand.toml"
    wrong: list[str] = []
    for case in CASES[part::4]:
        path.write_text(toml_text(document(case)), "utf-8")
        try:
            load_recording_stand(path)
            assert case.inside, f"{case.value!r} was taken"
        except BadInput as refused:
            try:
                judge_refusal(case, refused)
            except AssertionError as error:
                wrong.append(f"{case.id}: {str(error)[:300]}")
        except Exception as error:  # noqa: BLE001 - every case is told, not the first only
            wrong.append(f"{case.id}: {type(error).__name__}: {str(error)[:300]}")
    assert not wrong, f"{len(wrong)} of {len(CASES)}:\n" + "\n".join(wrong)


def test_the_keys_of_limits_and_device_are_among_them() -> None:
    assert len(CASES) > 400
    assert {"force_max_kN", "stamp_within_s", "u_delay_s", "device_id"} <= {case.key.name for case in CASES}
