"""Signing a report (extra ``sign``): the key from a file or a token, the signature at the end of the PDF."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.report.signing.extra import (
        needs_sign,
    )
    from bufferstand.evaluation.report.signing.keys import (
        SigningKey,
        name_of,
        open_key,
    )
    from bufferstand.evaluation.report.signing.signature import (
        FIELD_NAME,
        signed,
    )

__all__ = [
    "FIELD_NAME",
    "SigningKey",
    "name_of",
    "needs_sign",
    "open_key",
    "signed",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
