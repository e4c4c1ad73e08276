"""Keys and certificates for tests: made here, valid around now, and worth nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.hazmat.primitives.serialization import pkcs12
from cryptography.x509.oid import NameOID

PASSWORD = "žluťoučký kůň"
Key = ec.EllipticCurvePrivateKey | rsa.RSAPrivateKey


@dataclass(frozen=True)
class Made:
    """A key with its certificate, and both as files."""

    key: Key
    certificate: x509.Certificate
    p12: Path
    pem: Path


def make(
    folder: Path,
    name: str = "Test hall 2",
    *,
    key: Key | None = None,
    issuer: Made | None = None,
    days: tuple[float, float] = (-1.0, 1.0),
    signs: bool = True,
    authority: bool = False,
) -> Made:
    """Make a key (on a curve) and its certificate, valid for some days around now."""
    own = key or ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    now = datetime.now(UTC)
    certificate = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer.certificate.subject if issuer else subject)
        .public_key(own.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now + timedelta(days=days[0]))
        .not_valid_after(now + timedelta(days=days[1]))
        .add_extension(x509.BasicConstraints(ca=authority, path_length=None), critical=True)
        .add_extension(_usage(signs=signs, authority=authority), critical=True)
        .sign(issuer.key if issuer else own, hashes.SHA256())
    )
    folder.mkdir(parents=True, exist_ok=True)
    p12, pem = folder / "key.p12", folder / "certificate.pem"
    p12.write_bytes(stored(own, certificate, [issuer.certificate] if issuer else []))
    pem.write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    return Made(own, certificate, p12, pem)


def stored(
    key: Key | None, certificate: x509.Certificate | None, others: Sequence[x509.Certificate] = ()
) -> bytes:
    """Return a key and a certificate as PKCS#12, opened by :data:`PASSWORD`."""
    locked = serialization.BestAvailableEncryption(PASSWORD.encode())
    return pkcs12.serialize_key_and_certificates(b"lab", key, certificate, list(others) or None, locked)


def _usage(*, signs: bool, authority: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=signs,
        content_commitment=signs,
        key_encipherment=not signs,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=authority,
        crl_sign=authority,
        encipher_only=False,
        decipher_only=False,
    )
