"""Runs of the imperfect sample stand, wired right or wrong, as run files: no guard looks on.

The motions of a planned step are given to the stand in virtual time as they are, one after the other, and
what its devices deliver is written down as the campaign's runner would. So a wrong wire is in the record
from the first to the last sample, whatever a campaign's guards would have done about it.
"""

from __future__ import annotations

import json
import random
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from bufferstand.daq.campaign_folder.run_metadata import run_document
from bufferstand.daq.campaign_folder.stand_origin import StandOrigin
from bufferstand.daq.guards.from_limits import guards_for
from bufferstand.drivers.interfaces import EndReason, SampleBlock
from bufferstand.drivers.simulated.inprocess.stand import InProcessStand, open_in_process
from bufferstand.drivers.simulated.miswiring.settings import Miswired
from bufferstand.drivers.simulated.miswiring.signal import WrongSignal
from bufferstand.drivers.stand_file.schema import StandFile
from bufferstand.evaluation.document.build import evaluate_file
from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options
from bufferstand.foundation.channels.channel import Channel
from bufferstand.foundation.motions import StandStill
from bufferstand.protocols.planning.plan import Plan
from bufferstand.protocols.steps.motions import Hold
from bufferstand.recording.content import Anchor, Event, StreamContent
from bufferstand.recording.runfile.file import write_run
from tests.daq.run_in_process import facts_of, sample_plan

SAMPLES = Path(__file__).parents[3] / "sample_runs"
TOUCHED_OFF: Mapping[str, Any] = {
    "force_zero_kN": 0.0,
    "wire_zero_mm": (0.0, 0.0),
    "gap_mm": 0.0,
    "force_drift_kN_per_h": 0.0,
}
"""Zeros that a touch-off finds."""
SLOW = "kind = 'static'\nspeed_mm_per_s = 20.0\nforce_limit_kN = 400.0\ncycles = 2\npause_s = 1.0"
SINE = "kind = 'harmonic'\nprestress_mm = 40.0\namplitude_mm = 20.0\nfrequency_Hz = 0.5\ncycles = 4"
FAST = "kind = 'harmonic'\nprestress_mm = 50.0\namplitude_mm = 5.0\nfrequency_Hz = 2.5\ncycles = 12"
WARM = "kind = 'harmonic'\nprestress_mm = 50.0\namplitude_mm = 30.0\nfrequency_Hz = 0.85\ncycles = 45"
_TICK_S = 0.05


def a_step(draw: random.Random) -> str:
    """Return a step as laboratories drive them, that also a specimen 40 % stiffer lets through."""
    if draw.random() < 0.3:
        return (
            f"kind = 'static'\nspeed_mm_per_s = {draw.uniform(5.0, 40.0):.1f}\n"
            f"force_limit_kN = {draw.uniform(100.0, 400.0):.0f}.0\n"
            f"cycles = {draw.choice((1, 2))}\npause_s = 1.0"
        )
    top_mm = draw.uniform(20.0, 75.0)
    amplitude_mm = draw.uniform(3.0, min(30.0, 0.5 * top_mm))
    speed = draw.uniform(20.0, 250.0)
    frequency = min(2.5, max(0.1, speed / (6.2832 * amplitude_mm)))
    return (
        f"kind = 'harmonic'\nprestress_mm = {top_mm - amplitude_mm:.1f}\namplitude_mm = {amplitude_mm:.1f}\n"
        f"frequency_Hz = {frequency:.3f}\ncycles = {draw.randint(2, 6)}"
    )


@dataclass
class _Taken:
    """What one stream has delivered."""

    time_us: list[np.ndarray] = field(default_factory=list)
    counts: dict[str, list[np.ndarray]] = field(default_factory=lambda: defaultdict(list))

    def add(self, block: SampleBlock) -> None:
        self.time_us.append(block.time_us)
        for name, column in block.counts.items():
            self.counts[name].append(column)

    def content(self) -> StreamContent:
        return StreamContent(
            np.concatenate(self.time_us), {name: np.concatenate(one) for name, one in self.counts.items()}
        )


def planned(folder: Path, step: str) -> tuple[Plan, StandFile]:
    """Return the plan of one step on the sample stand, whose strokes are the piston's."""
    path = folder / "campaign.toml"
    path.write_text(
        f'[campaign]\nid = "bench"\nstand = "{SAMPLES / "stand.toml"}"\n'
        f'specimen = "{SAMPLES / "specimens/category-a-elastomer.toml"}"\n'
        f"[stroke]\ncompensate = false\n[[step]]\n{step}\n",
        encoding="utf-8",
    )
    return sample_plan(path)


@dataclass(frozen=True, eq=False)
class Recorded:
    """One step as it was recorded: the run file's document and what its streams delivered."""

    document: Mapping[str, Any]
    streams: Mapping[str, StreamContent]
    anchors: Sequence[Anchor]

    def written(self, folder: Path, events: Sequence[Event] = (), **document: Any) -> Path:
        """Write it as a run file; further keys replace those of its document."""
        path = folder / "bench-1.h5"
        return write_run(path, {**self.document, **document}, self.streams, events, self.anchors)

    def rewired(self, miswired: Miswired) -> Recorded:
        """Return what would have been recorded of the same motion over other wires.

        The controller acts on what it acted on; thermometers stay as they are.
        """
        streams = dict(self.streams)
        wires = {
            "controller": {
                name: getattr(miswired, name) for name in ("force", "stroke_1", "stroke_2", "position")
            },
            "amplifier": {"force_2": miswired.amplifier},
        }
        for stream, of_stream in wires.items():
            content = streams[stream]
            time_s = content.time * 1e-6
            counts = dict(content.counts)
            right = {name: self._value(stream, name) for name in counts}
            for name, facts in of_stream.items():
                own = right[getattr(facts, "reads", None) or name]
                arrived = WrongSignal(facts).arrive(time_s, own)
                counts[name] = self._counts(stream, name, arrived)
            streams[stream] = StreamContent(content.time, counts, content.segments)
        return replace(self, streams=streams)

    def with_thermometers(
        self, shown_C: Mapping[str, Callable[[np.ndarray, np.ndarray], np.ndarray]]
    ) -> Recorded:
        """Return it with thermometers that show something else, given time [s] and what they showed [°C]."""
        streams = dict(self.streams)
        for name, change in shown_C.items():
            content = streams[name]
            changed = change(content.time * 1e-6, self._value(name, name))
            streams[name] = StreamContent(
                content.time, {name: self._counts(name, name, changed)}, content.segments
            )
        return replace(self, streams=streams)

    def with_jump(self, name: str, by_kN: float, at_s: float, times: float = 1.0) -> Recorded:
        """Return it with a force that shows more, and so many times as much, from a time of its clock on."""
        stream = "amplifier" if name == "force_2" else "controller"
        content, right = self.streams[stream], self._value(stream, name)
        changed = np.where(content.time * 1e-6 >= at_s, times * right + by_kN, right)
        counts = {**content.counts, name: self._counts(stream, name, changed)}
        return replace(
            self, streams={**self.streams, stream: StreamContent(content.time, counts, content.segments)}
        )

    def _channel(self, stream: str, name: str) -> Channel:
        channels = self.document["streams"][stream]["channels"]
        return next(Channel.model_validate_json(json.dumps(c)) for c in channels if c["name"] == name)

    def _value(self, stream: str, name: str) -> np.ndarray:
        counts = self.streams[stream].counts[name]
        return np.asarray(self._channel(stream, name).calibration.apply(counts.astype(float)))

    def _counts(self, stream: str, name: str, value: np.ndarray) -> np.ndarray:
        dtype = self.streams[stream].counts[name].dtype
        counts = np.rint(self._channel(stream, name).calibration.counts_of(value))
        if dtype.kind in "iu":
            counts = np.clip(counts, np.iinfo(dtype).min, np.iinfo(dtype).max)
        return counts.astype(dtype)


def recorded(
    folder: Path,
    step: str,
    miswired: Mapping[str, Any] | None = None,
    *,
    status: str = "complete",
    **settings: Any,
) -> Recorded:
    """Record one step.

    Parameters
    ----------
    folder : Path
    step : str
        Keys of the step.
    miswired : mapping, optional
        ``[simulation.miswired]``.
    status : str
    settings
        Further keys of ``[simulation]``.
    """
    plan, stand_file = planned(folder, step)
    simulation = {**(stand_file.simulation or {}), **TOUCHED_OFF, "missed_cycles_per_h": 0.0, **settings}
    if miswired:
        simulation["miswired"] = miswired
    wired = stand_file.model_copy(update={"simulation": simulation})
    opened = open_in_process(wired, model=SAMPLES / "models/category-a-elastomer.toml", log_truth=False)
    (planned_step,) = (one for one in plan.steps if one.run_kind is not None)
    taken, anchors = _performed(opened, planned_step.motions)
    guards = guards_for(
        plan.campaign.limits, plan.limits, opened.stand, ambient=facts_of(stand_file).ambient()
    )
    document = run_document(
        "bench-1",
        planned_step,
        plan,
        opened.stand,
        opened.stand.controller.connect(),
        StandOrigin(True, "the bench's own"),
        guards,
        facts_of(stand_file),
    )
    document["run"] |= {"status": status, "ended_utc": document["run"]["started_utc"]}
    streams = {name: one.content() for name, one in taken.items()}
    return Recorded(document, streams, anchors)


def evaluated(path: Path) -> RunEvaluation:
    """Return the evaluation of a run file, without uncertainties."""
    return evaluate_file(path, Options(draws=0))


def found(path: Path) -> set[tuple[str, str]]:
    """Return kind and channel of what spoils a run file, and of what is noted of it."""
    return {(one.kind, one.channel) for one in evaluated(path).findings}


def _performed(opened: InProcessStand, motions: Any) -> tuple[dict[str, _Taken], list[Anchor]]:
    """Carry motions out one after the other, at the piston's stroke, and keep what comes meanwhile."""
    controller, clock = opened.stand.controller, opened.clock
    controller.connect()
    controller.enable(force_limit_kN=600.0, stroke_limit_mm=200.0, watchdog_ms=60_000)
    taken: dict[str, _Taken] = defaultdict(_Taken)
    anchors = []
    for sensor in opened.stand.sensors:
        sensor.start()

    def take() -> None:
        clock.sleep(_TICK_S)
        controller.feed_watchdog()
        while (block := controller.read_block()) is not None:
            taken["controller"].add(block)
        for sensor in opened.stand.sensors:
            for item in sensor.drain():
                if isinstance(item, SampleBlock):
                    taken[item.stream].add(item)

    for _ in range(20):
        take()
    for motion in motions:
        sequence = _started(opened, motion)
        until_s = clock.now_s() + (motion.wait_s if isinstance(motion, Hold) else 0.0)
        while controller.status().done_sequence != sequence or clock.now_s() < until_s:
            take()
        last = taken["controller"].time_us[-1][-1]
        anchors.append(Anchor(int(last), clock.now_s(), "2026-03-05T09:00:00+00:00"))
    assert controller.status().end_reason is not EndReason.DEVICE_LIMIT
    for _ in range(20):
        take()
    return taken, anchors


def _started(opened: InProcessStand, motion: Any) -> int:
    return opened.stand.controller.start(StandStill() if isinstance(motion, Hold) else motion)
