"""What the commands that evaluate share: options of judging, evaluations shown in the terminal."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.cli.evaluation.archive_view import (
        progress_bar,
        show_archive,
    )
    from bufferstand.cli.evaluation.judging import (
        JudgingOptions,
        judging_options,
    )
    from bufferstand.cli.evaluation.view import (
        show_evaluation,
    )

__all__ = [
    "JudgingOptions",
    "judging_options",
    "progress_bar",
    "show_archive",
    "show_evaluation",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
