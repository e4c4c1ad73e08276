"""The motions a controller knows: each gives the next command, sample by sample, until it has ended.

A motion knows its own transducer's force and the piston's position, nothing of wires or specimens. Commands
in mm, forces in kN, compression positive.
"""

from __future__ import annotations

import math

from bufferstand.drivers.interfaces import EndReason, MotionState

SETTLED_MM = 0.05
"""Deviation from its command within which the piston counts as arrived [mm]."""
ZERO_FORCE_KN = 0.2
"""Force below which a release has reached zero force [kN]."""
FOREVER = 1 << 40
"""Samples for which a command that has come to rest stays as it is."""


class Motion:
    """One motion in progress.

    Parameters
    ----------
    sequence : int
        Number of the command that started it (0: of the controller's own accord).
    state : MotionState
        What the controller reports meanwhile.
    command_mm : float
        Command at its start [mm].
    """

    def __init__(self, sequence: int, state: MotionState, command_mm: float) -> None:
        self.sequence = sequence
        self.state = state
        self.command_mm = command_mm
        self.end = EndReason.NONE
        self.cycles_done = 0

    def advance(self, force_kN: float, position_mm: float) -> float:
        """Return the next command [mm], also kept in ``command_mm``; set ``end`` with the last one."""
        raise NotImplementedError

    def still_samples(self) -> int:
        """Return for how many samples the command is sure to stay as it is."""
        return 0

    def skip(self, samples: int) -> None:
        """Let samples pass at once, not more than ``still_samples()``."""


class HoldMotion(Motion):
    """Come to rest with a bounded deceleration, then stay.

    Parameters
    ----------
    sequence : int
        Number of the command (0: of the controller's own accord).
    command_mm, rate_mm : float
        Present command, and its change per sample.
    deceleration_mm : float
        Change of ``rate_mm`` per sample; 0 stops at once.
    """

    def __init__(
        self, sequence: int, command_mm: float, rate_mm: float = 0.0, deceleration_mm: float = 0.0
    ) -> None:
        super().__init__(sequence, MotionState.HOLDING, command_mm)
        self._rate_mm = rate_mm if deceleration_mm > 0.0 else 0.0
        self._deceleration_mm = deceleration_mm

    def advance(self, force_kN: float, position_mm: float) -> float:  # noqa: ARG002 - a Motion's signature
        """Return the next command [mm]."""
        if self._rate_mm != 0.0:
            slower = max(0.0, abs(self._rate_mm) - self._deceleration_mm)
            self._rate_mm = math.copysign(slower, self._rate_mm) if slower else 0.0
            self.command_mm += self._rate_mm
        else:
            self.stands_at(position_mm)
        return self.command_mm

    def stands_at(self, position_mm: float) -> bool:
        """Return whether it has come to rest, with the piston at a position [mm]; it is over then."""
        settled = self._rate_mm == 0.0 and abs(position_mm - self.command_mm) < SETTLED_MM
        if settled and self.end is EndReason.NONE:
            self.end = EndReason.REACHED
        return self.end is not EndReason.NONE

    def still_samples(self) -> int:
        """Return for how many samples the command is sure to stay as it is."""
        return FOREVER if self.end is not EndReason.NONE else 0


class RampMotion(Motion):
    """Constant speed to a position.

    Parameters
    ----------
    sequence : int
        Number of the command.
    command_mm, target_mm : float
        From where to where.
    step_mm : float
        Change of the command per sample, positive.
    """

    def __init__(self, sequence: int, command_mm: float, target_mm: float, step_mm: float) -> None:
        super().__init__(sequence, MotionState.RAMPING, command_mm)
        self._target_mm = target_mm
        self._step_mm = step_mm

    def advance(self, force_kN: float, position_mm: float) -> float:  # noqa: ARG002 - a Motion's signature
        """Return the next command [mm]."""
        rest = self._target_mm - self.command_mm
        if abs(rest) > self._step_mm:
            self.command_mm += math.copysign(self._step_mm, rest)
        else:
            self.command_mm = self._target_mm
            if abs(position_mm - self._target_mm) < SETTLED_MM:
                self.end = EndReason.REACHED
        return self.command_mm


class HarmonicMotion(Motion):
    """Sine about a mean: one cycle of growing amplitude in, ``cycles`` at full amplitude, one out.

    Mean and amplitude can be changed meanwhile (:meth:`adjust`): both go over in one cycle by half a cosine,
    so that neither the command nor its rate jumps.

    Parameters
    ----------
    sequence : int
        Number of the command.
    mean_mm, amplitude_mm : float
        Centre and half the range.
    frequency_Hz : float
    cycles : int
        Cycles at full amplitude.
    dt_s : float
        Sample period [s].
    """

    def __init__(
        self,
        sequence: int,
        mean_mm: float,
        amplitude_mm: float,
        frequency_Hz: float,
        cycles: int,
        dt_s: float,
    ) -> None:
        super().__init__(sequence, MotionState.WAVEFORM, mean_mm)
        self.frequency_Hz = frequency_Hz
        self._before = self._after = (mean_mm, amplitude_mm)
        self._adjusted_at: float | None = None
        self._cycles = cycles
        self._dt_s = dt_s
        self._cycles_per_sample = frequency_Hz * dt_s
        self._samples = 0

    @property
    def adjustable(self) -> bool:
        """Whether :meth:`adjust` may be called: full amplitude, none under way, a full cycle left for it."""
        phase = self._samples * self._cycles_per_sample
        return 1.0 <= phase <= self._cycles and self._adjusted_at is None

    def adjust(self, mean_mm: float, amplitude_mm: float) -> None:
        """Go over to another mean and amplitude [mm] within one cycle from now on."""
        self._before, self._after = self._after, (mean_mm, amplitude_mm)
        self._adjusted_at = self._samples * self._cycles_per_sample

    def peak_speed_mm_per_s(self, mean_mm: float, amplitude_mm: float) -> float:
        """Return a bound of the command's speed while it goes over to another mean and amplitude [mm/s].

        d/dt (m + A sin φ) <= |m'| + |A'| + ω A, and half a cosine over a cycle changes at most π/2 f times
        what it bridges.
        """
        mean, amplitude = self._after
        bridged = abs(mean_mm - mean) + abs(amplitude_mm - amplitude)
        return math.pi * self.frequency_Hz * (2.0 * max(amplitude, amplitude_mm) + 0.5 * bridged)

    def deceleration_mm(self) -> float:
        """Return the change of the command's rate per sample that stops it within its own range [mm].

        A sine never needs more than ``A ω²``, and stopping with it from any phase stays inside ``mean ± A``:
        ``sin φ + cos² φ / 2 <= 1``.
        """
        amplitude_mm = max(self._before[1], self._after[1])
        return amplitude_mm * (2.0 * math.pi * self.frequency_Hz * self._dt_s) ** 2

    def _present(self, phase: float) -> tuple[float, float]:
        """Return mean and amplitude at a phase [mm]."""
        if self._adjusted_at is None:
            return self._after
        done = phase - self._adjusted_at
        if done >= 1.0:
            self._adjusted_at = None
            return self._after
        share = 0.5 * (1.0 - math.cos(math.pi * done))
        (mean, amplitude), (new_mean, new_amplitude) = self._before, self._after
        return mean + share * (new_mean - mean), amplitude + share * (new_amplitude - amplitude)

    def advance(self, force_kN: float, position_mm: float) -> float:  # noqa: ARG002 - a Motion's signature
        """Return the next command [mm]."""
        self._samples += 1
        phase = self._samples * self._cycles_per_sample
        last = self._cycles + 2.0
        mean, amplitude = self._present(phase)
        if phase >= last:
            self.cycles_done = self._cycles
            if abs(position_mm - mean) < SETTLED_MM:
                self.end = EndReason.REACHED
            self.command_mm = mean
            return self.command_mm
        edge = min(phase, last - phase)
        if edge < 1.0:
            # Half a cosine: amplitude and its rate join without a kink, and the envelope never exceeds 1.
            amplitude *= 0.5 * (1.0 - math.cos(math.pi * edge))
        self.cycles_done = min(self._cycles, max(0, int(phase) - 1))
        self.command_mm = mean + amplitude * math.sin(2.0 * math.pi * phase)
        return self.command_mm


class StaticMotion(Motion):
    """Compress at constant speed to a force or a position, unload at once to zero, pause; ``cycles`` times.

    Parameters
    ----------
    sequence : int
        Number of the command.
    command_mm : float
        Present command, at or near zero.
    step_mm : float
        Change of the command per sample, positive.
    turning_force_kN, turning_position_mm : float
        The cycle turns at whichever comes first.
    cycles : int
    pause_samples : int
        Rest at zero between two cycles.
    """

    def __init__(
        self,
        sequence: int,
        command_mm: float,
        step_mm: float,
        turning_force_kN: float,
        turning_position_mm: float,
        cycles: int,
        pause_samples: int,
    ) -> None:
        super().__init__(sequence, MotionState.WAVEFORM, command_mm)
        self._step_mm = step_mm
        self._turning_force_kN = turning_force_kN
        self._turning_position_mm = turning_position_mm
        self._cycles = cycles
        self._pause_samples = pause_samples
        self._pause_left = 0
        self._loading = True
        self._turned_by = EndReason.REACHED

    def advance(self, force_kN: float, position_mm: float) -> float:
        """Return the next command [mm]."""
        if self._pause_left > 0:
            self._pause_left -= 1
        elif self._loading:
            if force_kN >= self._turning_force_kN:
                self._turn(EndReason.FORCE_LIMIT)
            elif position_mm >= self._turning_position_mm:
                self._turn(EndReason.REACHED)
            else:
                self.command_mm += self._step_mm
        elif self.command_mm > self._step_mm:
            self.command_mm -= self._step_mm
        else:
            self.command_mm = 0.0
            if abs(position_mm) < SETTLED_MM and abs(force_kN) < ZERO_FORCE_KN:
                self._finish_cycle()
        return self.command_mm

    def still_samples(self) -> int:
        """Return for how many samples the command is sure to stay as it is."""
        return self._pause_left

    def skip(self, samples: int) -> None:
        """Let ``samples`` of the pause pass at once."""
        self._pause_left = max(0, self._pause_left - samples)

    def _turn(self, why: EndReason) -> None:
        self._loading = False
        self._turned_by = why
        self.command_mm = max(0.0, self.command_mm - self._step_mm)

    def _finish_cycle(self) -> None:
        self.cycles_done += 1
        if self.cycles_done >= self._cycles:
            self.end = self._turned_by
        else:
            self._loading = True
            self._pause_left = self._pause_samples


class ReleaseMotion(Motion):
    """Retract to the piston's zero, and on until the force is gone.

    Parameters
    ----------
    sequence : int
        Number of the command (0: of the controller's own accord).
    command_mm : float
        Present command.
    step_mm : float
        Change of the command per sample, positive.
    """

    def __init__(self, sequence: int, command_mm: float, step_mm: float) -> None:
        super().__init__(sequence, MotionState.RELEASING, command_mm)
        self._step_mm = step_mm

    def advance(self, force_kN: float, position_mm: float) -> float:
        """Return the next command [mm]."""
        if self.command_mm > self._step_mm:
            self.command_mm -= self._step_mm
        elif self.command_mm > 0.0:
            self.command_mm = 0.0
        elif abs(position_mm - self.command_mm) < SETTLED_MM:
            if abs(force_kN) < ZERO_FORCE_KN:
                self.end = EndReason.REACHED
            else:
                self.command_mm -= min(self._step_mm, 0.001)  # a specimen that has grown: follow it gently
        return self.command_mm
