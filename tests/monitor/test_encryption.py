"""Pages away from loopback: encrypted by a certificate, refused without, open only where asked for."""

from __future__ import annotations

import asyncio
import http.client
import json
import re
import signal
import ssl
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path

import pytest
import websockets
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec

from bufferstand.daq.monitor.encryption import Certificate, certificate_of
from bufferstand.daq.monitor.process import Address, web_process
from bufferstand.foundation.errors import BadInput
from tests.main_job.conftest import here

REFUSED = "unencrypted: who reads along on the network could act"


def made(folder: Path, password: bytes | None = None) -> Certificate:
    """Make a certificate of one's own for this machine, and its key."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "stand")])
    names = x509.SubjectAlternativeName([x509.DNSName("localhost"), x509.IPAddress(ip_address("127.0.0.1"))])
    now = datetime.now(UTC)
    builder = x509.CertificateBuilder().subject_name(name).issuer_name(name).public_key(key.public_key())
    builder = builder.serial_number(1).not_valid_before(now - timedelta(days=1))
    builder = builder.not_valid_after(now + timedelta(days=30)).add_extension(names, critical=False)
    signed = builder.sign(key, hashes.SHA256())
    folder.mkdir(exist_ok=True)
    made = Certificate(folder / "stand.pem", folder / "stand.key.pem")
    made.chain.write_bytes(signed.public_bytes(serialization.Encoding.PEM))
    kept = (
        serialization.NoEncryption() if password is None else serialization.BestAvailableEncryption(password)
    )
    made.key.write_bytes(
        key.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, kept)
    )
    return made


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> Certificate:
    return made(tmp_path_factory.mktemp("certificate"))


@pytest.mark.parametrize("host", ["0.0.0.0", "192.0.2.7", "stand.lab.example", "[2001:db8::7]"])
def test_another_address_than_loopback_is_refused_without_a_certificate(tmp_path: Path, host: str) -> None:
    for words in (
        ("desk", tmp_path, "--address", f"{host}:0"),
        ("monitor", tmp_path, "--address", f"{host}:0"),
        ("resume", tmp_path, "--monitor", f"{host}:0"),
    ):
        said = here(*words)
        assert said.returncode == 2
        assert REFUSED in said.stderr
        assert "--certificate FILE.pem --key FILE.pem, or --unencrypted" in said.stderr
    with pytest.raises(BadInput, match="unencrypted"), web_process(tmp_path, Address(host), print):
        pass


def test_loopback_and_what_was_asked_for_by_name_are_served_without() -> None:
    for address in (Address(), Address("localhost"), Address("::1"), Address("192.0.2.7", unencrypted=True)):
        address.demand_encryption()
    assert Address("192.0.2.7", unencrypted=True).encryption_words() == ("--unencrypted",)
    assert Address().encryption_words() == ()


def test_options_of_a_page_without_a_page_are_refused(tmp_path: Path) -> None:
    said = here("resume", tmp_path, "--unencrypted")
    assert (said.returncode, "add --monitor" in said.stderr) == (2, True)


def test_a_certificate_that_cannot_be_used_is_refused_in_one_line(
    tmp_path: Path, certificate: Certificate
) -> None:
    other, locked = made(tmp_path / "other"), made(tmp_path / "locked", b"secret")
    empty = tmp_path / "empty.pem"
    empty.write_text("no certificate\n")
    for chain, key, said in (
        (certificate.chain, None, "--key FILE.pem is missing"),
        (None, certificate.key, "--certificate FILE.pem is missing"),
        (certificate.chain, other.key, "this key is not that of the certificate"),
        (empty, certificate.key, "no PEM file of a certificate"),
        (certificate.chain, empty, "no PEM file of a certificate, or empty.pem none of a private key"),
        (locked.chain, locked.key, "the key has a password"),
        (tmp_path / "none.pem", certificate.key, "cannot be read: No such file"),
    ):
        with pytest.raises(BadInput) as refused:
            certificate_of(chain, key)
        assert said in str(refused.value)
    assert certificate_of(None, None) is None
    assert certificate_of(certificate.chain, certificate.key) == certificate


@contextmanager
def desk(folder: Path, *words: str | Path) -> Iterator[tuple[int, str, str]]:
    """Serve a desk; yield its port, the token for control, and all that it said."""
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "bufferstand", "desk", str(folder), *map(str, words)],
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    said = ""
    try:
        while "Ctrl-C ends" not in said:
            line = process.stderr.readline()
            assert line, said
            said += line
        found = re.search(r"to work: https?://[^/]+:(\d+)/#(\S+)", said)
        assert found, said
        yield int(found[1]), found[2], said
    finally:
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)


def test_a_desk_away_from_loopback_speaks_tls_and_nothing_else(
    tmp_path: Path, certificate: Certificate
) -> None:
    with desk(tmp_path, "--address", "0.0.0.0:0", *certificate.words()) as (port, token, said):
        assert "https://" in said
        assert "http://" not in said
        assert "the connection is encrypted" in said
        trust = ssl.create_default_context(cafile=str(certificate.chain))
        page = http.client.HTTPSConnection("127.0.0.1", port, context=trust, timeout=30)
        host = f"127.0.0.1:{port}"
        for origin, status in ((f"http://{host}", 403), (f"https://{host}", 200)):
            headers = {"Host": host, "Origin": origin, "Content-Type": "application/json"}
            page.request("POST", "/session", json.dumps({"token": token}), headers)
            answer = page.getresponse()
            answer.read()
            assert answer.status == status
        cookie = answer.headers["Set-Cookie"]
        assert "Secure" in cookie
        assert f"connect-src 'self' wss://{host}" in answer.headers["Content-Security-Policy"]
        page.close()
        plain = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
        plain.request("GET", "/")
        with pytest.raises((http.client.HTTPException, OSError)):
            plain.getresponse()
        plain.close()
        with pytest.raises(ssl.SSLCertVerificationError):
            http.client.HTTPSConnection(
                "127.0.0.1", port, context=ssl.create_default_context(), timeout=30
            ).connect()


def test_what_was_asked_for_by_name_is_served_unencrypted(tmp_path: Path) -> None:
    with desk(tmp_path, "--address", "0.0.0.0:0", "--unencrypted") as (port, _, said):
        assert "the network can read along" in said
        page = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
        page.request("GET", "/", headers={"Host": f"127.0.0.1:{port}"})
        assert page.getresponse().status in (200, 401, 403)
        page.close()


def test_the_page_of_a_campaign_is_encrypted_to_its_web_socket(
    tmp_path: Path, certificate: Certificate
) -> None:
    said: list[str] = []
    address = Address("localhost", 0, exact=True, certificate=certificate)
    with web_process(tmp_path, address, said.append):
        found = re.search(r"https://[^/]+:(\d+)/", said[0])
        assert found, said
        assert asyncio.run(first_word(int(found[1]), certificate))


async def first_word(port: int, certificate: Certificate) -> str | bytes:
    trust = ssl.create_default_context(cafile=str(certificate.chain))
    origin = f"https://127.0.0.1:{port}"
    async with websockets.connect(f"wss://127.0.0.1:{port}/live", ssl=trust, origin=origin) as wire:
        return await asyncio.wait_for(wire.recv(), 60)
