"""The runs that would determine the missing parameters, as the text of a campaign file."""

from __future__ import annotations

from collections.abc import Sequence

from bufferstand.model.identification.procedure import Identification, Unknown

_TEMPERATURE = ("sensitivity_per_K", "depth_mm", "loss_sensitivity_per_K")
_HEAT = ("capacity_J_per_K", "loss_W_per_K", "sensor_lag_s")
_RATE = ("beta", "tau_s", "spectrum_per_decade")


def needed(found: Identification) -> tuple[Unknown, ...]:
    """Return the unknown parameters that further runs could tell: those not left out on request."""
    return tuple(unknown for unknown in found.unknown if not unknown.on_request)


def missing_runs(found: Identification, *, stand: str, specimen: str) -> str:
    """Return a campaign file (docs/campaign-file.md) of runs that would identify what is unknown.

    Slow strokes and inner loops for the curves and their transition; the same again when the spring is
    warm for c_ts, alpha and c_eta; heating, and short runs while it cools, for C, lambda and
    the sensor's lag;
    constant amplitude at many rates in random order for beta, tau and the spectrum.

    Parameters
    ----------
    found : Identification
    stand, specimen : str
        Paths of the files that the campaign names, relative to it.
    """
    names = {unknown.name for unknown in needed(found)}
    reach = 0.95 * found.facts.stroke_mm
    warm_up = _harmonic("warm up", 0.74 * reach, 0.16 * reach, "peak_speed_mm_per_s = 80.0", 120)
    parts = [_head(found, stand, specimen), _static("slow stroke", reach), _inner_loops("inner loops", reach)]
    if names & set(_RATE):
        parts.append(_rates(reach))
    if names & set(_TEMPERATURE):
        parts += [warm_up, _static("slow stroke, warm", reach), _inner_loops("inner loops, warm", reach)]
    if names & set(_HEAT):
        parts.append(warm_up)
        short = _harmonic("temperature while cooling", 0.3 * reach, 0.1 * reach, "frequency_Hz = 0.5", 3)
        parts += [_hold(300.0), short] * 3
    return "\n".join(parts)


def _head(found: Identification, stand: str, specimen: str) -> str:
    reasons = [f"# - {unknown.name}: {unknown.why}" for unknown in needed(found)]
    return "\n".join(
        [
            f"# Runs that would tell what the runs of “{found.model.name}” do not:",
            *reasons,
            "# Let the specimen rest until it is as warm as the air, run all in order without a break, fit",
            "# with --in-a-row: temperatures from one run to the next tell capacity and losses. For c_ts, a",
            "# climate chamber or a day in the cold does more than more cycles.",
            "",
            "[campaign]",
            'id = "identification"',
            'title = "Runs for the identification of the spring model"',
            f"stand = {_text(stand)}",
            f"specimen = {_text(specimen)}",
            "",
            "[limits]",
            'on_temperature_stop = "skip"',
            "temperature_resume_C = 36.0  # so that the slow strokes after warming up are warm",
            "",
        ]
    )


def _static(name: str, reach: float) -> str:
    return _step("static", name, "speed_mm_per_s = 5.0", f"stroke_limit_mm = {reach:.1f}", "cycles = 2")


def _inner_loops(name: str, reach: float) -> str:
    return _step(
        "sweep",
        name,
        f"prestress_mm = {_list(0.25 * reach, 0.5 * reach, 0.75 * reach)}",
        f"amplitude_mm = {_list(0.02 * reach, 0.05 * reach, 0.15 * reach)}",
        "peak_speed_mm_per_s = 20.0",
        "cycles = 3",
        'beyond_limits = "leave-out"',
    )


def _rates(reach: float) -> str:
    return _step(
        "sweep",
        "constant amplitude, random order",
        f"prestress_mm = {_list(0.22 * reach, 0.42 * reach)}",
        f"amplitude_mm = {_list(0.2 * reach)}",
        "frequency_Hz = [0.02, 0.08, 0.32, 1.27]",
        "cycles = [2, 3, 4, 6]",
        'order = "random"',
        "seed = 1",
        'beyond_limits = "leave-out"',
    )


def _harmonic(name: str, prestress: float, amplitude: float, rate: str, cycles: int) -> str:
    return _step(
        "harmonic",
        name,
        f"prestress_mm = {prestress:.1f}",
        f"amplitude_mm = {amplitude:.1f}",
        rate,
        f"cycles = {cycles}",
    )


def _hold(duration_s: float) -> str:
    return _step("hold", "cool at rest", f"duration_s = {duration_s:g}")


def _step(kind: str, name: str, *lines: str) -> str:
    return "\n".join(["[[step]]", f"kind = {_text(kind)}", f"name = {_text(name)}", *lines, ""])


def _list(*values: float) -> str:
    return f"[{', '.join(f'{value:.1f}' for value in _rising(values))}]"


def _rising(values: Sequence[float]) -> list[float]:
    return sorted(values)


def _text(value: str) -> str:
    escaped = value.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
