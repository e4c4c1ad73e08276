"""Frozen facts that the steps of an evaluation hand on.

What is known of a run, cycles, results, findings, budgets. No computation.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.facts.budget import (
        Budget,
        BudgetLine,
        budget_entry,
    )
    from bufferstand.evaluation.facts.channel_identity import (
        Occasion,
        identity_of,
        weakest,
    )
    from bufferstand.evaluation.facts.choices import (
        DRAWS,
        REFERENCE_LOSS,
        DecisionRule,
        ForceCell,
        check_draws,
    )
    from bufferstand.evaluation.facts.cycle import (
        Cycle,
        CycleColumns,
        EndReading,
        ExtremeReading,
        Loop,
        TurnColumns,
        TurningPoint,
        TurnMethod,
    )
    from bufferstand.evaluation.facts.document_types import (
        Basis,
        BeforeAfterEntry,
        ChangeEntry,
        CopyEntry,
        Effect,
        EvaluationDocument,
        EvidenceEntry,
        ExtremeEntry,
        FindingKind,
        HistoryEntry,
        ImpactEntry,
        ProofLoadEntry,
        ProofRunEntry,
        PurposeEntry,
        RequirementEntry,
        RunEntry,
        RunIdentityEntry,
        RunInTimeEntry,
        StatementEntry,
        StepEntry,
        TemperatureComparisonEntry,
        TogetherEntry,
        TrendEntry,
        Verdict,
    )
    from bufferstand.evaluation.facts.draw_wires import (
        DrawWires,
        FailedWire,
    )
    from bufferstand.evaluation.facts.finding import (
        Finding,
        spoiled_cycles,
    )
    from bufferstand.evaluation.facts.first_contact import (
        FirstContact,
    )
    from bufferstand.evaluation.facts.history import (
        CumulatedEnergy,
        HoldKind,
        PerDecade,
        RecordedHold,
        ResidualStroke,
        RunHistory,
        Settling,
    )
    from bufferstand.evaluation.facts.inspection import (
        Inspection,
    )
    from bufferstand.evaluation.facts.mean_loop import (
        MeanLoop,
    )
    from bufferstand.evaluation.facts.moving_mass import (
        MASS_ACCURACY_PERCENT,
        InertiaCorrection,
        MassSource,
        MovingMass,
    )
    from bufferstand.evaluation.facts.planned_motion import (
        expected_turns,
        held_against,
    )
    from bufferstand.evaluation.facts.quantity_entries import (
        CycleEntry,
        SummaryEntry,
    )
    from bufferstand.evaluation.facts.results import (
        EXTREME_NAMES,
        CycleResult,
        Expanded,
        Extreme,
        Measured,
        Quantities,
        RequirementResult,
        RunEvaluation,
        StepResult,
        Summary,
        Trend,
    )
    from bufferstand.evaluation.facts.run_facts import (
        EVENT,
        GuardDoubt,
        Options,
        RunFacts,
        not_whole,
    )
    from bufferstand.evaluation.facts.shared_errors import (
        Distribution,
        ErrorSource,
        MeasuringChain,
        SharedContributions,
        SharedErrors,
        WeightedSource,
        shared_of,
    )
    from bufferstand.evaluation.facts.skew_sensitivity import (
        ClosedForm,
        SkewSensitivity,
    )

__all__ = [
    "DRAWS",
    "EVENT",
    "EXTREME_NAMES",
    "MASS_ACCURACY_PERCENT",
    "REFERENCE_LOSS",
    "Basis",
    "BeforeAfterEntry",
    "Budget",
    "BudgetLine",
    "ChangeEntry",
    "ClosedForm",
    "CopyEntry",
    "CumulatedEnergy",
    "Cycle",
    "CycleColumns",
    "CycleEntry",
    "CycleResult",
    "DecisionRule",
    "Distribution",
    "DrawWires",
    "Effect",
    "EndReading",
    "ErrorSource",
    "EvaluationDocument",
    "EvidenceEntry",
    "Expanded",
    "Extreme",
    "ExtremeEntry",
    "ExtremeReading",
    "FailedWire",
    "Finding",
    "FindingKind",
    "FirstContact",
    "ForceCell",
    "GuardDoubt",
    "HistoryEntry",
    "HoldKind",
    "ImpactEntry",
    "InertiaCorrection",
    "Inspection",
    "Loop",
    "MassSource",
    "MeanLoop",
    "Measured",
    "MeasuringChain",
    "MovingMass",
    "Occasion",
    "Options",
    "PerDecade",
    "ProofLoadEntry",
    "ProofRunEntry",
    "PurposeEntry",
    "Quantities",
    "RecordedHold",
    "RequirementEntry",
    "RequirementResult",
    "ResidualStroke",
    "RunEntry",
    "RunEvaluation",
    "RunFacts",
    "RunHistory",
    "RunIdentityEntry",
    "RunInTimeEntry",
    "Settling",
    "SharedContributions",
    "SharedErrors",
    "SkewSensitivity",
    "StatementEntry",
    "StepEntry",
    "StepResult",
    "Summary",
    "SummaryEntry",
    "TemperatureComparisonEntry",
    "TogetherEntry",
    "Trend",
    "TrendEntry",
    "TurnColumns",
    "TurnMethod",
    "TurningPoint",
    "Verdict",
    "WeightedSource",
    "budget_entry",
    "check_draws",
    "expected_turns",
    "held_against",
    "identity_of",
    "not_whole",
    "shared_of",
    "spoiled_cycles",
    "weakest",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
