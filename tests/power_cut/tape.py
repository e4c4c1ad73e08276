"""A tape of all that a program asks of a disk, and of what it says is safe: taken from the real calls.

While :func:`taped` is on, every call that changes something below one folder is written down after it has
been made, and every sync when it begins and when it has returned: what is written meanwhile is not covered.
"""

from __future__ import annotations

import builtins
import io
import os
import shutil
import stat
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ROOT = 0
"""Number of the folder itself, which is on the disk from the beginning."""
_APPENDING = getattr(os, "O_APPEND", 0)


@dataclass(frozen=True)
class Made:
    """A name was given to a new file or folder, or a second name to an old file."""

    folder: int
    name: str
    node: int
    is_folder: bool = False


@dataclass(frozen=True)
class Gone:
    """A name was taken away."""

    folder: int
    name: str


@dataclass(frozen=True)
class Moved:
    """A name was changed, in place of whatever had the new one."""

    folder: int
    name: str
    to_folder: int
    to_name: str


@dataclass(frozen=True)
class Written:
    """Bytes were written into a file."""

    node: int
    offset: int
    data: bytes


@dataclass(frozen=True)
class Sized:
    """A file was given a size; one that is ``at_least`` only grows (space reserved ahead)."""

    node: int
    size: int
    at_least: bool = False


@dataclass(frozen=True)
class SyncBegins:
    """A file or folder is being brought to the disk."""

    node: int
    ticket: int


@dataclass(frozen=True)
class Synced:
    """It has been brought there: all that was done before :class:`SyncBegins` with the ticket."""

    node: int
    ticket: int


@dataclass(frozen=True)
class Told:
    """The program said, or was about to do, something that a check looks at."""

    what: str
    content: Any


Entry = Made | Gone | Moved | Written | Sized | SyncBegins | Synced | Told


@dataclass
class Node:
    """A file or folder: what is in it, as the program sees it."""

    is_folder: bool = False
    names: dict[str, int] = field(default_factory=dict)
    content: bytearray = field(default_factory=bytearray)
    size: int = 0
    """May lie beyond ``content``: zeros."""


@dataclass
class Tape:
    """What was done to a folder.

    Parameters
    ----------
    root : Path
        The folder, absolute and without links.
    first : mapping of int to Node
        What was there at the beginning, all of it on the disk.
    """

    root: Path
    first: dict[int, Node]
    entries: list[Entry] = field(default_factory=list)

    def tell(self, what: str, content: Any = None) -> None:
        """Write down a fact that a check looks at."""
        self.entries.append(Told(what, content))


def found_on(root: Path) -> dict[int, Node]:
    """Return what lies in a folder, by numbers from :data:`ROOT` on."""
    nodes: dict[int, Node] = {}

    def take(path: Path) -> int:
        number = len(nodes)
        nodes[number] = node = Node(path.is_dir())
        if node.is_folder:
            node.names = {one.name: take(one) for one in sorted(path.iterdir())}
        else:
            node.content = bytearray(path.read_bytes())
            node.size = len(node.content)
        return number

    take(root)
    return nodes


class _Recording:
    """Follows names and open files, so that each call is written down with the file that it meant."""

    def __init__(self, tape: Tape) -> None:
        self.tape = tape
        self.lock = threading.RLock()
        self.names: dict[int, dict[str, int]] = {
            number: dict(node.names) for number, node in tape.first.items() if node.is_folder
        }
        self.open: dict[int, int] = {}
        self._count = len(tape.first)
        self._tickets = 0

    def place(self, path: Any) -> tuple[int, str] | None:
        """Return folder and name of a path below the root; None for any other."""
        if isinstance(path, int):
            return None
        whole = Path(os.path.normpath(Path.cwd() / os.fsdecode(path)))
        if not whole.is_relative_to(self.tape.root) or whole == self.tape.root:
            return None
        *folders, name = whole.relative_to(self.tape.root).parts
        folder = ROOT
        for one in folders:
            if one not in self.names.get(folder, {}):
                return None
            folder = self.names[folder][one]
        return folder, name

    def node(self, path: Any) -> int | None:
        """Return the number of what has a path; None where it is not followed."""
        if (
            not isinstance(path, int)
            and Path(os.path.normpath(Path.cwd() / os.fsdecode(path))) == self.tape.root
        ):
            return ROOT
        place = self.place(path)
        return None if place is None else self.names.get(place[0], {}).get(place[1])

    def make(self, path: Any, *, is_folder: bool = False) -> int | None:
        place = self.place(path)
        if place is None:
            return None
        number, self._count = self._count, self._count + 1
        if is_folder:
            self.names[number] = {}
        self.names[place[0]][place[1]] = number
        self.tape.entries.append(Made(*place, number, is_folder))
        return number

    def drop(self, path: Any) -> None:
        place = self.place(path)
        if place is not None and self.names[place[0]].pop(place[1], None) is not None:
            self.tape.entries.append(Gone(*place))

    def move(self, path: Any, to: Any) -> None:
        old, new = self.place(path), self.place(to)
        assert (old is None) == (new is None), f"a file came from or went to another disk: {path} -> {to}"
        if old is None or new is None:
            return
        self.names[new[0]][new[1]] = self.names[old[0]].pop(old[1])
        self.tape.entries.append(Moved(*old, *new))

    def opened(self, handle: int, path: Any, flags: int, *, was_there: bool) -> None:
        if flags & os.O_CREAT and not was_there:
            number = self.make(path)
        else:
            number = self.node(path)
            if number is not None and flags & os.O_TRUNC:
                self.tape.entries.append(Sized(number, 0))
        if number is not None:
            self.open[handle] = number
        else:
            self.open.pop(handle, None)

    def wrote(self, handle: int, data: Any, offset: int, taken: int) -> None:
        if handle in self.open and taken:
            piece = bytes(memoryview(data).cast("B")[:taken])
            self.tape.entries.append(Written(self.open[handle], offset, piece))

    def sized(self, handle: int, size: int, *, at_least: bool = False) -> None:
        if handle in self.open:
            self.tape.entries.append(Sized(self.open[handle], size, at_least))

    def sync(self, handle: int, real: Callable[[int], None]) -> None:
        with self.lock:
            number = self.open.get(handle)
            ticket, self._tickets = self._tickets, self._tickets + 1
            if number is not None:
                self.tape.entries.append(SyncBegins(number, ticket))
        real(handle)
        with self.lock:
            if number is not None:
                self.tape.entries.append(Synced(number, ticket))


class _TapedFile(io.FileIO):
    """What ``open`` gives for writing: buffers above it hand down here."""

    recording: _Recording

    def __init__(self, file: Any, mode: str, recording: _Recording, *, closefd: bool = True) -> None:
        self.recording = recording
        named = not isinstance(file, int)
        with recording.lock:
            was_there = named and os.path.lexists(file)
            super().__init__(file, mode, closefd=closefd)
            if named:
                flags = os.O_CREAT | (os.O_TRUNC if "w" in mode else 0)
                recording.opened(self.fileno(), file, flags, was_there=was_there)
        self._appends = "a" in mode

    def write(self, data: Any) -> int:
        with self.recording.lock:
            at = os.fstat(self.fileno()).st_size if self._appends else self.tell()
            taken = super().write(data)
            self.recording.wrote(self.fileno(), data, at, taken)
        return taken

    def truncate(self, size: int | None = None) -> int:
        with self.recording.lock:
            made = super().truncate(size)
            self.recording.sized(self.fileno(), made)
        return made


@contextmanager
def taped(root: Path) -> Iterator[Tape]:
    """Write down what this process does to the files below a folder, until the end of the block."""
    tape = Tape(root.resolve(), found_on(root.resolve()))
    recording = _Recording(tape)
    replaced: list[tuple[Any, str, Any]] = []

    def put(owner: Any, name: str, new: Any) -> None:
        replaced.append((owner, name, getattr(owner, name)))
        setattr(owner, name, new)

    for name, new in {**_calls(recording), **_names(recording)}.items():
        put(os, name, new)
    put(io, "open", opener := _opener(recording))
    put(builtins, "open", opener)
    if hasattr(shutil, "_USE_CP_SENDFILE"):  # it copies inside the kernel, past all calls that are followed
        put(shutil, "_USE_CP_SENDFILE", False)
    try:
        yield tape
    finally:
        for owner, name, old in reversed(replaced):
            setattr(owner, name, old)


def _opener(recording: _Recording) -> Callable[..., Any]:
    real_open = builtins.open

    def open_(
        file: Any, mode: str = "r", buffering: int = -1, encoding: str | None = None,
        errors: str | None = None, newline: str | None = None, closefd: bool = True, opener: Any = None,
    ) -> Any:  # fmt: skip
        writes = set(mode) & set("wax+")
        followed = (file in recording.open) if isinstance(file, int) else recording.place(file) is not None
        if not writes or not followed or opener is not None:
            return real_open(file, mode, buffering, encoding, errors, newline, closefd, opener)
        raw = _TapedFile(file, mode.replace("b", "").replace("t", ""), recording, closefd=closefd)
        if buffering == 0:
            return raw
        buffered = io.BufferedRandom(raw) if "+" in mode else io.BufferedWriter(raw)
        return buffered if "b" in mode else io.TextIOWrapper(buffered, encoding, errors, newline)

    return open_


def _calls(recording: _Recording) -> dict[str, Callable[..., Any]]:
    """Return the calls of ``os`` on open files, each followed by its entry on the tape."""
    names = ("open", "close", "write", "pwrite", "ftruncate", "truncate")
    names += ("posix_fallocate", "fsync", "fdatasync")
    real = {name: getattr(os, name) for name in names}
    lock = recording.lock

    def open_(path: Any, flags: int, mode: int = 0o777, *, dir_fd: int | None = None) -> int:
        assert dir_fd is None or recording.place(path) is None, (
            f"{path}: a name relative to a folder's handle"
        )
        with lock:
            was_there = os.path.lexists(path)
            handle = int(real["open"](path, flags, mode, dir_fd=dir_fd))
            recording.opened(handle, path, flags, was_there=was_there)
        return handle

    def close(handle: int) -> None:
        with lock:
            recording.open.pop(handle, None)
            real["close"](handle)

    def write(handle: int, data: Any) -> int:
        if handle not in recording.open:
            return int(real["write"](handle, data))
        with lock:
            appends = _appends(handle)
            at = os.fstat(handle).st_size if appends else os.lseek(handle, 0, os.SEEK_CUR)
            taken = int(real["write"](handle, data))
            recording.wrote(handle, data, at, taken)
        return taken

    def pwrite(handle: int, data: Any, offset: int) -> int:
        with lock:
            taken = int(real["pwrite"](handle, data, offset))
            recording.wrote(handle, data, offset, taken)
        return taken

    def ftruncate(handle: int, size: int) -> None:
        with lock:
            real["ftruncate"](handle, size)
            recording.sized(handle, size)

    def truncate(path: Any, size: int) -> None:
        with lock:
            real["truncate"](path, size)
            if (number := recording.node(path)) is not None:
                recording.tape.entries.append(Sized(number, size))

    def fallocate(handle: int, offset: int, size: int) -> None:
        with lock:
            real["posix_fallocate"](handle, offset, size)
            recording.sized(handle, offset + size, at_least=True)

    return {
        "open": open_,
        "close": close,
        "write": write,
        "pwrite": pwrite,
        "ftruncate": ftruncate,
        "truncate": truncate,
        "posix_fallocate": fallocate,
        "fsync": lambda handle: recording.sync(_number(handle), real["fsync"]),
        "fdatasync": lambda handle: recording.sync(_number(handle), real["fdatasync"]),
    }


def _names(recording: _Recording) -> dict[str, Callable[..., Any]]:
    """Return the calls of ``os`` that change names, each followed by its entry on the tape."""
    real = {name: getattr(os, name) for name in ("rename", "replace", "unlink", "link", "mkdir", "rmdir")}
    lock = recording.lock

    def mkdir(path: Any, mode: int = 0o777, *, dir_fd: int | None = None) -> None:
        with lock:
            real["mkdir"](path, mode, dir_fd=dir_fd)
            recording.make(path, is_folder=True)

    def link(path: Any, to: Any, **named: Any) -> None:
        with lock:
            real["link"](path, to, **named)
            number, place = recording.node(path), recording.place(to)
            if number is not None and place is not None:
                recording.names[place[0]][place[1]] = number
                recording.tape.entries.append(Made(*place, number))

    def moving(name: str) -> Callable[..., None]:
        def move(path: Any, to: Any, **named: Any) -> None:
            with lock:
                real[name](path, to, **named)
                recording.move(path, to)

        return move

    def dropping(name: str) -> Callable[..., None]:
        def drop(path: Any, **named: Any) -> None:
            with lock:
                real[name](path, **named)
                recording.drop(path)

        return drop

    return {
        "mkdir": mkdir,
        "link": link,
        "rename": moving("rename"),
        "replace": moving("replace"),
        "unlink": dropping("unlink"),
        "remove": dropping("unlink"),
        "rmdir": dropping("rmdir"),
    }


def _number(handle: Any) -> int:
    return handle if isinstance(handle, int) else int(handle.fileno())


def _appends(handle: int) -> bool:
    import fcntl

    return bool(fcntl.fcntl(handle, fcntl.F_GETFL) & _APPENDING) and stat.S_ISREG(os.fstat(handle).st_mode)
