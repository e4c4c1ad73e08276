"""Events of the stand's guards about its devices, read from a run file."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from bufferstand.evaluation.facts import GuardDoubt
from bufferstand.recording.runfile import RunEvent

KINDS = ("trip", "note")
"""Events that a guard writes."""
WIRING = "wiring"
"""A guard whose name begins so doubts that a channel measures what it should."""
_OF_CHANNEL = (f"{WIRING} of ", "plausibility of ", "frozen ")
_DEVICES = (WIRING, "plausibility of ", "frozen ", "controller", "recorder", "agreement")
"""Guards of devices by the beginnings of their names: files from before ``device_fault`` was written have
only these."""
_LOOKED_AT_SECOND = ("force_2", "position", "command")


def guard_doubts(events: Iterable[RunEvent]) -> tuple[GuardDoubt, ...]:
    """Return what guards said of devices and their wires; what a limit or an operator did is not among it.

    Parameters
    ----------
    events : iterable of RunEvent
    """
    return tuple(_doubt(event) for event in events if event.kind in KINDS and _is_of_a_device(event.data))


def _is_of_a_device(data: Any) -> bool:
    guard = str(data.get("guard") or "")
    return bool(data.get("device_fault")) or bool(data.get("doubt")) or guard.startswith(_DEVICES)


def _doubt(event: RunEvent) -> GuardDoubt:
    data = event.data
    guard = str(data.get("guard") or "")
    value = data.get("value")
    return GuardDoubt(
        guard,
        event.time_s,
        event.text,
        channel=_channel(guard, str(data.get("sensor") or "")),
        wiring=bool(data.get("doubt")) or guard.startswith(WIRING),
        value=float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None,
        unit=str(data.get("unit") or ""),
    )


def _channel(guard: str, sensor: str) -> str:
    """Return the channel that is doubted; of several one of which figures are read."""
    if not sensor:
        sensor = next((guard.removeprefix(start) for start in _OF_CHANNEL if guard.startswith(start)), "")
    names = [name.strip() for name in sensor.split(",") if name.strip()]
    figures = [name for name in names if name not in _LOOKED_AT_SECOND]
    return (figures or names or [""])[0]
