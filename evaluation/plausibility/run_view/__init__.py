"""What the detectors see of a run.

Its channels as recorded, its loading passes, and its cycles in order of time.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.plausibility.run_view.channels import (
        Channels,
    )
    from bufferstand.evaluation.plausibility.run_view.cycle_series import (
        CycleSeries,
        series_of,
    )
    from bufferstand.evaluation.plausibility.run_view.error_codes import (
        ErrorCodes,
    )
    from bufferstand.evaluation.plausibility.run_view.passes import (
        HalfCycle,
        Pass,
        beyond_others,
        others_of,
        pass_of,
        ways_of,
    )
    from bufferstand.evaluation.plausibility.run_view.samples import (
        Samples,
    )
    from bufferstand.evaluation.plausibility.run_view.view import (
        LONGER,
        RunView,
    )

__all__ = [
    "LONGER",
    "Channels",
    "CycleSeries",
    "ErrorCodes",
    "HalfCycle",
    "Pass",
    "RunView",
    "Samples",
    "beyond_others",
    "others_of",
    "pass_of",
    "series_of",
    "ways_of",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
