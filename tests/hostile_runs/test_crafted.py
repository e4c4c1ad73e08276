"""Every command on every crafted file: one message, the status of bad input, no traceback, bounded memory."""

from __future__ import annotations

import json
import resource
import warnings
from pathlib import Path

import h5py
import pytest

from bufferstand.cli.main import main
from bufferstand.foundation.errors import BadInput
from bufferstand.recording.runfile import open_run
from bufferstand.recording.runfile import reading_apart as apart
from bufferstand.recording.runfile.reader_process import HEAD, ReaderServer, stamp_of
from tests.hostile_runs.cases import ODD, REFUSED

BAD_INPUT = 2
_NOT_READ = "this is an HDF5 file"
MOST_KB = 1_500_000


def given(*words: str | Path) -> int:
    """Return the exit status of the command in this process; warnings of numpy are messages, too."""
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    code = ended.value.code
    assert isinstance(code, int)
    return code


@pytest.mark.dose(32)
@pytest.mark.parametrize("name", REFUSED)
def test_what_verify_refuses_no_command_reads(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = REFUSED[name](tmp_path)
    assert given("verify", path) == BAD_INPUT
    told = capsys.readouterr()
    assert told.err == "bufferstand: 1 damaged or altered; do not evaluate them\n"
    assert "does not come to an end" not in told.out
    assert "crashes" not in told.out
    assert not [line for line in told.out.splitlines() if line.startswith("Traceback")]
    with pytest.raises(BadInput) as refused:
        open_run(path)
    for words in (
        ("evaluate", path, "--no-cache", "--json", "-"),
        ("report", path, "--out", tmp_path / "out"),
    ):
        assert given(*words) == BAD_INPUT, words
        told = capsys.readouterr()
        assert told.out == "", words
        assert told.err.count("\n") <= 2, words  # of an archive: the file, and that none was evaluated
        assert refused.value.problem in told.err, words
    assert given("runs", path, "--no-cache") in (0, BAD_INPUT)  # lists what the document says
    assert capsys.readouterr().err.count("\n") <= 1
    assert given("import", path, "--out", tmp_path / "imported") == BAD_INPUT
    assert _NOT_READ in capsys.readouterr().err


@pytest.mark.parametrize("name", [*REFUSED, "good"])
def test_what_the_reader_says_of_it(name: str, tmp_path: Path) -> None:
    """In this process, which would die of what the other one is for: none of these has HDF5 run for ever."""
    path = (REFUSED | ODD)[name](tmp_path)
    said = tmp_path / "said"
    with said.open("wb") as stream:
        server = ReaderServer(stream.fileno())
        server.answer({"do": "open", "path": str(path), "numbers": True})
        server.answer({"do": "document", "path": str(path)})
    kind, size = HEAD.unpack_from(said.read_bytes())
    first = json.loads(said.read_bytes()[HEAD.size : HEAD.size + size])
    assert kind == b"J"
    assert first.keys() == {"refused"} or first.keys() == {"faults", "columns", "stamp", "inline"}
    if name == "good":
        assert first["faults"] == []
        assert first["inline"]


def test_rows_are_of_the_file_that_was_opened(tmp_path: Path) -> None:
    """A file that was changed meanwhile is refused; of another one that was asked for between, it is not."""
    path, said = ODD["good"](tmp_path), tmp_path / "said"
    rows = {"do": "column", "path": str(path), "place": "entry/controller/force", "rows": [3, 7]}
    with said.open("wb") as stream:
        server = ReaderServer(stream.fileno())
        server.answer({"do": "open", "path": str(path), "numbers": False})
        begin = stream.seek(0, 2)
        server.answer({**rows, "stamp": stamp_of(path)})
        ReaderServer(stream.fileno()).answer({**rows, "stamp": stamp_of(path)})
        server.answer({**rows, "stamp": [1, 2, 3]})
    frames = said.read_bytes()[begin:]
    with h5py.File(path, locking=False) as tree:
        wanted = (
            HEAD.pack(b"J", 2) + b"{}" + HEAD.pack(b"D", 16) + tree["entry/controller/force"][3:7].tobytes()
        )
    assert frames.startswith(2 * wanted)
    assert b"it was changed while it was in use" in frames[2 * len(wanted) :]
    with pytest.raises(BadInput, match="cannot be read: No such file"):
        stamp_of(tmp_path / "gone.h5")


@pytest.mark.slow
@pytest.mark.parametrize("name", ODD)
def test_what_is_odd_gives_a_result_or_a_message(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = ODD[name](tmp_path)
    assert given("verify", path) == 0
    with warnings.catch_warnings():
        for words in (
            ("evaluate", path, "--no-cache", "--json", "-"),
            ("report", path, "--out", tmp_path / "out"),
            ("runs", path, "--no-cache"),
        ):
            assert given(*words) in (0, BAD_INPUT), words
            told = capsys.readouterr()
            assert "bug" not in told.err, words
            assert "Traceback" not in told.err, words


def test_no_crafted_file_takes_more_memory_than_is_allowed() -> None:
    apart.READER.close()
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss < MOST_KB


def test_there_are_sixty_and_more() -> None:
    assert len(REFUSED) + len(ODD) > 60
