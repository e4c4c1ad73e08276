"""A run of devices with clocks of their own: of which channels its figures are, and how they are aligned.

Readings of both clocks place the samples to within half a round trip of each (:mod:`bufferstand.recording`).
Where both devices measure the same quantity, their records show the rest: by how much one must be shifted to
lie on the other, in stretches of the run, whose scatter is the uncertainty.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bufferstand.evaluation.loading.resample import usual_step_s
from bufferstand.evaluation.numerics import FloatArray
from bufferstand.foundation.channels import STROKE_CHANNELS
from bufferstand.recording import MAIN_STREAM
from bufferstand.recording.runfile import Alignment, Run, Series

STRETCHES = 24
LEAST_STRETCHES = 4
"""Fewer show no scatter that is worth anything."""
LEAST_STRETCH_S = 0.5
SMOOTHED_S = 0.015
"""Both records are averaged over so long, twice: noise must not hide which way a value moves [s]."""
STEEP = 0.2
"""A stretch counts where its values move at least so much as in the one with the most motion, in rms."""
DRIFTS_FROM_S = 30.0
"""A shorter run shows no drift beside that of the readings [s]."""
_STEPS = 4
_COVERED = 0.9545
"""Probability that twice the standard uncertainty is to cover."""


@dataclass(frozen=True)
class _Stretch:
    """How late the device's samples are in a stretch: its middle [s], the lateness [s], and its weight."""

    at_s: float
    late_s: float
    weight: float


def with_figures(run: Run) -> Run:
    """Return the run with the names that its figures go by: ``force`` and ``stroke_1`` … are those of them.

    Of a run whose stand has no acquisition device beside the controller: the same run. What the controller
    itself measured keeps being there: its force as ``force_2``, its draw wires as ``controller_stroke_1`` ….
    """
    stand = run.metadata.get("stand") or {}
    if not run.other_clocks.lines:
        return run  # and align() says what that means
    figures = stand.get("figures") or {}
    force, strokes = figures.get("force") or "force", tuple(figures.get("stroke") or ())
    own = run.streams[MAIN_STREAM].channels if MAIN_STREAM in run.streams else {}
    names: dict[str, dict[str, str]] = {name: {} for name in run.streams}
    if force != "force" and run.has(force):
        names[run.stream_of(force).name][force] = "force"
        if run.has("force"):
            names[run.stream_of("force").name]["force"] = force
    wires = [name for name in strokes if run.has(name)] or [name for name in own if name in STROKE_CHANNELS]
    for name in STROKE_CHANNELS:
        if run.has(name) and name not in wires:
            stream = run.stream_of(name).name
            names[stream][name] = f"{stream}_{name}"
    for number, name in enumerate(wires):
        names[run.stream_of(name).name][name] = STROKE_CHANNELS[number]
    return run.renamed(names)


def align(run: Run) -> tuple[str, ...]:
    """Align each device's samples with the controller's by a quantity that both have measured.

    Parameters
    ----------
    run : Run
        With the names of its figures (:func:`with_figures`); its devices' samples are placed anew.

    Returns
    -------
    tuple of str
        How the clocks lie to each other and how well that is known, a sentence for each device.
    """
    stand = run.metadata.get("stand") or {}
    if stand.get("figures") and not run.other_clocks.lines:
        text = (
            "no reading of the acquisition device's clock is on record: the figures are made of the "
            "controller's own channels"
        )
        return (text,)
    return tuple(_aligned(run, stream) for stream in run.other_clocks.lines)


def _aligned(run: Run, stream: str) -> str:
    clocks = run.other_clocks
    shown = (
        f"clock of {stream}: {-clocks.offset_s(stream):+.4f} s against the controller's at the middle of its "
        f"readings, {1e6 * clocks.drift(stream):+.1f} ppm"
    )
    known_s = clocks.bound_s(stream)
    coarse = f"{shown}; known by its readings alone, to {1e3 * known_s:.2f} ms, which is in every U"
    doubts = []
    for own, other in _pairs(run, stream):
        delays_s = [run.stream_of(name).channels[name].uncertainty.u_delay_s for name in (own, other)]
        found = late_against(run.series(own), run.series(other))
        if found is None:
            continue
        late_s, drift, at_s, u_s = found
        u_s = float(np.linalg.norm([u_s, *(one or 0.0 for one in delays_s)]))
        if abs(late_s) > known_s + 3.0 * u_s:
            doubts.append(
                f"{own} lies {1e3 * late_s:.2f} ms behind {other}, more than the clocks allow: see their "
                "delay_s"
            )
            continue
        run.align(stream, Alignment(late_s, drift, at_s, u_s, f"{own} against {other}"))
        missing = [name for name, delay in zip((own, other), delays_s, strict=True) if delay is None]
        taken = f" ({' and '.join(missing)} taken for exact: no u_delay_s is stated)" if missing else ""
        return (
            f"{shown}; aligned by {own} against {other}, another {1e3 * late_s:+.3f} ms, to "
            f"{2e3 * u_s:.3f} ms (k = 2){taken}"
        )
    return "; ".join((coarse, *doubts))


def _pairs(run: Run, stream: str) -> list[tuple[str, str]]:
    """Return pairs of channels of one quantity: the device's, and the controller's; draw wires first.

    A draw wire of each shows the same motion whatever the specimen does; two amplifiers of a force may have
    filters of their own.
    """
    if MAIN_STREAM not in run.streams:
        return []
    own, other = run.streams[stream].channels, run.streams[MAIN_STREAM].channels
    return [
        (one, two)
        for quantity in ("stroke", "force")
        for one, channel in own.items()
        for two, further in other.items()
        if channel.quantity == further.quantity == quantity
    ]


def late_against(own: Series, other: Series) -> tuple[float, float, float, float] | None:
    """Return by how much one record's times are late against another's of the same quantity.

    In each stretch, a(t) = p + q b(t + τ) is solved for τ by Gauss-Newton, with gain and zero free: records
    of two transducers differ in both. Both are smoothed alike, so that no shift comes in.

    Parameters
    ----------
    own, other : Series
        b and a.

    Returns
    -------
    tuple of float or None
        Lateness [s] at an instant, its drift, that instant [s], and the standard uncertainty of the
        lateness over the run [s] by the scatter of the stretches; None where too few of them move.
    """
    if not own.time_s.size or not other.time_s.size:
        return None
    begin = max(float(own.time_s[0]), float(other.time_s[0]))
    end = min(float(own.time_s[-1]), float(other.time_s[-1]))
    count = min(STRETCHES, int((end - begin) / LEAST_STRETCH_S))
    if count < LEAST_STRETCHES:
        return None
    smooth = _smoothed(own.time_s, own.value), _smoothed(other.time_s, other.value)
    edges = np.linspace(begin, end, count + 1)
    found = [
        one
        for low, high in pairwise(edges.tolist())
        if (one := _stretch((own.time_s, smooth[0]), (other.time_s, smooth[1]), low, high)) is not None
    ]
    most = max((one.weight for one in found), default=0.0)
    moving = [one for one in found if one.weight > STEEP**2 * most]
    if len(moving) < LEAST_STRETCHES or most <= 0.0:
        return None
    return _line(moving, end - begin)


def _smoothed(time_s: FloatArray, value: FloatArray) -> FloatArray:
    count = max(1, round(SMOOTHED_S / max(usual_step_s(time_s), 1e-9))) | 1
    window = np.ones(count) / count
    half = count // 2
    for _ in range(2):
        value = np.convolve(np.pad(value, half, mode="edge"), window, mode="valid")
    return value


def _stretch(
    own: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray], low: float, high: float
) -> _Stretch | None:
    margin = 2.0 * SMOOTHED_S
    inside = (other[0] > low + margin) & (other[0] < high - margin)
    time_s, wanted = other[0][inside], other[1][inside]
    if time_s.size < 16 or not np.all(np.isfinite(wanted)) or not np.all(np.isfinite(own[1])):
        return None
    slope = np.gradient(own[1], own[0])
    late_s = 0.0
    for _ in range(_STEPS):
        value, rate = (np.interp(time_s + late_s, own[0], column) for column in (own[1], slope))
        columns = np.column_stack((np.ones_like(value), value, rate))
        scales = np.maximum(np.linalg.norm(columns, axis=0), 1e-30)
        fit, _, rank, _ = np.linalg.lstsq(columns / scales, wanted, rcond=None)
        fit = fit / scales
        if rank < 3 or fit[1] <= 0.0:
            return None
        late_s += float(np.clip(fit[2] / fit[1], -0.02, 0.02))
    return _Stretch(0.5 * (low + high), late_s, float(np.mean((rate - np.mean(rate)) ** 2)))


def _line(moving: list[_Stretch], span_s: float) -> tuple[float, float, float, float]:
    from scipy.special import stdtrit  # noqa: PLC0415 - slow to import, and seldom needed

    at_s = np.array([one.at_s for one in moving])
    late_s = np.array([one.late_s for one in moving])
    weight = np.array([one.weight for one in moving])
    weight = weight / np.sum(weight)
    middle_s = float(np.sum(weight * at_s))
    columns = [np.ones_like(at_s)]
    if span_s >= DRIFTS_FROM_S and len(moving) >= 2 * LEAST_STRETCHES:
        columns.append(at_s - middle_s)
    design = np.column_stack(columns) * np.sqrt(weight)[:, np.newaxis]
    fit = np.linalg.lstsq(design, late_s * np.sqrt(weight), rcond=None)[0]
    left = late_s - np.column_stack(columns) @ fit
    free = len(moving) - len(columns)
    scatter = float(np.sum(weight * left**2)) * len(moving) / free
    covariance = np.linalg.inv(design.T @ design) * scatter / len(moving)
    # Of few stretches the scatter is not sure: U = 2 u is to cover as often as with many.
    widened = float(stdtrit(free, 0.5 * (1.0 + _COVERED))) / 2.0
    ends = (at_s[[0, -1]] - middle_s) if len(columns) > 1 else np.zeros(1)
    u2 = covariance[0, 0] + (float(np.max(ends**2)) * covariance[1, 1] / 3.0 if len(columns) > 1 else 0.0)
    return float(fit[0]), float(fit[1]) if len(columns) > 1 else 0.0, middle_s, widened * float(np.sqrt(u2))
