"""The evaluation document as types: what the evaluation writes, and report, comparison and archive read.

The document is plain JSON (docs/evaluation-document.md); these types give its keys, so that the type
checker follows one from where it is written to where it is read, and its JSON Schema (``bufferstand schema
evaluation``) is made from them. A figure that cannot be had is None.
"""

from __future__ import annotations

from typing import Any, Literal, NotRequired

from typing_extensions import TypedDict  # pydantic reads those of Python 3.12 and later only

from bufferstand.evaluation.facts.quantity_entries import (
    CycleEntry,
    NumberByQuantity,
    ReasonByQuantity,
    SummaryEntry,
)
from bufferstand.foundation import Kind, Purpose

Verdict = Literal[
    "pass", "conditional-pass", "conditional-fail", "fail", "inconclusive", "not-tested", "invalid"
]
Basis = Literal["certificate", "stand", "statement"]
"""On what it rests that runs have an error in common: the same certificate is on record; the same channel of
the same stand, which states the same; or nothing but that the records state the same."""
Effect = Literal["spoils", "noted"]
"""``spoils``: what is read there is no figure of the specimen. ``noted``: nothing hangs on it."""

FindingKind = Literal[
    "clipped",
    "held",
    "frozen",
    "spike",
    "stroke-jump",
    "gain-jump",
    "offset-jump",
    "drift",
    "unit",
    "sign",
    "zero",
    "unlike",
    "scale",
    "delay",
    "slip",
    "exchanged",
    "not-following",
    "detached",
    "swapped",
    "guard",
]


class SoftwareEntry(TypedDict):
    """What evaluated."""

    version: str
    code_sha256: NotRequired[str]
    python: NotRequired[str]
    libraries: NotRequired[dict[str, str]]


class ExtremeEntry(TypedDict):
    """A greatest or least value over all samples of a run."""

    value: float | None
    expanded_uncertainty: float | None
    coverage_factor: float
    half_width_95: float | None
    time_s: float | None
    channel: str
    cycle: int | None
    doubt: str


class BudgetSourceEntry(TypedDict):
    """One source of an uncertainty budget."""

    source: str
    unit: str
    value: float
    limit: float | None
    distribution: str
    standard_uncertainty: float
    sensitivity: float | None
    contribution: float
    degrees_of_freedom: float | None


class BudgetEntry(TypedDict):
    """The uncertainty budget of a quantity."""

    quantity: str
    unit: str
    value: float
    standard_uncertainty: float
    monte_carlo_standard_uncertainty: float | None
    degrees_of_freedom: float | None
    coverage_factor_95: float
    sources: list[BudgetSourceEntry]


class SharedSourceEntry(TypedDict):
    """An error that runs share, and the instrument that it comes from."""

    error: str
    instrument: str
    distribution: str
    share: float


class SharedErrorsEntry(TypedDict):
    """Errors that runs share: by quantity what each contributes [its unit]."""

    basis: Basis
    errors: list[str]
    sources: list[SharedSourceEntry]
    contributions: dict[str, list[float]]
    explained: dict[str, float]


class PerMsEntry(TypedDict):
    """What 1 ms of skew between force and stroke changes."""

    by_shifting: float | None
    closed_form: float | None


class SkewSensitivityEntry(TypedDict):
    """What skew between force and stroke changes in a run."""

    cycles: list[int]
    absorbed_energy_J_per_ms: PerMsEntry
    damping_per_ms: PerMsEntry
    form: str


class StepEntry(TypedDict):
    """A stretch of a record with one prestress, amplitude and frequency, where it has several."""

    index: int
    start_s: float
    end_s: float
    cycles: list[int]
    summary: SummaryEntry
    extremes: dict[str, ExtremeEntry]
    half_width_95: NumberByQuantity
    missing: ReasonByQuantity
    budget: list[BudgetEntry]
    skew_sensitivity: SkewSensitivityEntry | None
    shared_errors: SharedErrorsEntry | None


class RequirementEntry(TypedDict):
    """A requirement, or a condition of the test, and how the run stands to it."""

    standard: str
    edition: str | None
    clause: str | None
    source: str
    id: str
    cycle: int | None
    condition: bool
    requirement: str
    stroke_mm: float | None
    measured: float | None
    expanded_uncertainty: float | None
    lower_limit: float | None
    upper_limit: float | None
    unit: str
    conformance_probability: float | None
    verdict: Verdict
    why: str


class FindingEntry(TypedDict):
    """Something on record that no specimen and no motion make."""

    kind: FindingKind
    channel: str
    start_s: float
    end_s: float
    cycles: list[int]
    size: float | None
    unit: str
    text: str
    effect: Effect


class RunIdentityEntry(TypedDict):
    """Which run it is."""

    path: str
    id: str
    sha256: str | None
    kind: Kind
    specimen: dict[str, Any]
    purpose: Purpose | None
    simulated: bool | None
    zero: NotRequired[dict[str, Any]]


class PerDecadeEntry(TypedDict):
    """Change per decade of time while a stroke or force is held."""

    value: float
    expanded_uncertainty: float | None
    misfit: float


class HoldEntry(TypedDict):
    """A stroke or force held: relaxation and creep."""

    cycle: int
    kind: str
    start_s: float
    duration_s: float
    force_start_kN: float
    force_end_kN: float
    stroke_start_mm: float
    stroke_end_mm: float
    force_per_decade_kN: PerDecadeEntry
    stroke_per_decade_mm: PerDecadeEntry


class ResidualStrokeEntry(TypedDict):
    """What is left of the stroke when the force is zero again."""

    cycle: int
    residual_mm: float
    expanded_uncertainty: float
    pause_s: float
    recovered_mm: float


class SettlingEntry(TypedDict):
    """How a quantity settles from cycle to cycle."""

    quantity: str
    part: int | None
    first_cycle: int
    last_cycle: int
    first: float
    last: float
    relative_change: float | None
    expanded_uncertainty: float | None
    rate_per_cycle: float
    settled_at_cycle: int | None


class CumulatedEnergyEntry(TypedDict):
    """Energy that the specimen has absorbed in all cycles of the run [J]."""

    absorbed: float
    expanded_uncertainty: float | None
    cycles: int
    not_evaluated: list[int]


class WireOutEntry(TypedDict):
    """A draw wire that failed in the run."""

    wire: str
    from_s: float


class DrawWiresEntry(TypedDict):
    """How two draw wires agree."""

    largest_difference_mm: float
    at_s: float
    offset_mm: float | None
    scale_mismatch: float | None
    remaining_mm: float | None
    limit_mm: float | None
    out: list[WireOutEntry]


class InertiaEntry(TypedDict):
    """The correction of the force for the mass that moves with the cell."""

    moving_mass_kg: float
    source: str
    largest_force_kN: float
    accuracy_percent: float
    force_cell: str


class ImpactEntry(TypedDict):
    """Speed and mass of an impact as stated, and its greatest force."""

    speed_km_h: float | None
    mass_t: float | None
    force_max_kN: float | None


class FirstContactEntry(TypedDict):
    """Where the specimen is first touched."""

    stroke_mm: float | None
    expanded_uncertainty: float | None
    recorded_zero_offset_mm: float | None
    rest_force_kN: float | None
    stated_zero_mm: float
    beyond: bool
    how: str
    why: str


class HistoryEntry(TypedDict):
    """What the run says of the specimen over time."""

    holds: list[HoldEntry]
    residual_strokes: list[ResidualStrokeEntry]
    settling: list[SettlingEntry]
    cumulated_energy_J: CumulatedEnergyEntry | None


class EvidenceEntry(TypedDict):
    """How far the run's figures are to be believed."""

    skew_sensitivity: SkewSensitivityEntry | None
    draw_wires: DrawWiresEntry | None
    inertia_correction: InertiaEntry | None
    impact: ImpactEntry | None
    first_contact: FirstContactEntry | None


class RunEntry(HistoryEntry, EvidenceEntry):
    """A run and everything that is said of it."""

    run: RunIdentityEntry
    cycles: list[CycleEntry]
    summary: SummaryEntry | None
    steps: list[StepEntry]
    extremes: dict[str, ExtremeEntry]
    requirements: list[RequirementEntry]
    verdict: Verdict | None
    warnings: list[str]
    notes: list[str]
    plausibility: list[FindingEntry]
    limit_set: dict[str, Any] | None
    inspection: dict[str, Any] | None
    half_width_95: NumberByQuantity | None
    missing: ReasonByQuantity | None
    budget: list[BudgetEntry]
    shared_errors: SharedErrorsEntry | None
    purpose: NotRequired[Purpose | None]
    purpose_why: NotRequired[str]


class TrendEntry(TypedDict):
    """A quantity over frequency at one prestress and amplitude: points, line and its uncertainty."""

    quantity: str
    prestress_mm: float
    amplitude_mm: float | None
    runs: list[str]
    frequency_Hz: list[float]
    values: list[float]
    expanded_uncertainty: list[float | None]
    temperature_C: list[float | None]
    slope_per_Hz: float | None
    intercept: float | None
    slope_standard_uncertainty_per_Hz: float | None
    intercept_standard_uncertainty: float | None
    slope_half_width_95_per_Hz: float | None
    intercept_half_width_95: float | None
    slope_expanded_uncertainty_per_Hz: float | None
    slope_coverage_factor: float | None
    intercept_expanded_uncertainty: float | None
    intercept_coverage_factor: float | None
    confidence_band: list[float | None]
    line_expanded_uncertainty: list[float | None]
    scatter_standard_uncertainty: float | None
    shared_errors: Basis | None
    warnings: list[str]


class ThermalChangeEntry(TypedDict):
    """How a quantity differs between two temperatures."""

    reference: float | None
    value: float | None
    relative_change: float | None
    expanded_uncertainty: float | None
    relative_change_per_K: float | None
    expanded_uncertainty_per_K: float | None
    half_width_95: float | None


class RunAtTemperatureEntry(TypedDict):
    """A run with its temperature and how far it went."""

    run: str
    temperature_C: float
    end_stroke_mm: float
    end_force_kN: float
    damping: float | None


class WarmerRunEntry(RunAtTemperatureEntry):
    """A warmer run against the reference, over the strokes that both have."""

    from_mm: float
    to_mm: float
    changes: dict[str, ThermalChangeEntry]


class TemperatureComparisonEntry(TypedDict):
    """Runs of the same step at several temperatures."""

    specimen: str
    step: dict[str, float | str]
    reference: RunAtTemperatureEntry
    runs: list[WarmerRunEntry]
    warnings: list[str]


class CopyEntry(TypedDict):
    """A file that holds the recording of another one."""

    path: str
    of: str
    same: str


class StatementEntry(TypedDict):
    """On which runs a statement of conformity rests."""

    specimen: str | None
    campaign: str | None
    kind: Kind
    runs: list[str]
    characterisation: list[str]
    by: Literal["option", "campaign", "default"]
    why: str
    verdict: Verdict | None
    warnings: list[str]


class RunInTimeEntry(TypedDict):
    """A run of a step that a specimen went through more than once."""

    run: str
    path: str
    started: str | None
    temperature_C: float | None


class ChangeEntry(TypedDict):
    """What changed of a quantity between two runs, with the uncertainty of the difference."""

    before: float
    after: float
    change: float
    relative_change: float | None
    expanded_uncertainty: float | None
    coverage_factor: float
    half_width_95: float | None
    beyond: bool | None


class LaterRunEntry(RunInTimeEntry):
    """A later run, and what changed since the first."""

    changes: dict[str, ChangeEntry]


class BeforeAfterEntry(TypedDict):
    """A step that a specimen went through more than once: each later run against the first."""

    specimen: str
    kind: Kind
    before: RunInTimeEntry
    after: list[LaterRunEntry]
    warnings: list[str]


class ProofRunEntry(TypedDict):
    """A run with a proof load."""

    run: str
    path: str
    load_cycles: int
    verdict: Verdict | None


class ProofLoadEntry(TypedDict):
    """The complete load cycles of a proof load, over all runs of a specimen."""

    specimen: str
    proof_load: str
    load_cycles: int
    runs: list[ProofRunEntry]


class FailureEntry(TypedDict):
    """A file that could not be evaluated."""

    path: str
    problem: str


class PurposeEntry(TypedDict):
    """What a run is for, and who says so."""

    purpose: Purpose | None
    purpose_why: str


class TogetherEntry(TypedDict):
    """What runs say together."""

    trends: list[TrendEntry]
    temperature_comparisons: list[TemperatureComparisonEntry]
    before_after: list[BeforeAfterEntry]
    proof_load_totals: list[ProofLoadEntry]
    warnings: list[str]


class EvaluationDocument(TogetherEntry):
    """The evaluation of runs: one entry for each run, and what they say together."""

    schema: Literal["bufferstand/evaluation/1"]
    software: SoftwareEntry
    runs: list[RunEntry]
    copies: list[CopyEntry]
    conformity: list[StatementEntry]
    decision_rule: NotRequired[Literal["simple", "guard-band"]]
    settings: NotRequired[dict[str, Any]]
    failures: NotRequired[list[FailureEntry]]
