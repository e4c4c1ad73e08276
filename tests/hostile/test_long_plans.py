"""Steps of very many cycles: a plan of them takes no longer than that of a day, and says what comes of it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from bufferstand.cli.campaign.preparation import prepare
from bufferstand.protocols.planning import heating
from bufferstand.protocols.planning.estimate import SAID_STOPS
from bufferstand.protocols.planning.heating import MOST_STOPS, ONE_BY_ONE, Walker

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def campaign(tmp_path: Path) -> Path:
    """The static sample with its files."""
    return Path(shutil.copytree(ROOT / "sample_runs", tmp_path / "samples")) / "en15551.toml"


def written(campaign: Path, cycles: int, pause_s: float = 60.0, limits: str = "") -> Path:
    text = campaign.read_text("utf-8").replace("cycles = 3\n", f"cycles = {cycles}\n")
    text = text.replace("pause_s = 60.0", f"pause_s = {pause_s}")
    campaign.write_text(text.replace("[limits]\n", f"[limits]\n{limits}"), "utf-8")
    return campaign


def advances(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Note each piece of time that a walk goes through."""
    found: list[float] = []
    true = Walker._advance

    def noted(self: Walker, duration_s: float, heat_J: float, cycles: float = 0.0) -> None:
        found.append(duration_s)
        true(self, duration_s, heat_J, cycles)

    monkeypatch.setattr(Walker, "_advance", noted)
    return found


def test_the_work_of_a_plan_does_not_grow_with_its_cycles(
    campaign: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = advances(monkeypatch)
    prepare(written(campaign, 100_000))
    assert len(found) <= 6 * ONE_BY_ONE + 10


def test_many_cycles_at_once_heat_as_they_do_one_by_one(
    campaign: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After 4,000 cycles, of which 3,000 go by threes, against a walk through each."""
    path = written(campaign, 4000)
    quick = prepare(path).plan.steps[1]
    monkeypatch.setattr(heating, "ONE_BY_ONE", 4000)
    true = prepare(path).plan.steps[1]
    assert true.expected_heat_J == pytest.approx(quick.expected_heat_J, rel=1e-3)
    assert true.duration_s == pytest.approx(quick.duration_s, rel=1e-3)
    assert true.max_temperature_C == pytest.approx(quick.max_temperature_C, abs=0.1)
    assert true.sensor_end_temperature_C == pytest.approx(quick.sensor_end_temperature_C, abs=0.1)


def test_stops_without_end_are_counted_and_said_once(campaign: Path) -> None:
    limits = (
        'temperature_stop_C = 28.0\ntemperature_resume_C = 25.5\non_temperature_stop = "wait-and-continue"\n'
    )
    notes = prepare(written(campaign, 100_000, 1.0, limits)).plan.notes
    stops = [note for note in notes if "°C stop is expected" in note]
    assert len(stops) == SAID_STOPS
    more = MOST_STOPS - SAID_STOPS
    assert any(f"at least {more} more such stops are expected" in note for note in notes)
