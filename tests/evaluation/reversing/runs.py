"""Runs of the imperfect sample stand in process: what its transducers said, and what was true."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bufferstand.drivers.simulated.machine.commands import Command, CommandCode
from bufferstand.drivers.simulated.machine.device import SimulatedDevice
from bufferstand.drivers.simulated.machine.truth import TruthLog
from bufferstand.drivers.simulated.settings import model_path, simulation_settings
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.evaluation.facts.results import RunEvaluation
from bufferstand.evaluation.facts.run_facts import Options, RunFacts
from bufferstand.evaluation.record.record import Record, make_record
from bufferstand.evaluation.run.evaluate import evaluate_run
from bufferstand.foundation.channels.channel import Channel
from bufferstand.foundation.run_kinds import Kind
from bufferstand.model.file import load_model
from bufferstand.model.stepper import SpringStepper
from tests.clean_stand import SAMPLE_STAND
from tests.evaluation.signals import Floats

TOUCHED_OFF = {"force_zero_kN": 0.0, "wire_zero_mm": (0.0, 0.0), "gap_mm": 0.0, "force_drift_kN_per_h": 0.0}
"""Zeros that a touch-off finds; they are not what is asked here."""
_PIECE = 30_000
"""Samples that are taken from the ring at once; it holds 65 536."""


@dataclass(frozen=True)
class Harmonic:
    """A sine about a mean, so many cycles of full amplitude between one in and one out."""

    frequency_Hz: float
    amplitude_mm: float
    mean_mm: float = 50.0
    cycles: int = 8

    @property
    def kind(self) -> Kind:
        return "harmonic"

    @property
    def start_mm(self) -> float:
        return self.mean_mm

    def command(self, sequence: int) -> Command:
        return Command(
            sequence,
            CommandCode.HARMONIC,
            mean_mm=self.mean_mm,
            amplitude_mm=self.amplitude_mm,
            frequency_Hz=self.frequency_Hz,
            cycles=self.cycles,
        )


@dataclass(frozen=True)
class Static:
    """Strokes at one speed from zero to a stroke and back, with a pause between."""

    speed_mm_per_s: float
    top_mm: float = 70.0
    pause_s: float = 0.0
    cycles: int = 4

    @property
    def kind(self) -> Kind:
        return "static"

    @property
    def start_mm(self) -> float:
        return 0.0

    def command(self, sequence: int) -> Command:
        return Command(
            sequence,
            CommandCode.STATIC,
            speed_mm_per_s=self.speed_mm_per_s,
            cycles=self.cycles,
            turning_force_kN=600.0,
            turning_stroke_mm=self.top_mm,
            pause_s=self.pause_s,
        )


Motion = Harmonic | Static


@dataclass(frozen=True, eq=False)
class Run:
    """What was recorded, and what was true at the same samples."""

    motion: Motion
    record: Record
    stroke_mm: Floats
    force_kN: Floats
    channels: dict[str, Channel]

    def evaluated(self) -> RunEvaluation:
        """Return the evaluation with what the sample stand states of its channels."""
        facts = RunFacts(
            "i",
            self.motion.kind,
            force_uncertainty=self.channels["force"].uncertainty,
            stroke_uncertainty=tuple(self.channels[f"stroke_{n}"].uncertainty for n in (1, 2)),
        )
        return evaluate_run(self.record, facts, Options(draws=200, seed=1))


def run_of(motion: Motion, reversal_s: float, seed: int = 1, **settings: object) -> Run:
    """Return what the sample stand does with a motion, its noise, hum, lag and valve as they are.

    Parameters
    ----------
    motion : Motion
    reversal_s : float
        For so long the piston stands when it turns [s].
    seed : int
        Of the noise.
    settings
        Further keys of ``[simulation]``.
    """
    file = load_stand(SAMPLE_STAND)
    chosen = simulation_settings(file)
    spring = SpringStepper(load_model(model_path(file)), chosen.ambient_C, chosen.ambient_C)
    update = TOUCHED_OFF | {"reversal_s": reversal_s, "seed": seed} | settings
    stand = SimulatedDevice(file, chosen.model_copy(update=update), spring, lambda: 0.0, TruthLog())
    stand.controller.control(0x000F)
    ramp = Command(1, CommandCode.RAMP, target_mm=motion.start_mm, speed_mm_per_s=100.0)
    _carry_out(stand, ramp)
    stand.advance(1000)
    first = stand.ring.total
    stand.advance(500)
    raw = _carry_out(stand, motion.command(2), first)
    truth = {name: np.asarray(column)[first:] for name, column in stand.truth.arrays().items()}  # type: ignore[union-attr]
    channels = {channel.name: channel for channel in file.controller.channel}
    signals = {
        name: np.asarray(channel.calibration.apply(np.concatenate([own[name] for own in raw])))
        for name, channel in channels.items()
    }
    time_s = (truth["time_us"] - truth["time_us"][0]) * 1e-6
    force_kN = np.interp(time_s + channels["force"].delay_s, time_s, signals["force"])
    record = make_record(time_s, 0.5 * (signals["stroke_1"] + signals["stroke_2"]), force_kN)
    return Run(motion, record, truth["stroke_mm"], truth["force_kN"], channels)


def _carry_out(stand: SimulatedDevice, command: Command, first: int = 0) -> Sequence[dict[str, Floats]]:
    """Return what the ring held from a sample on to half a second after a motion, in pieces."""
    controller, raw = stand.controller, []
    controller.arm(command)
    controller.execute(command.sequence)

    def take() -> None:
        nonlocal first
        raw.append(stand.ring.window(first, stand.ring.total)[1])
        first = stand.ring.total

    while controller.done_sequence != command.sequence:
        stand.advance(100)
        if stand.ring.total - first > _PIECE:
            take()
    stand.advance(500)
    take()
    return raw
