"""Who gives commands is posted on this computer: told, held, killed, forged, not to be written."""

from __future__ import annotations

import fcntl
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bufferstand.drivers.controllers import writer_notice
from bufferstand.drivers.controllers.writer_notice import NoticeBoard, address_key

ADDRESS = "127.0.0.1:15020 unit 1"
CHILD = """
import sys
from pathlib import Path
from bufferstand.drivers.controllers import writer_notice
from bufferstand.drivers.controllers.writer_notice import NoticeBoard
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
    [
        b"",
        b"\xff\xfe",
        b"[]",
        b"{}",
        b'{"writer": "x"}',
        b'{"writer": 7, "pid": 1}',
        b"[" * 4000,
        b"7",
        b'{"writer": 7, "pid": Infinity, "since": "", "doing": "", "user": "", "host": ""}',
        b'{"writer": 7, "pid": %s, "since": "", "doing": "", "user": "", "host": ""}' % (b"9" * 1000),
    ],
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
        "doing": "\x1b[2J\n\u202e" + "y" * 500,
        "user": "u",
        "host": "h",
    }
    path = tmp_path / f"bufferstand-{address_key(ADDRESS)}-1-ab.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    found = NoticeBoard(ADDRESS, folder=tmp_path).find(7)
    assert found is not None
    assert "\x1b" not in found.text
    assert "\n" not in found.text
    assert "\u202e" not in found.text
    assert len(found.text) < 400
    assert found.lives is None, "of another computer's process nobody here knows"
    assert "killed" not in found.text


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


def test_what_dead_processes_have_left_is_tidied_away(tmp_path: Path) -> None:
    """Of every controller; not what may be another's that lives: another computer's, a living process's."""
    with child(tmp_path) as other:
        dead = other.pid
        other.kill()
        other.communicate()
    (left,) = tmp_path.glob("*.json")
    content = json.loads(left.read_text(encoding="utf-8"))
    assert content["pid"] == dead

    def leave(key: str, **changes: object) -> Path:
        path = tmp_path / f"bufferstand-{key}-{dead}-ab.json"
        path.write_text(json.dumps({**content, **changes}), encoding="utf-8")
        return path

    old = time.time() - 3600.0
    gone = [left, leave("1" * 16), leave("2" * 16, pid=os.getpid(), began="1")]
    junk, lock, held = (tmp_path / f"bufferstand-{name}" for name in ("3-1-a.json", "4.lock", "5.lock"))
    for path in (junk, lock, held):
        path.write_bytes(b"junk")
        os.utime(path, (old, old))
    kept = [leave("6" * 16, host="elsewhere"), leave("7" * 16, pid=os.getpid(), began=None), held]
    kept += [tmp_path / "bufferstand-8-1-a.json", tmp_path / "someone-elses.json"]
    for path in kept[-2:]:
        path.write_bytes(b"young")
    with held.open("rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        board = NoticeBoard(ADDRESS, folder=tmp_path)
        board.put(1)
        board.remove()
    assert [path.name for path in (*gone, junk, lock) if path.exists()] == []
    assert [path.name for path in kept if not path.exists()] == []


def test_a_lock_file_tidied_away_is_made_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Between opening and locking it: two programs that held two files of one name would both have it."""
    first, second = (NoticeBoard(ADDRESS, folder=tmp_path) for _ in range(2))
    lock, taken = writer_notice._lock, []

    def too_late(file: int, *, shared: bool = False) -> bool:
        if not taken:
            taken.append(1)
            (path,) = tmp_path.glob("*.lock")
            path.unlink()
        return lock(file, shared=shared)

    monkeypatch.setattr(writer_notice, "_lock", too_late)
    assert first.lock()
    assert taken
    assert second.find_locked() is not None
    assert not second.lock()
