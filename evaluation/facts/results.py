"""Results of an evaluation as frozen facts: what a report, a table and the JSON document are made from.

Names are those of docs/evaluation-document.md. A value that cannot be had is None.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from bufferstand.evaluation.catalogue import QUANTITIES
from bufferstand.evaluation.facts.budget import Budget
from bufferstand.evaluation.facts.cycle import Cycle
from bufferstand.evaluation.facts.document_types import Basis, Verdict
from bufferstand.evaluation.facts.draw_wires import DrawWires
from bufferstand.evaluation.facts.finding import Finding
from bufferstand.evaluation.facts.first_contact import FirstContact
from bufferstand.evaluation.facts.history import RunHistory
from bufferstand.evaluation.facts.mean_loop import MeanLoop
from bufferstand.evaluation.facts.moving_mass import InertiaCorrection
from bufferstand.evaluation.facts.run_facts import RunFacts
from bufferstand.evaluation.facts.shared_errors import SharedErrors
from bufferstand.evaluation.facts.skew_sensitivity import SkewSensitivity
from bufferstand.evaluation.record import Record

if TYPE_CHECKING:

    class Quantities(tuple[float | None, ...]):
        """The figures of one cycle by the names of the catalogue; None where one is missing."""

        _fields: tuple[str, ...]

        def __init__(self, *values: float | None, **named: float | None) -> None: ...
        def __getattr__(self, name: str) -> float | None: ...
        def _asdict(self) -> dict[str, float | None]: ...
        def _replace(self, **named: float | None) -> Quantities: ...

else:
    Quantities = namedtuple("Quantities", QUANTITIES.names, defaults=(None,) * len(QUANTITIES))


_NOTHING: Mapping[str, Any] = {}


class CycleResult(NamedTuple):
    """A cycle with its figures; ``warnings`` concern this cycle."""

    cycle: Cycle
    quantities: Quantities
    expanded_uncertainty: Mapping[str, float | None] = _NOTHING
    """U = 2u by name of quantity, where it could be propagated."""
    warnings: tuple[str, ...] = ()
    gap_limits: Mapping[str, float] = _NOTHING
    """By how much what is not on record may change a figure (limits, part of U), with their signs."""
    missing: Mapping[str, str] = _NOTHING
    """Why a figure is missing, by its name; why one has no uncertainty, by ``U(name)``."""


@dataclass(frozen=True)
class Measured:
    """A value with its expanded uncertainty U = k u (coverage factor k = 2)."""

    value: float | None
    expanded_uncertainty: float | None = None
    coverage_factor: float = 2.0
    half_width_95: float | None = None
    """Half-width of the 95 % coverage interval of the Monte Carlo propagation (JCGM 101)."""
    scatter_u: float = 0.0
    """Standard uncertainty of the mean by what its cycles scatter beyond their noise; part of the above."""
    missing: str = ""
    """Why there is no value; empty where there is one."""


EXTREME_NAMES = (
    "force_min_kN",
    "force_max_kN",
    "stroke_min_mm",
    "stroke_max_mm",
    "speed_max_mm_per_s",
    "speed_loading_max_mm_per_s",
    "speed_unloading_max_mm_per_s",
    "temperature_min_C",
    "temperature_max_C",
)
"""Every extreme of a run, by its name in the document."""


@dataclass(frozen=True)
class Extreme:
    """The least or greatest value of a quantity over all samples of a run.

    Attributes
    ----------
    value : float or None
        None where the record has no such channel.
    time_s : float or None
        When, from the run's start.
    expanded_uncertainty, half_width_95 : float or None
        U = 2 u, and the half-width of the 95 % coverage interval.
    channel : str
        Where it was read: ``force``, ``stroke``, ``speed``, or a temperature channel. A speed of ``stroke``
        is its derivative.
    cycle : int or None
        In which cycle; None outside of all.
    doubt : str
        Why it may be no value of the specimen; empty where nothing speaks against it.
    """

    value: float | None = None
    time_s: float | None = None
    expanded_uncertainty: float | None = None
    half_width_95: float | None = None
    channel: str = ""
    cycle: int | None = None
    doubt: str = ""
    coverage_factor: float = 2.0


@dataclass(frozen=True)
class Summary:
    """Means over the cycles used; ``values`` by name of quantity."""

    cycles_used: tuple[int, ...]
    values: Mapping[str, Measured]


@dataclass(frozen=True, eq=False)
class StepResult:
    """A step of a run that has several: cycles that belong together, and what stands for them.

    ``cycles`` are all complete ones of the step, ``summary.cycles_used`` those that it is the mean of;
    ``start_s`` and ``end_s`` are the ends of the first and the last of them [s].
    """

    index: int
    start_s: float
    end_s: float
    cycles: tuple[int, ...]
    summary: Summary
    budget: tuple[Budget, ...] = ()
    skew_sensitivity: SkewSensitivity | None = None
    mean_loop: MeanLoop | None = None
    shared_errors: SharedErrors | None = None
    extremes: Mapping[str, Extreme] = field(default_factory=dict)
    """Of all samples from ``start_s`` to ``end_s``."""
    unfit: bool = False
    """As that of a run."""


@dataclass(frozen=True)
class RequirementResult:
    """One requirement or condition judged (docs/evaluation-document.md).

    ``cycle`` is None where it concerns the run.
    """

    standard: str
    edition: str | None
    id: str
    cycle: int | None
    requirement: str
    measured: float | None
    expanded_uncertainty: float | None
    lower_limit: float | None
    upper_limit: float | None
    unit: str
    conformance_probability: float | None
    verdict: Verdict
    why: str
    condition: bool = False
    """True for a condition of the test, False for a requirement on the specimen."""
    clause: str | None = None
    """Of the standard's own text; None where the text was not at hand."""
    source: str = ""
    """Where limits and wording were taken from."""
    stroke_mm: float | None = None
    """Where a force window stands, by the limit set [mm]; 0: the preload. None for all other rows."""
    shared: tuple[float, ...] = ()
    """What ``measured`` owes to each error of the channels (:mod:`bufferstand.evaluation.across_runs`), where
    known."""


@dataclass(frozen=True, eq=False)
class RunEvaluation:
    """Everything that was found in one run; ``record`` and each result's ``cycle`` give back the loops."""

    facts: RunFacts
    record: Record
    cycles: tuple[CycleResult, ...]
    summary: Summary
    requirements: tuple[RequirementResult, ...]
    verdict: Verdict | None
    warnings: tuple[str, ...]
    limit_set: Mapping[str, Any] | None = None
    """Identity of the limits applied: id, standard, edition, clause, date, source, sha256, readings."""
    inspection: Mapping[str, Any] | None = None
    """What the inspector wrote down, whole and with its hash; None where no requirement asked for it."""
    budget: tuple[Budget, ...] = ()
    """Linear uncertainty budgets of the main results; empty where the channels state no accuracy."""
    skew_sensitivity: SkewSensitivity | None = None
    draw_wires: DrawWires | None = None
    """None where the record has no two wires."""
    inertia_correction: InertiaCorrection | None = None
    first_contact: FirstContact | None = None
    """None of any run but a static one."""
    mean_loop: MeanLoop | None = None
    """The loop that stands for the run, for comparisons; None where no cycle is complete."""
    shared_errors: SharedErrors | None = None
    """What the means owe to errors that other runs have, too; None where nothing was propagated."""
    steps: tuple[StepResult, ...] = ()
    """Of a run with several steps each one; ``summary`` is without values then. Empty for all other runs."""
    extremes: Mapping[str, Extreme] = field(default_factory=dict)
    """Least and greatest of all samples, by name; ``summary`` has means over cycles."""
    preload: Measured | None = None
    """Mean of the preloads that were judged cycle by cycle [kN]; None where none was."""
    history: RunHistory | None = None
    """Holds, residual strokes, settling and cumulated energy."""
    findings: tuple[Finding, ...] = ()
    """What on record no specimen and no motion make (:mod:`bufferstand.evaluation.plausibility`)."""
    notes: tuple[str, ...] = ()
    """Those of ``warnings`` that nobody needs to act on: what was planned, or stands with a requirement."""
    unfit: bool = False
    """Whether its means are of spoiled cycles: they are kept out of trends and comparisons. A run of several
    steps is unfit if all of them are; one without means if all its complete cycles are spoiled."""


@dataclass(frozen=True)
class Expanded:
    """Expanded uncertainty U = k u with its coverage factor k."""

    uncertainty: float
    coverage_factor: float


@dataclass(frozen=True)
class Trend:
    """A quantity over frequency at constant prestress and amplitude: value = intercept + slope_per_Hz · f.

    ``amplitude_mm`` is None when it varies among the runs (confounded; ``warnings`` says so). The band is the
    half-width of the 95 % confidence band of the line at each point. ``shared`` says on what it rests that
    the runs have errors in common; None where a run states no uncertainty: slope and band have the scatter
    of the points only then, from three points on, and are None below.
    """

    quantity: str
    prestress_mm: float
    amplitude_mm: float | None
    runs: tuple[str, ...]
    frequency_Hz: tuple[float, ...]
    values: tuple[float, ...]
    expanded_uncertainty: tuple[float | None, ...]
    temperature_C: tuple[float | None, ...]
    slope_per_Hz: float | None
    intercept: float | None
    slope_u_per_Hz: float | None
    intercept_u: float | None
    band: tuple[float | None, ...]
    warnings: tuple[str, ...] = ()
    slope_half_width_95_per_Hz: float | None = None
    intercept_half_width_95: float | None = None
    slope_expanded: Expanded | None = None
    """U of the slope: k is 2, or more where the scatter of a few points has to say how wide it is."""
    intercept_expanded: Expanded | None = None
    band_expanded: tuple[float | None, ...] = ()
    """U of the line at each point."""
    scatter_u: float | None = None
    """Standard deviation of the points about the line beyond their stated uncertainties."""
    shared: Basis | None = None
