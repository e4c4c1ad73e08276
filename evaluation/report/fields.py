"""``report.toml``: what only the laboratory knows and a report must say (ISO/IEC 17025, 7.8.2.1)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import BeforeValidator

from foundation.errors import BadInput
from foundation.settings import Day, Settings, load_settings

FILE_NAME = "report.toml"
_Lines = Annotated[tuple[str, ...], BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)]


class ReportFields(Settings):
    """The report's own facts; an empty one is missing, and the report a draft."""

    laboratory: str = ""
    laboratory_address: str = ""
    place_of_test: str = ""
    customer: str = ""
    customer_address: str = ""
    method: str = ""
    """Test method with edition and procedure version."""
    received: Day | None = None
    """When the specimen was received."""
    issued: Day | None = None
    tested_by: str = ""
    checked_by: str = ""
    authorised_by: str = ""
    sampling: str = ""
    """Sampling plan, where it bears on the results."""
    deviations: _Lines = ()
    """Additions to, deviations or exclusions from the method."""
    remarks: _Lines = ()
    customer_supplied: _Lines = ()
    """Data that the customer supplied, for which the laboratory does not answer."""
    amends: str = ""
    """Id of the report that this one replaces."""
    amendment_reason: str = ""


_REQUIRED = {
    "laboratory_address": "address of the laboratory",
    "place_of_test": "place of the test",
    "customer_address": "address of the customer",
    "method": "test method with edition and procedure version",
    "received": "date of receipt of the specimen",
    "issued": "date of issue",
    "checked_by": "who checked the report",
    "authorised_by": "who authorised the report",
}


def load_fields(folder: Path) -> ReportFields:
    """Read ``report.toml`` in ``folder``; without one every field is missing.

    Raises
    ------
    BadInput
        If it cannot be read or breaks the schema.
    """
    path = folder / FILE_NAME
    if not path.exists():
        return ReportFields()
    fields = load_settings(path, ReportFields)
    if fields.amends and not fields.amendment_reason:
        raise BadInput(
            f"the report amends {fields.amends} and does not say why",
            file=path,
            place="amendment_reason",
            remedy="add the reason",
        )
    return fields


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
    absent = [f"name of the {what}" for what, name in known.items() if not name]
    return (*absent, *(text for name, text in _REQUIRED.items() if not getattr(fields, name)))
