"""The twin: a fitted model alongside a run, its band, and what has moved (docs/twin.md)."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.model.twin.alarming import (
        LIMIT,
        Chart,
        Moved,
        TwinAlarm,
        dead_zone,
        increments,
        stepped,
    )
    from bufferstand.model.twin.fault_kinds import (
        FAULT_KINDS,
        FaultKind,
    )
    from bufferstand.model.twin.judging import (
        CycleJudgement,
        MeasuredCycle,
        judge_cycle,
    )
    from bufferstand.model.twin.parameter_spread import (
        ParameterSpread,
        moved_model,
    )
    from bufferstand.model.twin.running import (
        Twin,
        TwinStep,
        known_fit,
        load_known,
        twin_of_runs,
    )

__all__ = [
    "FAULT_KINDS",
    "LIMIT",
    "Chart",
    "CycleJudgement",
    "FaultKind",
    "MeasuredCycle",
    "Moved",
    "ParameterSpread",
    "Twin",
    "TwinAlarm",
    "TwinStep",
    "dead_zone",
    "increments",
    "judge_cycle",
    "known_fit",
    "load_known",
    "moved_model",
    "stepped",
    "twin_of_runs",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
