"""The key that a report is signed with: of a PKCS#12 file, or on a PKCS#11 token. None is ever made here."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from bufferstand.evaluation.report.signing.extra import needs_sign
from bufferstand.foundation import BadInput

if TYPE_CHECKING:
    from asn1crypto.x509 import Certificate
    from pyhanko.sign.signers import Signer, SimpleSigner

TOKEN = "pkcs11:"
LONGEST_KEY = 1 << 20
"""Bytes of a key file: one with a long chain of certificates has some ten thousand."""
_EXPORT = "make one: openssl pkcs12 -export -inkey KEY.pem -in CERTIFICATE.pem -out KEY.p12"


@dataclass(frozen=True, eq=False)
class SigningKey:
    """A key with its certificate, ready to sign.

    Attributes
    ----------
    signer : Signer
        What signs.
    name : str
        Whose certificate it is: the common name, else all of it.
    """

    signer: Signer
    name: str


@contextmanager
def open_key(where: str, password: Callable[[], str], *, now: datetime | None = None) -> Iterator[SigningKey]:
    """Open the key that a report is signed with, and look whether it can be used today.

    Parameters
    ----------
    where : str
        A PKCS#12 file (``.p12``, ``.pfx``), or the address of a key on a token after RFC 7512:
        ``pkcs11:token=NAME;object=NAME?module-path=LIBRARY``.
    password : callable
        Asked for the password, or the token's PIN, when it is needed.
    now : datetime, optional
        When it is to sign; None: now.

    Raises
    ------
    BadInput
        If the extra ``sign`` is missing, there is no such key, the password is wrong, or the certificate is
        not that of the key, not valid at this time, or not one to sign with.
    """
    needs_sign("a signature")
    if where.startswith(TOKEN):
        from bufferstand.evaluation.report.signing.tokens import open_token  # noqa: PLC0415 - an extra

        with open_token(where, password) as signer:
            yield _checked(signer, where, now or datetime.now(UTC))
    else:
        yield _checked(_of_file(Path(where), password), where, now or datetime.now(UTC))


def _of_file(path: Path, password: Callable[[], str]) -> SimpleSigner:
    from asn1crypto.pkcs12 import Pfx  # noqa: PLC0415 - an extra, as below
    from cryptography.hazmat.primitives.asymmetric import ec, rsa  # noqa: PLC0415
    from cryptography.hazmat.primitives.serialization.pkcs12 import load_key_and_certificates  # noqa: PLC0415
    from pyhanko.sign.signers import SimpleSigner  # noqa: PLC0415

    data = _content(path)
    if data.lstrip().startswith(b"-----BEGIN"):
        raise BadInput(
            "this is a PEM file; a PKCS#12 file with key and certificate is wanted here",
            file=path,
            remedy=_EXPORT,
        )
    try:
        Pfx.load(data, strict=True)["auth_safe"].native  # noqa: B018 - parsing is lazy
    except (ValueError, TypeError, KeyError):
        raise BadInput("this is no PKCS#12 file (.p12, .pfx)", file=path, remedy=_EXPORT) from None
    secret = password().encode()
    try:
        key, certificate, _ = load_key_and_certificates(data, secret or None)
    except ValueError:
        raise BadInput(
            "the password does not open it (or the file is damaged)",
            file=path,
            remedy="give its own password",
        ) from None
    if key is None or certificate is None:
        raise BadInput(
            f"it has no {'private key' if key is None else 'certificate of its key'}",
            file=path,
            remedy=_EXPORT,
        )
    if not isinstance(key, rsa.RSAPrivateKey | ec.EllipticCurvePrivateKey):
        raise BadInput(
            "its key is neither RSA nor on an elliptic curve, and PDF readers check no other",
            file=path,
            remedy="sign with a key of one of these kinds",
        )
    if key.public_key() != certificate.public_key():
        raise BadInput("its certificate is of another key", file=path, remedy=_EXPORT)
    signer: SimpleSigner = SimpleSigner.load_pkcs12_data(data, (), passphrase=secret or None)
    return signer


def _content(path: Path) -> bytes:
    try:
        with path.open("rb") as stream:
            data = stream.read(LONGEST_KEY + 1)
    except FileNotFoundError:
        raise BadInput(
            "no such file", file=path, remedy="name a key that you have: none is made here"
        ) from None
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path) from None
    if len(data) > LONGEST_KEY:
        raise BadInput(f"longer than {LONGEST_KEY} bytes: no key file", file=path, remedy="check the path")
    return data


def _checked(signer: Signer, where: str, now: datetime) -> SigningKey:
    certificate = signer.signing_cert
    if certificate is None:
        raise BadInput("the key has no certificate", file=where, remedy="put its certificate beside it")
    _check_time(certificate, where, now)
    usage = certificate.key_usage_value
    if usage is not None and not {"digital_signature", "non_repudiation"} & usage.native:
        raise BadInput(
            "its certificate is not one to sign with (key usage: "
            f"{', '.join(sorted(usage.native)).replace('_', ' ') or 'none'})",
            file=where,
            remedy="use a certificate for digital signatures or non-repudiation",
        )
    return SigningKey(signer, name_of(certificate))


def _check_time(certificate: Certificate, where: str, now: datetime) -> None:
    first, last = certificate.not_valid_before, certificate.not_valid_after
    if now > last:
        raise BadInput(
            f"its certificate expired on {last:%Y-%m-%d}", file=where, remedy="sign with a valid certificate"
        )
    if now < first:
        raise BadInput(
            f"its certificate is valid from {first:%Y-%m-%d} on, and this computer says that it is "
            f"{now:%Y-%m-%d}",
            file=where,
            remedy="set the clock, or sign with a valid certificate",
        )


def name_of(certificate: Certificate) -> str:
    """Return whose a certificate is: the common name, else all of the subject's."""
    common = certificate.subject.native.get("common_name")
    return str(common or certificate.subject.human_friendly)
