"""Every number of campaign, stand and specimen file, at its bounds, beyond them, and as nonsense.

The keys come from the schemas. A quick dose always, the whole with ``--long``.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from bufferstand.cli.campaign.preparation import PreparedCampaign
from bufferstand.drivers.simulated.settings import SimulationSettings, simulation_settings
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.settings.bounds import NumericKey, numeric_keys
from bufferstand.foundation.specimen.file import SpecimenFile
from bufferstand.protocols.campaign_file.guard_bounds import RELATIVE
from bufferstand.protocols.campaign_file.schema import CampaignFile
from tests.bounds.files import (
    Files,
    Table,
    base_campaign,
    base_specimen,
    base_stand,
    guards_of,
    thresholds,
    with_key,
)

pytestmark = pytest.mark.filterwarnings("error")

RELATIVE_KEYS = {(rule.table, rule.key) for rule in RELATIVE} | {("stand", "tilt_max_mm")}
"""Keys whose upper bound depends on others; tests/bounds/test_guard_bounds.py holds them to it."""
NONSENSE: tuple[object, ...] = (
    1e308, 5e-324, -1, -1.0, 0, 0.0, math.nan, math.inf, -math.inf, "600", True, 10**400,
)  # fmt: skip
QUICK = 97
"""One case of so many is always run."""
CEILINGS = {
    "channels.tilt.hold_s": 0.5,
    "channels.following error.hold_s": 1.0,
    "controller.silence_s": 5.0,
    "controller.gap_stop_s": 2.0,
    "silences.amplifier.limit_s": 30.0,
    "lag.stop_s": 30.0,
    "missed.most_per_min": 600.0,
    "disk_stop_s": 60.0,
}
"""What no setting may raise a threshold above, whatever the stand."""


def ceilings(stand: StandFile) -> dict[str, float]:
    """Return what no setting of a campaign may raise a threshold above, from what the stand can do."""
    limits = stand.limits
    return CEILINGS | {
        "channels.force.upper": 1.05 * limits.force_max_kN,
        "channels.stroke.upper": 1.05 * limits.stroke_max_mm + 2.0,
        "channels.tilt.upper": max(5.0, 0.05 * limits.stroke_max_mm),
        "channels.following error.upper": max(10.0, 0.1 * limits.stroke_max_mm),
        "agreement.tolerance_kN": max(6.0, 0.05 * limits.force_max_kN),
        "speeds.speed.limit": 1.5 * limits.speed_max_mm_per_s,
    }


@dataclass(frozen=True)
class Case:
    """One key of one file with one value, and whether the value keeps the key's own bounds."""

    file: str
    key: NumericKey
    path: tuple[str, ...]
    value: object
    inside: bool

    @property
    def id(self) -> str:
        return f"{self.file}:{'.'.join(self.path)}={self.value!r:.20}"


def schemas() -> Iterator[tuple[str, NumericKey, tuple[str, ...]]]:
    for name, schema in (("campaign", CampaignFile), ("stand", StandFile), ("specimen", SpecimenFile)):
        for key in numeric_keys(schema):
            if "kind=modbus-io" not in key.path:  # without a controller only: see test_recording_stand.py
                yield name, key, key.path
    for key in numeric_keys(SimulationSettings):
        yield "simulation", key, ("simulation", *key.path)


def inside(key: NumericKey, value: object) -> bool:
    """Return whether a value keeps the bounds that the schema states, by this test's own comparison."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(_float(value)):
        return False
    if key.integer and not isinstance(value, int):
        return False
    above = value > key.low or (value == key.low and not key.low_open)
    return above and (value < key.high or (value == key.high and not key.high_open))


def _float(value: float) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf


def values(key: NumericKey) -> Iterator[object]:
    yield from NONSENSE
    for bound, outward in ((key.low, -math.inf), (key.high, math.inf)):
        if math.isfinite(bound):
            step = 1 if outward > 0 else -1
            yield int(bound) if key.integer else bound
            yield int(bound) + step if key.integer else math.nextafter(bound, outward)
            yield int(bound) + 7 * step if key.integer else bound + step * max(1e-3, 1e-3 * abs(bound))


CASES = [
    Case(name, key, path, value, inside(key, value)) for name, key, path in schemas() for value in values(key)
]


def test_every_number_has_a_bound_on_either_side() -> None:
    for name, key, path in schemas():
        assert math.isfinite(key.low), (name, path)
        assert math.isfinite(key.high) or path in RELATIVE_KEYS, (name, path)


def test_the_cases_cover_every_table() -> None:
    assert len(CASES) > 5000
    owners = {case.key.owner.__name__ for case in CASES}
    assert {
        "TestLimits",
        "GuardTable",
        "ZeroTable",
        "StandFileLimits",
        "ControllerSettings",
        "Catalogue",
    } <= owners


def documents(case: Case) -> dict[str, Table]:
    """Return the files of a case; those that are as ever are left out."""
    if case.file == "campaign":
        kinds = [part.removeprefix("kind=") for part in case.path if part.startswith("kind=")]
        nested = kinds[1] if kinds and kinds[0] == "repeat" and len(kinds) > 1 else ""
        base = base_campaign(kinds[0] if kinds else "harmonic", nested=nested)
        return {"campaign": with_key(base, case.path, case.value)}
    if case.file == "specimen":
        return {"specimen": with_key(base_specimen(), case.path, case.value)}
    return {"stand": with_key(base_stand(), case.path, case.value)}


def attempt(case: Case, files: Files) -> PreparedCampaign | BadInput:
    """Return the plan of a case, or how it was refused."""
    try:
        prepared = files.prepare(**documents(case))
        if case.file == "simulation":
            simulation_settings(prepared.stand_file)
    except BadInput as refused:
        return refused
    return prepared


def judge_refusal(case: Case, refused: BadInput) -> None:
    """A value outside its bounds is named with file and key; one inside is refused by another rule only."""
    said = refused.message()
    assert refused.file is not None, said
    assert Path(refused.file).exists(), said
    if case.inside:
        assert not ("its bound is" in said and named(case.path) in refused.place), said
        return
    assert named(case.path) in said, said
    assert refused.problem, said


def judge(case: Case, files: Files, whole: set[str]) -> None:
    """Refused with file, key and bound; or planned, with numbers in it and every guard in its bounds."""
    outcome = attempt(case, files)
    if isinstance(outcome, BadInput):
        judge_refusal(case, outcome)
        return
    prepared = outcome
    assert case.inside or case.path in RELATIVE_KEYS, f"{case.id} was taken"
    json.dumps(prepared.plan.as_dict(), allow_nan=False)
    found = thresholds(guards_of(prepared))
    assert whole <= found.keys(), (case.id, whole - found.keys())
    for place, most in ceilings(prepared.stand_file).items():
        assert math.isfinite(found[place]), (case.id, place)
        assert found[place] <= most * (1.0 + 1e-9), (case.id, place, found[place])
    for place, value in found.items():
        if place.endswith(".stop_C"):
            assert value <= 85.0, (case.id, place)
        if place.startswith("temperatures") and place.endswith(".grace_s"):
            assert value <= 30.0, (case.id, place)
        if place.endswith(".limit_K_per_min"):
            assert value <= 60.0, (case.id, place)


def named(path: tuple[str, ...]) -> str:
    """Return the key as a message names it."""
    return next(part for part in reversed(path) if not part.startswith(("[", "kind=")))


def whole_set(files: Files) -> set[str]:
    """Return the places of all thresholds of the files as they are."""
    return set(thresholds(guards_of(files.prepare())))


def run_cases(cases: list[Case], folder: Path) -> None:
    files = Files(folder)
    whole = whole_set(files)
    wrong: list[str] = []
    for case in cases:
        try:
            judge(case, files, whole)
        except Exception as error:  # noqa: BLE001 - every case is told, not the first only
            wrong.append(f"{case.id}: {type(error).__name__}: {str(error)[:300]}")
    assert not wrong, f"{len(wrong)} of {len(cases)}:\n" + "\n".join(wrong)


def test_a_sample_of_all_cases(tmp_path: Path) -> None:
    run_cases(CASES[::QUICK], tmp_path)


@pytest.mark.long
@pytest.mark.parametrize("part", range(8))
def test_every_case(part: int, tmp_path: Path) -> None:
    run_cases(CASES[part::8], tmp_path)


def test_what_is_no_number_is_told_what_to_write(tmp_path: Path) -> None:
    files = Files(tmp_path)
    for value, said in (("600", "write a number from 0.5 to 10000"), (math.nan, "no finite number")):
        campaign: dict[str, Any] = with_key(base_campaign(), ("limits", "force_max_kN"), value)
        with pytest.raises(BadInput, match=said):
            files.prepare(campaign=campaign)


def test_a_whole_number_beyond_any_float_is_no_traceback(tmp_path: Path) -> None:
    """A rate of 10**400 baud ended in an OverflowError: it was divided by before it was bounded."""
    cases = [case for case in CASES if case.key.name == "baud" and case.value == 10**400]
    assert len(cases) == 7  # controller, four kinds of amplifiers, two of sensors
    run_cases(cases, tmp_path)
