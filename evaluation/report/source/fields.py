"""``report.toml``: what only the laboratory knows and a report must say (ISO/IEC 17025, 7.8.2.1)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import BeforeValidator, Field

from bufferstand.evaluation.report.source.number_range import check_pattern, is_pattern
from bufferstand.evaluation.wording import Code, Language, language_of, said
from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import Day, Settings, load_settings

FILE_NAME = "report.toml"
_Lines = Annotated[tuple[str, ...], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)]


CountryCode = Annotated[
    str, Field(pattern=r"^[A-Z]{2}$", description="two capital letters of ISO 3166-1, e.g. “DE”")
]


class ReportFields(Settings):
    """The report's own facts; an empty one is missing, and the report a draft."""

    language: Code = "en"
    """Language of the report (ISO 639-1)."""
    time_zone: str = ""
    """Time zone of its times, by the name of the IANA data base; empty: each as it is on record."""
    number: str = ""
    """The laboratory's own number of the report, or the pattern of its range (``PB-{year}-{running:04}``)."""
    number_register: str = ""
    """The CSV file in which the numbers of the range are written down, relative to this file."""
    laboratory: str = ""
    """Name of the laboratory; else that of the stand file."""
    laboratory_address: str = ""
    """Its address."""
    country: CountryCode | None = None
    """Country of the laboratory, two capital letters (ISO 3166-1); the digital report states it."""
    place_of_test: str = ""
    """Where it was tested."""
    customer: str = ""
    """Name of the customer; else that of the specimen file."""
    customer_address: str = ""
    """Address of the customer."""
    method: str = ""
    """Test method with edition and procedure version."""
    received: Day | None = None
    """When the specimen was received."""
    specimen_condition: str = ""
    """What state it was in: damage, wear, completeness (7.8.2.1 g)."""
    issued: Day | None = None
    """When the report was issued."""
    tested_by: str = ""
    """Who tested; else the operator of the runs."""
    checked_by: str = ""
    """Who checked."""
    authorised_by: str = ""
    """Who authorised."""
    sampling: str = ""
    """Sampling plan, where it bears on the results."""
    deviations: _Lines = ()
    """Additions to, deviations or exclusions from the method."""
    remarks: _Lines = ()
    """Remarks."""
    not_tested: _Lines = ()
    """What of the method was not tested, and why, beyond what the runs themselves show."""
    external_results: _Lines = ()
    """Results that are another laboratory's, and whose (7.8.2.1 p)."""
    decision_rule_set_by: str = ""
    """Who prescribed the decision rule: the standard, the customer, or the laboratory (7.8.6.1)."""
    opinions: _Lines = ()
    """Opinions and interpretations, kept apart from the results (7.8.7)."""
    mark: str = ""
    """The laboratory's mark (SVG, PNG or JPEG), relative to this file."""
    specimen_photo: str = ""
    """A photo of the specimen (PNG or JPEG), relative to this file."""
    setup_photo: str = ""
    """A photo of the specimen in the stand (PNG or JPEG), relative to this file."""
    accreditation_mark: str = ""
    """The mark of the laboratory's accreditation (SVG, PNG or JPEG), relative to this file."""
    accreditation_number: str = ""
    """Its number; the mark is never shown without it (ILAC-P8)."""
    introduction: str = ""
    """A text in Markdown that stands before the results, relative to this file."""
    appendices: _Lines = ()
    """Texts in Markdown that stand at the end of the annex, relative to this file."""
    template: str = ""
    """A folder with templates that override documented blocks of the shipped ones, relative to this file."""
    validation: str = ""
    """The record of ``bufferstand validate`` (validation.json), relative to this file (7.11.2)."""
    customer_supplied: _Lines = ()
    """Data that the customer supplied, for which the laboratory does not answer."""
    amends: str = ""
    """Id of the report that this one replaces (7.8.8)."""
    amends_report: str = ""
    """The PDF of that report, relative to this file: its id, its hash and what changed are taken from it."""
    amends_issued: Day | None = None
    """When that one was issued."""
    amendment_reason: str = ""
    """Why it was replaced."""
    amendment_changes: _Lines = ()
    """What is different from that one."""


_NAMES = {
    "laboratory": said("name of the laboratory"),
    "customer": said("name of the customer"),
    "operator": said("name of the operator"),
}
_FILES = (
    *("validation", "mark", "specimen_photo", "setup_photo", "accreditation_mark"),
    *("introduction", "number_register", "template", "amends_report"),
)
"""Keys that name a file relative to ``report.toml``."""
_REQUIRED = {
    "laboratory_address": said("address of the laboratory"),
    "place_of_test": said("place of the test"),
    "customer_address": said("address of the customer"),
    "method": said("test method with edition and procedure version"),
    "received": said("date of receipt of the specimen"),
    "issued": said("date of issue"),
    "checked_by": said("who checked the report"),
    "authorised_by": said("who authorised the report"),
}
_OF_AN_AMENDMENT = {
    "amends_issued": said("date of the report that this one replaces"),
    "amendment_changes": said("what this report changes"),
}


def load_fields(folder: Path) -> ReportFields:
    """Read ``report.toml`` in ``folder``; without one every field is missing.

    Raises
    ------
    BadInput
        As :func:`read_fields`.
    """
    path = folder / FILE_NAME
    return read_fields(path) if path.exists() else ReportFields()


def read_fields(path: Path) -> ReportFields:
    """Read a file of report fields.

    Raises
    ------
    BadInput
        If it cannot be read or breaks the schema, or changes a report and does not say which or why.
    """
    fields = load_settings(path, ReportFields)
    named = {key: getattr(fields, key) for key in _FILES}
    fields = fields.model_copy(update={key: str(path.parent / name) for key, name in named.items() if name})
    own = tuple(str(path.parent / name) for name in fields.appendices)
    fields = fields.model_copy(update={"appendices": own})
    _check_zone(fields, path)
    _check_number(fields, path)
    if fields.accreditation_mark and not fields.accreditation_number:
        raise BadInput(
            "the mark of an accreditation is not shown without its number",
            file=path,
            place="accreditation_mark",
            remedy="add accreditation_number",
        )
    amended = fields.amends or fields.amends_report
    if amended and not fields.amendment_reason:
        raise BadInput(
            f"the report amends {amended} and does not say why",
            file=path,
            place="amendment_reason",
            remedy="add the reason",
        )
    of_an_amendment = ("amends_issued", "amendment_reason", "amendment_changes")
    if not amended and (stray := [name for name in of_an_amendment if getattr(fields, name)]):
        raise BadInput(
            "the report is said to change another one, and not which",
            file=path,
            place=stray[0],
            remedy="add amends_report, the PDF of the report that it replaces, or amends, its id",
        )
    return fields


def _check_zone(fields: ReportFields, path: Path) -> None:
    try:
        language_for(fields, None)
    except BadInput as error:
        raise error.of_file(path) from None


def language_for(fields: ReportFields, code: Code | None) -> Language:
    """Return the language of a report, with its time zone: that of ``code``, or else of its fields.

    Raises
    ------
    BadInput
        If there is no such time zone.
    """
    return language_of(code or fields.language, fields.time_zone)


def _check_number(fields: ReportFields, path: Path) -> None:
    if is_pattern(fields.number):
        check_pattern(fields.number, path)
        if not fields.number_register:
            raise BadInput(
                "the number is a pattern, and no register of the given numbers is named",
                file=path,
                place="number",
                remedy="add number_register = “…/numbers.csv”, one file for all reports of the range",
            )
    elif fields.number_register:
        raise BadInput(
            "a register of numbers is named, and the number is no pattern",
            file=path,
            place="number_register",
            remedy="write number like “PB-{year}-{running:04}”, or leave number_register out",
        )


def missing_fields(fields: ReportFields, laboratory: str, customer: str, tested_by: str) -> tuple[str, ...]:
    """Return in words what is missing, given what the runs' own records say.

    Parameters
    ----------
    fields : ReportFields
        As the laboratory filled them in.
    laboratory, customer, tested_by : str
        As found in ``fields`` or the runs; empty where neither says it.
    """
    known = {"laboratory": laboratory, "customer": customer, "operator": tested_by}
    absent = [_NAMES[what] for what, name in known.items() if not name]
    required = _REQUIRED | (_OF_AN_AMENDMENT if fields.amends else {})
    return (*absent, *(text for name, text in required.items() if not getattr(fields, name)))
