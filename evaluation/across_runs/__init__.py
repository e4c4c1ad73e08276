"""What several runs say together.

Trends, comparisons, differences, and the errors that the runs have in common.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.across_runs.before_and_after import (
        before_after_entries,
        proof_load_entries,
    )
    from bufferstand.evaluation.across_runs.combine import (
        Figures,
    )
    from bufferstand.evaluation.across_runs.copies import (
        Copy,
        RecordingIdentity,
        each_once,
    )
    from bufferstand.evaluation.across_runs.differences import (
        Difference,
        UncertainValue,
        difference,
        equivalences,
    )
    from bufferstand.evaluation.across_runs.grouping import (
        mixture,
    )
    from bufferstand.evaluation.across_runs.points import (
        points_of,
    )
    from bufferstand.evaluation.across_runs.run_means import (
        figure_of,
    )
    from bufferstand.evaluation.across_runs.temperature_comparison import (
        FIGURES,
        compare_temperatures,
    )
    from bufferstand.evaluation.across_runs.trends import (
        find_trends,
    )

__all__ = [
    "FIGURES",
    "Copy",
    "Difference",
    "Figures",
    "RecordingIdentity",
    "UncertainValue",
    "before_after_entries",
    "compare_temperatures",
    "difference",
    "each_once",
    "equivalences",
    "figure_of",
    "find_trends",
    "mixture",
    "points_of",
    "proof_load_entries",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
