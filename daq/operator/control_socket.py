"""The socket of a running campaign: its operator stops it, or adds a note, from another terminal.

One request and one reply a connection, each a line of JSON: ``{"stop": "now"}`` (or ``cycle``, ``step``),
``{"note": "…"}``, ``{"finding": "…"}`` of a program beside the campaign (the twin); ``{"ok": true, "text":
"…"}``. Only the user who runs the campaign is heard. A request may say for whom it is made: ``"by":
"A. Smith (192.168.1.7)"``; a note of somebody's begins with that.
"""

from __future__ import annotations

import json
import os
import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from bufferstand.daq.operator.notes import clean_note, signed_note
from bufferstand.daq.operator.stop_request import StopLevel, StopRequest
from bufferstand.foundation import BadInput, bind_for_oneself, connected, exchange
from bufferstand.foundation.files import json_content

SOCKET_NAME = "control"
WAIT_S = 5.0
"""Longest wait for the other side [s]."""
LEVELS = {"now": StopLevel.NOW, "cycle": StopLevel.AFTER_CYCLE, "step": StopLevel.AFTER_STEP}
_SAID = {"now": "stopping now", "cycle": "stopping after the cycle", "step": "stopping after the step"}
LONGEST_NAME = 120
"""Characters of who asks."""
_LINE = 16384
_POLL_S = 0.2


@contextmanager
def listening(folder: Path, request: StopRequest) -> Iterator[None]:
    """While inside, take requests at the socket of a campaign's folder.

    Raises
    ------
    BadInput
        If a campaign that is running answers there already.
    """
    path = folder / SOCKET_NAME
    if is_running(folder):
        raise BadInput(
            "a campaign is running in this folder already",
            file=folder,
            remedy="wait for its end, stop it (bufferstand stop), or choose another folder",
        )
    with suppress(OSError):
        path.unlink(missing_ok=True)
    server, ending = socket.socket(socket.AF_UNIX), threading.Event()
    try:
        bind_for_oneself(server, path)
        server.listen(4)
        server.settimeout(_POLL_S)
    except OSError:  # a folder that takes no sockets: keys and signals are there still
        server.close()
        yield
        return
    thread = threading.Thread(target=_serve, args=(server, request, ending), name="control", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ending.set()
        thread.join()
        server.close()
        with suppress(OSError):
            path.unlink()


def ask(folder: Path, message: dict[str, str]) -> str | None:
    """Send a request to the campaign that runs in a folder; return its answer, None if none runs.

    Parameters
    ----------
    folder : Path
        The campaign's folder.
    message : dict
        ``stop`` or ``note``, and ``by``, if somebody else wants it.

    Raises
    ------
    BadInput
        If it refuses.
    """
    try:
        reply = exchange(folder / SOCKET_NAME, message, timeout_s=WAIT_S, longest=_LINE)
    except (OSError, ValueError):
        return None
    if not reply["ok"]:
        raise BadInput(reply["text"])
    return str(reply["text"])


def is_running(folder: Path) -> bool:
    """Return whether a campaign runs in a folder: it answers at its socket."""
    path = folder / SOCKET_NAME
    return path.exists() and _answers(path)


def _answers(path: Path) -> bool:
    with suppress(OSError), connected(path, WAIT_S):
        return True
    return False


def _serve(server: socket.socket, request: StopRequest, ending: threading.Event) -> None:
    while not ending.is_set():
        try:
            wire, _ = server.accept()
        except TimeoutError:
            continue
        except OSError:
            return
        with wire, suppress(OSError):
            wire.settimeout(WAIT_S)
            reply = _reply(wire, request)
            wire.sendall(json.dumps(reply).encode() + b"\n")


def _reply(wire: socket.socket, request: StopRequest) -> dict[str, Any]:
    if _user_of(wire) not in (os.getuid(), 0):
        return {"ok": False, "text": "only the user who runs the campaign is heard"}
    try:
        with wire.makefile("rb") as lines:
            message = json_content(lines.readline(_LINE))
        by = clean_note(str(message["by"]))[:LONGEST_NAME] if message.get("by") else ""
        if "note" in message:
            request.note(signed_note(str(message["note"]), by))
            return {"ok": True, "text": "noted"}
        if "finding" in message:
            request.find(by or "program", clean_note(str(message["finding"])))
            return {"ok": True, "text": "taken"}
        after = message["stop"]
        request.ask(LEVELS[after], f"{by or 'bufferstand stop'} ({after})")
        return {"ok": True, "text": _answer(request, after)}
    except BadInput as error:
        return {"ok": False, "text": error.problem}
    except (ValueError, KeyError, TypeError) as error:
        return {"ok": False, "text": f"this is no request ({error})"}


def _answer(request: StopRequest, after: str) -> str:
    """Say which stop it is to be: one that was asked for before may be sooner."""
    said = next((said for name, said in _SAID.items() if LEVELS[name] == request.level), _SAID[after])
    return said if request.level == LEVELS[after] else f"{said} already: {request.reason}"


def _user_of(wire: socket.socket) -> int:
    """Return the user id of the other side (the kernel says it)."""
    _, user, _ = struct.unpack("3i", wire.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12))
    return int(user)
