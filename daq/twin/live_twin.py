"""Judges cycles from what a campaign tells its listeners: samples, temperatures, what it does."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bufferstand.daq.monitor import TWIN_SCHEMA
from bufferstand.foundation import BadInput
from bufferstand.model import SpringModel
from bufferstand.model.identification import Drive, cycles_of, reduce_run
from bufferstand.model.twin import FAULT_KINDS, CycleJudgement, Twin, TwinAlarm

Floats = NDArray[np.float64]

RESTED_K = 0.5
UNKNOWN_C = 20.0
LEAST_SAMPLES = 60
MOST_SAMPLES = 200_000
"""Samples that are held of a stretch without a whole cycle: of more every second one is forgotten."""
CONTEXT = 0.4
"""So much of the last cycle is kept before its end, for its turning point to be fitted again."""
GAP_S = 2.0
"""Samples further apart than this within one recording: what the spring did meanwhile is not known."""
CYCLES_KEPT = 40
BAND_POINTS = 160


class LiveTwin:
    """The twin of a campaign under way.

    Parameters
    ----------
    model : SpringModel
        With what its fit knows.

    Raises
    ------
    BadInput
        If nobody says how well it is known.
    """

    def __init__(self, model: SpringModel) -> None:
        self._twin = Twin(model)
        self._name = model.name
        self._times: list[Floats] = []
        self._strokes: list[Floats] = []
        self._forces: list[Floats] = []
        self._size = self._asked_for = 0
        self._after_s = -np.inf
        self._last_s = -np.inf
        self._begun = False
        self._over = False
        self._lost = 0
        self._delay_s: dict[str, float] = {}
        self._readings: dict[str, float] = {}
        self._specimen: list[str] = []
        self._air: list[str] = []
        self._step = 0
        self._rows: deque[dict[str, Any]] = deque(maxlen=CYCLES_KEPT)
        self._band: dict[str, Any] | None = None
        self._alarms: list[dict[str, Any]] = []

    def hear(self, packet: Mapping[str, Any]) -> None:
        """Take a packet of the campaign (docs/monitor.md, what the socket says)."""
        for one in packet.get("channels", ()):
            self._delay_s[str(one["quantity"])] = float(one.get("delay_s") or 0.0)
        for stream, new in packet.get("readings", {}).items():
            if new:
                self._readings[stream] = float(new[-1][1])
        for guard in (packet.get("guards") or {}).get("temperatures", ()):
            kept = self._specimen if guard["resume_C"] is not None else self._air
            if guard["stream"] not in kept:
                kept.append(guard["stream"])
        progress = packet.get("progress") or {}
        if packet.get("recording") and progress.get("phase") != "touch":
            self._step = int(progress.get("step", self._step))
            self._add(packet.get("rows") or {}, int(packet.get("dropped", 0)))
        elif self._size and "at_s" in packet:
            self._over = True

    def judge(self) -> list[TwinAlarm]:
        """Judge what has come to its end since the last time; may take some tenths of a second."""
        if self._size < LEAST_SAMPLES or (not self._over and self._size < 1.1 * self._asked_for):
            return []
        self._asked_for = self._size
        alarms: list[TwinAlarm] = []
        try:
            drive = self._drive()
        except BadInput:
            drive = None
        if drive is not None:
            alarms = self._take(drive)
        if self._over:
            self._forget()
        return alarms

    @property
    def judged(self) -> int:
        """Number of cycles that were judged."""
        return self._twin.cycles

    def document(self) -> dict[str, Any]:
        """Return what the page draws: the band round the newest cycle, figures of the last, alarms."""
        return {
            "schema": TWIN_SCHEMA,
            "model": self._name,
            "step": self._step,
            "judged": self.judged,
            "band": self._band,
            "cycles": list(self._rows),
            "alarms": self._alarms,
        }

    def _add(self, rows: Mapping[str, Any], dropped: int) -> None:
        if not rows:
            return
        time_s = rows["t0_us"] / 1e6 + np.asarray(rows["t"], dtype=np.float64) / 1e4
        if self._over:
            self._forget()
        if time_s[0] < self._last_s or (self._size and time_s[0] > self._last_s + GAP_S):
            self._forget()  # another clock, or something happened that nobody told
            self._begun = False
        if dropped > self._lost and self._size:
            self._lost = dropped  # rows between, thinned out: turns may be a little off, nothing more
        self._last_s = float(time_s[-1])
        self._times.append(time_s)
        self._strokes.append(np.asarray(rows["s"], dtype=np.float64) / 1000.0)
        self._forces.append(np.asarray(rows["f"], dtype=np.float64) / 1000.0)
        self._size += time_s.size
        if self._size > MOST_SAMPLES:
            self._keep(slice(None, None, 2))

    def _keep(self, chosen: slice) -> None:
        for parts in (self._times, self._strokes, self._forces):
            parts[:] = [np.concatenate(parts)[chosen]]
        self._size = self._asked_for = int(self._times[0].size)

    def _forget(self) -> None:
        self._times, self._strokes, self._forces = [], [], []
        self._size = self._asked_for = 0
        self._over = False

    def _drive(self) -> Drive:
        """Reduce what is held; stroke and force are brought to the same moments by their delays."""
        time_s, stroke, force = (np.concatenate(p) for p in (self._times, self._strokes, self._forces))
        early = self._delay_s.get("force", 0.0) - self._delay_s.get("stroke", 0.0)
        if early:
            force = np.interp(time_s, time_s - early, force)
        specimen = [self._readings[name] for name in self._specimen if name in self._readings]
        air = [self._readings[name] for name in self._air if name in self._readings]
        warm = float(np.mean(specimen)) if specimen else None
        around = float(np.mean(air)) if air else (UNKNOWN_C if warm is None else warm)
        return reduce_run(
            time_s,
            stroke,
            force,
            sensor_s=[] if warm is None else [time_s[0]],
            sensor_C=[] if warm is None else [warm],
            ambient_C=around,
            rested=warm is not None and bool(air) and abs(warm - around) <= RESTED_K,
            name=f"step {self._step}",
        )

    def _take(self, drive: Drive) -> list[TwinAlarm]:
        if not self._begun:
            self._twin.begin(drive)
            self._begun, self._after_s = True, -np.inf
        last_half = int(drive.half[-1])
        whole = [
            drive.node[nodes]
            for nodes in cycles_of(drive)
            if self._over or drive.half[drive.node[nodes[-1]]] < last_half
        ]
        new = [at for at in whole if drive.time_s[at[-1]] > self._after_s]
        if not new and not self._over:
            return []
        until_s = np.inf if self._over else float(drive.time_s[new[-1][-1]])
        taken = self._twin.take(drive, self._after_s, until_s)
        for one in taken.judged:
            self._remember(one)
        self._alarms += [
            {"step": self._step, "sentence": alarm.sentence, "cycle": alarm.cycle} for alarm in taken.alarms
        ]
        self._after_s = float(drive.time_s[-1]) if self._over else until_s
        if new and not self._over:
            begin_s, end_s = drive.time_s[new[-1][0]], drive.time_s[new[-1][-1]]
            first = int(np.searchsorted(np.concatenate(self._times), end_s - CONTEXT * (end_s - begin_s)))
            self._keep(slice(first, None))
        return list(taken.alarms)

    def _remember(self, one: CycleJudgement) -> None:
        cycle = one.cycle
        self._rows.append(
            {
                "step": self._step,
                "start_s": round(cycle.start_s, 3),
                "outside": round(one.share_outside, 3),
                "alone": {k.name: float(f"{v:.5g}") for k, v in zip(FAULT_KINDS, one.alone, strict=True)},
            }
        )
        stride = max(1, -(-cycle.stroke_mm.size // BAND_POINTS))
        chosen = slice(None, None, stride)
        self._band = {
            "s": np.round(cycle.stroke_mm[chosen], 3).tolist(),
            "low": np.round((cycle.model_kN - one.half_width_kN)[chosen], 3).tolist(),
            "high": np.round((cycle.model_kN + one.half_width_kN)[chosen], 3).tolist(),
        }
