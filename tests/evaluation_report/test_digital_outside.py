"""PTB's own programs find nothing wrong with a digital test report, and do find what is wrong."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bufferstand.evaluation.report.build import build_content
from bufferstand.evaluation.report.digital.elements import SI
from bufferstand.evaluation.report.digital.quantities import DSI_UNITS
from bufferstand.evaluation.report.digital.whole import render_digital
from tests.evaluation_report.conftest import Made
from tests.evaluation_report.test_digital import WHOLE
from tests.outside.dcc import NO_SCHEMA, Faults, faults_of_dcc

pytestmark = pytest.mark.slow

WRONG = ((b"<dcc:mainSigner>true", b"<dcc:mainSigner>maybe"), (rb"\kilo\newton<", rb"\kilonewton<"))


@pytest.fixture(scope="module")
def checked(report: Made, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Faults]:
    folder = tmp_path_factory.mktemp("digital")
    whole = replace(report.source, fields=WHOLE)
    files = {name: folder / f"{name}.xml" for name in ("whole", "draft", "wrong", "units")}
    files["whole"].write_bytes(render_digital(whole, build_content(whole)))
    files["draft"].write_bytes(render_digital(report.source, report.content))
    wrong = files["whole"].read_bytes()
    for right, broken in WRONG:
        assert right in wrong
        wrong = wrong.replace(right, broken)
    files["wrong"].write_bytes(wrong)
    units = "".join(f"<si:unit>{unit}</si:unit>" for unit in DSI_UNITS.values())
    files["units"].write_text(f'<all xmlns:si="{SI}">{units}</all>', encoding="utf-8")
    found = faults_of_dcc(list(files.values()))
    return {name: found[file] for name, file in files.items()}


def test_a_whole_report_keeps_ptbs_rules(checked: dict[str, Faults]) -> None:
    assert checked["whole"].rules == ()
    assert checked["whole"].units == ()


def test_a_draft_breaks_one_only_where_it_has_no_country(checked: dict[str, Faults]) -> None:
    assert checked["draft"].rules == ("The given country code is invalid according to ISO3166-1.",)


def test_both_are_valid_by_the_schema_and_what_is_wrong_is_not(checked: dict[str, Faults]) -> None:
    if checked["whole"].schema is None:
        pytest.skip(NO_SCHEMA)
    assert checked["whole"].schema == ()
    assert checked["draft"].schema == ()
    (fault,) = checked["wrong"].schema or ()
    assert "mainSigner" in fault


def test_every_unit_that_can_be_written_is_one_of_d_si(checked: dict[str, Faults]) -> None:
    assert checked["units"].units == ()
    assert checked["wrong"].units == (r"\kilonewton",)
