"""Thousands of runs evaluated again: only what changed, on all cores or on a cluster, to the last bit.

Start with :func:`bufferstand.evaluation.archive.evaluate.evaluate_archive`; docs/archives.md and
docs/cluster.md.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.archive.cache import (
        Cache,
    )
    from bufferstand.evaluation.archive.comparison import (
        EvaluationComparison,
        Move,
        VerdictChange,
        check_evaluation,
        compare_evaluations,
        load_evaluation,
    )
    from bufferstand.evaluation.archive.dask_cluster import (
        ClusterWorkers,
    )
    from bufferstand.evaluation.archive.evaluate import (
        ArchiveEvaluation,
        ArchiveProgress,
        Workers,
        evaluate_archive,
    )
    from bufferstand.evaluation.archive.local_workers import (
        LocalWorkers,
    )
    from bufferstand.evaluation.archive.run_files import (
        find_runs,
    )
    from bufferstand.evaluation.archive.run_queries import (
        FIELDS,
        RESULTS,
        results_by_path,
    )
    from bufferstand.evaluation.archive.settings_and_software import (
        EvaluationSettings,
        Software,
        settings_entry,
        software,
    )
    from bufferstand.evaluation.archive.stored_run import (
        RequestedParts,
        StoredRun,
    )
    from bufferstand.evaluation.archive.tables import (
        document,
        write_document,
        write_tables,
    )
    from bufferstand.evaluation.archive.worker_processes import (
        handed_out,
        spawned_workers,
    )

__all__ = [
    "FIELDS",
    "RESULTS",
    "ArchiveEvaluation",
    "ArchiveProgress",
    "Cache",
    "ClusterWorkers",
    "EvaluationComparison",
    "EvaluationSettings",
    "LocalWorkers",
    "Move",
    "RequestedParts",
    "Software",
    "StoredRun",
    "VerdictChange",
    "Workers",
    "check_evaluation",
    "compare_evaluations",
    "document",
    "evaluate_archive",
    "find_runs",
    "handed_out",
    "load_evaluation",
    "results_by_path",
    "settings_entry",
    "software",
    "spawned_workers",
    "write_document",
    "write_tables",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
