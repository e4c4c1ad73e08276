"""A report that somebody sent: what holds is said, and whatever was altered is found."""

from __future__ import annotations

import io
import json
import shutil
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

import pikepdf
import pytest
from click.testing import CliRunner, Result
from pyhanko.pdf_utils import generic
from pyhanko.pdf_utils.incremental_writer import IncrementalPdfFileWriter

from bufferstand.cli.commands.recordings.verify import command
from bufferstand.evaluation.report.report_file import read_pdf
from bufferstand.evaluation.report.verifying import Against, Finding, verify_report
from bufferstand.evaluation.report.verifying.differences import differences
from bufferstand.evaluation.report.verifying.signatures import signature_findings
from bufferstand.foundation import BadInput
from tests.evaluation_report import keys
from tests.evaluation_report.signed_reports import SignedReport, sign
from tests.evaluation_report.test_rendering import pages, squeezed

ALONE = Against()
PROOF = b'{"schema":"bufferstand/report-proof/1","report":"BR-1","draft":false,"runs":[],"evaluations":[%s]}'


def told(findings: list[Finding], level: str) -> list[str]:
    return [f"{finding.place}: {finding.text}" for finding in findings if finding.level == level]


def faults(path: Path, against: Against = ALONE) -> list[str]:
    return told(verify_report(path, against), "fault")


def of_signature(path: Path) -> list[Finding]:
    """Return what a check of the signature alone finds."""
    try:
        data, reader = read_pdf(path)
    except BadInput as error:
        return [Finding("fault", "file", error.problem)]
    return list(signature_findings(data, reader, ()))


def rewritten(pdf: bytes, change: Callable[[pikepdf.Pdf], None]) -> bytes:
    """Return a PDF of sound structure with something else in it, written anew."""
    with pikepdf.open(io.BytesIO(pdf)) as document:
        change(document)
        out = io.BytesIO()
        document.save(out)
    return out.getvalue()


def updated(pdf: bytes, change: Callable[[IncrementalPdfFileWriter], None]) -> bytes:
    """Return a PDF with an update appended: the bytes that were signed stay."""
    writer = IncrementalPdfFileWriter(io.BytesIO(pdf))
    change(writer)
    out = io.BytesIO()
    writer.write(out)
    return out.getvalue()


def with_damping(document: pikepdf.Pdf, damping: float) -> None:
    """Put another evaluation inside, with its hash: all of it fits together."""
    evaluation = json.loads(document.attachments["evaluation.json"].get_file().read_bytes())
    evaluation["runs"][0]["summary"]["damping"]["value"] = damping
    proof = json.loads(document.attachments["proof.json"].get_file().read_bytes())
    text = json.dumps(evaluation).encode()
    proof["evaluations"][0]["sha256"] = sha256(text).hexdigest()
    put_inside(document, {"evaluation.json": text, "proof.json": json.dumps(proof).encode()})


def put_inside(document: pikepdf.Pdf, files: dict[str, bytes]) -> None:
    for specification in document.Root.AF:
        name = str(specification.UF)
        if name in files:
            specification.EF.F = specification.EF.UF = document.make_stream(files[name])


def test_a_report_as_it_was_issued_holds(sealed: SignedReport, tmp_path: Path) -> None:
    path = sealed.put(tmp_path, sealed.signed)
    findings = verify_report(path, Against(trusted=sealed.key.pem))
    assert told(findings, "fault") == []
    held = "\n".join(told(findings, "holds"))
    assert "signature: intact; signed by Test hall 2, 20" in held
    assert "signature: covers the whole file" in held
    assert "the signer is one of those trusted" in held
    assert "run files: 1 of 1 have the SHA-256 that the report states" in held
    assert "evaluation.json: the same as the evaluation made anew of 1 run file(s); the SHA-256" in held
    printed = squeezed("".join(pages(sealed.signed)))
    assert held.split(": ")[-1] in printed, "the hash of what was found"
    assert [note for note in told(findings, "note") if "draft" not in note] == []


def test_what_cannot_be_checked_is_a_note(sealed: SignedReport, tmp_path: Path) -> None:
    path = sealed.put(tmp_path, sealed.signed, with_run=False)
    findings = verify_report(path, ALONE)
    assert told(findings, "fault") == []
    notes = "\n".join(told(findings, "note"))
    assert "whose key it is is not known here: give --trust CERTIFICATE.pem" in notes
    assert "none are beside the report: give --runs DIR" in notes


def test_trust_in_an_issuer_is_trust_in_whom_it_certified(sealed: SignedReport, tmp_path: Path) -> None:
    issuer = keys.make(tmp_path / "issuer", "Issuer", authority=True)
    signer = keys.make(tmp_path / "signer", "Hall 3", issuer=issuer)
    path = sealed.put(tmp_path / "report", sign(sealed.plain, signer), with_run=False)
    assert faults(path, Against(trusted=issuer.pem)) == []
    stranger = keys.make(tmp_path / "stranger", "Issuer", authority=True)
    (found,) = faults(path, Against(trusted=stranger.pem))
    assert "the signer is none of those trusted" in found


def test_a_report_that_is_not_signed_is_refused_where_a_signature_is_wanted(
    sealed: SignedReport, tmp_path: Path
) -> None:
    path = sealed.put(tmp_path, sealed.plain, with_run=False)
    assert faults(path) == []
    (found,) = faults(path, Against(trusted=sealed.key.pem))
    assert "there is none: nothing shows whether the pages are as they were issued" in found


@pytest.mark.parametrize("pieces", [12, pytest.param(200, marks=pytest.mark.slow)])
def test_a_turned_bit_anywhere_is_found(sealed: SignedReport, tmp_path: Path, pieces: int) -> None:
    path = sealed.put(tmp_path, sealed.signed, with_run=False)
    length = len(sealed.signed)
    start = sealed.signed.index(b"/Contents <") + len(b"/Contents <")
    end = sealed.signed.index(b">", start)
    within = (start + 40, start + 2 * 600, end - 2)  # of the signature: its content, its value, its padding
    steps = range(0, length, length // pieces)
    places = [*(place for place in steps if not start <= place < end), *within, length - 1]
    assert told(of_signature(path), "fault") == []
    for number, place in enumerate(places):
        altered = bytearray(sealed.signed)
        altered[place] ^= 1 << (number % 3)  # of a hexadecimal digit these make another digit, or none
        path.write_bytes(altered)
        assert told(of_signature(path), "fault"), f"byte {place} of {length}"


def test_a_signature_that_is_hidden_from_readers_is_found(sealed: SignedReport, tmp_path: Path) -> None:
    for word in (b"/AcroForm", b"/Fields", b"/FT /Sig", b"/Type /Sig"):
        place = sealed.signed.rindex(word) + len(word) - 2
        altered = bytearray(sealed.signed)
        altered[place] ^= 1
        path = sealed.put(tmp_path, bytes(altered), with_run=False)
        assert told(of_signature(path), "fault"), word


def test_an_exchanged_page_is_found(sealed: SignedReport, tmp_path: Path) -> None:
    def exchange(document: pikepdf.Pdf) -> None:
        document.pages.append(document.pages[0])
        del document.pages[1]

    path = sealed.put(tmp_path, rewritten(sealed.signed, exchange), with_run=False)
    assert faults(path)


def test_an_appended_update_is_found(sealed: SignedReport, tmp_path: Path) -> None:
    def other_page(writer: IncrementalPdfFileWriter) -> None:
        page = writer.root["/Pages"]["/Kids"][0]
        stream = generic.StreamObject(stream_data=b"BT ET")
        page["/Contents"] = writer.add_object(stream)
        writer.update_container(page)

    def nothing(writer: IncrementalPdfFileWriter) -> None:
        writer.set_info(generic.DictionaryObject({generic.pdf_name("/Title"): generic.pdf_string("x")}))

    for data in (updated(sealed.signed, other_page), updated(sealed.signed, nothing), sealed.signed + b"\n"):
        path = sealed.put(tmp_path, data, with_run=False)
        assert "bytes were added after it was signed" in "\n".join(faults(path))


@pytest.mark.slow
def test_a_report_signed_again_after_a_change_is_found(sealed: SignedReport, tmp_path: Path) -> None:
    def other_page(writer: IncrementalPdfFileWriter) -> None:
        page = writer.root["/Pages"]["/Kids"][0]
        page["/Contents"] = writer.add_object(generic.StreamObject(stream_data=b"BT ET"))
        writer.update_container(page)

    from pyhanko.sign import signers

    stranger = keys.make(tmp_path / "key", "Stranger")
    signer = signers.SimpleSigner.load_pkcs12(str(stranger.p12), passphrase=keys.PASSWORD.encode())
    changed = updated(sealed.signed, other_page)
    writer = IncrementalPdfFileWriter(io.BytesIO(changed))
    what = signers.PdfSignatureMetadata(field_name="Second", md_algorithm="sha256")
    path = sealed.put(tmp_path, signers.sign_pdf(writer, what, signer=signer).getvalue(), with_run=False)
    found = faults(path, Against(trusted=sealed.key.pem))
    assert any("more than a further signature was added after it" in text for text in found)
    assert any(text.startswith("signature 2: the signer is none of those trusted") for text in found)


@pytest.mark.slow
def test_a_second_signature_is_no_change(sealed: SignedReport, tmp_path: Path) -> None:
    from pyhanko.sign import signers

    second = keys.make(tmp_path / "key", "Head of the laboratory")
    signer = signers.SimpleSigner.load_pkcs12(str(second.p12), passphrase=keys.PASSWORD.encode())
    writer = IncrementalPdfFileWriter(io.BytesIO(sealed.signed))
    what = signers.PdfSignatureMetadata(field_name="Second", md_algorithm="sha256")
    path = sealed.put(tmp_path, signers.sign_pdf(writer, what, signer=signer).getvalue(), with_run=False)
    findings = verify_report(path, ALONE)
    assert told(findings, "fault") == []
    held = "\n".join(told(findings, "holds"))
    assert "signature 1: intact; signed by Test hall 2" in held
    assert "signature 2: covers the whole file" in held


@pytest.mark.slow
def test_another_evaluation_of_sound_structure_is_found_by_the_signature_and_by_the_runs(
    sealed: SignedReport, tmp_path: Path
) -> None:
    path = sealed.put(tmp_path / "signed", rewritten(sealed.signed, lambda pdf: with_damping(pdf, 0.2)))
    assert any(text.startswith("signature: ") for text in faults(path))
    unsigned = sealed.put(tmp_path / "plain", rewritten(sealed.plain, lambda pdf: with_damping(pdf, 0.2)))
    (found,) = faults(unsigned)
    place = f"evaluation.json: runs.{sealed.run.stem}.summary.damping.value"
    assert found.startswith(f"{place} is 0.2 in the report, and 0.222678")


def test_an_evaluation_that_does_not_fit_its_hash_is_found(sealed: SignedReport, tmp_path: Path) -> None:
    def change(document: pikepdf.Pdf) -> None:
        put_inside(document, {"evaluation.json": b"{}"})

    path = sealed.put(tmp_path, rewritten(sealed.plain, change))
    (found,) = faults(path)
    assert found == (
        "evaluation.json: it is not the one that the report was made with: its hash is not that in proof.json"
    )


def test_a_file_that_was_put_inside_or_taken_out_is_found(sealed: SignedReport, tmp_path: Path) -> None:
    def put(document: pikepdf.Pdf) -> None:
        added = pikepdf.AttachedFileSpec(document, b"x", filename="more.txt")
        document.attachments["more.txt"] = added

    (found,) = faults(sealed.put(tmp_path, rewritten(sealed.plain, put)))
    assert found == "files inside: it has more.txt inside, which proof.json does not name"

    def swap(document: pikepdf.Pdf) -> None:
        names = document.Root.Names.EmbeddedFiles.Names
        names[1], names[3] = names[3], names[1]

    (found,) = faults(sealed.put(tmp_path, rewritten(sealed.plain, swap)))
    assert "is inside under another name, or twice" in found

    def double(document: pikepdf.Pdf) -> None:
        document.Root.AF[0].EF.UF = document.make_stream(b"other")

    (found,) = faults(sealed.put(tmp_path, rewritten(sealed.plain, double)))
    assert "is inside with two contents" in found

    def take(document: pikepdf.Pdf) -> None:
        del document.attachments["digital-report.xml"]

    (found,) = faults(sealed.put(tmp_path, rewritten(sealed.plain, take)))
    assert found == "files inside: it has no digital-report.xml inside, which proof.json names"


@pytest.mark.parametrize(
    ("proof", "words"),
    [
        (b"[1]", ""),
        (b"\xff", "not UTF-8 text"),
        (b"{}", "Field required"),
        (b'{"schema": "other"}', "Input should be"),
        (
            PROOF % (b'{"file":"gone.json","sha256":"%s"}' % (b"0" * 64)),
            "it has no gone.json inside",
        ),
        (
            PROOF % b'{"file":"../x","sha256":"A"}',
            "String should match pattern",
        ),
    ],
)
def test_a_proof_that_is_none_is_told(sealed: SignedReport, tmp_path: Path, proof: bytes, words: str) -> None:
    data = rewritten(sealed.plain, lambda pdf: put_inside(pdf, {"proof.json": proof}))
    (found,) = faults(sealed.put(tmp_path, data))
    assert words in found


def test_a_pdf_of_others_and_what_is_no_pdf_are_told(sealed: SignedReport, tmp_path: Path) -> None:
    blank = pikepdf.new()
    blank.add_blank_page()
    blank.save(tmp_path / "other.pdf")
    (found,) = faults(tmp_path / "other.pdf")
    assert "it has no proof.json inside" in found
    (tmp_path / "text.pdf").write_text("no PDF")
    (found,) = faults(tmp_path / "text.pdf")
    assert "no PDF that is whole" in found
    (tmp_path / "torn.pdf").write_bytes(sealed.signed[: len(sealed.signed) // 2])
    assert faults(tmp_path / "torn.pdf")


@pytest.mark.slow
def test_a_file_inside_that_grows_without_bounds_is_refused(sealed: SignedReport, tmp_path: Path) -> None:
    def change(document: pikepdf.Pdf) -> None:
        put_inside(document, {"evaluation.json": bytes(300 << 20)})

    data = rewritten(sealed.plain, change)
    assert len(data) < 1 << 20
    (found,) = faults(sealed.put(tmp_path, data))
    assert found.startswith("files inside: ")


def test_a_run_file_that_was_altered_is_found(sealed: SignedReport, tmp_path: Path) -> None:
    path = sealed.put(tmp_path, sealed.signed)
    run = tmp_path / sealed.run.name
    content = bytearray(run.read_bytes())
    content[-100] ^= 1
    run.write_bytes(content)
    (found,) = faults(path)
    assert f"{sealed.run.name}: not the file that was reported" in found


def test_run_files_are_found_by_their_hash_wherever_they_are_named(
    sealed: SignedReport, tmp_path: Path
) -> None:
    path = sealed.put(tmp_path / "report", sealed.signed, with_run=False)
    shutil.copyfile(sealed.run, tmp_path / "renamed.h5")
    findings = verify_report(path, Against(runs=(tmp_path,)))
    assert "run files: 1 of 1 have the SHA-256 that the report states" in told(findings, "holds")
    with pytest.raises(BadInput, match="no such file or folder"):
        verify_report(path, Against(runs=(tmp_path / "gone",)))


def test_a_limit_set_that_is_not_known_here_is_told(sealed: SignedReport, tmp_path: Path) -> None:
    def change(document: pikepdf.Pdf) -> None:
        evaluation = json.loads(document.attachments["evaluation.json"].get_file().read_bytes())
        evaluation["settings"]["limit_set"] = "0" * 64
        proof = json.loads(document.attachments["proof.json"].get_file().read_bytes())
        text = json.dumps(evaluation).encode()
        proof["evaluations"][0]["sha256"] = sha256(text).hexdigest()
        put_inside(document, {"evaluation.json": text, "proof.json": json.dumps(proof).encode()})

    findings = verify_report(sealed.put(tmp_path, rewritten(sealed.plain, change)), ALONE)
    assert told(findings, "fault") == []
    assert "judged by a limit set that is not known here; give --limits" in "\n".join(told(findings, "note"))


def test_what_is_trusted_must_be_certificates(sealed: SignedReport, tmp_path: Path) -> None:
    path = sealed.put(tmp_path, sealed.signed, with_run=False)
    (tmp_path / "text.pem").write_text("no certificate")
    (tmp_path / "broken.pem").write_text("-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n")
    for name, words in (
        ("text.pem", "no certificate is in it"),
        ("broken.pem", "no certificate is in it"),
        ("gone.pem", "cannot be read"),
    ):
        with pytest.raises(BadInput, match=words):
            verify_report(path, Against(trusted=tmp_path / name))


def test_differences_name_their_place() -> None:
    one: Any = {"a": [1.0, 2, {"b": "x"}], "c": None, "d": True}
    assert list(differences(one, {**one, "a": [1.0 + 1e-12, 2, {"b": "x"}]})) == []
    assert list(differences({"zero": 3.9e-17}, {"zero": -4.2e-17})) == []  # as another system rounds it
    assert [place for place, _, _ in differences({"small": 3.9e-9}, {"small": 4.2e-9})] == ["small"]
    assert list(differences(one, {**one, "c": 0.0, "d": 1})) == [("c", "null", "0.0"), ("d", "True", "1")]
    assert list(differences(one, {"a": [1.0, 3, {}], "c": None})) == [
        ("a.1", "2", "3"),
        ("a.2.b", "x", "not there"),
        ("d", "True", "not there"),
    ]
    assert list(differences({"a": [1]}, {"a": [1, 2]})) == [("a", "a list of 1", "a list of 2")]


def run(*words: str | Path) -> Result:
    return CliRunner().invoke(command, list(map(str, words)), standalone_mode=False)


def test_the_command_tells_line_by_line_and_ends_with_2_where_something_does_not_hold(
    sealed: SignedReport, tmp_path: Path
) -> None:
    path = sealed.put(tmp_path, sealed.signed)
    done = run(path, "--trust", sealed.key.pem)
    assert done.return_value == 0
    first, *lines = done.output.splitlines()
    assert first == f"{path}: holds, as far as it could be checked"
    assert all(line.startswith(("    holds: ", "    note: ")) for line in lines)
    path.write_bytes(sealed.signed + b"%")
    done = run(path, tmp_path / sealed.run.name)
    assert done.return_value == 2
    assert f"{tmp_path / sealed.run.name}: whole and unaltered" in done.output
    assert f"{path}: NOT AS IT SAYS" in done.output
    assert "fault: signature: 1 bytes were added after it was signed" in done.output
    assert "1 report(s) not as they say; do not rely on them" in done.stderr


def test_options_for_reports_are_refused_without_one(sealed: SignedReport) -> None:
    told_of = run(sealed.run, "--trust", sealed.key.pem).exception
    assert isinstance(told_of, BadInput)
    assert str(told_of) == "--trust: it is for a report, and none is named; name its PDF"


def test_without_the_extra_the_message_names_how_to_add_it(
    sealed: SignedReport, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = sealed.put(tmp_path, sealed.signed)
    monkeypatch.setattr("bufferstand.evaluation.report.signing.extra.find_spec", lambda _: None)
    told_of = run(path).exception
    assert isinstance(told_of, BadInput)
    assert "reading a report needs pyHanko, which is not installed; install it (" in str(told_of)
