"""The guards of a stand that others move: they warn, and may ask for a stop; they hold nothing."""

from __future__ import annotations

from collections.abc import Mapping

from bufferstand.daq.guards import Action, Guard, GuardPanel, GuardSet, Trip
from bufferstand.daq.guards.kinds import ChannelGuard, SilenceGuard
from bufferstand.daq.scaling import ScaledBlock, scale
from bufferstand.drivers import RecordingDevices, SampleBlock, SensorFault, StreamFacts
from bufferstand.drivers.stand_file import RecordingStand
from bufferstand.foundation import Clock
from bufferstand.foundation.channels import Branch

AGAIN_S = 30.0
"""What lasts is warned of again after so long [s of the wall]."""


class RecordingWatch:
    """Looks at every sample of a recording.

    Parameters
    ----------
    stand : RecordingStand
        With the limits.
    devices : RecordingDevices
    clock : Clock
    """

    def __init__(self, stand: RecordingStand, devices: RecordingDevices, clock: Clock) -> None:
        self._clock = clock
        self._facts: Mapping[str, StreamFacts] = {one.facts.name: one.facts for one in devices.all}
        self._branches = {
            channel.name: Branch() for facts in self._facts.values() for channel in facts.channels
        }
        self.patience_s = {
            one.facts.name: max(stand.limits.silence_s, 3.0 / one.facts.rate_Hz) for one in devices.all
        }
        """By stream: a silence of so long is warned of [s of the wall]."""
        self.guards = GuardSet(_guards(stand, self.patience_s), complete=False)
        self._panel = GuardPanel(self.guards, wall_s=clock.wall_s())
        self._again_s = clock.wall_s() + AGAIN_S
        self.values: dict[str, float] = {}
        """Newest value of every channel and of ``stroke``, in its unit."""

    def look(self, block: SampleBlock) -> None:
        """Judge the samples of a block."""
        scaled: ScaledBlock = scale(block, self._facts[block.stream], self._branches)
        for name, values in scaled.values.items():
            if len(values):
                self.values[name] = float(values[-1])
        self._panel.observe(scaled, self._clock.wall_s())

    def complain(self, fault: SensorFault) -> None:
        """Take what a device complains of: it explains a silence, should it last."""
        self._panel.complain(fault)

    def said(self) -> list[Trip]:
        """Judge silences, and return (and forget) what the guards have to say."""
        wall_s = self._clock.wall_s()
        self._panel.listen(self._clock.now_s(), wall_s)
        said = self._panel.said()
        if wall_s >= self._again_s:
            self._again_s = wall_s + AGAIN_S
            self._panel.reset()
        return said


def _guards(stand: RecordingStand, patience_s: Mapping[str, float]) -> list[Guard]:  # type: ignore[type-arg]
    limits = stand.limits
    guards: list[Guard] = [  # type: ignore[type-arg]
        SilenceGuard(stream, limit_s, Action.STOP) for stream, limit_s in patience_s.items()
    ]
    if limits.force_max_kN is not None or limits.force_min_kN is not None:
        guards.append(
            ChannelGuard(
                "force", "force", limits.force_max_kN, limits.force_min_kN, "kN", "force", Action.STOP
            )
        )
    if limits.stroke_max_mm is not None:
        guards.append(
            ChannelGuard("stroke", "stroke", limits.stroke_max_mm, None, "mm", "stroke", Action.STOP)
        )
    if (tilt := stand.stand.tilt_max_mm) is not None:
        guards.append(
            ChannelGuard("tilt", "tilt", tilt, -tilt, "mm", "difference of the draw wires", Action.STOP, 0.05)
        )
    if limits.temperature_max_C is not None:
        guards += [
            ChannelGuard(
                channel.name,
                channel.name,
                limits.temperature_max_C,
                None,
                "°C",
                f"temperature {channel.place or channel.name}",
                Action.STOP,
            )
            for _, channel in stand.channels()
            if channel.quantity == "temperature"
        ]
    return guards
