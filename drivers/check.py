"""Read every device of a stand once, and say what answers, what is stale and what cannot be true."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import date

import numpy as np

from drivers.check_rows import (
    CheckRow,
    Verdict,
    bus_rows,
    calibration_rows,
    channels_of,
    difference_row,
    force_rows,
    value_row,
)
from drivers.connect import build_controller, build_sensors
from drivers.interfaces import Controller, DeviceFault, MotionState, SampleBlock, Sensor, SensorFault
from drivers.register_panel import FAULT_TEXTS
from drivers.stand_file import StandFile
from drivers.w1_folder import roms_on_bus
from foundation.channel import Channel
from foundation.clock import Clock

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
_POLL_S = 0.01


def check_stand(stand_file: StandFile, clock: Clock, today: date | None = None) -> list[CheckRow]:
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

    Raises
    ------
    BadInput
        If the controller's register profile cannot be read.
    """
    rows: list[CheckRow] = []
    forces: dict[str, float] = {}
    controller = build_controller(stand_file, clock)
    try:
        for row in _controller_rows(controller, stand_file, clock, forces):
            rows.append(row)  # noqa: PERF402 - what came before a fault must be kept
    except DeviceFault as fault:
        rows.append(CheckRow("controller", "connection", "", Verdict.FAULT, str(fault)))
    finally:
        rows += [CheckRow("controller", "wire", "", Verdict.NOTE, event) for event in controller.events()]
        controller.close()
    sensors = build_sensors(stand_file, clock)
    try:
        rows += _sensor_rows(sensors, stand_file, clock, forces)
    finally:
        for sensor in sensors:
            sensor.close()
    rows += force_rows(forces, stand_file)
    root = stand_file.w1_root()
    rows += bus_rows(stand_file, () if root is None else roms_on_bus(root))
    rows += calibration_rows(channels_of(stand_file), today or date.today())  # noqa: DTZ011 - the lab's day
    return rows


def _controller_rows(
    controller: Controller, stand_file: StandFile, clock: Clock, forces: dict[str, float]
) -> Iterator[CheckRow]:
    identity = controller.connect()
    yield CheckRow(
        "controller",
        "identity",
        f"{identity.device}, serial {identity.serial}, {identity.sample_rate_Hz:g} Hz, at {identity.address}",
    )
    yield from _liveness_rows(controller, clock)
    block = _newest_block(controller, clock)
    if block is None:
        remark = "its ring stays empty; look whether sampling is switched on in the controller"
        yield CheckRow("controller", "samples", "none", Verdict.FAULT, remark)
        return
    values = _mean_values(controller.facts.channels, block)
    forces["force"] = values["force"]
    age_s = clock.now_s() - block.received_s
    for channel in controller.facts.channels:
        yield value_row(
            "controller", channel, values[channel.name], stand_file, age_s=age_s, stale_after_s=STALE_S
        )
    yield difference_row(values["stroke_1"], values["stroke_2"], stand_file.stand.tilt_max_mm)


def _liveness_rows(controller: Controller, clock: Clock) -> Iterator[CheckRow]:
    """Time status reads; see that the device counts, and what state it is in."""
    durations_ms: list[float] = []
    first = status = controller.status()
    for _ in range(ROUND_TRIPS):
        start_s = clock.wall_s()
        status = controller.status()
        durations_ms.append((clock.wall_s() - start_s) * 1e3)
    p50_ms, p99_ms = np.percentile(durations_ms, [50, 99])
    text = f"p50 {p50_ms:.2f} ms, p99 {p99_ms:.2f} ms ({ROUND_TRIPS} reads)"
    yield CheckRow("controller", "round trip", text)
    deadline_s = clock.wall_s() + ANSWER_WAIT_S
    while status.heartbeat == first.heartbeat and clock.wall_s() < deadline_s:
        clock.sleep(_POLL_S)
        status = controller.status()
    if status.heartbeat == first.heartbeat:
        remark = "it answers but its heartbeat does not count: its control loop stands still"
        yield CheckRow("controller", "heartbeat", f"{status.heartbeat}", Verdict.FAULT, remark)
    else:
        yield CheckRow("controller", "heartbeat", "counts")
    state = status.state.name.lower()
    if status.state is MotionState.FAULT or status.fault_code:
        remark = f"fault {status.fault_code} ({FAULT_TEXTS.get(status.fault_code, 'unknown')})"
        yield CheckRow("controller", "state", state, Verdict.FAULT, remark)
    else:
        yield CheckRow("controller", "state", state)
    if status.watchdog_trips:
        remark = "a program that fed it died or lost the link since the controller was switched on"
        yield CheckRow("controller", "watchdog trips", f"{status.watchdog_trips}", Verdict.NOTE, remark)


def _newest_block(controller: Controller, clock: Clock) -> SampleBlock | None:
    """Get the ring's newest samples, reading past what it held."""
    newest: SampleBlock | None = None
    deadline_s = clock.wall_s() + ANSWER_WAIT_S
    while clock.wall_s() < deadline_s:
        block = controller.read_block()
        if block is None and newest is not None:
            break
        if block is None:
            clock.sleep(_POLL_S)
        newest = block or newest
    return newest


def _sensor_rows(
    sensors: Sequence[Sensor], stand_file: StandFile, clock: Clock, forces: dict[str, float]
) -> Iterator[CheckRow]:
    started: list[Sensor] = []
    for sensor in sensors:
        try:
            sensor.start()
        except DeviceFault as fault:
            yield CheckRow(sensor.facts.name, "connection", "", Verdict.FAULT, str(fault))
        else:
            started.append(sensor)
    for sensor in started:
        yield from _reading_rows(sensor, stand_file, clock, forces)


def _reading_rows(
    sensor: Sensor, stand_file: StandFile, clock: Clock, forces: dict[str, float]
) -> Iterator[CheckRow]:
    name, channel = sensor.facts.name, sensor.facts.channels[0]
    block, faults = _first_reading(sensor, clock)
    for fault in faults:
        yield CheckRow(name, "reading", "", Verdict.FAULT, fault.what)
    if block is None:
        if not faults:
            remark = f"nothing came within {READING_WAIT_S:g} s; look at cable and power"
            yield CheckRow(name, "reading", "none", Verdict.FAULT, remark)
        return
    yield CheckRow(name, "identity", sensor.facts.device)
    value = _mean_values(sensor.facts.channels, block)[channel.name]
    if channel.quantity == "force":
        forces[channel.name] = value
    yield value_row(
        name,
        channel,
        value,
        stand_file,
        age_s=clock.now_s() - block.received_s,
        stale_after_s=max(STALE_S, 3.0 / sensor.facts.rate_Hz),
    )


def _first_reading(sensor: Sensor, clock: Clock) -> tuple[SampleBlock | None, list[SensorFault]]:
    """Wait for a block of a sensor, not long after a fault; get it and every fault that came."""
    deadline_s = clock.wall_s() + READING_WAIT_S
    block: SampleBlock | None = None
    faults: list[SensorFault] = []
    while block is None and clock.wall_s() < deadline_s:
        for item in sensor.drain():
            if isinstance(item, SampleBlock):
                block = item
                continue
            if not faults:
                deadline_s = min(deadline_s, clock.wall_s() + SECOND_CHANCE_S)
            faults.append(item)
        if block is None:
            clock.sleep(_POLL_S)
    return block, faults


def _mean_values(channels: Sequence[Channel], block: SampleBlock) -> dict[str, float]:
    """Return each channel's mean over a block, in its unit."""
    return {
        channel.name: float(np.mean(channel.calibration.apply(block.counts[channel.name])))
        for channel in channels
    }
