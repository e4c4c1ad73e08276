"""A campaign for others: an RO-Crate with its runs, evaluation and report, and who made it with what."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.publication.fields import (
        PUBLICATION_FILE,
        Publication,
        read_publication,
    )
    from bufferstand.evaluation.publication.making import (
        Judging,
        Published,
        publish,
    )

__all__ = [
    "PUBLICATION_FILE",
    "Judging",
    "Publication",
    "Published",
    "publish",
    "read_publication",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
