"""One turned bit of a run file: every command ends, says so, and goes on with the others."""

from __future__ import annotations

import contextlib
import random
from dataclasses import replace
from pathlib import Path

import pytest

from bufferstand.daq.campaign.first_stroke import recorded_curve
from bufferstand.daq.campaign_folder.as_run import observed_run
from bufferstand.daq.campaign_folder.folder import CampaignFolder
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.finding import list_runs
from bufferstand.recording.runfile import open_run, read_metadata, write_run
from bufferstand.recording.runfile import reading_apart as apart
from bufferstand.recording.sealing import verify
from tests.cli.test_edits import Lab
from tests.hostile_runs.cases import REFUSED
from tests.hostile_runs.crafting import seal
from tests.hostile_runs.damage import circle, small_run, structure_of
from tests.hostile_runs.test_crafted import BAD_INPUT, given
from tests.recording import samples

NO_END = "HDF5 does not come to an end with it"


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a file have half a second of processor time, and no bound of what others leave of the processor."""
    monkeypatch.setattr(apart, "LEAST_S", 0.5)
    monkeypatch.setattr(apart, "WALL_RATIO", 1000)


@pytest.mark.slow
@pytest.mark.parametrize("sealed", [False, True])
@pytest.mark.usefixtures("impatient")
def test_a_bit_that_has_hdf5_run_in_circles(
    sealed: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = circle(small_run(tmp_path / "bad.h5"), sealed=sealed)
    small_run(tmp_path / "good.h5")
    for words in (("runs",), ("verify",), ("evaluate", "--no-cache"), ("report", "--out", tmp_path / "out")):
        assert given(*words, bad) == BAD_INPUT, words
        told = capsys.readouterr()
        assert NO_END in told.out + told.err, words
    assert given("runs", tmp_path, "--no-cache") == 0
    told = capsys.readouterr()
    assert "good.h5" in told.out
    assert told.err.count(NO_END) == 1
    assert given("verify", tmp_path) == BAD_INPUT
    assert "good.h5: whole and unaltered" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.usefixtures("impatient")
def test_a_campaign_with_a_rotten_run_goes_on(tmp_path: Path) -> None:
    lab = Lab(tmp_path)
    (lab.out / "runs/one.h5").unlink()
    circle(small_run(lab.out / "runs/one.h5"), sealed=False)
    first = replace(lab.record.steps[0], status="running", cycles_done=0)
    CampaignFolder(lab.out).save(lab.record.with_step(first))
    record = lab.start(lab.resume())
    assert [step.status for step in record.steps] == ["pending", "pending"]


@pytest.mark.slow
@pytest.mark.parametrize("name", REFUSED)
def test_what_a_resumed_campaign_reads_of_a_crafted_run(name: str, tmp_path: Path) -> None:
    """It learns nothing from it, and goes on: nothing but a refusal comes out of any file."""
    path = REFUSED[name](tmp_path)
    assert observed_run(path, ()) is None
    assert recorded_curve(path) is None
    assert len(list_runs(path)) == 1
    with contextlib.suppress(BadInput):
        assert isinstance(read_metadata(path)["run"]["status"], str)


@pytest.mark.dose(2)
@pytest.mark.slow
@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("seed", range(3))
def test_turned_bits_of_the_structure_are_refused_or_change_nothing(seed: int, tmp_path: Path) -> None:
    """Single bits of what has no check sum of ours, with the seal made anew every second time."""
    path = tmp_path / "run-1.h5"
    metadata = samples.metadata("run-1", status="complete")
    write_run(path, metadata, samples.content(), samples.EVENTS, samples.ANCHORS)
    path.chmod(0o644)
    good, places = path.read_bytes(), structure_of(path)
    force = open_run(path).series("force").value.tobytes()
    dice = random.Random(seed)
    for number in range(200):
        place, bit = dice.choice(places), dice.randrange(8)
        data = bytearray(good)
        data[place] ^= 1 << bit
        path.write_bytes(data)
        if sealed := bool(number % 2):
            seal(path)
        try:
            found = open_run(path).series("force").value.tobytes()
        except BadInput:
            assert any(finding.level == "fault" for finding in verify(path)), (place, bit)
            continue
        assert found == force, (place, bit)
        assert any(one.level == "fault" for one in verify(path)) is not sealed, (place, bit)
