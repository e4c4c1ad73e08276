"""The commands: parsing of options and printing, nothing else."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.cli.from_python import (
        compare,
        fit_model,
        plan_campaign,
        run_campaign,
        write_report,
    )

__all__ = [
    "compare",
    "fit_model",
    "plan_campaign",
    "run_campaign",
    "write_report",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
