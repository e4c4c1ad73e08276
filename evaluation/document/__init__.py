"""The evaluation document, the tables made of it, and the Python API that returns them."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.document.build import (
        LIGHT,
        SCHEMA,
        evaluate_entry,
        evaluate_file,
        evaluate_paths,
        run_entry,
        what_runs_say_together,
    )
    from bufferstand.evaluation.document.evidence import (
        skew_effect,
    )
    from bufferstand.evaluation.document.python_api import (
        Paths,
        before_after,
        channels,
        cycles,
        dataset,
        evaluate,
        holds,
        import_record,
        loops,
        open_run,
        paths_of,
        requirements,
        residual_strokes,
        runs,
        settling,
        signals,
        summaries,
    )
    from bufferstand.evaluation.document.tables import (
        NUMBERS,
        OfRun,
        check_table_name,
        cycle_frame,
        cycle_numbers,
        cycle_rows,
        fit_for_excel,
        version_text,
        write_cycle_csv,
        write_cycles,
        write_frames,
    )

__all__ = [
    "LIGHT",
    "NUMBERS",
    "SCHEMA",
    "OfRun",
    "Paths",
    "before_after",
    "channels",
    "check_table_name",
    "cycle_frame",
    "cycle_numbers",
    "cycle_rows",
    "cycles",
    "dataset",
    "evaluate",
    "evaluate_entry",
    "evaluate_file",
    "evaluate_paths",
    "fit_for_excel",
    "holds",
    "import_record",
    "loops",
    "open_run",
    "paths_of",
    "requirements",
    "residual_strokes",
    "run_entry",
    "runs",
    "settling",
    "signals",
    "skew_effect",
    "summaries",
    "version_text",
    "what_runs_say_together",
    "write_cycle_csv",
    "write_cycles",
    "write_frames",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
