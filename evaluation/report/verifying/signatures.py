"""The signatures of a report: whether they are intact, cover the whole file, and whose they are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from bufferstand.evaluation.report.signing import name_of, needs_sign
from bufferstand.evaluation.report.verifying.findings import Finding, fault, holds, note
from bufferstand.foundation import BadInput

if TYPE_CHECKING:
    from asn1crypto.x509 import Certificate
    from pyhanko.pdf_utils.reader import PdfFileReader
    from pyhanko.sign.validation.pdf_embedded import EmbeddedPdfSignature

PLACE = "signature"
_LONGEST_CERTIFICATES = 1 << 20


def read_certificates(path: Path) -> tuple[Certificate, ...]:
    """Read certificates that are trusted: PEM (one or more) or DER.

    Raises
    ------
    BadInput
        If the file cannot be read or has none.
    """
    needs_sign("checking a signature")
    from asn1crypto import pem, x509  # noqa: PLC0415 - an extra

    try:
        with path.open("rb") as stream:
            data = stream.read(_LONGEST_CERTIFICATES)
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path, remedy="check the path") from None
    try:
        if pem.detect(data):
            ders = [der for kind, _, der in pem.unarmor(data, multiple=True) if kind == "CERTIFICATE"]
        else:
            ders = [data]
        found = tuple(x509.Certificate.load(der, strict=True) for der in ders)
        for certificate in found:
            certificate.native  # noqa: B018 - parsing is lazy
    except (ValueError, TypeError, KeyError):
        found = ()
    if not found:
        raise BadInput(
            "no certificate is in it",
            file=path,
            remedy="name the certificate of the signer, or of its issuer (PEM)",
        )
    return found


def signature_findings(
    data: bytes, reader: PdfFileReader, trusted: Sequence[Certificate]
) -> Iterator[Finding]:
    """Check the signatures of a PDF.

    Parameters
    ----------
    data : bytes
        The PDF.
    reader : PdfFileReader
        Of the same bytes.
    trusted : sequence of Certificate
        Of signers or their issuers. If there are any, the report has to be signed, and by one of them.

    Yields
    ------
    Finding
    """
    try:
        found = list(reader.embedded_regular_signatures)
    except (Exception, RecursionError) as error:  # noqa: BLE001 - of a damaged file it raises anything
        yield fault(PLACE, f"cannot be read: {str(error) or type(error).__name__}")
        return
    if not found:
        text = "there is none: nothing shows whether the pages are as they were issued"
        yield fault(PLACE, text) if trusted else note(PLACE, text)
        return
    for position, one in enumerate(found, start=1):
        place = PLACE if len(found) == 1 else f"{PLACE} {position}"
        try:
            yield from _checked(one, data, trusted, place, last=position == len(found))
        except (Exception, RecursionError) as error:  # noqa: BLE001 - of an altered one it raises anything
            yield fault(place, f"cannot be checked: {str(error) or type(error).__name__}")


def _checked(
    one: EmbeddedPdfSignature, data: bytes, trusted: Sequence[Certificate], place: str, *, last: bool
) -> Iterator[Finding]:
    from pyhanko.sign.validation import validate_pdf_signature  # noqa: PLC0415 - an extra
    from pyhanko.sign.validation.settings import KeyUsageConstraints  # noqa: PLC0415
    from pyhanko_certvalidator import ValidationContext  # noqa: PLC0415

    when = one.self_reported_timestamp
    moment = when if when is not None and when.tzinfo is not None else datetime.now(UTC)
    context = ValidationContext(
        trust_roots=list(trusted), other_certs=list(one.other_embedded_certs), moment=moment
    )
    usage = KeyUsageConstraints(key_usage={"digital_signature", "non_repudiation"})
    status = validate_pdf_signature(one, context, key_usage_settings=usage, skip_diff=last)
    if not (status.intact and status.valid):
        yield fault(place, "the file was altered after it was signed, or the signature itself was")
        return
    certificate = one.signer_cert
    told = (
        f"{when.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC by the signer’s own clock"
        if when
        else "at no stated time"
    )
    yield holds(place, f"intact; signed by {name_of(certificate)}, {told}")
    if last:
        yield from _coverage(one, data, place)
    elif not status.docmdp_ok:
        yield fault(place, "more than a further signature was added after it")
    mark = f"certificate SHA-256 {certificate.sha256_fingerprint.replace(' ', '').lower()}"
    if status.trusted:
        yield holds(place, f"the signer is one of those trusted; revocation was not asked; {mark}")
    elif trusted:
        yield fault(place, f"the signer is none of those trusted, or was not when it was signed; {mark}")
    else:
        yield note(place, f"whose key it is is not known here: give --trust CERTIFICATE.pem; {mark}")


def _coverage(one: EmbeddedPdfSignature, data: bytes, place: str) -> Iterator[Finding]:
    """Say whether the signature is of every byte but its own.

    Its own place has to hold the signature, as hexadecimal digits, and then zeros, and nothing else: what
    stands there is not signed.
    """
    from asn1crypto import parser  # noqa: PLC0415 - an extra

    start, before, behind, rest = (int(number) for number in one.byte_range)
    gap = data[before:behind]
    content = one.pkcs7_content
    own = gap[:1] == b"<" and gap[-1:] == b">" and bytes.fromhex(gap[1:-1].decode("ascii")) == content
    padding = content[parser.peek(content) :]
    if start != 0 or not own or padding.strip(b"\0"):
        yield fault(place, "it does not cover all of the file before its own place")
    elif behind + rest != len(data):
        yield fault(place, f"{len(data) - behind - rest} bytes were added after it was signed")
    else:
        yield holds(place, "covers the whole file")
