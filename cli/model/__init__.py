"""What the model commands share: measured runs, the model shown in the terminal, pictures."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.cli.model.fit_document import (
        document_of,
    )
    from bufferstand.cli.model.next_campaign import (
        Admission,
        admission,
        campaign_text,
        made_campaign,
        seen_from,
        shared_errors_of,
    )
    from bufferstand.cli.model.pictures import (
        picture_comparison,
        picture_simulation,
        picture_warming,
        save_picture,
    )
    from bufferstand.cli.model.runs import (
        MeasuredRun,
        beyond_the_runs,
        read_runs,
        settings_of,
        sittings,
    )
    from bufferstand.cli.model.train_picture import (
        picture_train,
    )
    from bufferstand.cli.model.twin_view import (
        show_twin,
        twin_document,
    )
    from bufferstand.cli.model.view import (
        show_cycles,
        show_identification,
    )

__all__ = [
    "Admission",
    "MeasuredRun",
    "admission",
    "beyond_the_runs",
    "campaign_text",
    "document_of",
    "made_campaign",
    "picture_comparison",
    "picture_simulation",
    "picture_train",
    "picture_warming",
    "read_runs",
    "save_picture",
    "seen_from",
    "settings_of",
    "shared_errors_of",
    "show_cycles",
    "show_identification",
    "show_twin",
    "sittings",
    "twin_document",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
