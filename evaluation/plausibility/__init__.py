"""Plausibility of each channel and of the set of cycles: what on record no specimen and no motion make.

Each detector is a pure function from a :class:`Look` to findings, in a module of its own;
:data:`DETECTORS` lists them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from evaluation.plausibility.channels import Channels
from evaluation.plausibility.clipped import clipped
from evaluation.plausibility.codes import codes
from evaluation.plausibility.finding import Effect, Finding, FindingKind, spoiled_cycles
from evaluation.plausibility.frozen import frozen
from evaluation.plausibility.held import held
from evaluation.plausibility.jumps import jumps, stroke_jumps
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
_RIGHT_SCALE = (jumps, unlike_cycles)
"""These hold the force against the stroke: of another unit or sign they would find what is none."""
_OF_ANY_SCALE: Mapping[Detector, Detector] = {jumps: stroke_jumps}
"""What of them holds a channel against nothing but itself."""
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
        own: Detector | None = detector
        if detector in _RIGHT_SCALE and any(finding.kind in ("unit", "sign") for finding in found):
            own = _OF_ANY_SCALE.get(detector)
        if own is not None:
            found += sorted(own(look), key=lambda finding: finding.start_s)
    return tuple(replace(f, effect="noted") if f.channel in look.out else f for f in found)
