"""The signature of a report: PAdES (ETSI EN 319 142-1, level B-B), appended to the unsigned bytes."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from bufferstand.evaluation.report.content import SigningLine
from bufferstand.evaluation.report.signing.appearance import drawing
from bufferstand.evaluation.report.signing.keys import SigningKey
from bufferstand.evaluation.wording import ENGLISH, Language
from bufferstand.foundation import BadInput

if TYPE_CHECKING:
    from pyhanko.sign.fields import SigFieldSpec
    from pyhanko.stamp import StaticStampStyle

FIELD_NAME = "Signature"


def signed(
    pdf: bytes,
    key: SigningKey,
    *,
    reason: str = "",
    line: SigningLine | None = None,
    language: Language = ENGLISH,
) -> bytes:
    """Return a PDF with a signature that covers all of it.

    The unsigned bytes are the beginning of the signed ones: what can be made again from the same runs can be
    compared with what was signed. A line end is put between them, because without one the file is no PDF/A
    any more (ISO 19005-3, 6.1.3; veraPDF says so, and a test asks it).

    Parameters
    ----------
    pdf : bytes
        A report as it is rendered, not signed yet.
    key : SigningKey
        Whose signature it becomes.
    reason : str
        Why it is signed, as PDF readers show it.
    line : SigningLine or None
        Where the signature is shown; None: nowhere on the pages.
    language : Language
        In which it is shown: that of the report.

    Returns
    -------
    bytes
        With the time of this computer's clock in it: other bytes each time.

    Raises
    ------
    BadInput
        If the key does not sign: a token that was pulled out.
    """
    from pkcs11.exceptions import PKCS11Error  # noqa: PLC0415 - an extra
    from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter  # noqa: PLC0415 - an extra
    from pyhanko.sign import signers  # noqa: PLC0415
    from pyhanko.sign.fields import SigSeedSubFilter  # noqa: PLC0415
    from pyhanko.sign.general import SigningError  # noqa: PLC0415

    what = signers.PdfSignatureMetadata(
        field_name=FIELD_NAME,
        md_algorithm="sha256",
        subfilter=SigSeedSubFilter.PADES,
        name=key.name,
        reason=reason or None,
        signer_key_usage={"digital_signature", "non_repudiation"},
    )
    writer = IncrementalPdfFileWriter(io.BytesIO(pdf + b"\n"))
    field, style = (None, None) if line is None else _shown(key.name, line, language)
    try:
        out = signers.PdfSigner(what, key.signer, stamp_style=style, new_field_spec=field).sign_pdf(
            writer, output=io.BytesIO()
        )
    except (SigningError, PKCS11Error) as error:
        raise BadInput(
            f"the key does not sign: {str(error) or type(error).__name__}",
            file="--sign",
            remedy="see whether the token is still there",
        ) from None
    whole: bytes = out.getvalue()
    if not whole.startswith(pdf):
        raise RuntimeError("the signed file does not begin with the unsigned one")
    return whole


def _shown(name: str, line: SigningLine, language: Language) -> tuple[SigFieldSpec, StaticStampStyle]:
    """Return the field above the line, and what it shows."""
    from pyhanko.pdf_utils.content import RawContent  # noqa: PLC0415 - an extra
    from pyhanko.pdf_utils.layout import (  # noqa: PLC0415
        AxisAlignment,
        BoxConstraints,
        Margins,
        SimpleBoxLayoutRule,
    )
    from pyhanko.sign.fields import SigFieldSpec  # noqa: PLC0415
    from pyhanko.stamp import StaticStampStyle  # noqa: PLC0415

    box = line.box
    width, height = box[2] - box[0], box[3] - box[1]
    content = RawContent(drawing(name, width, language), box=BoxConstraints(width=width, height=height))
    field = SigFieldSpec(FIELD_NAME, on_page=line.page - 1, box=box)
    whole = SimpleBoxLayoutRule(
        x_align=AxisAlignment.ALIGN_MIN, y_align=AxisAlignment.ALIGN_MIN, margins=Margins(0, 0, 0, 0)
    )
    return field, StaticStampStyle(border_width=0, background=content, background_layout=whole)
