"""The words of a report: English texts that know what they are made of, and languages to put them into."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.wording.language import (
        ENGLISH,
        LANGUAGES,
        Code,
        Language,
        language_of,
    )
    from bufferstand.evaluation.wording.plain_data import spoken
    from bufferstand.evaluation.wording.terms import (
        channel_words,
        effect_words,
        finding_words,
        hold_words,
        kind_words,
        specimen_words,
        status_words,
        test_words,
        verdict_words,
    )
    from bufferstand.evaluation.wording.texts import (
        Worded,
        capital,
        day,
        joined,
        label,
        moment,
        numeral,
        said,
        said_count,
        span,
    )

__all__ = [
    "ENGLISH",
    "LANGUAGES",
    "Code",
    "Language",
    "Worded",
    "capital",
    "channel_words",
    "day",
    "effect_words",
    "finding_words",
    "hold_words",
    "joined",
    "kind_words",
    "label",
    "language_of",
    "moment",
    "numeral",
    "said",
    "said_count",
    "span",
    "specimen_words",
    "spoken",
    "status_words",
    "test_words",
    "verdict_words",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
