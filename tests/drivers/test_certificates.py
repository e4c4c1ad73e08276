"""A digital calibration certificate becomes a channel's calibration, or is refused with one message."""

from __future__ import annotations

import tomllib
from datetime import date
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from bufferstand.cli.commands.calibration.import_ import command
from bufferstand.drivers.certificates.channel_calibration import calibrated
from bufferstand.drivers.certificates.reading import read_certificate
from bufferstand.drivers.certificates.stand_text import channel_of
from bufferstand.drivers.stand_file.loading import load_stand
from bufferstand.foundation.channels.calibration import Calibration
from bufferstand.foundation.errors import BadInput
from tests.drivers.conftest import SAMPLE_STAND
from tests.drivers.made_certificate import (
    CHAIN,
    FORCES_KN,
    KN,
    MV_PER_V,
    SIGNALS,
    TRANSDUCER,
    certificate,
    listed,
    newer_uncertainty,
    quantity,
    table,
    uncertainty,
    written,
)

BEHIND_AMPLIFIER = Calibration(
    id="old", coefficients=(0.0, 315.0), input_per_count=2.5e-7, input_unit="mV/V", zero_counts=1200.0
)
IN_MV_PER_V = (
    "coefficients = [0.0, 9.5367431640625e-05], certificate",
    'coefficients = [0.0, 315.0], input_per_count = 3.0e-7, input_unit = "mV/V", certificate',
)
"""A change of the stand's file: its force is that of a transducer behind an amplifier."""


def stand(folder: Path, *changes: tuple[str, str]) -> Path:
    text = SAMPLE_STAND.read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    path = folder / "stand.toml"
    path.write_text(text, encoding="utf-8")
    return path


def imported(*words: object) -> Result:
    return CliRunner().invoke(command, [str(word) for word in words], standalone_mode=False)


def channels(path: Path) -> dict[str, dict[str, Any]]:
    return {
        channel["name"]: channel
        for channel in tomllib.loads(path.read_text(encoding="utf-8"))["controller"]["channel"]
    }


def test_a_transducers_signal_becomes_the_channels_table(tmp_path: Path) -> None:
    read = read_certificate(written(tmp_path, certificate(TRANSDUCER)))
    new = calibrated(read, "force", BEHIND_AMPLIFIER)
    kept = {
        key: value
        for key, value in BEHIND_AMPLIFIER.model_dump().items()
        if key in {"input_per_count", "zero_counts"}
    }
    taken = {key: value for key, value in new.calibration.items() if value is not None}
    calibration = Calibration.model_validate(taken | kept)
    counts = [1200.0 + signal / 2.5e-7 for signal in SIGNALS]
    assert calibration.apply(counts) == pytest.approx(FORCES_KN)
    assert (calibration.id, calibration.date) == ("K-630 0001", date(2026, 3, 2))
    assert calibration.certificate == "DKD-K-12345 2026-03, Kraft & Söhne"
    assert calibration.valid_until == date(2028, 3, 2)
    # U = 0.001 mV/V of 315 kN a mV/V: 0.315 kN, 0.5 % of 63 kN, and at no load.
    assert new.uncertainty == {"accuracy_percent": 0.5, "zero": 0.315}


def test_errors_of_the_whole_chain_become_limits_with_u(tmp_path: Path) -> None:
    read = read_certificate(written(tmp_path, certificate(CHAIN)))
    new = calibrated(read, "force", Calibration())
    assert not {"coefficients", "table"} & new.calibration.keys()
    # the largest share: (0.2 + 0.1) of 63 kN; at no load 0.1 + 0.1 kN
    assert new.uncertainty == {"accuracy_percent": 0.477, "zero": 0.2}


def test_limits_of_a_whole_chain_hold_for_rising_and_falling_points(tmp_path: Path) -> None:
    forces = (0.0, 315.0, 630.0, 315.0, 0.0)
    shown = table(
        listed(forces, KN),
        listed((0.1, 315.5, 629.0, 316.5, 0.4), KN),
        listed((0.1, 0.5, -1.0, 1.5, 0.4), KN, uncertainty("0.1 0.4 0.8 0.4 0.1")),
    )
    new = calibrated(read_certificate(written(tmp_path, certificate(shown))), "force", Calibration())
    assert "Its points rise and fall: the limits hold for both directions." in new.notes
    # of falling points: (1.5 + 0.4) of 315 kN; at no load 0.4 + 0.1 kN
    assert new.uncertainty == {"accuracy_percent": 0.604, "zero": 0.5}


def test_u_of_another_k_is_taken_to_two_and_the_newer_form_is_read_alike(tmp_path: Path) -> None:
    shown = listed(SIGNALS, MV_PER_V, newer_uncertainty("0.0015", k="3"))
    text = certificate(table(listed(FORCES_KN, KN), shown), version="3.3.0")
    new = calibrated(read_certificate(written(tmp_path, text)), "force", BEHIND_AMPLIFIER)
    assert new.uncertainty == {"accuracy_percent": 0.5, "zero": 0.315}


def test_units_are_taken_to_the_channels(tmp_path: Path) -> None:
    wire = table(
        listed((0.0, 0.1, 0.25), r"\metre"),
        listed((0.0, 100.1, 250.2), r"\milli\metre"),
        listed((0.0, 100.0, 200.0), r"\micro\metre", uncertainty("50")),
    )
    new = calibrated(read_certificate(written(tmp_path, certificate(wire))), "stroke", Calibration())
    assert new.uncertainty == {"linearity": 0.25}
    bath = table(
        f"<si:hybrid>{listed((293.15, 313.15), chr(92) + 'kelvin')}</si:hybrid>",
        listed((20.1, 40.3), r"\degreecelsius"),
        listed((0.1, 0.3), r"\kelvin", uncertainty("0.05")),
    )
    warm = calibrated(read_certificate(written(tmp_path, certificate(bath))), "temperature", Calibration())
    assert warm.uncertainty == {"zero": 0.35}


def test_a_limit_is_never_rounded_down(tmp_path: Path) -> None:
    points = table(listed((100.0,), KN), listed((100.0,), KN), listed((0.0,), KN, uncertainty("0.33349")))
    new = calibrated(read_certificate(written(tmp_path, certificate(points))), "force", Calibration())
    assert new.uncertainty["accuracy_percent"] == pytest.approx(0.334)


def test_the_stand_file_is_changed_there_alone_and_keeps_its_comments(tmp_path: Path) -> None:
    path = stand(tmp_path, IN_MV_PER_V)
    before = path.read_text(encoding="utf-8").splitlines()
    done = imported(written(tmp_path, certificate(TRANSDUCER)), "--channel", "force", "--stand", path)
    assert done.exit_code == 0, done.exception
    assert "before by “GTM-K-630-0001” (simulated, 2026-01-15)" in done.stdout
    after = path.read_text(encoding="utf-8").splitlines()
    moved = [(old, new) for old, new in zip(before, after, strict=True) if old != new]
    assert [old.split(" =")[0] for old, _ in moved] == ["calibration", "uncertainty"]
    force = channels(path)["force"]
    assert force["calibration"] == {
        "id": "K-630 0001",
        "table": [list(point) for point in zip(SIGNALS, FORCES_KN, strict=True)],
        "input_per_count": 3.0e-7,
        "input_unit": "mV/V",
        "certificate": "DKD-K-12345 2026-03, Kraft & Söhne",
        "date": "2026-03-02",
        "valid_until": "2028-03-02",
    }
    assert force["uncertainty"] == {
        "accuracy_percent": 0.5,
        "reversibility_percent": 0.5,
        "zero": 0.315,
        "u_delay_s": 2e-5,
    }
    load_stand(path)


def test_a_device_with_a_scale_of_its_own_keeps_it(tmp_path: Path) -> None:
    path = stand(tmp_path)
    bath = table(
        listed((20.0, 40.0), r"\degreecelsius"), listed((20.1, 40.3), r"\degreecelsius", uncertainty("0.05"))
    )
    done = imported(written(tmp_path, certificate(bath)), "--channel", "temperature_1", "--stand", path)
    assert done.exit_code == 0, done.exception
    quantity_, calibration = channel_of(path, "temperature_1")
    assert (quantity_, calibration.coefficients) == ("temperature", (0.0, 0.0625))
    assert calibration.certificate.startswith("DKD-K-12345")


def test_lines_to_be_pasted_are_refused_until_they_are_filled_in(tmp_path: Path) -> None:
    done = imported(written(tmp_path, certificate(TRANSDUCER)), "--channel", "force_2")
    assert done.exit_code == 0, done.exception
    lines = tomllib.loads(done.stdout)
    assert lines["calibration"]["input_per_count"] == "fill-in"
    assert lines["uncertainty"] == {"accuracy_percent": 0.5, "zero": 0.315}
    chain = imported(written(tmp_path, certificate(CHAIN)), "--channel", "force")
    assert tomllib.loads(chain.stdout)["calibration"]["coefficients"] == "fill-in"


def test_what_the_certificate_does_not_say_is_said(tmp_path: Path) -> None:
    signature = (
        '<ds:Signature xmlns:ds="http://www.w3.org/2000/09/xmldsig#"/></dcc:digitalCalibrationCertificate>'
    )
    text = certificate(CHAIN, statements="").replace("</dcc:digitalCalibrationCertificate>", signature)
    done = imported(written(tmp_path, text), "--channel", "force")
    assert "valid_until is not written" in done.stderr
    assert "a signature, which was not checked" in done.stderr
    assert "valid_until" not in done.stdout
    given = imported(written(tmp_path, text), "--channel", "force", "--valid-until", "2027-01-31")
    assert 'valid_until = "2027-01-31"' in given.stdout


NO_U = table(listed(FORCES_KN, KN), listed(SIGNALS, MV_PER_V))
BOTH_WAYS = table(
    listed((0.0, 300.0, 600.0, 300.0), KN), listed((0.0, 1.0, 2.0, 1.01), MV_PER_V, uncertainty("0.001"))
)
DEEP = "<dcc:x>" * 100 + "</dcc:x>" * 100


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (certificate(CHAIN, space="https://ptb.de/dcc/"), "and not with <digitalCalibrationCertificate>"),
        ("<html/>", "it begins with <html>, and not with <digitalCalibrationCertificate> of"),
        (certificate(CHAIN, version="2.4.0"), "version “2.4.0” of the schema; known are 3.0 to 3.3"),
        (certificate(), "it has no table with quantities"),
        (certificate(CHAIN, CHAIN), "it has 2 tables: 1 Points; 2 Points"),
        (certificate(CHAIN, items=2), "it is of 2 items"),
        (certificate(CHAIN, number=""), "dcc:uniqueIdentifier: it is missing or empty"),
        (certificate(NO_U), "it states no expanded uncertainty"),
        (
            certificate(TRANSDUCER).replace(MV_PER_V, r"\newton\metre"),
            "which is no unit of force that is known",
        ),
        (certificate(CHAIN).replace(KN, "kN"), "its reference values are in kN, which is no unit"),
        (certificate(CHAIN).replace("629.0", "much"), "“much” in si:valueXMLList is no number"),
        (certificate(CHAIN).replace("629.0", "nan"), "“nan” in si:valueXMLList is no number"),
        (certificate(CHAIN).replace("629.0", "1e308"), "“1e308” in si:valueXMLList is more than 1e+12"),
        (certificate(CHAIN).replace("315.5 629.0", "315.5"), "4 reference values stand beside 3 measured"),
        (certificate(CHAIN).replace("0.1 0.1 0.4 0.8", "0.1 0.1"), "4 points have 2 uncertainties"),
        (certificate(CHAIN).replace("0.1 0.1 0.4 0.8", "-0.1"), "an uncertainty is negative"),
        (
            certificate(CHAIN).replace(f"{KN}</si:unitXMLList>", rf"{KN} \newton</si:unitXMLList>", 1),
            "different units",
        ),
        (certificate(BOTH_WAYS), "do not rise, or fall, all along"),
        (
            certificate(CHAIN.replace("<dcc:list>", "<dcc:list>" + quantity("basic_measuredValue", ""))),
            "2 quantities basic_measuredValue",
        ),
        (certificate(CHAIN).replace("2026-03-02", "2. 3. 2026"), "“2. 3. 2026” is no day"),
        (
            certificate(CHAIN).replace("2028-03-02", "2020-01-01"),
            "valid until 2020-01-01, before its own day",
        ),
        (certificate(CHAIN, before='<!DOCTYPE x [<!ENTITY a "b">]>\n'), "it has a document type"),
        (certificate(DEEP, CHAIN), "more than 64 elements lie within one another"),
        (b"%PDF-1.7 \xe2\xe3", "line 1, column 9: it is no XML"),
        (b"", "it is no XML"),
        (certificate(CHAIN)[:500], "it is no XML"),
        (certificate(CHAIN).replace("UTF-8", "klingon", 1), "it is no XML"),
    ],
)
def test_what_is_not_clear_is_refused_with_one_message(
    tmp_path: Path, text: str | bytes, problem: str
) -> None:
    path = stand(tmp_path, IN_MV_PER_V)
    before = path.read_bytes()
    behind = written(tmp_path, text)
    for words in ((), ("--stand", path)):
        done = imported(behind, "--channel", "force", *words)
        assert isinstance(done.exception, BadInput)
        assert problem in str(done.exception)
        assert done.exception.remedy
        assert done.stdout == ""
    assert path.read_bytes() == before
    assert sorted(file.name for file in tmp_path.iterdir()) == ["certificate.xml", "stand.toml"]


def test_a_table_is_chosen_by_its_number(tmp_path: Path) -> None:
    behind = written(tmp_path, certificate(BOTH_WAYS, CHAIN))
    assert imported(behind, "--channel", "force", "--table", 2).exit_code == 0
    wrong = imported(behind, "--channel", "force", "--table", 3)
    assert "it has no table 3; name one by --table 1 to 2" in str(wrong.exception)


def test_the_channel_must_be_one_of_the_stand_and_its_counts_must_have_a_meaning(tmp_path: Path) -> None:
    path = stand(tmp_path)
    behind = written(tmp_path, certificate(TRANSDUCER))
    unknown = imported(behind, "--channel", "forc", "--stand", path)
    assert "it has no channel “forc”; name one of force, stroke_1" in str(unknown.exception)
    assert "does not tell what the channel measures" in str(imported(behind, "--channel", "cell").exception)
    counts = imported(behind, "--channel", "force", "--stand", path)
    assert "does not say what a count is in mV/V" in str(counts.exception)


def test_a_stand_that_could_not_be_used_with_it_is_left_as_it_is(tmp_path: Path) -> None:
    path = stand(tmp_path)
    before = path.read_bytes()
    far = table(listed((1.0,), KN), listed((3.0,), KN, uncertainty("0.1")))
    done = imported(written(tmp_path, certificate(far)), "--channel", "force", "--stand", path)
    assert isinstance(done.exception, BadInput)
    assert done.exception.file == str(path)
    assert "nothing was changed" in done.exception.remedy
    assert path.read_bytes() == before
