"""Does a step keep every limit? If not: which one does it break, and what is the nearest that would do?"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from protocols.campaign import MotionSettings
from protocols.kinds import (
    ConditioningStep,
    CoolDownStep,
    HarmonicPiece,
    HarmonicStep,
    HoldStep,
    InnerLoopsStep,
    MotionStep,
    RampPiece,
    ReleasePiece,
    SingleStep,
    StaticStep,
)
from protocols.limits import TOLERANCE, Bound, Envelope
from protocols.prediction import Predictor, force_at, peak_force

BELOW_ZERO = "prestress_mm − amplitude_mm >= 0"
"""Name of the limit that keeps the actuator in contact (paper § 3.1: no force impacts)."""

_RESOLUTION = 0.01
"""Steps in which admissible values are proposed [mm, mm/s]; frequencies in tenths of it [Hz]."""


@dataclass(frozen=True)
class Breach:
    """A limit that a step breaks.

    Parameters
    ----------
    limit : str
        Name of the limit.
    problem : str
        What is asked, and what is allowed by whom.
    nearest : dict of str to float
        Keys of the step to change, with their nearest admissible values; empty if there are none.
    """

    limit: str
    problem: str
    nearest: dict[str, float]

    def remedy(self) -> str:
        """Return the nearest admissible values as a sentence."""
        if not self.nearest:
            return "no value of this step's keys is admissible: check the limits and the spring model"
        return "nearest admissible: " + ", ".join(
            f"{key} = {value:.10g}" for key, value in self.nearest.items()
        )


@dataclass(frozen=True)
class Judge:
    """Holds what a step is judged by.

    Parameters
    ----------
    limits : Envelope
        The limits in force.
    predictor : Predictor
        The spring model.
    ramp_speed_mm_per_s : float
        Of the ramp to the prestress or hold.
    coldest_C : float
        The lowest temperature the specimen can have: forces are greatest there.
    """

    limits: Envelope
    predictor: Predictor
    ramp_speed_mm_per_s: float
    coldest_C: float

    def breach(self, step: SingleStep) -> Breach | None:  # noqa: PLR0911 - one for each kind
        """Return the first limit that a step breaks, with the nearest admissible values, or None."""
        match step:
            case HarmonicStep():
                return self._harmonic(step)
            case StaticStep():
                return self._static(step)
            case HoldStep():
                return self._hold(step)
            case ConditioningStep():
                return self.breach(step.as_step())
            case InnerLoopsStep():
                return self._loops(step)
            case MotionStep():
                return self._composed(step)
        return None

    def motion_breach(self, motion: MotionSettings) -> Breach | None:
        """Return the limit that a ramp's speed breaks."""
        for key in ("ramp_speed_mm_per_s", "release_speed_mm_per_s"):
            if found := _over(key, getattr(motion, key), self.limits.speed):
                return found
        return None

    def _harmonic(self, step: HarmonicStep) -> Breach | None:
        found = self._harmonic_problem(step)
        if found is None:
            return None
        name, problem = found
        return Breach(name, problem, self._nearest_harmonic(step))

    def _harmonic_problem(self, step: HarmonicStep) -> tuple[str, str] | None:
        limits, (frequency, speed) = self.limits, step.rate()
        prestress, amplitude = step.prestress_mm, step.amplitude_mm
        lowest, highest = prestress - amplitude, prestress + amplitude
        if lowest < -TOLERANCE * amplitude:
            problem = (
                f"the stroke would go to {prestress:g} − {amplitude:g} = {lowest:g} mm, below first contact "
                f"({BELOW_ZERO})"
            )
            return BELOW_ZERO, problem
        if not limits.stroke.allows(highest):
            return _said(f"the stroke {prestress:g} + {amplitude:g}", highest, limits.stroke)
        if not limits.frequency.allows(frequency):
            by = "" if step.frequency_Hz else f" of {speed:g} mm/s at {amplitude:g} mm"
            return _said(f"the frequency{by}", frequency, limits.frequency)
        if not limits.speed.allows(speed):
            return _said(f"the peak speed 2π · {frequency:g} Hz · {amplitude:g} mm", speed, limits.speed)
        force = peak_force(
            self.predictor, prestress, amplitude, frequency, self.ramp_speed_mm_per_s, self.coldest_C
        )
        if not limits.force.allows(force):
            what = f"the expected peak force at {highest:g} mm and {self.coldest_C:g} °C"
            return _said(what, force, limits.force)
        return None

    def _nearest_harmonic(self, step: HarmonicStep) -> dict[str, float]:
        """Mend stroke, then rate, then force; only what must change changes, and no more than it must."""
        mended = self._mend_rate(self._mend_stroke(step))
        problem = self._harmonic_problem(mended)
        if problem is not None and problem[0] == self.limits.force.name:
            mended = self._mend_force(mended)
        if self._harmonic_problem(mended) is not None:
            return {}
        keys = ("prestress_mm", "amplitude_mm", "frequency_Hz", "peak_speed_mm_per_s")
        return {key: getattr(mended, key) for key in keys if getattr(mended, key) != getattr(step, key)}

    def _mend_stroke(self, step: HarmonicStep) -> HarmonicStep:
        top, prestress = self.limits.stroke.value, step.prestress_mm
        room = min(prestress, top - prestress)
        if step.amplitude_mm <= room * (1.0 + TOLERANCE):
            return step
        if room >= _RESOLUTION:
            return step.model_copy(update={"amplitude_mm": _down(room)})
        amplitude = min(step.amplitude_mm, _down(top / 2.0))  # no room at this prestress: move the prestress
        prestress = amplitude if prestress < top / 2.0 else top - amplitude
        return step.model_copy(update={"prestress_mm": prestress, "amplitude_mm": amplitude})

    def _mend_rate(self, step: HarmonicStep) -> HarmonicStep:
        per_Hz = 2.0 * math.pi * step.amplitude_mm
        highest_Hz = min(self.limits.frequency.value, self.limits.speed.value / per_Hz)
        frequency, _ = step.rate()
        if frequency <= highest_Hz * (1.0 + TOLERANCE):
            return step
        if step.frequency_Hz is not None:
            return step.model_copy(update={"frequency_Hz": _down(highest_Hz, _RESOLUTION / 10.0)})
        return step.model_copy(update={"peak_speed_mm_per_s": _down(highest_Hz * per_Hz)})

    def _mend_force(self, step: HarmonicStep) -> HarmonicStep:
        """Lower the amplitude, or where that cannot help the prestress, to the greatest force allowed."""

        def lower_amplitude(share: float) -> HarmonicStep:
            return self._mend_rate(step.model_copy(update={"amplitude_mm": _down(step.amplitude_mm * share)}))

        def lower_prestress(share: float) -> HarmonicStep:
            prestress = _down(step.prestress_mm * share)
            changed = {"prestress_mm": prestress, "amplitude_mm": min(step.amplitude_mm, prestress)}
            return self._mend_rate(step.model_copy(update=changed))

        for change, size in ((lower_amplitude, step.amplitude_mm), (lower_prestress, step.prestress_mm)):
            share = _greatest_share(self._keeping(change), size)
            if share > 0.0:
                return change(share)
        return step

    def _keeping(self, change: Callable[[float], HarmonicStep]) -> Callable[[float], bool]:
        return lambda share: self._harmonic_problem(change(share)) is None

    def _static(self, step: StaticStep) -> Breach | None:
        asked = (
            ("speed_mm_per_s", step.speed_mm_per_s, self.limits.speed),
            ("force_limit_kN", step.force_limit_kN, self.limits.force),
            ("stroke_limit_mm", step.stroke_limit_mm, self.limits.stroke),
        )
        for key, value, bound in asked:
            if value is not None and (found := _over(key, value, bound)):
                return found
        return None

    def _loops(self, step: InnerLoopsStep) -> Breach | None:
        for loop in step.loops():
            if found := self._harmonic(loop):
                which = f"loop {loop.prestress_mm:g} ± {loop.amplitude_mm:g} mm"
                return _within(which, found, {"prestress_mm": "mean_mm"})
        return None

    def _composed(self, step: MotionStep) -> Breach | None:
        at_mm = 0.0
        for number, piece in enumerate(step.piece, start=1):
            found: Breach | None = None
            if isinstance(piece, HarmonicPiece):
                found = self._harmonic(piece.about(at_mm))
                if found and "prestress_mm" in found.nearest:
                    found = Breach(found.limit, found.problem, {})  # that is the piece's before it
            elif isinstance(piece, RampPiece):
                found = self._ramp(piece)
                at_mm = piece.to_mm if piece.to_mm is not None else self.limits.stroke.value
            elif isinstance(piece, ReleasePiece):
                if piece.speed_mm_per_s is not None:
                    found = _over("speed_mm_per_s", piece.speed_mm_per_s, self.limits.speed)
                at_mm = 0.0
            if found:
                return _within(f"piece {number}", found, {})
        return None

    def _ramp(self, piece: RampPiece) -> Breach | None:
        if found := _over("speed_mm_per_s", piece.speed_mm_per_s, self.limits.speed):
            return found
        if piece.to_kN is not None:
            return _over("to_kN", piece.to_kN, self.limits.force)
        return self._stroke("to_mm", piece.to_mm or 0.0, piece.speed_mm_per_s)

    def _hold(self, step: HoldStep) -> Breach | None:
        if step.force_kN is not None:
            found = _over("approach_speed_mm_per_s", step.approach_speed_mm_per_s, self.limits.speed)
            return found or _over("force_kN", step.force_kN, self.limits.force)
        return self._stroke("stroke_mm", step.stroke_mm or 0.0, self.ramp_speed_mm_per_s)

    def _stroke(self, key: str, asked_mm: float, speed_mm_per_s: float) -> Breach | None:
        """Judge a compression to a stroke by stroke and force."""
        if asked_mm <= 0.0:
            return None
        stroke = min(asked_mm, self.limits.stroke.value)

        def force_at_mm(stroke_mm: float) -> float:
            return force_at(self.predictor, stroke_mm, speed_mm_per_s, self.coldest_C)

        def keeps(share: float) -> bool:
            return self.limits.force.allows(force_at_mm(_down(stroke * share)))

        if self.limits.force.allows(force_at_mm(stroke)):
            return _over(key, asked_mm, self.limits.stroke)
        share = _greatest_share(keeps, stroke)
        nearest = {key: _down(stroke * share)} if share > 0.0 else {}
        if not self.limits.stroke.allows(asked_mm):
            return Breach(*_said(key, asked_mm, self.limits.stroke), nearest)
        what = f"the expected force at {asked_mm:g} mm and {self.coldest_C:g} °C"
        return Breach(*_said(what, force_at_mm(asked_mm), self.limits.force), nearest)


def _within(part: str, found: Breach, keys: Mapping[str, str]) -> Breach:
    """Return a breach of one part of a step, named, with the keys as the step has them."""
    nearest = {f"{keys.get(key, key)} ({part})": value for key, value in found.nearest.items()}
    return Breach(found.limit, f"{part}: {found.problem}", nearest)


def cool_down_note(step: CoolDownStep, ambient_C: float) -> str | None:
    """Return a warning for a cool-down that the air is too warm for, None if it can end."""
    if step.temperature_C > ambient_C:
        return None
    return (
        f"cooling to {step.temperature_C:g} °C cannot end in air of {ambient_C:g} °C (conditions.ambient_C): "
        f"it would give up after {step.timeout_s:g} s"
    )


def _down(value: float, resolution: float = _RESOLUTION) -> float:
    """Round down to the resolution; what is below it stays as it is."""
    if value < resolution:
        return value
    return round(math.floor(value / resolution * (1.0 + TOLERANCE)) * resolution, 6)


def _said(what: str, value: float, bound: Bound) -> tuple[str, str]:
    return bound.name, f"{what} = {value:.4g} {bound.unit} is above {bound.text()}"


def _over(key: str, value: float, bound: Bound) -> Breach | None:
    if bound.allows(value):
        return None
    return Breach(*_said(key, value, bound), {key: bound.value})


def _greatest_share(keeps: Callable[[float], bool], size: float) -> float:
    """Return the greatest share of ``size`` (to the resolution) that keeps the limits; 0 if none does.

    ``keeps`` must hold below some share and not above it.
    """
    low, high = min(1.0, _RESOLUTION / size), 1.0
    if not keeps(low):
        return 0.0
    while (high - low) * size > _RESOLUTION / 4.0:
        middle = (low + high) / 2.0
        low, high = (middle, high) if keeps(middle) else (low, middle)
    return low
