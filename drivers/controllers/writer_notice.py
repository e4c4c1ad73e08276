"""A notice on this computer: which of its programs gives commands to which controller.

The controller knows a number; the notice says which process that is. It lies in a folder that all users of
this computer share, is written beside and renamed, and is held locked by its process as long as that lives:
one that is not locked was left by a process that was killed. What it says is shown to people and shortens no
wait: anybody may write into that folder. Nothing here raises: a notice that cannot be written is missing.
"""

from __future__ import annotations

import getpass
import hashlib
import json
import os
import secrets
import socket
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bufferstand.foundation.operating_system import is_lock_taken

PREFIX = "bufferstand"
LONGEST = 4096
"""A notice has at most so many bytes; what is longer is none."""
LONGEST_TEXT = 200
GREATEST_PID = 1 << 31
FRESH_S = 60.0
"""So young a notice is left alone, also unlocked: its process is about to lock it [s]."""
_TRIES, _AGAIN_S = 5, 0.01


@dataclass(frozen=True)
class Notice:
    """Who gives commands to a controller.

    Parameters
    ----------
    writer : int
        Its number in the controller.
    pid : int
        Process on this computer.
    since : str
        When it took the right (UTC).
    doing : str
        What it does.
    user, host : str
        Whose process, and where.
    lives : bool or None
        Whether the process lives; None where it is another computer's, of which nobody here can tell.
    """

    writer: int
    pid: int
    since: str
    doing: str
    user: str
    host: str
    lives: bool | None

    @property
    def text(self) -> str:
        """The program in words."""
        if not self.pid:
            return "an unknown program of this computer, which has posted no notice"
        killed = ", which was killed" if self.lives is False else ""
        doing = f", {self.doing}" if self.doing else ""
        return f"process {self.pid} of {self.user} on {self.host}{doing}, since {self.since} UTC{killed}"


def shared_folder() -> Path:
    """Return the folder for temporary files that the users of this computer share."""
    return Path(os.environ.get("PROGRAMDATA") or tempfile.gettempdir())


def address_key(address: str) -> str:
    """Return the same short name for the same controller: ``host:port`` or a line, with the device's id.

    A line is followed to the device that it leads to, a host's name to its address.
    """
    where, _, unit = address.rpartition(" unit ")
    host, _, port = where.rpartition(":")
    if port.isdigit() and host:
        with suppress(OSError):
            host = socket.gethostbyname(host)
        where = f"{host.lower()}:{port}"
    else:
        where = os.path.realpath(where)
    return hashlib.sha256(f"{where} {unit}".encode()).hexdigest()[:16]


class NoticeBoard:
    """The notices of one controller on this computer.

    Parameters
    ----------
    address : str
        Of the controller, as its link says it.
    doing : str
        What this program does, in words.
    folder : Path, optional
        Where the notices lie; :func:`shared_folder` without it.
    """

    def __init__(self, address: str, doing: str = "", folder: Path | None = None) -> None:
        self._address = address
        self._doing = doing
        self._folder = folder or shared_folder()
        self._own: tuple[Path, int] | None = None
        self._exclusive: int | None = None
        self._key = ""

    @property
    def _prefix(self) -> str:
        self._key = self._key or address_key(self._address)
        return f"{PREFIX}-{self._key}"

    def put(self, number: int) -> None:
        """Post that this program gives commands, under a number; what killed programs left is taken away."""
        self._take_away()
        with suppress(OSError):
            self._tidy()
            path = self._folder / f"{self._prefix}-{os.getpid()}-{secrets.token_hex(4)}.json"
            if file := _write_locked(path, json.dumps(self._content(number)).encode()):
                self._own = path, file

    def _tidy(self) -> None:
        """Take away what dead processes of this computer have left, of every controller."""
        for path in self._folder.glob(f"{PREFIX}-*.json"):
            if not _is_locked(path) and _is_left(path, own=path.name.startswith(self._prefix)):
                with suppress(OSError):  # another user's
                    path.unlink()
        for path in self._folder.glob(f"{PREFIX}-*.new"):
            with suppress(OSError):
                if _age_s(path) > FRESH_S:
                    path.unlink()
        for path in self._folder.glob(f"{PREFIX}-*.lock"):
            if not path.name.startswith(self._prefix):
                _remove_unheld(path)

    def _content(self, number: int) -> dict[str, Any]:
        return {
            "writer": number,
            "pid": os.getpid(),
            "began": _began(os.getpid()),
            "since": datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S"),
            "doing": self._doing[:LONGEST_TEXT],
            "user": _user(),
            "host": socket.gethostname(),
        }

    def remove(self) -> None:
        """Take the own notice away, and let go of the lock of :meth:`lock`."""
        self._take_away()
        exclusive, self._exclusive = self._exclusive, None
        if exclusive is not None:
            with suppress(OSError):
                os.close(exclusive)

    def _take_away(self) -> None:
        own, self._own = self._own, None
        if own is not None:
            with suppress(OSError):
                own[0].unlink(missing_ok=True)
            with suppress(OSError):
                os.close(own[1])
            with suppress(OSError):  # where an open file cannot be removed
                own[0].unlink(missing_ok=True)

    def find(self, number: int) -> Notice | None:
        """Return the notice of another program of this computer that has this number, if there is one."""
        found = [notice for notice in self._others() if notice.writer == number]
        return max(found, key=lambda notice: (notice.lives is not False, notice.since), default=None)

    def lock(self) -> bool:
        """Take the lock that stands for a controller without one; return False where another process has it.

        Where the folder cannot be used there is no such lock, and nobody has it.
        """
        if self._exclusive is not None:
            return True
        path = self._folder / f"{self._prefix}.lock"
        for _ in range(_TRIES):  # whoever looks whether it is locked holds it for a moment
            file = _opened(path)
            if file is None:
                return True
            if _lock(file) and _is_same(file, path):
                self._exclusive = file
                return True
            os.close(file)
            time.sleep(_AGAIN_S)
        return False

    def find_locked(self) -> Notice | None:
        """Return who has the lock of :meth:`lock`; None where nobody else has it."""
        path = self._folder / f"{self._prefix}.lock"
        if self._exclusive is not None or not _is_locked(path):
            return None
        living = [notice for notice in self._others() if notice.lives]
        unknown = Notice(0xFFFF, 0, "an unknown time", "", "an unknown user", "this computer", lives=True)
        return max(living, key=lambda notice: notice.since, default=unknown)

    def _paths(self) -> list[Path]:
        own = self._own[0] if self._own else None
        return [path for path in self._folder.glob(f"{self._prefix}-*.json") if path != own]

    def _others(self) -> Iterator[Notice]:
        with suppress(OSError):
            for path in self._paths():
                if (notice := _read(path)) is not None:
                    yield notice


def _read(path: Path) -> Notice | None:
    """Return what a file says; None where it is no notice."""
    try:
        lives: bool | None = _is_locked(path)
        file = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
        try:
            content = json.loads(os.read(file, LONGEST))
        finally:
            os.close(file)
        since, doing, user, host = (_plain(content[key]) for key in ("since", "doing", "user", "host"))
        writer, pid = int(content["writer"]), int(content["pid"])
        if not (0 < writer <= 0xFFFF and 0 < pid < GREATEST_PID):
            return None
        if content["host"] != socket.gethostname() and not lives:
            lives = None
        return Notice(writer, pid, since, doing, user, host, lives)
    except (OSError, ValueError, KeyError, TypeError, OverflowError, RecursionError):
        return None


def _is_left(path: Path, *, own: bool) -> bool:
    """Return whether a notice that nobody holds locked was left by a process of this computer that is over.

    One of the controller that this program has taken (``own``) is left in any case.
    """
    if own:
        return True
    try:
        with path.open("rb") as file:
            content = json.loads(file.read(LONGEST))
        pid, began, host = int(content["pid"]), content.get("began"), content["host"]
    except (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
        with suppress(OSError):
            return _age_s(path) > FRESH_S  # no notice at all
        return False
    if host != socket.gethostname() or not 0 < pid < GREATEST_PID:
        return False
    return not _runs(pid) or (began is not None and _began(pid) != began)


def _runs(pid: int) -> bool:
    """Return whether a process of this computer has this number."""
    if sys.platform == "win32":  # there a signal of 0 would end it
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _began(pid: int) -> str | None:
    """Return what tells a process from a later one of the same number; None where the system does not say."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace")
    except OSError:
        return None
    fields = stat.rpartition(")")[2].split()
    return fields[19] if len(fields) > 19 else None  # starttime of proc(5), since the computer was started


def _age_s(path: Path) -> float:
    return time.time() - path.lstat().st_mtime


def _is_same(file: int, path: Path) -> bool:
    """Return whether an open file is still the one of that name: it may have been tidied away meanwhile."""
    try:
        return os.path.samestat(os.fstat(file), path.lstat())
    except OSError:
        return False


def _remove_unheld(path: Path) -> None:
    """Take a lock file away that nobody holds, holding it: who opened it before sees that it is gone."""
    if sys.platform == "win32":  # an open file cannot be removed
        return
    with suppress(OSError):
        file = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        try:
            if _lock(file) and _is_same(file, path) and _age_s(path) > FRESH_S:
                path.unlink()
        finally:
            os.close(file)


def _plain(text: Any) -> str:
    """Return a text of somebody else's as one that does nothing to a terminal."""
    return "".join(sign if sign.isprintable() else "?" for sign in str(text)[:LONGEST_TEXT])


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError, ImportError):
        return "an unknown user"


def _write_locked(path: Path, content: bytes) -> int | None:
    """Write a file beside, rename it and hold it locked; return what holds it, None where it cannot be."""
    beside = path.with_suffix(".new")
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0)
    try:
        file = os.open(beside, flags, 0o644)
        with os.fdopen(file, "wb") as stream:
            stream.write(content)
        beside.replace(path)
        held = os.open(path, os.O_RDWR | getattr(os, "O_CLOEXEC", 0))
    except OSError:
        with suppress(OSError):
            beside.unlink(missing_ok=True)
        return None
    _lock(held)
    return held


def _opened(path: Path) -> int | None:
    """Open a lock file that all users share, made if need be; None where that cannot be."""
    flags = (os.O_RDWR if sys.platform == "win32" else os.O_RDONLY) | getattr(os, "O_CLOEXEC", 0)
    for more in (0, os.O_CREAT | os.O_EXCL, 0):  # in a shared folder nobody may “create” another's file
        try:
            return os.open(path, flags | more | getattr(os, "O_NOFOLLOW", 0), 0o644)
        except (FileNotFoundError, FileExistsError):
            continue
        except OSError:
            return None
    return None


def _is_locked(path: Path) -> bool:
    """Return whether a process holds a file locked."""
    flags = (os.O_RDWR if sys.platform == "win32" else os.O_RDONLY) | getattr(os, "O_CLOEXEC", 0)
    try:
        file = os.open(path, flags | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0))
    except OSError:
        return False
    try:
        return not _lock(file, shared=True)
    finally:
        os.close(file)


def _lock(file: int, *, shared: bool = False) -> bool:
    """Lock a file until it is closed; return whether nobody else has."""
    try:
        return is_lock_taken(file, shared=shared)
    except OSError:  # a file system without locks: nobody can be told to have one
        return True
