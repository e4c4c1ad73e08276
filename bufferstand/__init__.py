"""bufferstand: test-stand data acquisition and evaluation for railway buffers and draw gear.

``import bufferstand as bs`` is the door: what :data:`__all__` lists stays, and later versions only add
(docs/python-api.md). A name is loaded when it is first used, so that the import itself costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.cli import compare, fit_model, plan_campaign, run_campaign, write_report
    from bufferstand.evaluation.document import (
        before_after,
        channels,
        cycles,
        dataset,
        evaluate,
        holds,
        import_record,
        loops,
        open_run,
        requirements,
        residual_strokes,
        runs,
        settling,
        signals,
        summaries,
    )
    from bufferstand.foundation import BadInput
    from bufferstand.model import load_model, save_model, simulate
    from bufferstand.recording.foreign import ImportOptions

__all__ = [
    "BadInput",
    "ImportOptions",
    "before_after",
    "channels",
    "compare",
    "cycles",
    "dataset",
    "evaluate",
    "fit_model",
    "holds",
    "import_record",
    "load_model",
    "loops",
    "open_run",
    "plan_campaign",
    "requirements",
    "residual_strokes",
    "run_campaign",
    "runs",
    "save_model",
    "settling",
    "signals",
    "simulate",
    "summaries",
    "write_report",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
