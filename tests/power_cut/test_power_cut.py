"""Power cuts: a dose always, a thousand with ``--long``; and that a missing sync does not pass."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.fresh_process import in_fresh_process
from tests.power_cut import tape as tape_module
from tests.power_cut.cuts import cut
from tests.power_cut.disk import MANNERS, as_left, put_on
from tests.power_cut.tape import SyncBegins, Synced, found_on, taped
from tests.power_cut.tapes import made, share, tape_of
from tests.power_cut.workloads import WORKLOADS

SEED = 0


@pytest.mark.dose(30)
@pytest.mark.parametrize("number", range(1000))
def test_a_power_cut_loses_nothing_that_was_acknowledged(number: int) -> None:
    workload = share(number)
    result = cut(tape_of(workload), workload, SEED, number)
    assert not result.losses, f"{result.line()}\nagain: {again(number)}"


def again(number: int) -> str:
    return f"python -m tests.power_cut --seed {SEED} --first {number} --cuts 1"


@pytest.mark.parametrize("workload", WORKLOADS)
def test_the_tape_has_all_that_was_written_and_what_was_promised(workload: str) -> None:
    """A call that the tape does not follow would be one that no cut can lose."""
    assert in_fresh_process(same_again, workload) is True
    assert sum(isinstance(one, Synced) for one in tape_of(workload).tape.entries) >= 10


def same_again(folder: Path, workload: str) -> bool:
    """Return whether the tape, put on an empty disk, leaves what the workload left."""
    (folder / "disk").mkdir()
    done = WORKLOADS[workload](folder / "disk")
    (folder / "again").mkdir()
    put_on(as_left(done.tape), folder / "again")
    return _files(folder / "disk") == _files(folder / "again")


def _files(root: Path) -> dict[str, bytes]:
    return {str(path.relative_to(root)): path.read_bytes() for path in root.rglob("*") if path.is_file()}


def _no_sync(handle: object) -> None:
    """Say that it was brought to the disk."""


def _without(call: str) -> None:
    """Let a call of ``os`` do nothing, under the tape's own eyes: nothing is brought to the disk by it."""
    real = tape_module._calls
    tape_module._calls = lambda recording: {**real(recording), call: _no_sync}


def without_fsync() -> None:
    _without("fsync")


def without_fdatasync() -> None:
    _without("fdatasync")


def without_folder_syncs() -> None:
    from bufferstand.foundation.files import durable
    from bufferstand.recording import whole_files
    from bufferstand.recording.journal import file

    for module in (durable, whole_files, file):
        if hasattr(module, "sync_folder"):
            module.sync_folder = _no_sync


@pytest.mark.parametrize(
    ("workload", "breaks"),
    [
        ("recordings", without_fsync),
        ("recordings", without_fdatasync),
        ("recordings", without_folder_syncs),
        ("by hand", without_fsync),
        ("by hand", without_folder_syncs),
        ("campaign", without_folder_syncs),
    ],
)
def test_a_program_that_does_not_synchronise_is_found_out(workload: str, breaks: Callable[[], None]) -> None:
    done = made(workload, breaks)
    lost = [one for number in range(12) if (one := cut(done, workload, 0, number)).losses]
    assert len(lost) >= 3


def test_every_manner_leaves_what_was_synchronised(tmp_path: Path) -> None:
    root = tmp_path / "disk"
    root.mkdir()
    with taped(root) as tape:
        handle = os.open(root / "file", os.O_RDWR | os.O_CREAT)
        os.write(handle, b"a" * 2000)
        os.fsync(handle)
        folder = os.open(root, os.O_RDONLY)
        os.fsync(folder)
        os.close(folder)
        os.pwrite(handle, b"b" * 2000, 2000)
        os.close(handle)
        (root / "new").write_text("not synchronised")
    assert sum(isinstance(one, SyncBegins) for one in tape.entries) == 2
    left = set()
    for seed in range(60):
        for manner in MANNERS:
            nodes = _cut_at_end(tape, manner, seed)
            names = nodes[0].names
            content = bytes(nodes[names["file"]].content[: nodes[names["file"]].size])
            assert content[:2000] == b"a" * 2000
            assert set(content[2000:]) <= {0, ord("b")}
            left.add((len(content), "new" in names, b"b" in content))
    assert {(2000, False, False), (4000, True, True), (4000, False, False), (4000, True, False)} <= left
    assert found_on(root)[0].names.keys() == {"file", "new"}


def _cut_at_end(tape: object, manner: object, seed: int) -> dict[int, object]:
    from random import Random

    from tests.power_cut.disk import after_cut

    return after_cut(tape, len(tape.entries), manner, Random(seed))  # type: ignore[attr-defined, arg-type, return-value]


def test_the_command_cuts_as_often_as_it_is_asked_to() -> None:
    said = subprocess.run(
        [sys.executable, "-m", "tests.power_cut", "--cuts", "1", "--first", "2", "--seed", "3"],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert said.returncode == 0, said.stdout + said.stderr
    assert "1 cuts, 0 with a loss, seed 3" in said.stdout


def test_the_command_refuses_what_is_no_number_of_cuts() -> None:
    said = subprocess.run(
        [sys.executable, "-m", "tests.power_cut", "--cuts", "0"],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert said.returncode == 2
    assert "--cuts is 1 or more" in said.stderr
