"""Messages while a stand is checked: events of the run, or kept until there is one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.acquisition.sensor_messages import SensorMessages
from bufferstand.daq.guards import RecorderState
from bufferstand.drivers import SensorFault
from bufferstand.foundation import Clock


class BlockRecorder(RecorderState, Protocol):
    """Where the raw blocks of a run go (:class:`bufferstand.recording.recorder.RunRecorder`)."""

    def append(
        self,
        stream: str,
        sequence: int,
        time_us: NDArray[np.int64],
        counts: Mapping[str, NDArray[Any]],
        lost: int = 0,
    ) -> None:
        """Queue a block; never blocks on the disk."""
        ...

    def anchor(self, device_us: int, host_s: float, utc: str) -> None:
        """Queue a pair of the device's and the host's clock."""
        ...

    def event(self, at_s: float, kind: str, text: str, **data: Any) -> None:
        """Queue an event."""
        ...

    def close(self, status: str, reason: str = "") -> Path:
        """End and seal the run; return its file."""
        ...


class RunLog:
    """Puts events into the run under way, and keeps what is said while there is none.

    Parameters
    ----------
    clock : Clock
        Stand time.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._recorder: BlockRecorder | None = None
        self._complaints = SensorMessages()
        self._aside: list[str] = []
        self._last_aside = ""
        self._doubts: list[tuple[float, str, str, dict[str, object]]] = []
        """What was said of the wiring while nothing was recorded: it belongs into the next run."""

    @property
    def recorder(self) -> BlockRecorder | None:
        """Return the recorder of the run under way."""
        return self._recorder

    def attach(self, recorder: BlockRecorder) -> None:
        """Write into this run from now on, beginning with the doubts that were waiting for one."""
        self._complaints.end()
        self._recorder = recorder
        doubts, self._doubts = self._doubts, []
        for at_s, kind, text, data in doubts:
            now_s = self._clock.now_s()
            recorder.event(now_s, kind, text, **data, before_s=round(now_s - at_s, 3))

    def detach(self) -> BlockRecorder | None:
        """Write into it no longer, once complaints are counted in it; return the recorder, not closed."""
        for stream, text in self._complaints.end():
            self.say("sensor", text, stream=stream)
        recorder, self._recorder = self._recorder, None
        return recorder

    def say(self, kind: str, text: str, **data: object) -> None:
        """Put an event into the run under way.

        Where there is none, devices' words are kept to be shown, and a doubt of the wiring for the next run.
        """
        if self._recorder is not None:
            self._recorder.event(self._clock.now_s(), kind, text, **data)
        elif data.get("doubt"):
            self._doubts.append((self._clock.now_s(), kind, text, data))
        elif kind in ("wire", "sensor") and text != self._last_aside:
            self._last_aside = text
            self._aside.append(text)

    def unrecorded(self) -> list[str]:
        """Return (and forget) what devices said while nothing was recorded."""
        aside, self._aside = self._aside, []
        return aside

    def complain(self, fault: SensorFault) -> None:
        """Say what a sensor complains of, the first time in a run."""
        if self._complaints.is_new(fault):
            self.say("sensor", f"{fault.stream}: {fault.what}", stream=fault.stream)
