"""Read every device of a stand once, and say what answers, what is stale and what cannot be true."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import date

import numpy as np

from bufferstand.drivers.check.clock import drift_row, fit_drift
from bufferstand.drivers.check.hints import controller_hint, port_hint
from bufferstand.drivers.check.rows import (
    CheckRow,
    ShownLimits,
    calibration_rows,
    channels_of,
    difference_row,
    force_rows,
    rate_row,
    shown_limits,
    thermometer_rows,
    value_row,
)
from bufferstand.drivers.check.samples import POLL_S, delivery_row, missed_row, sample_rate_row, watch
from bufferstand.drivers.check.verdict import WATCH_S, Verdict
from bufferstand.drivers.connect import build_controller
from bufferstand.drivers.connect_recording import build_recording
from bufferstand.drivers.connect_sensors import build_sensors
from bufferstand.drivers.controllers import FAULT_TEXTS, is_read_by_one, leeway_of, who_uses
from bufferstand.drivers.interfaces import (
    Controller,
    FindsOut,
    MotionState,
    SampleBlock,
    Sensor,
    SensorFault,
)
from bufferstand.drivers.stand_file import RecordingStand, StandFile
from bufferstand.foundation import Clock, DeviceFault
from bufferstand.foundation.channels import Channel, PlausibilityWatch, farthest_strokes

ROUND_TRIPS = 50
"""Status reads whose duration is measured."""
ANSWER_WAIT_S = 2.0
"""Longest wait for a counting heartbeat and for samples [s of wall time]."""
READING_WAIT_S = 8.0
"""Longest wait for the first reading of each sensor [s of wall time]: several conversions of 0.8 s."""
SECOND_CHANCE_S = 1.5
"""Wait for a reading after a fault of the same sensor [s of wall time]."""
STALE_S = 5.0
"""A reading older than this, and than three of its periods, is stale [s of stand time]."""
SENSOR_RATE_TOLERANCE = 0.05
SLOW_RATE_TOLERANCE = 0.5
"""Shares by which rates may differ from those stated: amplifier, temperature sensors."""
LISTENED_S = 3.0
"""So long the devices of a stand without a controller are heard at most [s of wall time]."""
_LEAST_SPAN_S = 0.5


def check_stand(
    stand_file: StandFile, clock: Clock, today: date | None = None, *, watch_s: float = WATCH_S
) -> list[CheckRow]:
    """Connect to each device in turn, read it, and judge what comes; nothing is moved or set.

    A device that fails is a row, not an exception, and the others are still read.

    Parameters
    ----------
    stand_file : StandFile
        What the stand is made of.
    clock : Clock
        Stand and wall time.
    today : date, optional
        Day by which calibrations are judged; the present one without it.
    watch_s : float
        Wall time over which rate and clock of the controller are watched [s]; 0 leaves both out.

    Raises
    ------
    BadInput
        If the controller's register profile cannot be read.
    """
    controller, sensors = build_controller(stand_file, clock), build_sensors(stand_file, clock)
    return [
        *check_devices(stand_file, controller, sensors, clock, watch_s=watch_s),
        *thermometer_rows(stand_file),
        *calibration_rows(channels_of(stand_file), today or date.today()),  # noqa: DTZ011 - the lab's day
    ]


def check_recording(
    stand: RecordingStand, clock: Clock, today: date | None = None, *, watch_s: float = WATCH_S
) -> list[CheckRow]:
    """Read the devices of a stand without a controller, as :func:`check_stand` does; streams are started.

    Parameters
    ----------
    stand : RecordingStand
    clock : Clock
    today : date, optional
        Day by which calibrations are judged; the present one without it.
    watch_s : float
        Wall time for which they are heard [s]; 0 leaves their rates out.

    Raises
    ------
    BadInput
        If a register map that one names cannot be read.
    """
    devices = build_recording(stand, clock)
    limits = ShownLimits(stand.limits.force_max_kN, stand.limits.stroke_max_mm)
    try:
        started, rows = _start(devices.all)
        clock.sleep(min(watch_s, LISTENED_S))
        for sensor in started:
            rows += _reading_rows(sensor, limits, clock, {}, watched=watch_s > 0.0)
    finally:
        devices.close()
    rows += thermometer_rows(stand)
    return [*rows, *calibration_rows(stand.channels(), today or date.today())]  # noqa: DTZ011 - the lab's day


def check_devices(
    stand_file: StandFile,
    controller: Controller,
    sensors: Sequence[Sensor],
    clock: Clock,
    *,
    watch_s: float = WATCH_S,
) -> list[CheckRow]:
    """Read devices that are there already, as :func:`check_stand` does; lets go of them at the end.

    Parameters
    ----------
    stand_file : StandFile
        What they are said to be.
    controller, sensors
        Not connected or started yet.
    clock : Clock
        Stand and wall time.
    watch_s : float
        Wall time over which rate and clock of the controller are watched [s]; 0 leaves both out.
    """
    rows: list[CheckRow] = []
    forces: dict[str, float] = {}
    try:
        started, refused = _start(sensors)  # they read while the controller is watched
        try:
            for row in _controller_rows(controller, stand_file, clock, forces, watch_s):
                rows.append(row)  # noqa: PERF402 - what came before a fault must be kept
        except DeviceFault as fault:
            hint = controller_hint(fault, stand_file)
            remark = f"{fault}; {hint}" if hint else str(fault)
            rows.append(CheckRow("controller", "connection", "", Verdict.FAULT, remark))
        finally:
            rows += [CheckRow("controller", "wire", "", Verdict.NOTE, event) for event in controller.events()]
            controller.close()
        rows += refused
        for sensor in started:
            rows += _reading_rows(sensor, shown_limits(stand_file), clock, forces, watched=watch_s > 0.0)
    finally:
        for sensor in sensors:
            sensor.close()
    rows += force_rows(forces, stand_file)
    return rows


def _controller_rows(
    controller: Controller, stand_file: StandFile, clock: Clock, forces: dict[str, float], watch_s: float
) -> Iterator[CheckRow]:
    identity = controller.connect()
    yield CheckRow(
        "controller",
        "identity",
        f"{identity.device}, serial {identity.serial}, {identity.sample_rate_Hz:g} Hz, at {identity.address}",
    )
    yield from _found_out_rows(controller)  # before what a wrong setting keeps from being read
    yield from _liveness_rows(controller, clock)
    polled = not is_read_by_one(controller)
    user = _user_row(controller)
    if user is not None:
        yield user
        if not polled:  # to read a ring is to write what was wanted last: that is the other program's
            yield from _rows_beside(controller, clock, watch_s)
            return
    controller.skip_backlog()
    newest = _newest_block(controller, clock)
    if newest is None:
        yield from _no_samples_rows(controller, polled=polled)
        return
    if watch_s > 0.0:
        seen = watch(controller, clock, newest, watch_s)
        yield sample_rate_row(seen, identity.sample_rate_Hz, polled=polled)
        if missed := missed_row(seen):
            yield missed
        yield drift_row(fit_drift(seen.host_s, seen.trip_s, seen.tick_us))
        newest = seen.newest or newest
    if delivery := controller.delivery():
        yield delivery_row(delivery)
    yield _outage_row(stand_file)
    values = _mean_values(controller.facts.channels, newest)
    forces |= {one.name: values[one.name] for one in controller.facts.channels if one.quantity == "force"}
    age_s = clock.now_s() - newest.received_s
    for channel in controller.facts.channels:
        row = value_row(
            "controller",
            channel,
            values[channel.name],
            shown_limits(stand_file),
            age_s=age_s,
            stale_after_s=STALE_S,
        )
        yield _implausible(row, channel, newest)
    if farthest := farthest_strokes(values):
        yield difference_row(*farthest, stand_file.stand.tilt_max_mm)


def _found_out_rows(controller: Controller) -> Iterator[CheckRow]:
    """Yield what the documents of the controller do not say, found out by reading."""
    for found in controller.findings() if isinstance(controller, FindsOut) else ():
        verdict = Verdict.FAULT if found.is_wrong else Verdict.NOTE if found.remark else Verdict.OK
        yield CheckRow("controller", found.item, found.value, verdict, found.remark, figures=found.figures)


def _outage_row(stand_file: StandFile) -> CheckRow:
    """Return how long an outage of the wire is ridden out by a campaign."""
    leeway, timeout_s = (
        leeway_of(stand_file.controller, stand_file.profile()),
        stand_file.controller.timeout_s,
    )
    figures = {"longest_outage_s": leeway.longest_s(timeout_s)}
    return CheckRow("controller", "outages", leeway.sentence(timeout_s), figures=figures)


def _user_row(controller: Controller) -> CheckRow | None:
    """Return which other program commands the stand, None where none is seen to."""
    if not (who := who_uses(controller)):
        return None
    remark = "another program is at work here: it is left alone"
    return CheckRow("controller", "in use", who, Verdict.NOTE, remark)


def _rows_beside(controller: Controller, clock: Clock, watch_s: float) -> Iterator[CheckRow]:
    """Yield what can be read of a controller with a ring beside the program that reads it."""
    remark = (
        "its ring is not read, since that would acknowledge samples that the other program still wants: "
        "check rate, channels and whether the wire keeps up once that one has ended"
    )
    yield CheckRow("controller", "samples", "not read", Verdict.NOTE, remark)
    if watch_s > 0.0:
        seen = watch(controller, clock, None, watch_s, samples=False)
        yield drift_row(fit_drift(seen.host_s, seen.trip_s, seen.tick_us))
    status = controller.status()
    figures = {
        "value_kN": status.force_kN,
        "stroke_mm": status.stroke_mm,
        "position_mm": status.position_mm,
        "command_mm": status.command_mm,
    }
    value = (
        f"force {status.force_kN:.2f} kN, stroke {status.stroke_mm:.2f} mm, "
        f"position {status.position_mm:.2f} mm, command {status.command_mm:.2f} mm"
    )
    yield CheckRow("controller", "its own reading", value, figures=figures)


def _no_samples_rows(controller: Controller, *, polled: bool) -> Iterator[CheckRow]:
    """Yield why no samples come, as far as it can be seen."""
    remark = "its ring stays empty; look whether sampling is switched on in the controller"
    if polled:
        remark = "every poll was left out: its reads come further apart than one period"
        if delivery := controller.delivery():
            yield delivery_row(delivery)
    yield CheckRow("controller", "samples", "none", Verdict.FAULT, remark)


def _implausible(row: CheckRow, channel: Channel, block: SampleBlock) -> CheckRow:
    """Return the row, as a fault where the channel's own limits say that transducer or wire has failed."""
    raw = block.counts[channel.name]
    found = PlausibilityWatch(channel).look(block.time_us, raw, channel.calibration.apply(raw))
    return replace(row, verdict=Verdict.FAULT, remark=found[0].what) if found else row


def _liveness_rows(controller: Controller, clock: Clock) -> Iterator[CheckRow]:
    """Time status reads; see that the device counts, and what state it is in."""
    durations_ms: list[float] = []
    first = status = controller.status()
    for _ in range(ROUND_TRIPS):
        start_s = clock.wall_s()
        status = controller.status()
        durations_ms.append((clock.wall_s() - start_s) * 1e3)
    p50_ms, p99_ms = (float(value) for value in np.percentile(durations_ms, [50, 99]))
    text = f"p50 {p50_ms:.2f} ms, p99 {p99_ms:.2f} ms ({ROUND_TRIPS} reads)"
    figures = {"round_trip_p50_ms": p50_ms, "round_trip_p99_ms": p99_ms}
    yield CheckRow("controller", "round trip", text, figures=figures)
    deadline_s = clock.wall_s() + ANSWER_WAIT_S
    while status.heartbeat == first.heartbeat and clock.wall_s() < deadline_s:
        clock.sleep(POLL_S)
        status = controller.status()
    if status.heartbeat == first.heartbeat:
        remark = "it answers but its heartbeat does not count: its control loop stands still"
        yield CheckRow("controller", "heartbeat", f"{status.heartbeat}", Verdict.FAULT, remark)
    else:
        yield CheckRow("controller", "heartbeat", "counts")
    state = status.state.name.lower()
    if status.state is MotionState.FAULT or status.fault_code:
        remark = f"fault {status.fault_code} ({FAULT_TEXTS.get(status.fault_code, 'unknown')}): look why; "
        remark += "the next start that moves the stand says it and resets it, once no force is left"
        yield CheckRow("controller", "state", state, Verdict.FAULT, remark)
    else:
        yield CheckRow("controller", "state", state)
    for name in ("force_kN", "stroke_mm", "position_mm", "command_mm"):
        if not math.isfinite(getattr(status, name)):
            remark = (
                f"register {name.partition('_')[0]} holds no number; look at its transducer "
                "and at the controller's own messages"
            )
            value = f"{name.partition('_')[0]} {getattr(status, name)}"
            yield CheckRow("controller", "momentary values", value, Verdict.FAULT, remark)
    if status.watchdog_trips:
        remark = "a program that fed it died or lost the link since the controller was switched on"
        yield CheckRow("controller", "watchdog trips", f"{status.watchdog_trips}", Verdict.NOTE, remark)


def _newest_block(controller: Controller, clock: Clock) -> SampleBlock | None:
    """Get the ring's newest samples, reading past what it held."""
    newest: SampleBlock | None = None
    deadline_s = clock.wall_s() + ANSWER_WAIT_S
    while clock.wall_s() < deadline_s:
        block = controller.read_block()
        newest = block or newest
        if block is None:
            clock.sleep(POLL_S)
        if newest is not None and (block is None or not block.more):
            break
    return newest


def _start(sensors: Sequence[Sensor]) -> tuple[list[Sensor], list[CheckRow]]:
    """Begin to read the sensors; return those that do, and a row for each that does not."""
    started: list[Sensor] = []
    refused: list[CheckRow] = []
    for sensor in sensors:
        try:
            sensor.start()
        except DeviceFault as fault:
            hint = port_hint(str(fault))
            remark = f"{fault}; {hint}" if hint else str(fault)
            refused.append(CheckRow(sensor.facts.name, "connection", "", Verdict.FAULT, remark))
        else:
            started.append(sensor)
    return started, refused


def _reading_rows(
    sensor: Sensor, limits: ShownLimits, clock: Clock, forces: dict[str, float], *, watched: bool
) -> Iterator[CheckRow]:
    name = sensor.facts.name
    blocks, faults = _readings(sensor, clock)
    for what in dict.fromkeys(fault.what for fault in faults):
        yield CheckRow(name, "reading", "", Verdict.FAULT, what)
    block = blocks[-1] if blocks else None
    if block is None:
        if not faults:
            remark = f"nothing came within {READING_WAIT_S:g} s; look at cable and power"
            yield CheckRow(name, "reading", "none", Verdict.FAULT, remark)
        return
    identity = getattr(sensor, "identity", "") or sensor.facts.device
    yield CheckRow(name, "identity", identity)
    if stamps := getattr(sensor, "stamp_note", ""):
        yield CheckRow(name, "time stamps", stamps)
    if watched:
        yield from _rate_rows(sensor, blocks)
    values = _mean_values(sensor.facts.channels, block)
    for channel in sensor.facts.channels:
        if channel.quantity == "force":
            forces[channel.name] = values[channel.name]
        yield value_row(
            name,
            channel,
            values[channel.name],
            limits,
            age_s=clock.now_s() - block.received_s,
            stale_after_s=max(STALE_S, 3.0 / sensor.facts.rate_Hz),
        )


def _readings(sensor: Sensor, clock: Clock) -> tuple[list[SampleBlock], list[SensorFault]]:
    """Return all that has come of a sensor, waiting for a first block, not long after a fault."""
    deadline_s = clock.wall_s() + READING_WAIT_S
    blocks: list[SampleBlock] = []
    faults: list[SensorFault] = []
    while True:
        for item in sensor.drain():
            if isinstance(item, SampleBlock):
                blocks.append(item)
                continue
            if not faults:
                deadline_s = min(deadline_s, clock.wall_s() + SECOND_CHANCE_S)
            faults.append(item)
        if blocks or clock.wall_s() >= deadline_s:
            return blocks, faults
        clock.sleep(POLL_S)


def _rate_rows(sensor: Sensor, blocks: Sequence[SampleBlock]) -> Iterator[CheckRow]:
    """Yield how often a sensor delivers, where enough has come to tell."""
    values = sum(len(block.time_us) for block in blocks) - len(blocks[0].time_us)
    lost = sum(block.lost for block in blocks[1:])
    span_s = blocks[-1].received_s - blocks[0].received_s  # its stamps are even by their nature
    if values < 2 or span_s < _LEAST_SPAN_S or span_s * sensor.facts.rate_Hz < 2.0:
        return
    tolerance = SENSOR_RATE_TOLERANCE if sensor.facts.rate_Hz > 10.0 else SLOW_RATE_TOLERANCE
    yield rate_row(
        sensor.facts.name, "rate", (values + lost) / span_s, sensor.facts.rate_Hz, lost, tolerance=tolerance
    )


def _mean_values(channels: Sequence[Channel], block: SampleBlock) -> dict[str, float]:
    """Return each channel's mean over a block, in its unit."""
    return {
        channel.name: float(np.mean(channel.calibration.apply(block.counts[channel.name])))
        for channel in channels
    }
