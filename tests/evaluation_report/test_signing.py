"""A signed report: the unsigned bytes first, PDF/A still, and sound in the eyes of other programs."""

from __future__ import annotations

import io
import shutil
import subprocess
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pikepdf
import pytest
from click.testing import CliRunner, Result
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ed25519, rsa
from cryptography.hazmat.primitives.serialization import pkcs12

from bufferstand.cli.commands.recordings.report import command
from bufferstand.cli.passwords import SIGN_PASSWORD, sign_password
from bufferstand.evaluation.report import write_report
from bufferstand.evaluation.report.signing import open_key, signed
from bufferstand.foundation import BadInput
from tests.evaluation_report import keys
from tests.evaluation_report.signed_reports import GIVEN, RUN, SignedReport, sign
from tests.outside.verapdf import faults_of_pdfa

SOFTHSM = Path("/usr/lib/softhsm/libsofthsm2.so")


def opened(where: Path | str, password: str = keys.PASSWORD, *, now: datetime | None = None) -> str:
    with open_key(str(where), lambda: password, now=now) as key:
        return key.name


def told_by_poppler(pdf: bytes, folder: Path) -> str:
    if shutil.which("pdfsig") is None:
        pytest.skip(
            "pdfsig is not installed: NO SIGNATURE IS CHECKED FROM OUTSIDE; “bash .ci/peers” installs it"
        )
    (folder / "report.pdf").write_bytes(pdf)
    done = subprocess.run(
        ["pdfsig", "-nocert", folder / "report.pdf"], capture_output=True, text=True, check=False
    )
    return done.stdout


def test_the_unsigned_report_is_the_beginning_of_the_signed_one(sealed: SignedReport) -> None:
    assert sealed.signed.startswith(sealed.plain + b"\n")
    again = sign(sealed.plain, sealed.key)
    assert again.startswith(sealed.plain + b"\n")


def test_it_is_signed_by_pades_and_shows_the_same_pages(sealed: SignedReport) -> None:
    with pikepdf.open(io.BytesIO(sealed.signed)) as document, pikepdf.open(io.BytesIO(sealed.plain)) as plain:
        (field,) = document.Root.AcroForm.Fields
        assert (str(field.V.SubFilter), str(field.V.Name)) == ("/ETSI.CAdES.detached", "Test hall 2")
        assert [page.Contents.read_bytes() for page in document.pages] == [
            page.Contents.read_bytes() for page in plain.pages
        ]
        assert set(document.attachments) == {"evaluation.json", "digital-report.xml", "proof.json"}


def test_poppler_finds_it_sound_and_a_turned_bit(sealed: SignedReport, tmp_path: Path) -> None:
    said = told_by_poppler(sealed.signed, tmp_path)
    assert "Total document signed" in said
    assert "Signature Validation: Signature is Valid." in said
    altered = bytearray(sealed.signed)
    altered[len(sealed.plain) // 2] ^= 1
    assert "Signature Validation: Signature is Valid." not in told_by_poppler(bytes(altered), tmp_path)


@pytest.mark.slow
def test_it_is_pdf_a_signed_or_not_and_would_not_be_without_the_line_end(
    sealed: SignedReport, tmp_path: Path
) -> None:
    names = ("plain", "signed", "joined")
    files = {name: tmp_path / f"{name}.pdf" for name in names}
    files["plain"].write_bytes(sealed.plain)
    files["signed"].write_bytes(sealed.signed)
    with open_key(str(sealed.key.p12), lambda: keys.PASSWORD) as key:
        from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter
        from pyhanko.sign import signers

        writer = IncrementalPdfFileWriter(io.BytesIO(sealed.plain))
        what = signers.PdfSignatureMetadata(field_name="S", md_algorithm="sha256")
        files["joined"].write_bytes(signers.sign_pdf(writer, what, signer=key.signer).getvalue())
    faults = faults_of_pdfa(list(files.values()), "3b", tmp_path / "home")
    assert {name: bool(faults[files[name]]) for name in names} == {
        "plain": False,
        "signed": False,
        "joined": True,
    }


def test_an_rsa_key_signs_too(sealed: SignedReport, tmp_path: Path) -> None:
    key = keys.make(tmp_path, key=rsa.generate_private_key(65537, 2048))
    assert "Signature is Valid" in told_by_poppler(sign(sealed.plain, key), tmp_path)


def test_the_time_of_the_certificate_is_looked_at(tmp_path: Path) -> None:
    key = keys.make(tmp_path)
    assert opened(key.p12) == "Test hall 2"
    for days, words in ((2.0, "its certificate expired on"), (-2.0, "its certificate is valid from")):
        with pytest.raises(BadInput, match=words):
            opened(key.p12, now=datetime.now(UTC) + timedelta(days=days))


def bad_keys(folder: Path) -> dict[str, tuple[Path, str]]:
    good, other = keys.make(folder / "good"), keys.make(folder / "other", "Somebody")
    curve = ed25519.Ed25519PrivateKey.generate()
    contents = {
        "certificate": (good.pem.read_bytes(), "this is a PEM file; a PKCS#12 file"),
        "text": (b"no key at all", "this is no PKCS#12 file"),
        "empty": (b"", "this is no PKCS#12 file"),
        "torn": (good.p12.read_bytes()[:-40], "this is no PKCS#12 file"),
        "no-key": (keys.stored(None, good.certificate), "it has no private key"),
        "another": (keys.stored(other.key, other.certificate), ""),
        "odd": (
            pkcs12.serialize_key_and_certificates(
                None, curve, None, None, serialization.BestAvailableEncryption(keys.PASSWORD.encode())
            ),
            "it has no certificate of its key",
        ),
        "not-to-sign": (keys.make(folder / "enc", signs=False).p12.read_bytes(), "not one to sign with"),
        "huge": (bytes(2 << 20), "no key file"),
    }
    found = {}
    for name, (data, words) in contents.items():
        found[name] = (folder / f"{name}.p12", words)
        found[name][0].write_bytes(data)
    return found


def test_what_is_no_key_to_sign_with_gets_one_message(tmp_path: Path) -> None:
    for path, words in bad_keys(tmp_path).values():
        if not words:
            assert opened(path) == "Somebody"
            continue
        with pytest.raises(BadInput, match=words) as caught:
            opened(path)
        assert caught.value.file == str(path)
        assert caught.value.remedy
    with pytest.raises(BadInput, match="no such file; name a key that you have: none is made here"):
        opened(tmp_path / "none.p12")
    assert not (tmp_path / "none.p12").exists()
    with pytest.raises(BadInput, match="the password does not open it"):
        opened(tmp_path / "good" / "key.p12", "another")


def test_without_the_extra_the_message_names_how_to_add_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    key = keys.make(tmp_path)
    monkeypatch.setattr("bufferstand.evaluation.report.signing.extra.find_spec", lambda _: None)
    with pytest.raises(BadInput, match=r"a signature needs pyHanko, which is not installed; install it \("):
        opened(key.p12)


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("pkcs11:object=a?module-path=/lib", "has no token or serial"),
        ("pkcs11:token=a?module-path=/lib", "has no object or id"),
        ("pkcs11:token=a;object=b", "has no module-path"),
        (
            "pkcs11:token=a;object=b?module-path=/nowhere/lib.so",
            "/nowhere/lib.so: module-path: no such library",
        ),
        ("pkcs11:token=a;objekt=b?module-path=/lib", "“objekt=b” is no part of a key's address"),
        ("pkcs11:token=a;id=xy?module-path=/lib", "“xy” is no hexadecimal number"),
        ("pkcs11:token=a;object=b?pin-value=1234", "a PIN has no place on the command line"),
    ],
)
def test_an_address_that_is_none_is_refused(address: str, words: str) -> None:
    with pytest.raises(BadInput) as caught:
        opened(address)
    assert words in str(caught.value)


@pytest.fixture
def token(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A token of SoftHSM with the key “report key”, and its address."""
    if not SOFTHSM.exists() or shutil.which("softhsm2-util") is None:
        pytest.skip("SoftHSM is not installed: NO KEY ON A TOKEN IS TRIED; “bash .ci/peers” installs it")
    import pkcs11
    from pkcs11.util.x509 import decode_x509_certificate

    (tmp_path / "tokens").mkdir()
    (tmp_path / "softhsm2.conf").write_text(f"directories.tokendir = {tmp_path / 'tokens'}\n")
    monkeypatch.setenv("SOFTHSM2_CONF", str(tmp_path / "softhsm2.conf"))
    made = keys.make(tmp_path / "key")
    pem = made.key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    (tmp_path / "key.pem").write_bytes(pem)
    label, pin = ("--label", "report key"), ("--pin", "1234")
    for words in (
        ("--init-token", "--free", "--label", "lab", *pin, "--so-pin", "5678"),
        ("--import", tmp_path / "key.pem", "--token", "lab", *label, "--id", "0a0b", *pin),
    ):
        subprocess.run(["softhsm2-util", *words], check=True, capture_output=True)
    library = pkcs11.lib(str(SOFTHSM))
    library.reinitialize()
    with library.get_token(token_label="lab").open(user_pin="1234", rw=True) as session:
        der = made.certificate.public_bytes(serialization.Encoding.DER)
        names = {pkcs11.Attribute.LABEL: "report key", pkcs11.Attribute.ID: b"\x0a\x0b"}
        session.create_object({**decode_x509_certificate(der), **names, pkcs11.Attribute.TOKEN: True})
    return f"pkcs11:token=lab;object=report%20key?module-path={SOFTHSM}"


def test_a_key_on_a_token_signs(token: str, sealed: SignedReport, tmp_path: Path) -> None:
    with open_key(token, lambda: "1234") as key:
        pdf = signed(sealed.plain, key)
    assert pdf.startswith(sealed.plain + b"\n")
    assert "Signature is Valid" in told_by_poppler(pdf, tmp_path)
    assert opened(token.replace("object=report%20key", "id=0a0b"), "1234") == "Test hall 2"
    for address, pin, words in (
        (token, "9999", "the PIN does not open the token"),
        (token.replace("lab", "gone"), "1234", "no such token can be opened"),
        (token.replace("report%20key", "other"), "1234", "the token has no such key"),
    ):
        with pytest.raises(BadInput, match=words):
            opened(address, pin)


def run(*words: str | Path) -> Result:
    return CliRunner().invoke(command, [str(RUN), *map(str, words)], standalone_mode=False)


def test_the_command_looks_at_the_key_before_it_evaluates_anything(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    key = keys.make(tmp_path / "key")
    monkeypatch.delenv(SIGN_PASSWORD, raising=False)
    out = ("--out", tmp_path / "out")
    told = run(*out, "--sign", key.p12).exception
    assert isinstance(told, BadInput)
    assert "there is no terminal to ask on; give --sign-password-file FILE" in str(told)
    told = run(*out, "--sign-password-file", key.pem).exception
    assert isinstance(told, BadInput)
    assert "add --sign KEY.p12" in str(told)
    monkeypatch.setenv(SIGN_PASSWORD, "wrong")
    assert "the password does not open it" in str(run(*out, "--sign", key.p12).exception)
    assert not (tmp_path / "out").exists()


def test_a_password_comes_from_a_file_or_the_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "password"
    file.write_bytes(f"{keys.PASSWORD}\r\nmore\n".encode())
    assert sign_password(file)() == keys.PASSWORD
    monkeypatch.setenv(SIGN_PASSWORD, "of the environment")
    assert sign_password(None)() == "of the environment"
    for wrong, words in ((tmp_path / "none", "no such file"), (tmp_path, "cannot be read")):
        with pytest.raises(BadInput, match=words):
            sign_password(wrong)()
    file.write_bytes(b"\xff\xfe")
    with pytest.raises(BadInput, match="not UTF-8"):
        sign_password(file)()


def test_a_report_without_a_pdf_is_not_signed(sealed: SignedReport, tmp_path: Path) -> None:
    with (
        open_key(str(sealed.key.p12), lambda: keys.PASSWORD) as key,
        pytest.raises(BadInput, match="a signature is part of the PDF"),
    ):
        write_report(RUN, tmp_path / "out", formats=("html",), given=GIVEN, key=key)
    assert not (tmp_path / "out").exists()


def test_write_report_signs_and_leaves_the_page_alone(sealed: SignedReport, tmp_path: Path) -> None:
    with open_key(str(sealed.key.p12), lambda: keys.PASSWORD) as key:
        html, pdf = write_report(RUN, tmp_path, given=GIVEN, key=key)
    assert pdf.read_bytes().startswith(sealed.plain + b"\n")
    assert html.name.removesuffix(".html") == pdf.name.removesuffix(".pdf")
    assert {path.name for path in tmp_path.iterdir()} == {html.name, pdf.name}
    assert pdf.stat().st_size > len(sealed.plain)
