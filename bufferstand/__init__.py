"""bufferstand: test-stand data acquisition and evaluation for railway buffers and draw gear.

``import bufferstand as bs`` is the door: what :data:`__all__` lists stays, and later versions only add
(docs/python-api.md). A name is loaded when it is first used, so that the import itself costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

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
    "simulate",
    "summaries",
    "write_report",
]

_ELSEWHERE = {
    "BadInput": "foundation.errors",
    "compare": "cli.from_python",
    "fit_model": "cli.from_python",
    "load_model": "model.file",
    "plan_campaign": "cli.from_python",
    "run_campaign": "cli.from_python",
    "save_model": "model.file",
    "simulate": "model.simulation",
    "write_report": "cli.from_python",
}
"""The module of what does not come from :mod:`bufferstand.evaluation.document.python_api`."""


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = importlib.import_module(f"{__name__}.{_ELSEWHERE.get(name, 'evaluation.document.python_api')}")
    found: object = getattr(module, name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
