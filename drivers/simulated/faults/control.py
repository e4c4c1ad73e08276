"""Faults on command: a socket beside the wires of a served stand, and how to talk to it.

One request and one reply a connection, each a line of JSON: ``{"add": "temperature_1=crc", "for_s": 30}``,
``{"clear": "temperature_1"}`` (null: all) or ``{"list": true}``; ``{"ok": true, "text": "…"}``.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from bufferstand.drivers.simulated.faults.schedule import (
    FOREVER_S,
    ONCE,
    FaultSchedule,
    ScheduledFault,
    parse_fault,
    target_class,
)
from bufferstand.foundation import BadInput, exchange, short_address

SOCKET = "faults"
"""Name of the socket in the folder of the wires."""
WAIT_S = 5.0
"""Longest wait for a served stand's answer [s of the wall]."""
_LINE = 65536


class FaultControl:
    """Takes faults while the stand is served.

    Parameters
    ----------
    path : Path
        Where the socket shall be.
    faults : FaultSchedule
        What it adds to.
    now_s : callable
        Present stand time [s].
    demand_possible : callable
        Raises BadInput for a fault that this stand cannot show.
    """

    def __init__(
        self,
        path: Path,
        faults: FaultSchedule,
        now_s: Callable[[], float],
        demand_possible: Callable[[ScheduledFault], object],
    ) -> None:
        self.path = path
        self._faults = faults
        self._now_s = now_s
        self._demand_possible = demand_possible
        self._server: asyncio.Server | None = None
        self._inode = 0

    async def start(self) -> None:
        """Listen; a socket that was left behind is replaced.

        Raises
        ------
        BadInput
            If something else lies there, or no socket can be made.
        """
        if self.path.exists() and not self.path.is_socket():
            raise BadInput(
                "a file lies where the socket for faults shall appear",
                file=self.path,
                remedy="choose another folder for the wires (--wires)",
            )
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self.path.unlink(missing_ok=True)
            with short_address(self.path) as address:
                self._server = await asyncio.start_unix_server(self._serve, address, limit=_LINE)
            self._inode = self.path.stat().st_ino
        except OSError as error:
            raise BadInput(f"cannot be made: {error.strerror or error}", file=self.path) from None

    async def stop(self) -> None:
        """Take the socket away, if it is still ours."""
        server, self._server = self._server, None
        if server is None:
            return
        server.close()
        with suppress(OSError):
            if self.path.stat().st_ino == self._inode:
                self.path.unlink()
        await server.wait_closed()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            line = await asyncio.wait_for(reader.readline(), WAIT_S)
            reply = self._answer(line)
        except BadInput as error:
            reply = {"ok": False, "text": error.problem, "remedy": error.remedy}
        except (TimeoutError, ValueError, AttributeError, TypeError) as error:
            reply = {"ok": False, "text": f"this is no request ({error or 'nothing came'})", "remedy": ""}
        with suppress(OSError):
            writer.write(json.dumps(reply).encode() + b"\n")
            await writer.drain()
            writer.close()
            await writer.wait_closed()

    def _answer(self, line: bytes) -> dict[str, Any]:
        request = json.loads(line)
        now_s = self._now_s()
        if "add" in request:
            fault = parse_fault(str(request["add"]), file="fault", start_s=lambda: now_s)
            length_s = request.get("for_s")
            if length_s is not None and fault.kind not in ONCE:
                fault = replace(fault, end_s=fault.start_s + float(length_s))
            self._demand_possible(fault)
            self._faults.add(fault)
            return {"ok": True, "text": f"at {now_s:.1f} s of stand time: {fault}"}
        if "clear" in request:
            target = request["clear"]
            if target is not None:
                target_class(str(target))
            count = self._faults.clear(target)
            return {"ok": True, "text": f"{count} fault{'' if count == 1 else 's'} taken away"}
        if "list" in request:
            lines = [f"stand time {now_s:.1f} s", *(_shown(one, now_s) for one in self._faults.faults)]
            return {"ok": True, "text": "\n".join(lines)}
        raise ValueError("add, clear or list is missing")


def ask(path: Path, request: dict[str, object]) -> str:
    """Send a request to a served stand; return its answer.

    Parameters
    ----------
    path : Path
        Its socket.
    request : dict
        See the head of this module.

    Raises
    ------
    BadInput
        If no stand is served there, or it refuses.
    """
    try:
        reply = exchange(path, request, timeout_s=WAIT_S, longest=_LINE)
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) and error.strerror else "no answer"
        raise BadInput(
            f"no simulated stand takes faults here ({why})",
            file=path,
            remedy="start it with bufferstand simulate-stand, with the same STAND.toml and --wires",
        ) from None
    if not reply["ok"]:
        raise BadInput(reply["text"], remedy=reply["remedy"])
    return str(reply["text"])


def _shown(fault: ScheduledFault, now_s: float) -> str:
    if fault.kind in ONCE:
        state = "done" if fault.start_s <= now_s else "to come"
    elif fault.start_s > now_s:
        state = "to come"
    else:
        state = "on" if fault.end_s == FOREVER_S or now_s < fault.end_s else "over"
    return f"{state:8}{fault}"
