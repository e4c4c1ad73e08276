"""Recording a stand that others move: drain, record, judge, until the operator or the time ends it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from bufferstand.daq.acquisition import BlockRecorder
from bufferstand.daq.guards import Trip
from bufferstand.daq.operator import StopLevel, StopRequest
from bufferstand.daq.record_only.watch import RecordingWatch
from bufferstand.drivers import RecordingDevices, SampleBlock, SensorFault
from bufferstand.foundation import Clock, duration_text

PASS_S = 0.02
"""Between two looks at the devices [s of the wall]."""
TOLD_S = 1.0
"""Between two reports of progress [s of the wall]."""
LAST_S = 0.3
"""What is still under way when a recording ends is waited for so long [s of the wall]."""


@dataclass
class RecordingProgress:
    """How a recording goes.

    Parameters
    ----------
    lasted_s : float
        Since the first pass [s].
    samples, lost : mapping of str to int
        By stream.
    values : mapping of str to float
        Newest values.
    warnings : int
    silent_s : mapping of str to float
        By stream that had fallen silent when the recording ended: for how long by then [s].
    """

    lasted_s: float = 0.0
    samples: dict[str, int] = field(default_factory=dict)
    lost: dict[str, int] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    warnings: int = 0
    silent_s: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class RecordingOutcome:
    """How a recording ended.

    Parameters
    ----------
    path : Path
        The sealed run file.
    status : str
        ``complete``, ``stopped`` (before its time was over) or ``failed`` (the disk, or a device that was
        silent at the end).
    reason : str
    progress : RecordingProgress
    """

    path: Path
    status: str
    reason: str
    progress: RecordingProgress


class _Session:
    def __init__(
        self,
        devices: RecordingDevices,
        recorder: BlockRecorder,
        watch: RecordingWatch,
        clock: Clock,
        *,
        asks_for_stop: bool,
        tell: Callable[[str], object],
    ) -> None:
        self._devices, self._recorder, self._watch, self._clock = devices, recorder, watch, clock
        self._asks, self._tell = asks_for_stop, tell
        streams = [one.facts.name for one in devices.all]
        self.progress = RecordingProgress(samples=dict.fromkeys(streams, 0), lost=dict.fromkeys(streams, 0))
        self._heard_s = dict.fromkeys(streams, clock.wall_s())
        self._complaints: dict[str, str] = {}
        # Its clock is the run's; every block tells how the two lie to each other.
        own = [one.facts.name for one in devices.acquisition if one.facts.clock == "device"]
        self._leading = own[0] if own else ""
        self._anchored_s = -1.0
        self._said: dict[str, float] = {}
        self._asked = False

    def pass_once(self) -> None:
        """Take what has come in, and judge it."""
        for device in self._devices.all:
            for item in device.drain():
                if isinstance(item, SampleBlock):
                    self._take(item)
                else:
                    self._complain(item)
        for trip in self._watch.said():
            self._warn(trip)
        for device in self._devices.acquisition:
            if self._asked and device.stop_asked:
                self._asked = False
                self._say("stop-asked", f"{device.facts.name}: its stop output is set")
        self.progress.values = self._watch.values

    def note_stamps(self) -> None:
        """Keep how far the stamps of polled devices were off."""
        for device in self._devices.acquisition:
            if said := getattr(device, "stamp_note", ""):
                self._recorder.event(self._clock.now_s(), "note", f"{device.facts.name}: {said}")

    def _take(self, block: SampleBlock) -> None:
        name = block.stream
        self._recorder.append(name, block.first_sequence, block.time_us, block.counts, block.lost)
        if name == self._leading and len(block.time_us):
            self._recorder.anchor(int(block.time_us[-1]), block.received_s, datetime.now(UTC).isoformat())
        self.progress.samples[name] += len(block.time_us)
        self.progress.lost[name] += block.lost
        if len(block.time_us):
            now_s = self._clock.wall_s()
            if (silent_s := now_s - self._heard_s[name]) > self._watch.patience_s[name]:
                self._say("note", f"{name} delivers again, after {duration_text(silent_s)}", stream=name)
            self._heard_s[name] = now_s
            self._complaints.pop(name, None)
        self._watch.look(block)

    def note_silence(self) -> str:
        """Keep which devices are silent at the end; return it in words, "" where none is."""
        now_s = self._clock.wall_s()
        silent_s = {name: now_s - heard_s for name, heard_s in self._heard_s.items()}
        self.progress.silent_s = {
            name: lasted_s for name, lasted_s in silent_s.items() if lasted_s > self._watch.patience_s[name]
        }
        return "; ".join(
            f"{name} has delivered nothing for the last {duration_text(lasted_s)}"
            + (f": {self._complaints[name]}" if name in self._complaints else "")
            for name, lasted_s in self.progress.silent_s.items()
        )

    def _complain(self, fault: SensorFault) -> None:
        self._complaints[fault.stream] = fault.what
        self._watch.complain(fault)
        self._say("sensor", f"{fault.stream}: {fault.what}", stream=fault.stream)

    def _warn(self, trip: Trip) -> None:
        self.progress.warnings += 1
        # A run's events of guards are read by the evaluation: nothing was stopped here, so it is a note.
        self._say("note", trip.reason, **{**trip.facts(), "action": "warned"})
        if self._asks and not trip.device_fault:
            for device in self._devices.acquisition:
                if device.can_ask_for_stop and not device.stop_asked:
                    self._asked = True
                    device.ask_for_stop(trip.reason)
                    self._say("stop-asked", f"{device.facts.name}: asks the stand to stop: {trip.reason}")

    def _say(self, kind: str, text: str, **data: object) -> None:
        self._recorder.event(self._clock.now_s(), kind, text, **data)
        self._tell(text)


def record_devices(
    devices: RecordingDevices,
    recorder: BlockRecorder,
    watch: RecordingWatch,
    clock: Clock,
    request: StopRequest,
    *,
    for_s: float | None = None,
    asks_for_stop: bool = False,
    tell: Callable[[str], object] = str,
    show: Callable[[RecordingProgress], object] = repr,
) -> RecordingOutcome:
    """Record devices that are reading, until the time is over or somebody asks for the end.

    Parameters
    ----------
    devices : RecordingDevices
        Started; not closed here.
    recorder : BlockRecorder
        Of this run; it is closed.
    watch : RecordingWatch
    clock : Clock
    request : StopRequest
        What signals and other programs ask.
    for_s : float, optional
        How long [s of the wall]; without it until somebody ends it.
    asks_for_stop : bool
        Whether a limit that is passed sets the devices' stop outputs.
    tell : callable
        Takes each warning in words.
    show : callable
        Takes the progress, about once a second.

    Raises
    ------
    RecordingFault
        If it could not be sealed; the journal stays.
    """
    session = _Session(devices, recorder, watch, clock, asks_for_stop=asks_for_stop, tell=tell)
    recorder.event(clock.now_s(), "record-only", "another controller moves this stand; it is only recorded")
    began_s = told_s = clock.wall_s()
    while (level := request.level) is StopLevel.NONE and recorder.failure is None:
        session.pass_once()
        for note in request.take_notes():
            recorder.event(clock.now_s(), "note", f"operator: {note}")
        now_s = clock.wall_s()
        session.progress.lasted_s = now_s - began_s
        if for_s is not None and now_s - began_s >= for_s:
            break
        if now_s - told_s >= TOLD_S:
            told_s = now_s
            show(session.progress)
        clock.sleep(PASS_S)
    if recorder.failure is None:
        _take_the_rest(session, clock)
        session.note_stamps()
    status, reason = "complete", ""
    if level is not StopLevel.NONE:
        reason = f"ended by {request.reason}"
        status = "complete" if for_s is None else "stopped"
    if silence := session.note_silence():
        # What it should have measured is not on record: whoever reads only the last line must not miss it.
        status, reason = "failed", "; ".join(part for part in (reason, silence) if part)
    if recorder.failure is not None:
        status, reason = "failed", f"recording failed: {recorder.failure}"
    return RecordingOutcome(recorder.close(status, reason), status, reason, session.progress)


def _take_the_rest(session: _Session, clock: Clock) -> None:
    """Take what the devices had sampled by now and is still under way."""
    end_s = clock.wall_s() + LAST_S
    while clock.wall_s() < end_s:
        clock.sleep(PASS_S)
        session.pass_once()
