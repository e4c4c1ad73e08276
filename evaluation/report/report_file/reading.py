"""A report as a file: the PDF from a stranger, read within bounds, and the files inside."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from bufferstand.evaluation.archive import check_evaluation
from bufferstand.evaluation.report.report_file.proof import PROOF_NAME, Proof
from bufferstand.evaluation.report.signing import needs_sign
from bufferstand.foundation import BadInput
from bufferstand.foundation.files import json_object

if TYPE_CHECKING:
    from pyhanko.pdf_utils.reader import PdfFileReader

LONGEST_REPORT = 1 << 28
"""Bytes of a report: one of 60 runs with pictures has some ten million."""
LONGEST_INSIDE = 1 << 28
"""Bytes of a file inside."""
_MOST_FILES = 100
_NOT_OURS = "look whether it is the report that you mean: one of bufferstand has its evaluation inside"


@dataclass(frozen=True, eq=False)
class ReportFile:
    """A report as it was read.

    Attributes
    ----------
    path : Path
    data : bytes
        The PDF.
    reader : PdfFileReader
        Of the same bytes.
    proof : Proof
    evaluations : mapping of str to mapping
        The evaluation documents inside, by name: those that the proof names, and no other.
    """

    path: Path
    data: bytes
    reader: PdfFileReader
    proof: Proof
    evaluations: Mapping[str, Mapping[str, Any]]

    @property
    def sha256(self) -> str:
        """Hash of the PDF."""
        return sha256(self.data).hexdigest()


def read_pdf(path: Path) -> tuple[bytes, PdfFileReader]:
    """Read a PDF.

    Raises
    ------
    BadInput
        If the extra ``sign`` is missing, the file cannot be read, or is no PDF that is whole.
    """
    needs_sign("reading a report")
    from pyhanko.pdf_utils.reader import PdfFileReader  # noqa: PLC0415 - an extra

    try:
        with path.open("rb") as stream:
            data = stream.read(LONGEST_REPORT + 1)
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path) from None
    if len(data) > LONGEST_REPORT:
        raise BadInput(f"longer than {LONGEST_REPORT} bytes: no report", file=path, remedy="check the path")
    try:
        reader = PdfFileReader(io.BytesIO(data))
        reader.root  # noqa: B018 - parsing is lazy
    except (Exception, RecursionError) as error:  # noqa: BLE001 - of a damaged file it raises anything
        raise BadInput(f"no PDF that is whole: {str(error) or type(error).__name__}", file=path) from None
    return data, reader


def read_report(path: Path) -> ReportFile:
    """Read a report with the files inside.

    Raises
    ------
    BadInput
        As :func:`read_pdf`, or if what is inside is not what a report of bufferstand has.
    """
    data, reader = read_pdf(path)
    try:
        inside = _inside(reader, path)
    except BadInput:
        raise
    except (Exception, RecursionError) as error:  # noqa: BLE001 - of a damaged file it raises anything
        raise BadInput(
            f"the files inside cannot be read: {str(error) or type(error).__name__}", file=path
        ) from None
    if PROOF_NAME not in inside:
        raise BadInput(f"it has no {PROOF_NAME} inside", file=path, remedy=_NOT_OURS)
    content = _json(inside[PROOF_NAME], path, PROOF_NAME)
    try:
        proof = Proof.model_validate(content)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        raise BadInput(first["msg"], file=path, place=f"{PROOF_NAME}: {place}", remedy=_NOT_OURS) from None
    _check_hashes(proof, inside, path)
    return ReportFile(path, data, reader, proof, _evaluations(proof, inside, path))


def _evaluations(proof: Proof, inside: Mapping[str, bytes], path: Path) -> Mapping[str, Mapping[str, Any]]:
    found = {}
    for named in proof.evaluations:
        document = _json(inside[named.file], path, named.file)
        check_evaluation(document, path)
        found[named.file] = document
    return found


def _check_hashes(proof: Proof, inside: Mapping[str, bytes], path: Path) -> None:
    """Refuse a file inside that is not the one that the report was made with."""
    named = {one.file: one.sha256 for one in (*proof.evaluations, *proof.attached)}
    if missing := [name for name in named if name not in inside]:
        raise BadInput(f"it has no {missing[0]} inside, which {PROOF_NAME} names", file=path)
    for name in sorted({*inside} - {PROOF_NAME}):
        if name not in named:
            raise BadInput(f"it has {name} inside, which {PROOF_NAME} does not name", file=path)
        if sha256(inside[name]).hexdigest() != named[name]:
            raise BadInput(
                f"it is not the one that the report was made with: its hash is not that in {PROOF_NAME}",
                file=path,
                place=name,
            )


def _json(data: bytes, path: Path, name: str) -> dict[str, Any]:
    try:
        text = data.decode()
    except UnicodeDecodeError:
        raise BadInput("not UTF-8 text", file=path, place=name, remedy=_NOT_OURS) from None
    return json_object(text, path, remedy=_NOT_OURS, most_values=LONGEST_INSIDE)


def _inside(reader: PdfFileReader, path: Path) -> dict[str, bytes]:
    """Return the associated files by name.

    What is listed as an attachment has to be the same: else a reader would show another file than is checked.
    """
    root = reader.root
    if "/AF" not in root:
        return {}
    associated, listed = root["/AF"], root["/Names"]["/EmbeddedFiles"]["/Names"]
    if len(associated) > _MOST_FILES or len(listed) != 2 * len(associated):
        raise BadInput("its files inside are not listed as in a report", file=path, remedy=_NOT_OURS)
    places = {str(listed[at]): listed.raw_get(at + 1) for at in range(0, len(listed), 2)}
    found: dict[str, bytes] = {}
    for at in range(len(associated)):
        specification = associated[at]
        name = str(specification["/UF"])
        if name in found or places.get(name) != associated.raw_get(at):
            raise BadInput(f"{name} is inside under another name, or twice", file=path, remedy=_NOT_OURS)
        streams = specification["/EF"]
        if len({streams.raw_get(key) for key in streams}) != 1:
            raise BadInput(f"{name} is inside with two contents", file=path, remedy=_NOT_OURS)
        data: bytes = streams["/F"].data
        if len(data) > LONGEST_INSIDE:
            raise BadInput(f"longer than {LONGEST_INSIDE} bytes", file=path, place=name)
        found[name] = data
    return found
