"""The content of a report as plain data, and numbers as a report prints them."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.report.content.attachment import (
        Attachment,
    )
    from bufferstand.evaluation.report.content.content import (
        DASH,
        Block,
        Cell,
        Column,
        Content,
        Lack,
        Picture,
        Section,
        Sheet,
        Signature,
        Signatures,
        Table,
        Texts,
        Tone,
        VerdictLine,
        in_language,
        numbered,
    )
    from bufferstand.evaluation.report.content.numbers import (
        SUBSCRIPTED,
        UNBROKEN,
        day_text,
        decimals_of,
        fixed,
        limits_text,
        measured_cell,
        moment_of,
        moment_text,
        probability_text,
        quantity_cell,
        significant,
        span_text,
        to_digits,
        usable,
        value_text,
        with_uncertainty,
    )
    from bufferstand.evaluation.report.content.own_template import (
        OwnTemplate,
        TemplateFile,
    )
    from bufferstand.evaluation.report.content.prose import (
        Image,
        Mark,
        Prose,
        ProsePart,
        Words,
    )
    from bufferstand.evaluation.report.content.signing_line import (
        SigningLine,
    )

__all__ = [
    "DASH",
    "SUBSCRIPTED",
    "UNBROKEN",
    "Attachment",
    "Block",
    "Cell",
    "Column",
    "Content",
    "Image",
    "Lack",
    "Mark",
    "OwnTemplate",
    "Picture",
    "Prose",
    "ProsePart",
    "Section",
    "Sheet",
    "Signature",
    "Signatures",
    "SigningLine",
    "Table",
    "TemplateFile",
    "Texts",
    "Tone",
    "VerdictLine",
    "Words",
    "day_text",
    "decimals_of",
    "fixed",
    "in_language",
    "limits_text",
    "measured_cell",
    "moment_of",
    "moment_text",
    "numbered",
    "probability_text",
    "quantity_cell",
    "significant",
    "span_text",
    "to_digits",
    "usable",
    "value_text",
    "with_uncertainty",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
