"""One power cut: a moment, what the disk has left, what the software makes of it, and is that right."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

from bufferstand.daq.campaign_folder.as_run import AS_RUN_NAME, add_as_run, read_as_run
from bufferstand.daq.campaign_folder.folder import RECORD_NAME, CampaignFolder
from bufferstand.daq.campaign_folder.start_records import begin, left_to_do
from bufferstand.daq.operator.notes import NOTES_NAME, add_note
from bufferstand.daq.strokes.stroke_rows import STROKES_NAME, add_strokes, read_strokes
from bufferstand.daq.zero.file import STORED_SUFFIX, ZERO_NAME, kept_zero, stored_zero
from bufferstand.evaluation.report.source.number_range import number_of_range
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.sealing.seal_journal import seal_orphans
from tests.daq.run_in_process import facts_of, sample_plan
from tests.main_job.conftest import here
from tests.power_cut.disk import MANNERS, Leaves, after_cut, put_on
from tests.power_cut.promises import Promised, broken, promised
from tests.power_cut.tape import SyncBegins, Synced, Tape, Told, taped
from tests.power_cut.workloads import Done

TWICE = 0.3
"""So many cuts are followed by another one, while the software recovers from the first."""


@dataclass
class Cut:
    """A cut and what came of it.

    Parameters
    ----------
    workload : str
    number : int
        Of the cut; with the seed it draws everything.
    moment, of : int
        After so many entries of the tape, of so many.
    manner : Leaves
    """

    workload: str
    number: int
    moment: int
    of: int
    manner: Leaves
    twice: bool = False
    losses: list[str] = field(default_factory=list)

    def line(self) -> str:
        """Return it as a person says it, with what was lost."""
        again = ", and again while recovering" if self.twice else ""
        head = (
            f"cut {self.number}: {self.workload} after {self.moment} of {self.of} ({self.manner.name}{again})"
        )
        return "\n".join([head, *(f"  {one}" for one in self.losses)])


def cut(done: Done, workload: str, seed: int, number: int) -> Cut:
    """Cut the power at a drawn moment, recover, and judge."""
    draw = Random(f"{seed}/{workload}/{number}")
    tape = done.tape
    moment = _moment(tape, draw)
    made = Cut(workload, number, moment, len(tape.entries), draw.choice(MANNERS))
    promise = promised(tape, moment)
    nodes = after_cut(tape, moment, made.manner, draw)
    with _folder() as root:
        put_on(nodes, root)
        if draw.random() < TWICE:
            made.twice = True
            with taped(root) as recovering:
                made.losses += _caught(root)
            again = Random(draw.random())
            nodes = after_cut(
                recovering, again.randrange(len(recovering.entries) + 1), again.choice(MANNERS), again
            )
            with _folder() as other:
                put_on(nodes, other)
                made.losses += _judged(other, promise, done)
        else:
            made.losses += _judged(root, promise, done)
    return made


def _moment(tape: Tape, draw: Random) -> int:
    """Return a moment: any, or one just before or after something was promised or a sync was made."""
    if draw.random() < 0.5:
        return draw.randrange(len(tape.entries) + 1)
    near = [at for at, one in enumerate(tape.entries) if isinstance(one, Told | SyncBegins | Synced)]
    return min(max(0, draw.choice(near) + draw.choice((0, 1, 1, 2))), len(tape.entries))


@contextmanager
def _folder() -> Iterator[Path]:
    root = Path(tempfile.mkdtemp(prefix="cut-")).resolve()
    try:
        yield root
    finally:
        shutil.rmtree(root)


def _judged(root: Path, promise: Promised, done: Done) -> Iterator[str]:
    yield from _caught(root)
    try:
        yield from broken(root, promise, done.evidence)
        yield from _said(root)
        yield from _goes_on(root, promise)
    except Exception as error:  # noqa: BLE001 - whatever it is: after a power cut there is no traceback
        yield f"{type(error).__name__}: {error}".replace(str(root), "")


def _caught(root: Path) -> list[str]:
    """Recover; what that refuses, or ends with, is a loss."""
    try:
        return _recovered(root)
    except Exception as error:  # noqa: BLE001 - whatever it is
        return [f"recovering: {type(error).__name__}: {error}".replace(str(root), "")]


def _recovered(root: Path) -> list[str]:
    """Do what ``resume`` does before anything moves; return what is wrong with it."""
    losses: list[str] = []
    with suppress(FileNotFoundError):
        seal_orphans(root / "runs")
    out = root / "out"
    if not (out / RECORD_NAME).is_file():
        seal_orphans(out / "runs")
        return losses
    folder = CampaignFolder(out)
    seal_orphans(folder.runs)
    before = folder.load()
    assert before is not None
    over = {step.plan_hash for step in before.steps if step.over}
    plan, stand_file = sample_plan(out / before.campaign_file)
    left = {step.plan_hash for step, _ in left_to_do(plan, before, out)}
    if again := over & left:
        losses.append(f"{len(again)} steps that are complete would be run again")
    begin(plan, folder, facts_of(stand_file))
    return losses


def _said(root: Path) -> Iterator[str]:
    """Let the commands list and verify what is there."""
    for words in (("runs", root), ("verify", root)):
        said = here(*words)
        if "Traceback" in said.stderr or said.returncode not in (0, 2):
            yield f"{words[0]}: exit status {said.returncode}: {said.stderr[-300:]}"
        # What was not acknowledged may have come to the disk behind a gap: it is kept apart, and told.
        elif said.returncode == 2 and any(root.rglob("*.h5")) and not any(root.rglob("*.journal-damaged*")):
            yield f"{words[0]}: {(said.stdout + said.stderr)[-400:]}"


def _goes_on(root: Path, promise: Promised) -> Iterator[str]:
    """Write on, as a resumed campaign does: nothing of before and nothing new may be lost by it."""
    out = root / "out"
    for place, (must, _) in promise.lines.items():
        path = root / place
        if (not must and not path.exists()) or not _added(path):
            continue
        there = path.read_bytes().replace(b"\r", b"").split(b"\n")
        if there[-1] or not there[-2]:
            yield f"{path.name}: the line that was added does not stand by itself"
        if lost := [line for line in must if line not in there]:
            yield f"{path.name}: adding a line lost {len(lost)} others"
        if path.suffix == ".jsonl" and not there[-2].startswith(b"{"):
            yield f"{path.name}: the line that was added is glued to one that was torn"
        numbers = [line.split(b",")[0] for line in there[1:] if line]
        if path.suffix == ".csv" and len(set(numbers)) < len(numbers):
            yield f"{path.name}: a number was given twice"
    if (out / ZERO_NAME).exists():
        kept_zero(out)
    for path in root.rglob(f"*{STORED_SUFFIX}"):
        stored_zero(path.with_name(path.name.removesuffix(STORED_SUFFIX) + ".toml"))


def _added(path: Path) -> bool:
    """Add a line to a file in the way of its own; return whether there was something to add."""
    if path.name == NOTES_NAME:
        add_note(path.parent, "after the cut")
    elif path.name == AS_RUN_NAME and (rows := read_as_run(path.parent)):
        add_as_run(path.parent, rows[0])
    elif path.name == STROKES_NAME and read_strokes(path.parent):
        add_strokes(path.parent, 9, "after the cut", (), {})
    elif path.suffix == ".csv":
        return _takes_number(path)
    else:
        return False
    return True


def _takes_number(register: Path) -> bool:
    """Take the next number; return whether there is one: a register with a torn line asks to be mended."""
    try:
        number_of_range("PB-{year}-{running:04}", register, year=2026, evaluation="f" * 64, report="c")
    except BadInput as refused:  # a line that was torn: the message says what to do
        if "mend the line" not in str(refused):
            raise
        return False
    return True
