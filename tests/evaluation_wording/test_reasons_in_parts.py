"""Reasons in a row: each part is said on its own, and words that nobody foresaw stay as they are."""

from __future__ import annotations

import pytest

from bufferstand.evaluation.wording import Code, Language
from tests.evaluation_wording.messages import TRANSLATED
from tests.evaluation_wording.test_code_texts import ENGLISH

STOPPED = "safe stop: force 0.4 kN (channel force_2, zero taken off; force shows 31.5 kN), stroke 1.2 mm, "
NOT_OFF = "VALVE NOT OFF (state ramping), after 12.3 s; NOT SAFE: use the stand's emergency stop"
WHOLE = (
    STOPPED + NOT_OFF,
    STOPPED + NOT_OFF + " (watchdog not fed: it hums; the release did not end in time)",
    (
        "safe stop by the controller itself: force 0.0 kN (the controller's own reading), stroke 0.3 mm, "
        "valve off, after 1.0 s (a guard demanded an emergency after the hold: released at once)"
    ),
    (
        "nothing was sent: another program may have the stand (it hums); last seen: force 3.0 kN (the "
        "controller's own reading), stroke 1.0 mm, valve off, after 0.1 s; NOT SAFE: it is not this "
        "program's to stop; look at the stand, which has its emergency stop"
    ),
)


def test_what_nobody_foresaw_stays_as_it_is() -> None:
    text = f"{STOPPED}{NOT_OFF} (hold: it hums; nobody knows why; released at once)"
    assert Language("de").say(text) == (
        "sicherer Halt: Kraft 0,4 kN (Kanal force_2, Nullpunkt abgezogen; force zeigt 31,5 kN), Hub 1,2 mm, "
        "VENTIL NICHT AUS (Zustand: fährt eine Rampe), nach 12,3 s; NICHT SICHER: den Not-Halt des "
        "Prüfstands benutzen (Halten: it hums; nobody knows why; sofort entlastet)"
    )


def test_a_text_that_nobody_knows_is_not_said_by_halves() -> None:
    text = "it hums; nobody knows why (the release did not end in time)"
    assert Language("de").say(text) == text


def test_french_has_its_own_signs_between_reasons() -> None:
    said = Language("fr").say("the controller or its wire failed: its watchdog had not been fed yet; it hums")
    assert said.endswith("n’avait pas encore été alimenté\N{NO-BREAK SPACE}; it hums")


FAILED = "the controller or its wire failed: controller at 127.0.0.1:15020 unit 1: "
LATE = "no reply within 0.5 s, twice"
CABLE = "look at the network cable, the controller's load, and whether a second program talks to it"
WIRES = (
    f"{FAILED}exchanging the sample ring (FC23, 9 registers from 40001): {LATE}; {CABLE}",
    (
        f"{FAILED}reading status (FC3, 12 registers from 0): refused with Modbus exception 4 (device "
        "failure); look at the register profile and the state of the controller"
    ),
    (
        f"{FAILED}no connection within 0.5 s; is it switched on, the network cable in, and the host "
        "right?; not fed for 2.1 s, its watchdog (2 s) acts by itself"
    ),
    (
        f"{FAILED}two blocks of samples running cannot be true: the block begins at sequence 70000, "
        "before 70400 which was asked for: the controller has restarted, or another program reads its "
        "ring; look at the controller's event log, and whether a second program talks to it"
    ),
    (
        f"{FAILED}it has dropped this program's right to give commands (it was started anew, or got no "
        "heartbeat for 10 s); nothing more is sent to it"
    ),
    (
        f"{STOPPED}{NOT_OFF} (status: controller at 127.0.0.1:502 unit 1: reading status (FC3, 12 "
        f"registers from 0): {LATE}; {CABLE})"
    ),
)
SENSORS = (
    (
        "specimen has given no true reading for 12.0 s (limit 10 s; last true reading 24.00 °C): "
        "temperature_1 (in the bore, 28-0000073d1a52): not on the bus; look at plug and cable, "
        "and at the ROM in the stand file"
    ),
    (
        "force_2 has delivered nothing for 3.0 s (limit 2 s): force_2 at /dev/ttyUSB0: silent for 1.2 s; "
        "look at cable, power and port"
    ),
    (
        "force_2: force_2 at /dev/ttyUSB0: the spacing of its frames was lost (count since the start: 2); "
        "look at cable, shield and baud rate"
    ),
    (
        "stroke_1: stroke_1 reads 0 counts (≤ 100), an end of its converter: a draw wire at its end, or its "
        "cable broken; look at the wire, its plug and its supply"
    ),
    (
        "temperature_1: 5 times in this run: temperature_1 (at the foot, 28-1): the data line is shorted; "
        "look at plugs and crushed cables"
    ),
)


@pytest.mark.parametrize("code", TRANSLATED)
@pytest.mark.parametrize("text", SENSORS)
def test_a_sensor_that_stopped_is_said(code: Code, text: str) -> None:
    said = Language(code).say(text)
    assert said != text
    assert not ENGLISH.search(said.replace("in the bore", "").replace("at the foot", ""))


def test_addresses_and_registers_are_written_as_they_are() -> None:
    assert Language("de").say(WIRES[0]) == (
        "die Steuerung oder ihre Leitung fiel aus: Steuerung bei 127.0.0.1:15020 Gerät 1: Austausch: "
        "Ringspeicher der Messwerte (FC23, 9 Register ab 40001): keine Antwort innerhalb von 0,5 s, "
        "zweimal; Netzwerkkabel und Auslastung (Steuerung) prüfen, und ob ein zweites Programm mit ihr "
        "spricht"
    )


NOTED = (
    "20 ± 10 mm at 1.27 Hz cannot be reached: force_max_kN = 300",
    "20 ± 10 mm at 1.27 Hz cannot be reached: speed of the piston, at most 120 mm/s",
    (
        "20 ± 10 mm would need ± 12.31 mm of the piston, and ± 10.02 mm are left by travel of the piston, to "
        "60.00 mm from first contact"
    ),
    "cycle 3: 10.1 … 99.8 kN",
    (
        "first contact was not found: the force rose by 0.20 kN at most, with a noise of 0.30 kN: no "
        "contact; touch off again"
    ),
    (
        "force reads +12.00 kN at rest with the valve off, more than zero_force_max_kN = 5 kN, and force_2 "
        "+2.00 kN of one transducer: scale, zero or wire of one of them is wrong, and there need be no load"
    ),
    (
        "the force reads +12.00 kN at rest, more than [guards] zero_force_max_kN = 5 kN: force reads +12.00 "
        "kN and force_2 +2.00 kN of one transducer: scale, zero or wire of one of them is wrong, and there "
        "need be no load: look at their wiring and at [[controller.channel]] name = “force”, calibration; "
        "where the specimen bears one: unload the specimen, or set the zero of transducer or calibration"
    ),
)


@pytest.mark.parametrize("code", TRANSLATED)
@pytest.mark.parametrize("text", [*WHOLE, *WIRES, *NOTED])
def test_what_went_wrong_or_is_noted_is_said(code: Code, text: str) -> None:
    said = Language(code).say(text)
    assert said != text
    assert not ENGLISH.search(said)


def test_a_text_longer_than_any_message_stays_and_costs_nothing() -> None:
    """Of a few thousand characters the forms would have to be told apart for minutes."""
    text = "force 3 kN exceeds " * 2000
    assert Language("de").say(text) == text


def test_a_long_row_of_reasons_is_said_part_by_part() -> None:
    text = "; ".join(["no temperature"] * 200)
    assert Language("de").say(text) == "; ".join(["keine Temperatur"] * 200)
