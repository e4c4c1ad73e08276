"""Entries of the document for skew, draw wires, inertia, and for several runs together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from bufferstand.evaluation.across_runs import compare_temperatures
from bufferstand.evaluation.facts import EvidenceEntry, ImpactEntry, RunEvaluation, TemperatureComparisonEntry


def evidence_entry(run: RunEvaluation) -> EvidenceEntry:
    """Return ``skew_sensitivity``, ``draw_wires`` and ``inertia_correction`` of a run.

    Each is None where it does not concern the run: it was not evaluated, or has no two draw wires. What is
    wrong with the draw wires is among the run's warnings.
    """
    wires = plain(run.draw_wires)
    if wires is not None:
        del wires["warnings"]
    return {
        "skew_sensitivity": plain(run.skew_sensitivity),
        "draw_wires": wires,
        "inertia_correction": plain(run.inertia_correction),
        "impact": _impact(run),
        "first_contact": None if run.first_contact is None else run.first_contact.entry(),
    }


def _impact(run: RunEvaluation) -> ImpactEntry | None:
    """Return speed and mass as stated, and the greatest force on record; None of any other kind of run."""
    if run.facts.kind != "impact":
        return None
    greatest = run.extremes.get("force_max_kN")
    return {
        "speed_km_h": run.facts.impact_speed_km_h,
        "mass_t": run.facts.impact_mass_t,
        "force_max_kN": None if greatest is None else greatest.value,
    }


def skew_effect(run: RunEvaluation) -> dict[str, Any]:
    """Return what 1 ms of skew changes in a run: in units, and as a share of the run's own figures.

    Of a run with several steps each has its own: :func:`bufferstand.evaluation.run.steps.points_of`.

    The share is None where it would be more than 1: of an elastic reference, which has nothing to lose.
    """
    values = run.summary.values
    entry = {
        "run": run.facts.id,
        "path": run.facts.path,
        "frequency_Hz": values["frequency_Hz"].value,
        **(plain(run.skew_sensitivity) or {}),
    }
    for name, key in (("absorbed_energy_J", "absorbed_energy"), ("damping", "damping")):
        changed, own = entry[f"{name}_per_ms"]["by_shifting"], values[name].value
        entry[f"{key}_share_per_ms"] = _share(changed, own)
    return entry


def _share(changed: float | None, own: float | None) -> float | None:
    if changed is None or not own or abs(changed) > abs(own):
        return None
    return changed / abs(own)


def comparison_entries(runs: Sequence[RunEvaluation]) -> list[TemperatureComparisonEntry]:
    """Return ``temperature_comparisons`` of the runs."""
    return [plain(comparison) for comparison in compare_temperatures(runs)]


def plain(facts: Any) -> Any:
    """Return a dataclass as what JSON holds: dictionaries and lists; None stays None."""
    if facts is None:
        return None
    return _listed(asdict(facts))


def _listed(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _listed(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_listed(inner) for inner in value]
    return value
