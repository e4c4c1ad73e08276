"""Plausibility of each channel and of the set of cycles: what on record no specimen and no motion make.

Each detector is a pure function from a :class:`Look` to findings, in a module of its own;
:data:`DETECTORS` lists them.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace

from evaluation.plausibility.channels import Channels
from evaluation.plausibility.clipped import clipped
from evaluation.plausibility.codes import codes
from evaluation.plausibility.finding import Effect, Finding, FindingKind, spoiled_cycles
from evaluation.plausibility.frozen import frozen
from evaluation.plausibility.held import held
from evaluation.plausibility.jumps import jumps, jumps_in_metres, jumps_in_newtons, stroke_jumps
from evaluation.plausibility.look import Look
from evaluation.plausibility.reads import Spoiled, doubted, summary_without_claims, without_claims
from evaluation.plausibility.samples import Samples
from evaluation.plausibility.scale import implausible_units
from evaluation.plausibility.signs import turned_signs
from evaluation.plausibility.spikes import spikes
from evaluation.plausibility.unlike import unlike_cycles

__all__ = [
    "DETECTORS",
    "Channels",
    "Effect",
    "Finding",
    "FindingKind",
    "Look",
    "Samples",
    "Spoiled",
    "doubted",
    "look_for_implausible",
    "spoiled_cycles",
    "summary_without_claims",
    "without_claims",
]

Detector = Callable[[Look], list[Finding]]
DETECTORS: tuple[Detector, ...] = (
    codes,
    clipped,
    held,
    frozen,
    spikes,
    implausible_units,
    turned_signs,
    jumps,
    unlike_cycles,
)
"""Every detector, in the order in which their findings are told."""
_WRONG = (("sign", "force"), ("sign", "stroke"), ("unit", "stroke"), ("unit", "force"))
_RIGHT_SCALE: Mapping[Detector, Mapping[tuple[str, str], Detector]] = {
    jumps: dict(zip(_WRONG, (stroke_jumps, stroke_jumps, jumps_in_metres, jumps_in_newtons), strict=True)),
    unlike_cycles: {},
}
"""These hold the force against the stroke: of another unit or sign they would find what is none. What of them
is left by each (kind and quantity of its finding)."""
_LEAST_SAMPLES = 8


def look_for_implausible(look: Look) -> tuple[Finding, ...]:
    """Return everything that speaks against a run, in the order of the detectors and of time.

    Parameters
    ----------
    look : Look

    Returns
    -------
    tuple of Finding
        What is wrong with a draw wire that is not used is noted only.
    """
    if look.samples.time_s.size < _LEAST_SAMPLES:
        return ()
    found: list[Finding] = []
    for detector in DETECTORS:
        own = _fit_for(detector, {(finding.kind, finding.quantity) for finding in found})
        if own is not None:
            found += sorted(own(look), key=lambda finding: finding.start_s)
    return tuple(replace(f, effect="noted") if f.channel in look.out else f for f in found)


def _fit_for(detector: Detector, found: Collection[tuple[str, str]]) -> Detector | None:
    """Return what of a detector is looked for beside what was found; None: nothing."""
    instead = _RIGHT_SCALE.get(detector)
    if instead is None:
        return detector
    return next((instead.get(wrong) for wrong in _WRONG if wrong in found), detector)
