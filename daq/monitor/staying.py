"""The page stays when its campaign has ended: by which rule, and how it is found and ended.

It stays while somebody has it open, and :data:`IDLE_S` longer, at most :data:`MOST_S`. Where nobody has had
it open so lately, it ends with the campaign: a script that runs campaigns leaves no process behind.
"""

from __future__ import annotations

import fcntl
import json
import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

IDLE_S = 600.0
"""A page that nobody has had open for so long ends [s]."""
MOST_S = 12 * 3600.0
"""It ends so long behind its campaign, whoever has it open [s]."""
PAGE_NAME = "page"
"""Which process serves the page of a campaign that has ended: a file in its folder, locked while it does."""
END_S = 15.0
"""Longest wait for it to end [s]."""
_POLL_S = 0.05


@contextmanager
def announced(folder: Path, port: int) -> Iterator[None]:
    """While inside, the campaign's folder says which process serves its page.

    A folder that takes no file, or no lock, is no reason not to serve it: it cannot be found then.
    """
    path, descriptor = folder / PAGE_NAME, -1
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.ftruncate(descriptor, 0)
        os.write(descriptor, json.dumps({"pid": os.getpid(), "port": port}).encode())
        ours = True
    except OSError:
        ours = False
    try:
        yield
    finally:
        if ours:
            with suppress(OSError):
                path.unlink()
        if descriptor >= 0:
            os.close(descriptor)


def end_page(folder: Path) -> bool:
    """End the page that has stayed behind a campaign in this folder; return whether there was one.

    Only a process that holds the lock of the folder's file is ended: a number alone could be another's.
    """
    path = folder / PAGE_NAME
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError:
        return False
    try:
        if not _is_held(descriptor):
            with suppress(OSError):
                path.unlink()  # of a process that was killed
            return False
        pid = int(json.loads(os.read(descriptor, 4096))["pid"])
        os.kill(pid, signal.SIGTERM)
        until_s = time.monotonic() + END_S
        while _is_held(descriptor) and time.monotonic() < until_s:
            time.sleep(_POLL_S)
    except (OSError, ValueError, KeyError, TypeError):
        return False
    else:
        return True
    finally:
        os.close(descriptor)


def _is_held(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    fcntl.flock(descriptor, fcntl.LOCK_UN)
    return False


def rule_in_words() -> str:
    """Return when a page that has stayed ends."""
    return f"it ends when nobody has had it open for {IDLE_S / 60.0:.0f} minutes"
