"""Whether the document names each fault of the record, and nothing that is no fault.

A fault is named by a plausibility finding of a fitting kind and channel whose time overlaps the fault's, or
by a warning that says in one clause what is wrong and with what. It need not be named where its effect is
shown to be within U (the brief): where figures that it falsifies are there, and all of them are right. One
that nothing on record tells from what a sound specimen does is counted apart (``indistinct.py``).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np

from .applied import Applied
from .chain import Scene
from .indistinct import is_indistinct
from .judgement import Judgement

# Words of a fault in a warning, and the imperfections that may make one say so.
JUMPS = {"gain-jump", "offset-jump", "stroke-slip", "spikes", "sentinel", "frozen", "clock-set-back"}
JUMPS |= {"force-late-beyond"}  # still falling, or falling already, while the stroke rests
UNITS = {"unit-N-as-kN", "unit-lbf-as-kN", "unit-m-as-mm", "unit-in-as-mm", "times-ten"}
SIGNS = {"sign-force", "sign-stroke", "force-late-beyond", "force-zero-off", "zero-off", "sentinel", *JUMPS}
HOLES = {"lost-single", "lost-burst", "lost-turn", "lost-branch", "lost-stroke", "lost-pause"}
SLOWER = {"rate-change", "rate-change-moving", "stops-at-rest", "event-log", "few-samples"}
BLANKS = {"nan-cells", "nan-burst", "sentinel", "blanks", "interleaved"}
STAMPS = {"backward", "clock-set-back", "doubled", "rounded-stamps", "jitter"}
ALARMS: dict[str, tuple[str, set[str]]] = {
    "clip": (r"clip|saturat", {"clipped-force", "clipped-stroke", "frozen", "spikes", "sentinel", *UNITS}),
    "held": (
        r"fr[eo]ze|\bstuck|same value|\bheld (at|for|over)",
        {"held", "frozen", "clipped-force", "clipped-stroke"},
    ),
    "jump": (r"\bjump|\bslip(s|ped)\b", JUMPS | {"drift-beyond", "clipped-stroke", "clipped-force"}),
    "drift": (r"\bdrift", {"drift-beyond", "force-zero-off", *JUMPS}),
    "unit": (r"wrong unit|implausib|not plausible", UNITS | {"sentinel"}),
    "sign": (r"mostly negative|turned sign|negative (absorbed|energy)", SIGNS | UNITS | {"drift-beyond"}),
    "sensor": (r"power-on|disconnect|sensor fault", {"temperature-85", "temperature-127"}),
    "lost": (
        r"\bgaps?\b|samples? (is |are )?(missing|lost)|lost samples?",
        HOLES | BLANKS | STAMPS | SLOWER | {"temperature-hole", "temperature-first-second"},
    ),
    "alone": (r"spike|outlier|stands? alone", JUMPS | {"temperature-85", "temperature-127"}),
}
# "cycles that do not belong": what two strokes may differ by before a finding that says so has a cause
UNLIKE = {
    "stroke_max_mm": 0.02,
    "stroke_min_mm": 0.02,
    "speed_loading_max_mm_per_s": 0.15,
    "stored_energy_J": 0.02,
}

Clock = Callable[[float], float]


def hold_names(j: Judgement, scene: Scene, run: dict[str, Any], at_import: list[str], back: Clock) -> None:
    """Note faults without a name and names without a fault; `back` brings stamps to true times."""
    warnings = list(at_import) + [str(w) for w in run["warnings"]]
    findings = list(run.get("plausibility") or [])
    slack = 0.5 * _cycle_s(scene)  # a jump shows where a cycle that has it is compared with one that has not
    times = [(s - slack, e + slack) for s, e in (_times(f, scene, back) for f in findings)]
    named = [is_named(a, warnings, findings, times) for a in scene.applied]
    for a, known in zip(scene.applied, named, strict=True):
        if not known and (a.kinds or a.words) and a.figures != "hidden":
            _unnamed(j, scene, a, named)
    for f, (start, end) in zip(findings, times, strict=True):
        if not any(a.fits(f, start, end, may=True) for a in scene.applied) and not _differs(scene, f):
            j.say("false alarm", f"{f.get('kind')} of {f.get('channel')}", str(f.get("text"))[:200])
    words = "\n".join(warnings)
    applied = {a.name for a in scene.applied}
    for name, (pattern, causes) in ALARMS.items():
        hit = re.search(f".{{0,80}}(?:{pattern}).{{0,80}}", words, re.IGNORECASE)
        if hit and not applied & causes:
            j.say("false alarm", f"the word {name}", hit.group(0))


def is_named(
    a: Applied, warnings: list[str], findings: list[dict[str, Any]], times: list[tuple[float, float]]
) -> bool:
    """Return whether a finding or a warning names this fault."""
    found = any(a.fits(f, start, end) for f, (start, end) in zip(findings, times, strict=True))
    return found or a.said_in(warnings)


def _cycle_s(scene: Scene) -> float:
    whole = [c.end_s - c.start_s for c in scene.cycles if c.whole]
    return float(np.median(whole)) if whole else float(np.ptp(scene.true_time_s))


def _times(finding: dict[str, Any], scene: Scene, back: Clock) -> tuple[float, float]:
    start, end = finding.get("start_s"), finding.get("end_s")
    first, last = float(scene.true_time_s.min()), float(scene.true_time_s.max())
    return (first if start is None else back(start), last if end is None else back(end))


def _unnamed(j: Judgement, scene: Scene, a: Applied, named: list[bool]) -> None:
    """Note a fault that is not named, unless its effect is shown to be within U."""
    wrong = [o for o in j.off if a.touches(o[0]) and a.overlaps(o[1], o[2])]
    if a.figures == "within":  # gaps, blanks, stamps (import.md, evaluation/samples.md)
        j.say("unnamed", a.name, a.size)
        return
    others = [
        b
        for b, known in zip(scene.applied, named, strict=True)
        if b is not a and (known or b.figures == "hidden")
    ]
    own = [o for o in wrong if not any(b.touches(o[0]) and b.overlaps(o[1], o[2]) for b in others)]
    if is_indistinct(scene, a):
        j.say("not distinguishable", a.name, a.size)
    elif own or (wrong and a.plain):
        j.say("unnamed", a.name, f"{a.size}: {(own or wrong)[0][3]}")
    elif a.plain and not any(a.touches(n) and a.overlaps(s, e) for n, s, e in j.held):
        j.say("unnamed", a.name, f"{a.size}: no figure shows that its effect is within U")
    else:
        j.say("quiet", a.name, a.size)


def _differs(scene: Scene, finding: dict[str, Any]) -> bool:
    """Return whether the record's own strokes differ, so that `unlike` has a cause in the truth."""
    if finding.get("kind") != "unlike":
        return False
    if any(not c.closes for c in scene.cycles):
        return True
    for name, share in UNLIKE.items():
        values = [c.figures[name][0] for c in scene.cycles if name in c.figures]
        span = scene.span_mm if name.endswith("_mm") else max(map(abs, values), default=1.0)
        if values and max(values) - min(values) > share * span:
            return True
    return False
