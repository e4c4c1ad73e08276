"""What is done on the disk that the power is cut of: real recordings, a real campaign, what is noted by hand.

All of it goes by stand time or step by step in one thread, so that a workload has the same tape each time but
for the civil times in it.
"""

from __future__ import annotations

import errno
import os
import shutil
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from bufferstand.daq.campaign.campaign_runner import run_campaign
from bufferstand.daq.campaign_folder import as_run, inputs
from bufferstand.daq.campaign_folder.folder import CampaignFolder
from bufferstand.daq.operator import notes
from bufferstand.daq.operator.progress import CampaignProgress
from bufferstand.daq.operator.stop_request import StopLevel, StopRequest
from bufferstand.daq.strokes import stroke_rows
from bufferstand.daq.zero import file as zero_file
from bufferstand.drivers.interfaces import Stand
from bufferstand.drivers.simulated.inprocess.stand import open_in_process
from bufferstand.evaluation.report.source import number_range
from bufferstand.foundation.channels.zero import ChannelZero, Zero
from bufferstand.model.file import load_model
from bufferstand.protocols.prediction.predictor import ModelPredictor
from bufferstand.recording.foreign.importing import import_file
from bufferstand.recording.journal import JournalFile
from tests.daq.run_in_process import COARSE, facts_of, sample_plan
from tests.main_job.conftest import here
from tests.power_cut.tape import Tape, taped
from tests.recording import samples
from tests.worlds.computer import Computer, Disk, Evidence, VirtualRecorder

SAMPLES = Path(__file__).parents[2] / "sample_runs"
STEPS = """
[[step]]
kind = "static"
speed_mm_per_s = 20.0
force_limit_kN = 60.0
cycles = 1

[[step]]
kind = "harmonic"
prestress_mm = 20.0
amplitude_mm = 5.0
frequency_Hz = 2.0
cycles = 6

[[step]]
kind = "harmonic"
prestress_mm = 25.0
amplitude_mm = 5.0
frequency_Hz = 2.0
cycles = 6
"""


@dataclass
class Done:
    """What a workload did.

    Parameters
    ----------
    tape : Tape
    evidence : mapping of str to Given
        What each recorder was given, by run.
    """

    tape: Tape
    evidence: dict[str, Given] = field(default_factory=dict)


@dataclass
class Given:
    """What a recorder was given, as nobody can alter it afterwards."""

    samples: Evidence
    items: list[Any] = field(default_factory=list)
    """Events and anchors, in their order."""


def everywhere(original: Any, other: Any) -> None:
    """Put a function in the place of another wherever the software has it; for the rest of this process."""
    for name, module in list(sys.modules.items()):
        if name.startswith("bufferstand"):
            for key, value in list(vars(module).items()):
                if value is original:
                    setattr(module, key, other)


class ToldRecorder(VirtualRecorder):
    """A recorder that tells the tape what it acknowledges."""

    def __init__(
        self, directory: Path, run_id: str, metadata: Mapping[str, Any], computer: Computer, done: Done
    ) -> None:
        self._done = done
        self._told = 0
        super().__init__(directory, run_id, metadata, computer)
        self.given = done.evidence.setdefault(run_id, Given(self.evidence))
        done.tape.tell("recording", str(self.path.relative_to(done.tape.root)))

    def _hand_over(self, item: Any) -> None:
        if not hasattr(item, "stream"):
            self.given.items.append(item)
        super()._hand_over(item)

    def _note_acknowledged(self) -> None:
        super()._note_acknowledged()
        if self.durable > self._told:
            self._told = self.durable
            self._done.tape.tell("samples", (self.evidence.run_id, self.durable))

    def close(self, status: str, reason: str = "") -> Path:
        """End the recording, and tell what was said of it."""
        path = super().close(status, reason)
        self._done.tape.tell("closed", (self.evidence.run_id, status))
        return path


class _Clock:
    """Stand time that somebody sets."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        return self.time_s


class _AilingDisk(Disk):
    """A disk that refuses some syncs, so that a journal goes on in a new file."""

    def journal_file(self, path: Path, header: bytes) -> JournalFile:
        """Make a journal whose third sync fails."""
        left = [3]

        def fdatasync(handle: int) -> None:
            left[0] -= 1
            if not left[0]:
                raise OSError(errno.EIO, os.strerror(errno.EIO))
            os.fdatasync(handle)

        return JournalFile(path, header, fdatasync=fdatasync)


def recordings(root: Path) -> Done:
    """Record three runs one after the other: with short segments, on an ailing disk, and a plain one."""
    runs = root / "runs"
    runs.mkdir()
    with taped(root) as tape:
        done = Done(tape)
        for number, (disk, segment_bytes) in enumerate(
            [(Disk(), 12_000), (_AilingDisk(), 1 << 30), (Disk(), 1 << 30)]
        ):
            clock = _Clock()
            computer = Computer(clock, disk)  # type: ignore[arg-type]
            run_id = f"run-{number + 1}"
            recorder = ToldRecorder(runs, run_id, samples.metadata(run_id), computer, done)
            recorder._journal._segment_bytes = segment_bytes
            _record(recorder, clock)
            recorder.close("complete")
    return done


def _record(recorder: ToldRecorder, clock: _Clock) -> None:
    for block in range(60):
        first = block * 20
        clock.time_s += 0.02
        recorder.append(*samples.block(first, 20))
        if block % 5 == 0:
            stamp = int(samples.time_us(np.array([first]))[0])
            recorder.anchor(stamp, 9000.0 + first * 1e-3, "2026-03-01T08:00:00+00:00")
            slow = np.array([9_000_000_000 + 200_000 * block // 5], dtype=np.int64)
            recorder.append("temperature_1", block // 5, slow, {"temperature_1": np.array([20.0 + block])})
        if block % 17 == 3:
            recorder.event(9000.0 + first * 1e-3, "note", f"block {block}", block=block)


def campaign(root: Path) -> Done:
    """Run a campaign, stop it in its second step, edit it, and go on to its end."""
    _write_campaign(root / "lab")
    with taped(root) as tape:
        done = Done(tape)
        _follow_files(tape)
        out = root / "out"
        _, stand_file = sample_plan(root / "lab" / "campaign.toml")
        opened = open_in_process(stand_file)
        computer = Computer(opened.clock)
        computer.take_over()
        model = load_model(SAMPLES / "models" / "category-a-elastomer.toml")

        def recorder(folder: Path, run_id: str, metadata: Mapping[str, Any]) -> ToldRecorder:
            return ToldRecorder(folder, run_id, metadata, computer, done)

        def start(stop_in_step: int) -> int:
            request = StopRequest()
            first = stop_in_step > 0
            controller = opened.stand.controller if first else opened.second()
            outcome = run_campaign(
                sample_plan(root / "lab" / "campaign.toml")[0],
                Stand(controller, opened.stand.sensors),
                opened.clock,
                out,
                facts_of(stand_file),
                progress=_Stopper(request, stop_in_step),
                stop_request=request,
                settings=replace(COARSE, awaits_stand=not first),
                recorder=recorder,
                predictor=ModelPredictor(model),
            )
            controller.close()
            return int(outcome.exit_status)

        assert start(2) == 3
        notes.add_note(out, "stopped to look at the plate")
        path = root / "lab" / "campaign.toml"
        path.write_text(path.read_text(encoding="utf-8") + "# looked at\n", encoding="utf-8")
        opened.clock.sleep(15.0)
        assert start(0) == 0
    return done


class _Stopper:
    """Stops a campaign in one of its steps."""

    def __init__(self, request: StopRequest, step: int) -> None:
        self._request, self._step = request, step

    def update(self, progress: CampaignProgress) -> None:
        """Ask for the end after the cycle in which the step is."""
        if progress.step == self._step and progress.phase == "motion" and self._step:
            self._step = 0
            self._request.ask(StopLevel.AFTER_CYCLE, "asked to stop")

    def message(self, text: str) -> None:
        """Show nothing."""


def _write_campaign(lab: Path) -> None:
    (lab / "specimens").mkdir(parents=True)
    (lab / "models").mkdir()
    shutil.copy(SAMPLES / "stand.toml", lab / "stand.toml")
    for place in ("specimens/category-a-elastomer.toml", "models/category-a-elastomer.toml"):
        shutil.copy(SAMPLES / place, lab / place)
    (lab / "campaign.toml").write_text(
        '[campaign]\nid = "cut"\nstand = "stand.toml"\nspecimen = "specimens/category-a-elastomer.toml"\n'
        + STEPS,
        encoding="utf-8",
    )


def by_hand(root: Path) -> Done:
    """Write notes, zeros and report numbers as the commands do, and import a record."""
    lab = root / "lab"
    lab.mkdir()
    (lab / "stand.toml").write_text("# a stand\n", encoding="utf-8")
    time_s = np.arange(400) * 0.01
    rows = [f"{t:.3f},{5 - 5 * np.cos(t * 3):.6f},{40 - 40 * np.cos(t * 3 + 0.1):.6f}" for t in time_s]
    (lab / "record.csv").write_text("time [s],stroke [mm],force [kN]\n" + "\n".join(rows) + "\n")
    with taped(root) as tape:
        done = Done(tape)
        _follow_files(tape)
        for number in range(4):
            assert (
                here("note", root / "out", f"note {number}: " + "as seen on the plate " * 20).returncode == 0
            )
            found = ChannelZero(name="force", unit="kN", value=0.1 * number, u=0.01)
            zero = Zero(how="tare", found=datetime(2026, 3, 1, 8, number, tzinfo=UTC), channel=(found,))
            zero_file.store_zero(lab / "stand.toml", zero)
            zero_file.keep_zero(root / "out", zero)
            number_range.number_of_range(
                "PB-{year}-{running:04}",
                lab / "numbers.csv",
                year=2026,
                evaluation=f"{number:064x}",
                report="c",
            )
            if number == 1:
                path = import_file(lab / "record.csv", root / "imported").path
                tape.tell("imported", str(path.relative_to(root)))
    return done


def _follow_files(tape: Tape) -> None:
    """Let what is written whole, or line by line, be told when its writer has returned."""

    def line(original: Callable[..., Any], path_of: Callable[..., Path]) -> None:
        def write(*words: Any, **named: Any) -> Any:
            found = original(*words, **named)
            path = path_of(*words)
            last = path.read_bytes().splitlines()[-1]
            tape.tell("line", (str(path.relative_to(tape.root)), last))
            return found

        everywhere(original, write)

    def whole(original: Callable[..., Any], path_of: Callable[..., Path]) -> None:
        def write(*words: Any, **named: Any) -> Any:
            found = original(*words, **named)
            path = path_of(*words)
            tape.tell("whole", (str(path.relative_to(tape.root)), path.read_bytes()))
            return found

        everywhere(original, write)

    line(as_run.add_as_run, lambda folder, _: folder / "as-run.jsonl")
    line(stroke_rows.add_strokes, lambda folder, *_: folder / "strokes.jsonl")
    line(notes.add_note, lambda folder, _: folder / "notes.jsonl")
    line(number_range.number_of_range, lambda _, register: register)
    whole(zero_file.keep_zero, lambda folder, _: folder / "zero.json")
    whole(zero_file.store_zero, lambda stand, _: zero_file.stored_path(stand))
    keep, save = inputs.keep_before, CampaignFolder.save

    def keep_before(texts: Mapping[str, str], folder: Path, stamp: str) -> str:
        place = keep(texts, folder, stamp)
        tape.tell("kept", (str((folder / place).relative_to(tape.root)), dict(texts)))
        return place

    def save_record(folder: CampaignFolder, record: Any) -> None:
        save(folder, record)
        path = folder.path / "campaign.json"
        tape.tell("whole", (str(path.relative_to(tape.root)), path.read_bytes()))

    everywhere(keep, keep_before)
    CampaignFolder.save = save_record  # type: ignore[method-assign]


WORKLOADS: dict[str, Callable[[Path], Done]] = {
    "recordings": recordings,
    "campaign": campaign,
    "by hand": by_hand,
}
