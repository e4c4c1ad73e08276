"""Plausibility of each channel and of the set of cycles: what on record no specimen and no motion make.

Each detector is a pure function from a :class:`RunView` to findings, in a module of its own;
:data:`DETECTORS` lists them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

from bufferstand.evaluation.facts import Finding
from bufferstand.evaluation.plausibility.cycle_outliers import unlike_cycles
from bufferstand.evaluation.plausibility.invalid_samples import codes, spike_rows, spikes
from bufferstand.evaluation.plausibility.jumps import (
    jumps,
    jumps_in_metres,
    jumps_in_newtons,
    jumps_of_turned_stroke,
)
from bufferstand.evaluation.plausibility.run_view import RunView
from bufferstand.evaluation.plausibility.stuck_channels import clipped, frozen, held
from bufferstand.evaluation.plausibility.units_and_signs import force_falls, implausible_units, turned_signs

Detector = Callable[[RunView], list[Finding]]
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
_DOUBTED: Mapping[tuple[str, str], Detector] = {
    ("sign", "stroke"): jumps_of_turned_stroke,
    ("sign", "force"): jumps_in_metres,
    ("unit", "stroke"): jumps_in_metres,
    ("unit", "force"): jumps_in_newtons,
}
"""What is looked for instead of :func:`jumps` beside such a finding (kind and quantity): that one holds the
force against the stroke, and of another unit or sign would find what is none."""
_LEAST_SAMPLES = 8


def look_for_implausible(look: RunView) -> tuple[Finding, ...]:
    """Return everything that speaks against a run, in the order of the detectors and of time.

    Parameters
    ----------
    look : Look

    Returns
    -------
    tuple of Finding
        What is wrong with a draw wire that is not used is noted only.
    """
    if look.samples.time_s.size < _LEAST_SAMPLES:  # what no stand makes shows in a single one
        return tuple(implausible_units(look)) if look.samples.time_s.size else ()
    found: list[Finding] = []
    for detector in DETECTORS:
        wrong = {(finding.kind, finding.quantity) for finding in found}
        if detector is unlike_cycles and any(kind in ("unit", "sign") for kind, _ in wrong):
            continue
        own = detector
        seen = look
        if detector is jumps:
            own = next((instead for what, instead in _DOUBTED.items() if what in wrong), jumps)
            seen = _as_it_moves(look, found)
        found += sorted(own(seen), key=lambda finding: finding.start_s)
        if detector is clipped and (cut := _clipped_cycles(found)):
            look = replace(look, given=look.seen, clipped=cut)
        if detector is turned_signs and any(one.kind == "sign" for one in found) and force_falls(look):
            look = look.with_force_turned()
    return tuple(replace(f, effect="noted") if f.channel in look.out else f for f in found)


def _as_it_moves(look: RunView, found: Sequence[Finding]) -> RunView:
    """Return a run without the steps that held samples make and the spikes of the stroke.

    A slip is told from the next largest leaps, which a spike must not be. With it comes what is known of a
    frozen channel.
    """
    if any(one.kind == "spike" and one.quantity == "stroke" for one in found):
        look = look.without_spikes({one.name: spike_rows(look.seen, one) for one in look.strokes})
    stood = [one for one in found if one.kind == "frozen" and one.quantity == "stroke"]
    if stood:
        look = replace(look, given=look.seen, frozen_s=tuple((one.start_s, one.end_s) for one in stood))
    if still := {
        number for one in found if (one.kind, one.quantity) == ("frozen", "force") for number in one.cycles
    }:
        look = replace(look, stood=frozenset(still))
    repeating = {one.channel for one in found if one.kind == "held"}
    return look.without_repeats(repeating) if repeating else look


def _clipped_cycles(found: Iterable[Finding]) -> dict[str, frozenset[int]]:
    """Return the cycles in which a quantity is clipped, by its name."""
    known: dict[str, frozenset[int]] = {}
    for one in found:
        if one.kind == "clipped":
            known[one.quantity] = known.get(one.quantity, frozenset()) | set(one.cycles)
    return known
