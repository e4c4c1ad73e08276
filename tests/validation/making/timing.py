"""Group ``timing``: what happens to stamps, rates and delays, and how a record may be written."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from tests.validation.making.closed_form import FORCE, STROKE, TIME, plain
from tests.validation.making.sines import ENERGIES, MOTION, PI, STIFFNESSES, Ellipse, agreed_means, sampled
from tests.validation.making.standard_set import Agreed, StandardSet, complete_cycles, csv_text

_TIGHT = {ENERGIES: 1e-3, STIFFNESSES: 5e-3, MOTION: 1e-3}
_ELLIPSE = Ellipse()
_CYCLES = 3


def _agreed(shares: Mapping[tuple[str, ...], float] = _TIGHT, ellipse: Ellipse = _ELLIPSE) -> list[Agreed]:
    return [*agreed_means(ellipse, dict(shares)), complete_cycles(_CYCLES, "lower turns on record: 4")]


def timing_sets() -> list[StandardSet]:
    """Return the sets of the group."""
    return [
        _late(),
        _corrected(),
        _jitter(),
        _rounded_stamps(),
        _lost(),
        _doubled(),
        _rates(),
        _german(),
        _imperial(),
        _without_time(),
        _edge_to_edge(),
    ]


def _record() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return sampled(_ELLIPSE, 200.0, 4.6)


def _late() -> StandardSet:
    """Return a force that is 20 ms late: δ falls by ω τ, and with it what the record holds of the loop."""
    time_s, stroke, _ = _record()
    moment = time_s + 0.3 / _ELLIPSE.frequency_Hz
    force = _ELLIPSE.force_at(moment - 0.02)
    seen = Ellipse(delta=_ELLIPSE.delta - 2.0 * PI * _ELLIPSE.frequency_Hz * 0.02)
    return StandardSet(
        "timing/force-late",
        "Force 20 ms late, not corrected",
        "Agreed are the figures of the record as it is: δ less ω τ. No program can know better.",
        _agreed(ellipse=seen),
        plain(time_s, stroke, force),
    )


def _corrected() -> StandardSet:
    time_s, stroke, _ = _record()
    moment = time_s + 0.3 / _ELLIPSE.frequency_Hz
    mapping = (
        'name = "delay of the force channel"\n\n[columns.force]\nheader = "force"\nunit = "kN"\n'
        'delay_s = 0.02\n\n[columns.stroke]\nheader = "stroke"\nunit = "mm"\n'
    )
    return StandardSet(
        "timing/force-late-corrected",
        "Force 20 ms late, its delay stated",
        "The delay stands in the mapping file (delay_s); agreed are the figures of the specimen.",
        _agreed(),
        plain(time_s, stroke, _ELLIPSE.force_at(moment - 0.02)),
        mapping=mapping,
    )


def _jitter() -> StandardSet:
    """Return samples at uneven instants that the stamps state truly."""
    generator = np.random.default_rng(7)
    time_s, _, _ = _record()
    time_s = time_s + generator.uniform(-0.3, 0.3, time_s.size) / 200.0
    time_s -= time_s[0]
    moment = time_s + 0.3 / _ELLIPSE.frequency_Hz
    return StandardSet(
        "timing/uneven-instants",
        "Uneven instants, stamped truly",
        "Steps between 0.4 and 1.6 of the usual one: no sample is lost.",
        _agreed(),
        plain(time_s, _ELLIPSE.stroke_mm(moment), _ELLIPSE.force_at(moment)),
    )


def _rounded_stamps() -> StandardSet:
    """Return stamps rounded down to 10 ms at 200 samples a second: every two samples share one."""
    time_s, stroke, force = _record()
    stamps = np.floor(time_s * 100.0 + 1e-9) / 100.0
    return StandardSet(
        "timing/rounded-stamps",
        "Time stamps of 10 ms at 200 samples a second",
        "Two samples share each stamp. Areas do not depend on time; frequency by the record's length.",
        [*agreed_means(_ELLIPSE, {ENERGIES: 2e-3, MOTION: 2e-3}), complete_cycles(_CYCLES, "as recorded")],
        [(TIME, stamps, 2), (STROKE, stroke, 6), (FORCE, force, 6)],
    )


def _lost() -> StandardSet:
    """Return a record that lacks one sample in each cycle, one of them at a turn."""
    time_s, stroke, force = _record()
    keep = np.ones(time_s.size, dtype=bool)
    lower = round(0.7 / _ELLIPSE.frequency_Hz * 200.0)  # sample of the first lower turn
    keep[[lower, lower + 530, lower + 845, lower + 1403]] = False
    return StandardSet(
        "timing/lost-samples",
        "One sample lost in each cycle",
        "400 samples a cycle; one of those lost is the one at a lower turning point.",
        _agreed(),
        plain(time_s[keep], stroke[keep], force[keep]),
    )


def _doubled() -> StandardSet:
    time_s, stroke, force = _record()
    again = np.sort(np.concatenate((np.arange(time_s.size), np.arange(50, time_s.size, 97))))
    return StandardSet(
        "timing/doubled-rows",
        "Some rows written twice",
        "The same row again, every 97th: one sample each.",
        _agreed(),
        plain(time_s[again], stroke[again], force[again]),
    )


def _rates() -> StandardSet:
    """Return stroke at every fifth instant of the force, temperature once a second: blanks between."""
    time_s, stroke, force = _record()
    row = np.arange(time_s.size)
    slow = np.where(row % 5 == 0, stroke, np.nan)
    temperature = np.where(row % 200 == 0, 21.5, np.nan)
    return StandardSet(
        "timing/several-rates",
        "Force at 200, stroke at 40, temperature at 1 sample a second",
        "One file, blanks between the readings of the slower channels: nothing is lost.",
        [
            *agreed_means(_ELLIPSE, {ENERGIES: 2e-3, MOTION: 2e-3}),
            complete_cycles(_CYCLES, "as recorded"),
        ],
        [*plain(time_s, slow, force), ("temperature [°C]", temperature, 1)],
    )


def _german() -> StandardSet:
    time_s, stroke, force = _record()
    columns = [("Zeit (s)", time_s, 4), ("Weg (mm)", stroke, 5), ("Kraft (N)", 1e3 * force, 2)]
    text = csv_text(columns, separator=";", comma=True)
    return StandardSet(
        "timing/decimal-comma",
        "Semicolons, decimal commas, force in N, UTF-16",
        "As an export of a German program.",
        _agreed(),
        text=text.encode("utf-16"),
        options={"column": {"time": "Zeit", "stroke": "Weg", "force": "Kraft"}},
    )


def _imperial() -> StandardSet:
    time_s, stroke, force = _record()
    columns = [
        ("time [ms]", 1e3 * time_s, 3),
        ("stroke [in]", stroke / 25.4, 7),
        ("force [lbf]", force / 4.4482216152605e-3, 3),
    ]
    return StandardSet(
        "timing/imperial-units",
        "Milliseconds, inches, pounds-force; the force negative in compression",
        "1 in = 25.4 mm, 1 lbf = 4.4482216152605 N, exactly.",
        _agreed(),
        [columns[0], columns[1], ("force [lbf]", -columns[2][1], 3)],
        options={"invert": ["force"]},
    )


def _without_time() -> StandardSet:
    _, stroke, force = _record()
    options: dict[str, Any] = {"sample_rate_Hz": 200.0}
    return StandardSet(
        "timing/no-time-column",
        "No time column, 200 samples a second stated",
        "Stroke and force alone.",
        _agreed(),
        [(STROKE, stroke, 6), (FORCE, force, 6)],
        options=options,
    )


def _edge_to_edge() -> StandardSet:
    """Return a record that begins with the first sample of the motion and ends with its last."""
    time_s, _, _ = sampled(_ELLIPSE, 200.0, 4.0, 0.0)
    one = np.array([time_s.size / 200.0])
    moment = np.concatenate((time_s, one))
    return StandardSet(
        "timing/edge-to-edge",
        "The record begins and ends with the motion",
        "First and last sample are lower turning points; all four cycles are on record.",
        [
            *agreed_means(_ELLIPSE, {ENERGIES: 2e-3, MOTION: 2e-3}),
            complete_cycles(4, "four whole ones"),
        ],
        plain(moment, _ELLIPSE.stroke_mm(moment), _ELLIPSE.force_at(moment)),
    )
