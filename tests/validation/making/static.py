"""Group ``static``: static tests of EN 15551 on a made buffer, each brought to one verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from tests.validation.making.buffer import Buffer, Test, motion, whole
from tests.validation.making.closed_form import FORCE, STROKE, TIME
from tests.validation.making.standard_set import (
    Agreed,
    FloatArray,
    StandardSet,
    measured,
    of_cycle,
    run_verdict,
    verdict,
)

_WINDOWS = (("force-at-25mm", 25.0), ("force-at-60mm", 60.0), ("force-at-100mm", 100.0))
_OF_A_STROKE = (
    "preload",
    "force-at-25mm",
    "force-at-60mm",
    "force-at-100mm",
    "stored-energy",
    "absorbed-energy-ratio",
)


@dataclass(frozen=True)
class Case:
    """A static set in the making."""

    name: str
    title: str
    about: str
    buffer: Buffer = field(default_factory=Buffer)
    test: Test = field(default_factory=Test)
    temperature_C: float | None = 20.0
    facts: Mapping[str, Any] = field(default_factory=dict)


def _columns(case: Case) -> list[tuple[str, FloatArray, int]]:
    time_s, stroke, force = motion(case.buffer, case.test)
    columns = [(TIME, time_s, 4), (STROKE, stroke, 4), (FORCE, force, 4)]
    if case.temperature_C is not None:
        columns.append(("temperature [°C]", np.full(time_s.size, case.temperature_C), 1))
    return columns


def _figures(case: Case) -> list[Agreed]:
    """Return the agreed figures of every stroke, and the measured values of what is asked of it."""
    found: list[Agreed] = []
    preload = case.buffer.extrapolated_preload()
    for index, (top, ratio) in enumerate(zip(case.test.tops_mm, case.test.ratios, strict=True), start=1):
        stored = case.buffer.stored(top)
        found.append(of_cycle(index, "stored_energy_J", stored, "∫ F_l dx", share=2e-3))
        found.append(of_cycle(index, "absorbed_energy_J", ratio * stored, "ratio put in", share=5e-3))
        found.append(of_cycle(index, "stroke_max_mm", top, "top put in", absolute=0.05))
        force = float(case.buffer.loading(np.array([top]))[0])
        found.append(of_cycle(index, "force_max_kN", force, "F_l(x_1)", share=3e-3))
        found.append(measured("preload", index, preload, "kN", "line of 2 to 10 mm at 0", absolute=0.3))
        for identity, place in _WINDOWS:
            if place <= top:
                value = float(case.buffer.loading(np.array([place]))[0])
                found.append(measured(identity, index, value, "kN", "F_l there", share=2e-3))
    return found


def _made(case: Case, agreed: Sequence[Agreed], columns: Any = None, **more: Any) -> StandardSet:
    specimen = {"category": "A", "elastic_system": "elastomer", "assembled": "2026-01-05T08:00:00Z"}
    facts = {"started": "2026-01-15T08:00:00Z", **case.facts}
    specimen |= {key: facts.pop(key) for key in list(facts) if key == "assembled"}
    return StandardSet(
        f"static/{case.name}",
        case.title,
        case.about,
        list(agreed),
        _columns(case) if columns is None else columns,
        kind="static",
        specimen=specimen,
        test=facts,
        **more,
    )


def _all(value: str, cycles: Sequence[int] = (1, 2, 3)) -> list[Agreed]:
    return [
        verdict(identity, cycle, value, "by the figures put in")
        for cycle in cycles
        for identity in _OF_A_STROKE
    ]


def static_sets() -> list[StandardSet]:
    """Return the sets of the group."""
    return [*_of_the_specimen(), *_of_the_test(), *_of_the_record()]


_GOOD = Case(
    "pass", "Meets every requirement", "Three strokes to 103 mm at 20 mm/s, 20 °C, ten days after assembly."
)


def _of_the_specimen() -> list[StandardSet]:
    """Return a good buffer, and one for every requirement that misses just that one."""
    sets = [_made(_GOOD, [*_figures(_GOOD), *_all("pass"), run_verdict("pass", "all are met")])]
    bad: list[tuple[str, str, Buffer, Test, list[tuple[str, int]]]] = [
        ("preload-low", "preload", Buffer(preload_kN=6.0), Test(), [("preload", i) for i in (1, 2, 3)]),
        (
            "force-25-high",
            "force-at-25mm",
            Buffer(20.0, 4.6, 2.0e-4),
            Test(),
            [("force-at-25mm", i) for i in (1, 2, 3)],
        ),
        (
            "force-60-low",
            "force-at-60mm",
            Buffer(15.0, 0.7, 8.15e-14, 8),
            Test(tops_mm=(101.0,) * 3),
            [("force-at-60mm", i) for i in (1, 2, 3)],
        ),
        (
            "force-100-low",
            "force-at-100mm",
            Buffer(30.0, 1.9, 1.0e-4),
            Test(),
            [("force-at-100mm", i) for i in (1, 2, 3)],
        ),
        (
            "stored-energy-low",
            "stored-energy",
            Buffer(12.0, 0.9, 2.78e-6, 4),
            Test(tops_mm=(100.5,) * 3),
            [("stored-energy", i) for i in (1, 2, 3)],
        ),
        (
            "first-ratio-low",
            "absorbed-energy-ratio of the first stroke",
            Buffer(),
            Test(ratios=(0.47, 0.46, 0.45)),
            [("absorbed-energy-ratio", 1)],
        ),
        (
            "later-ratio-low",
            "absorbed-energy-ratio of the third stroke",
            Buffer(),
            Test(ratios=(0.55, 0.46, 0.39)),
            [("absorbed-energy-ratio", 3)],
        ),
    ]
    for name, what, buffer, test, failing in bad:
        case = Case(name, f"Fails by its {what}", "All else is met.", buffer, test)
        rows = [
            verdict(
                identity, cycle, "fail" if (identity, cycle) in failing else "pass", "by the figures put in"
            )
            for cycle in (1, 2, 3)
            for identity in _OF_A_STROKE
        ]
        sets.append(_made(case, [*_figures(case), *rows, run_verdict("fail", "one is not met")]))
    return sets


def _of_the_test() -> list[StandardSet]:
    """Return tests of which one condition is broken, or cannot be shown."""
    sets = []
    broken: list[tuple[Case, str, list[int | None], Sequence[int]]] = [
        (
            replace(_GOOD, name="too-warm", title="Made at 27 °C", temperature_C=27.0),
            "temperature-range",
            [1, 2, 3],
            (1, 2, 3),
        ),
        (
            replace(
                _GOOD, name="too-fast", title="Made at 70 mm/s", test=Test(speed_mm_per_s=70.0, rate_Hz=100.0)
            ),
            "speed-limit",
            [1, 2, 3],
            (1, 2, 3),
        ),
        (
            replace(
                _GOOD,
                name="pause-too-long",
                title="Pauses of 11 min, logged every 10 s",
                test=Test(pause_s=660.0, pause_rate_Hz=0.1),
            ),
            "pause-limit",
            [2, 3],
            (2, 3),
        ),
        (
            replace(
                _GOOD,
                name="fresh-from-assembly",
                title="Made 24 h after assembly",
                facts={"assembled": "2026-01-14T08:00:00Z"},
            ),
            "rest-after-assembly",
            [None],
            (1, 2, 3),
        ),
        (
            replace(_GOOD, name="dwell-at-the-top", title="Dwells 3 s at the top", test=Test(dwell_s=3.0)),
            "immediate-unloading",
            [1, 2, 3],
            (1, 2, 3),
        ),
        (
            replace(_GOOD, name="not-released", title="Returns to 4 mm only", test=Test(residual_mm=4.0)),
            "full-release",
            [2, 3],
            (2, 3),
        ),
        (
            replace(
                _GOOD,
                name="two-strokes",
                title="Two strokes only",
                test=Test(tops_mm=(103.0,) * 2, ratios=(0.55, 0.46)),
            ),
            "cycle-count",
            [None],
            (1, 2),
        ),
    ]
    for case, condition, where, governed in broken:
        rows = [verdict(condition, cycle, "fail", "put in") for cycle in where]
        rows += _all("invalid", governed)
        about = "The condition is broken: what it governs is invalid, whatever the figures."
        sets.append(
            _made(replace(case, about=about), [*rows, run_verdict("invalid", "a condition is broken")])
        )
    unknown: list[tuple[Case, str, list[int | None]]] = [
        (
            replace(_GOOD, name="no-thermometer", title="No temperature on record", temperature_C=None),
            "temperature-range",
            [1, 2, 3],
        ),
        (
            replace(
                _GOOD, name="assembly-unknown", title="Date of assembly not stated", facts={"assembled": None}
            ),
            "rest-after-assembly",
            [None],
        ),
    ]
    for case, condition, where in unknown:
        rows = [verdict(condition, cycle, "inconclusive", "not on record") for cycle in where]
        about = "The record cannot show a condition: neither pass nor fail."
        made = _made(
            replace(case, about=about),
            [*rows, *_all("inconclusive"), run_verdict("inconclusive", "a condition is not shown")],
        )
        specimen = {key: value for key, value in made.specimen.items() if value is not None}
        sets.append(replace(made, specimen=specimen))
    return [*sets, _short(), _guarded("pass"), _guarded("fail")]


def _short() -> StandardSet:
    """Return a test that ends at 80 mm, as a stand without the force for more does."""
    case = replace(
        _GOOD,
        name="short-of-full-stroke",
        title="Ends at 80 mm",
        about="A window that was not reached is not tested; the ratio of a short loop is not the standard's.",
        test=Test(tops_mm=(80.0,) * 3),
    )
    rows = []
    for cycle in (1, 2, 3):
        rows += [
            verdict("full-stroke", cycle, "inconclusive", "80 of 100 mm"),
            verdict("force-at-25mm", cycle, "pass", "F_l there"),
            verdict("force-at-60mm", cycle, "pass", "F_l there"),
            verdict("force-at-100mm", cycle, "not-tested", "not reached"),
            verdict("absorbed-energy-ratio", cycle, "inconclusive", "short of full stroke"),
            verdict("stored-energy", cycle, "inconclusive", "not met yet at the stroke reached"),
        ]
    return _made(case, [*_figures(case), *rows, run_verdict("inconclusive", "short of full stroke")])


def _guarded(side: str) -> StandardSet:
    """Return a third ratio close to its limit of 0.42: conditional by the guard band."""
    ratio = 0.423 if side == "pass" else 0.417
    mapping = (
        'name = "stated accuracies"\n\n[columns.force]\nheader = "force"\nunit = "kN"\n'
        "uncertainty = { accuracy_percent = 0.5, reversibility_percent = 1.5, zero = 0.3, "
        "u_delay_s = 0.0001 }\n\n"
        '[columns.stroke]\nheader = "stroke"\nunit = "mm"\n'
        "uncertainty = { accuracy_percent = 0.05, linearity = 0.1, zero = 0.1, u_delay_s = 0.0001 }\n\n"
        '[columns.temperature]\nheader = "temperature"\nunit = "°C"\n'
    )
    case = replace(
        _GOOD,
        name=f"guard-band-conditional-{side}",
        title=f"Third ratio {ratio}, judged by the guard band",
        about="The ratio is closer to its limit of 0.42 than its expanded uncertainty.",
        test=Test(ratios=(0.55, 0.46, ratio)),
    )
    rows = [
        verdict("absorbed-energy-ratio", 1, "pass", "0.55 of 0.50"),
        verdict("absorbed-energy-ratio", 2, "pass", "0.46 of 0.42"),
        verdict("absorbed-energy-ratio", 3, f"conditional-{side}", f"{ratio} of 0.42, U about 0.007"),
    ]
    return _made(case, [*_figures(case), *rows], mapping=mapping, options={"decision_rule": "guard-band"})


def _of_the_record() -> list[StandardSet]:
    """Return good tests with faults of the record: samples lost, readings that are none."""
    columns = _columns(_GOOD)
    time_s = columns[0][1]
    top = 2.0 + whole(103.0 / 20.0, 40.0)  # when the first stroke turns

    def without(lost: Any) -> list[tuple[str, FloatArray, int]]:
        return [(name, values[~lost], decimals) for name, values, decimals in columns]

    one = np.abs(time_s - (top - 2.0)) < 1e-6
    many = np.abs(time_s - top) < 0.5
    pause = (time_s > top + 5.5) & (time_s < top + 8.5)
    warm = columns[3][1].copy()
    warm[np.searchsorted(time_s, top + 1.0)] = 85.0
    sparse = np.where(np.arange(time_s.size) % 40 == 0, columns[3][1], np.nan)
    slow = replace(_GOOD, test=Test(speed_mm_per_s=2.0, rate_Hz=8.0))
    slow_columns = _columns(slow)
    slow_time = slow_columns[0][1]
    strokes = [2.0, 2.0 + 107.0, 2.0 + 214.0]
    known = np.any([(slow_time >= begin) & (slow_time < begin + 1.0) for begin in strokes], axis=0)
    holes = np.where(known, slow_columns[3][1], np.nan)
    good = [*_figures(_GOOD), *_all("pass"), run_verdict("pass", "nothing of it is changed")]
    late = [*_all("pass", (2, 3))]
    return [
        _made(
            replace(
                _GOOD,
                name="one-sample-lost",
                title="One sample lost in the first stroke",
                about="Bridged: what it could change is far below what counts.",
            ),
            good,
            without(one),
        ),
        _made(
            replace(
                _GOOD,
                name="first-turn-lost",
                title="One second lost about the first upper turn",
                about="Stroke 1 is not evaluated; the second and third keep their numbers and limits.",
            ),
            [
                verdict("absorbed-energy-ratio", 1, "inconclusive", "not evaluated"),
                *late,
                run_verdict("inconclusive", "stroke 1 is not evaluated"),
            ],
            without(many),
        ),
        _made(
            replace(
                _GOOD,
                name="pause-not-logged",
                title="Three seconds of the pause not logged",
                about="Rest is rest, logged or not.",
            ),
            good,
            without(pause),
        ),
        _made(
            replace(
                _GOOD,
                name="sensor-85-degrees",
                title="One reading of 85.0 °C, the power-on value of a DS18B20",
                about="A fault of the sensor, and no temperature.",
            ),
            good,
            [*columns[:3], ("temperature [°C]", warm, 1)],
        ),
        _made(
            replace(
                _GOOD,
                name="temperature-every-second",
                title="Temperature once a second, blanks between",
                about="Readings of a slower channel; they cover every stroke.",
            ),
            good,
            [*columns[:3], ("temperature [°C]", sparse, 1)],
        ),
        _made(
            replace(
                slow,
                name="temperature-with-holes",
                title="Temperature in the first second of each stroke only",
                about="Strokes of 103 s; the rest of each is not covered.",
            ),
            [
                *[verdict("temperature-range", cycle, "inconclusive", "not covered") for cycle in (1, 2, 3)],
                *_all("inconclusive"),
                run_verdict("inconclusive", "a condition is not shown"),
            ],
            [*slow_columns[:3], ("temperature [°C]", holes, 1)],
        ),
    ]
