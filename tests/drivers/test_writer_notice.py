"""Who gives commands is posted on this computer: told, held, killed, forged, not to be written."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from drivers.writer_notice import NoticeBoard, address_key

ADDRESS = "127.0.0.1:15020 unit 1"
CHILD = """
import sys
from pathlib import Path
from drivers.writer_notice import NoticeBoard
board = NoticeBoard(sys.argv[1], "stand jog", Path(sys.argv[2]))
print(board.lock(), flush=True)
board.put(4711)
print("posted", flush=True)
sys.stdin.read()
board.remove()
"""


def child(folder: Path) -> subprocess.Popen[str]:
    """Start a process that takes lock and notice, and has them until its input ends."""
    process = subprocess.Popen(
        [sys.executable, "-c", CHILD, ADDRESS, str(folder)],
        cwd=Path(__file__).parents[2],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert [process.stdout.readline().strip() for _ in range(2)] == ["True", "posted"]
    return process


def test_another_process_is_told_and_known_to_be_killed(tmp_path: Path) -> None:
    board = NoticeBoard(ADDRESS, folder=tmp_path)
    assert board.find(4711) is None
    with child(tmp_path) as other:
        try:
            found, holder = board.find(4711), board.find_locked()
            assert found is not None
            assert holder == found
            assert (found.lives, found.pid, found.doing) == (True, other.pid, "stand jog")
            assert found.text.startswith(f"process {other.pid} of ")
            assert ", stand jog, since 20" in found.text
            assert not board.lock(), "one program at a time"
            assert board.find(4712) is None
            assert NoticeBoard("127.0.0.1:15020 unit 2", folder=tmp_path).find(4711) is None
        finally:
            other.kill()
            other.communicate()
    found = board.find(4711)
    assert found is not None
    assert not found.lives
    assert found.text.endswith(" UTC, which was killed")
    assert board.find_locked() is None
    assert board.lock()
    board.put(1)
    assert board.find(4711) is None, "what was left is taken away by who comes next"
    board.remove()
    assert list(tmp_path.glob("*.json")) == []


def test_the_own_notice_is_nobody_elses_and_is_taken_away(tmp_path: Path) -> None:
    board, other = NoticeBoard(ADDRESS, "a", tmp_path), NoticeBoard(ADDRESS, "b", tmp_path)
    board.put(7)
    assert board.find(7) is None
    seen = other.find(7)
    assert seen is not None
    assert (seen.lives, seen.doing, seen.pid) == (True, "a", os.getpid())
    board.put(8)
    assert other.find(7) is None
    board.remove()
    assert other.find(8) is None


@pytest.mark.parametrize(
    "content",
    [b"", b"\xff\xfe", b"[]", b"{}", b'{"writer": "x"}', b'{"writer": 7, "pid": 1}', b"[" * 4000, b"7"],
)
def test_what_is_no_notice_is_none(tmp_path: Path, content: bytes) -> None:
    (tmp_path / f"bufferstand-{address_key(ADDRESS)}-1-ab.json").write_bytes(content)
    board = NoticeBoard(ADDRESS, folder=tmp_path)
    assert board.find(7) is None
    board.put(8)


def test_a_forged_notice_does_nothing_to_a_terminal(tmp_path: Path) -> None:
    content = {
        "writer": 7,
        "pid": 1,
        "since": "x",
        "doing": "\x1b[2J\n" + "y" * 500,
        "user": "u",
        "host": "h",
    }
    path = tmp_path / f"bufferstand-{address_key(ADDRESS)}-1-ab.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    found = NoticeBoard(ADDRESS, folder=tmp_path).find(7)
    assert found is not None
    assert "\x1b" not in found.text
    assert "\n" not in found.text
    assert len(found.text) < 400
    assert not found.lives


def test_a_folder_that_is_none_stops_nobody(tmp_path: Path) -> None:
    board = NoticeBoard(ADDRESS, "a", tmp_path / "none")
    assert board.lock()
    board.put(7)
    assert (board.find(7), board.find_locked()) == (None, None)
    board.remove()


def test_the_same_controller_has_the_same_key(tmp_path: Path) -> None:
    (tmp_path / "by-id").symlink_to(tmp_path / "ttyUSB0")
    line, named = f"{tmp_path / 'ttyUSB0'} unit 1", f"{tmp_path / 'by-id'} unit 1"
    assert address_key(line) == address_key(named)
    assert address_key("localhost:502 unit 1") == address_key("127.0.0.1:502 unit 1")
    assert len({address_key(a) for a in (line, ADDRESS, "127.0.0.1:15021 unit 1")}) == 3
