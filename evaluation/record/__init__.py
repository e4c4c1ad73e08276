"""The record of a run.

Stroke, force and temperatures on one time base, and each defect of its samples and time stamps.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.record.by_quantity import (
        RecordedChannel,
        channels_of_quantity,
    )
    from bufferstand.evaluation.record.clock_stamps import (
        understand,
    )
    from bufferstand.evaluation.record.defects import (
        USUAL_SHARES,
        Cleaner,
        Defect,
        describe,
        finite_where_rising,
        step_limits,
        usual_limit_s,
    )
    from bufferstand.evaluation.record.event_logging import (
        waits_show,
    )
    from bufferstand.evaluation.record.interpolated_force import (
        InterpolationLimits,
    )
    from bufferstand.evaluation.record.peaks import (
        joined,
        peaks_of,
        stands_alone,
    )
    from bufferstand.evaluation.record.record import (
        Ends,
        Peak,
        Record,
        Temperature,
        check_usable,
        make_record,
        with_own_steps,
    )
    from bufferstand.evaluation.record.signals import (
        MOST,
        PISTON,
        Signals,
        signals_of,
    )
    from bufferstand.evaluation.record.temperature_sensors import (
        said,
        true_readings,
    )
    from bufferstand.evaluation.record.time_steps import (
        LONGER,
    )

__all__ = [
    "LONGER",
    "MOST",
    "PISTON",
    "USUAL_SHARES",
    "Cleaner",
    "Defect",
    "Ends",
    "InterpolationLimits",
    "Peak",
    "Record",
    "RecordedChannel",
    "Signals",
    "Temperature",
    "channels_of_quantity",
    "check_usable",
    "describe",
    "finite_where_rising",
    "joined",
    "make_record",
    "peaks_of",
    "said",
    "signals_of",
    "stands_alone",
    "step_limits",
    "true_readings",
    "understand",
    "usual_limit_s",
    "waits_show",
    "with_own_steps",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
