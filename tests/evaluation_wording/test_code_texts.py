"""Every text of ours that can reach a report is said in every language: looked for in the code itself."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest

from bufferstand.daq.strokes.stroke_rows import StrokeRow
from bufferstand.daq.warm_up.outcome import WarmUpOutcome
from bufferstand.evaluation.wording import Code, Language
from tests.evaluation_wording.code_texts import FACT, CodeText, code_texts, handed_texts
from tests.evaluation_wording.messages import ROOT, TRANSLATED

ROOMS = (
    "evaluation",
    "daq/acquisition/catching_up.py",
    "daq/acquisition/outage.py",
    "daq/acquisition/suspend_check.py",
    "daq/motions/force_rows.py",
    "daq/motions/release_bound.py",
    "daq/motions/safe_stop.py",
    "daq/motions/stop_observer.py",
    "daq/strokes/correction_steps.py",
    "daq/strokes/knowledge.py",
    "daq/strokes/sine_command.py",
    "daq/zero/first_contact.py",
    "daq/zero/limits.py",
    "drivers/amplifiers/host_stamps.py",
    "drivers/amplifiers/aed/values.py",
    "drivers/controllers/ring_reader.py",
    "drivers/modbus/link.py",
    "drivers/modbus/wires.py",
    "drivers/thermometers/bus.py",
    "drivers/thermometers/ds18b20.py",
    "foundation/channels/plausibility.py",
    "model/identified_range.py",
    "model/spring.py",
    "model/twin/alarming.py",
    "recording/journal/records.py",
    "recording/journal/segments.py",
    "recording/sealing/seal_journal.py",
)
"""Rooms and files whose texts stand in evaluation documents and run files, and so in reports."""
STOPPING = tuple(
    f"daq/{room}"
    for room in (
        *("acquisition", "campaign", "guards", "motions", "operator"),
        *("stand", "strokes", "twin", "warm_up", "zero"),
    )
)
"""Rooms that stop a run, or note what happened in it."""
GUARDS_SAY = frozenset({"Trip", "SignalDoubt", "_doubt", "_scaled_doubt"})
"""What is handed what a guard says: a trip, and a doubt of a signal, which a trip tells."""
HALTS = frozenset({"Halt", "NoContactError", "_latch_fault", "_refusal", "_refuse", "trip_at", "trip_of"})
"""What is handed why the program itself stops: the controller, its wire, the operator, the disk."""
EVENTS = frozenset({"say", "event", "once"})
"""What is handed an event of a run: a report has the last one of a run that ended early."""
CONTROLLERS = ("drivers/controllers",)
SENSORS = ("drivers/acquisition", "drivers/amplifiers", "drivers/thermometers")
"""Rooms whose words about a device, or its wire, stand behind a reason, or are an event of a run."""
FAULTS = frozenset(
    {
        *("DeviceFault", "NotInCharge", "WireLost", "CommandRejected", "ModbusRefusal"),
        *("fault", "lost", "note", "distrust", "AlteredBlock", "DoubtfulBlock", "CannotOpenError"),
    }
)
"""What is handed what the driver of a controller says."""
SENSORS_SAY = frozenset({"_fault", "complain", "refuse", "SensorFault"})
"""What is handed what a sensor's driver says while it reads; it is set up before a run."""
NO_REPORT = {
    "evaluation/archive": "settings, tables and messages of whole archives; a report has none of them",
    "evaluation/catalogue": "names and definitions of quantities: the messages of the code have the names",
    "evaluation/document": "the written document and its schema",
    "evaluation/facts/channel_identity.py": "what tells channels apart; compared, never shown",
    "evaluation/facts/quantity_entries.py": "texts of the JSON Schema",
    "evaluation/figures": "the figures of the model and of the paper: a folder of its own, in English",
    "evaluation/publication": "the crate of a publication, which is English",
    "evaluation/report": "said with their parts: the messages of the code have them",
    "evaluation/validation": "the record of the validation, which is English",
    "evaluation/wording": "the languages themselves",
}
"""Folders and files with texts that no report shows, and why not."""
NOT_SHOWN = {
    "by itself": "a key of a group of runs",
    "{least} or more": "of an error",
    "first contact": "what a release is measured from: a message has it in it",
    "its own zero (no contact was touched off)": "as before",
    **dict.fromkeys(
        (
            *("[zero] travel_max_mm", "[zero] stroke_max_mm", "[guards] zero_force_max_kN"),
            ", more than {apart_mm} mm ({wires_apart}): align the specimen, or hook the wires in anew",
        ),
        "a setting, or a piece of a message that is told whole",
    ),
    "nothing follows": "a kind of end, told in other words",
    "record cut short": "a kind of end, told in other words",
    "invalid record": "a kind of end, told in other words",
    "wiring of ": "the beginning of a guard's name",
    "plausibility of ": "the beginning of a guard's name",
    "the limit set asks for: {asked}; take the item out, or name its set with --limits": "of an error",
}
"""Texts of the other files that no report shows, and why not."""
READING = ("recording/runfile", "evaluation/loading", "evaluation/record")
"""Rooms that refuse a file of a run."""
NO_PROBLEM = {
    "a dataset needs the library xarray, which is not installed": "of a notebook",
    "install it: {xarray}": "of a notebook",
    "is {kind}; a run file has none such": "a link: its three kinds are messages of their own",
}
"""What these refuse besides, and why no report has it."""
KEYS = "keys: Ctrl-C stop now · c stop after the cycle · s stop after the step · n note (end with Enter)"
NO_REASON = {
    KEYS: "said at the terminal",
    "waits for the controller to come to rest by itself{at_most}: {what} ({shown}); nothing is written to it "
    "meanwhile, Ctrl-C ends the wait": "said at the terminal",
    "the controller is at rest, and nobody has it, after {began_s} s: going on": "said at the terminal",
    "{why}; the stand was not touched": "a motion by hand, of which there is no run",
    "start temperature": "the name of a guard",
    "fallen off": "a kind of doubt",
    "no heat": "a kind of doubt",
    "follows the specimen": "a kind of doubt",
    "force, force_2": "names of channels",
    "force, position": "names of channels",
    "calibration (hooked in anew since the zero?)": "a key behind its table, which is told with it",
    "delay_s and calibration": "a key behind its table, which is told with it",
    "{calibration}, or [limits] machine_stiffness_kN_per_mm": "two keys",
}
"""What guards hand over besides, and what it is."""
LIKELY = {
    "lacking": "cycle 7",
    **dict.fromkeys(("reading", "others", "broken", "silent"), ""),
    "further": "given up",
    "stop": "force 7 kN (7), stroke 7 mm, valve off, after 7 s",
}
LIKELY_OF_GUARDS = {"more": "", "beside": "", "fault": ": its sign is turned"}
"""Facts that are no number, and one of their values."""
TWO_WORDS = re.compile(r"[A-Za-z]{2,}.* .*[A-Za-z]{2,}|[A-Za-z]{2,} .*[A-Za-z]{2,}", re.DOTALL)
ENGLISH = re.compile(
    r"\b(the|of|is|are|and|which|from|by|with|has|cannot|not|what|that|between|at least|same|first|whole)\b"
)


def reaching(rooms: tuple[str, ...] = ROOMS) -> list[Path]:
    """Return the files whose texts can reach a report."""
    files = [file for room in rooms for file in sorted((ROOT / room).rglob("*.py")) or [ROOT / room]]
    return [file for file in files if not _left_out(file.relative_to(ROOT).as_posix())]


def _left_out(file: str) -> bool:
    return any(file == one or file.startswith(f"{one}/") for one in NO_REPORT)


def example(form: str, likely: Mapping[str, str] = LIKELY) -> str:
    """Return a text of a form: with numbers for its facts, without a fact that a word follows at once."""
    text = re.sub(r"\{\w+\}(?=[A-Za-z])", "", form)
    return FACT.sub(lambda fact: likely.get(fact[1], "7"), text)


def left_as_it_is(text: CodeText, code: Code, likely: Mapping[str, str] = LIKELY) -> list[str]:
    """Return the forms of a text that a language does not say, or not wholly."""
    examples = [(form, example(form, likely)) for form in text.forms]
    said = [(form, english, Language(code).say(english)) for form, english in examples]
    return [
        form
        for form, english, other in said
        if TWO_WORDS.search(FACT.sub("", form)) and form not in NOT_SHOWN
        if other in {english, ""} or ENGLISH.search(other) or _part_stays(english, other)
    ]


def _part_stays(english: str, other: str) -> bool:
    """Return whether one of the reasons in a row is left as it is: it may have none of the common words."""
    parts = re.split("; |: ", english)
    return any(TWO_WORDS.search(part) and part in other for part in parts)


@pytest.fixture(scope="module")
def texts() -> list[CodeText]:
    return [text for file in reaching() for text in code_texts(file)]


@pytest.mark.parametrize("code", TRANSLATED)
def test_every_text_that_can_reach_a_report_has_a_translation(texts: list[CodeText], code: Code) -> None:
    """Without one the report of another language would say it in English, and nothing else would tell."""
    assert len(texts) > 300
    lacking = [f"{text.file}:{text.line}: {form}" for text in texts for form in left_as_it_is(text, code)]
    assert lacking == [], f"no message of the context evaluation in {code}.po has this form"


@pytest.mark.parametrize(
    ("say", "least", "likely"),
    [(GUARDS_SAY, 150, LIKELY_OF_GUARDS), (HALTS, 35, LIKELY), (EVENTS, 15, LIKELY_OF_GUARDS)],
)
def test_what_is_said_while_a_run_is_made_has_a_translation(
    say: frozenset[str], least: int, likely: Mapping[str, str]
) -> None:
    """Why a run was stopped, and what was noted in it: it is in the run's file, so in reports."""
    files = sorted(file for room in STOPPING for file in (ROOT / room).rglob("*.py"))
    reasons = [text for file in files for text in handed_texts(file, say)]
    assert len({form for text in reasons for form in text.forms}) > least
    for code in TRANSLATED:
        lacking = {
            f"{text.file}:{text.line}: {form}"
            for text in reasons
            for form in left_as_it_is(text, code, likely)
            if form not in NO_REASON
        }
        assert lacking == set(), f"no message of the context evaluation in {code}.po has this form"


@pytest.mark.parametrize(
    ("rooms", "say", "least"),
    [(CONTROLLERS, FAULTS, 50), (SENSORS, SENSORS_SAY, 20)],
    ids=["controllers", "sensors"],
)
def test_what_drivers_say_has_a_translation(rooms: tuple[str, ...], say: frozenset[str], least: int) -> None:
    """Why a wire or a device failed: behind the reason of a run that ended early, or its last event."""
    files = [file for room in rooms for file in sorted((ROOT / room).rglob("*.py"))]
    words = [text for file in files for text in handed_texts(file, say)]
    assert len({form for text in words for form in text.forms}) > least
    for code in TRANSLATED:
        lacking = {
            f"{text.file}:{text.line}: {form}" for text in words for form in left_as_it_is(text, code, LIKELY)
        }
        assert lacking == set(), f"no message of the context evaluation in {code}.po has this form"


SINE = StrokeRow(
    "harmonic", 1.27, 20.0, 10.0, 20.0, 10.0, 20.2, 10.1, 19.8, 9.7, 20.0, 9.9, cycles=9, cycles_off="1-3"
)
WARM = WarmUpOutcome(goes=2, lag_s=40.0, rise_K=0.31, spring_C=25.2, above_K=0.0, rested_s=120.0)
SENTENCES = (
    SINE.sentence(),
    replace(SINE, by_force=True).sentence(),
    replace(SINE, cycles_changed="1", cycles_not_close="4-6", cycles_unseen="9").sentence(),
    f"warmed up: 25.1 °C: {WARM.sentence()}",
    f"warmed up: 25.1 °C: {replace(WARM, goes=1, lag_s=None, above_K=0.4).sentence()}",
)


@pytest.mark.parametrize("code", TRANSLATED)
def test_what_objects_say_of_themselves_is_said(code: Code) -> None:
    """Sentences that methods put together, which are not followed through the code."""
    for text in SENTENCES:
        said = Language(code).say(text)
        assert said != text
        assert not ENGLISH.search(said)


def test_why_a_run_is_not_in_a_report_has_a_translation() -> None:
    """What is wrong with a file that could not be read or evaluated, and what to do about it."""
    files = [file for room in READING for file in sorted((ROOT / room).rglob("*.py"))]
    refused = [text for file in files for text in handed_texts(file, frozenset({"BadInput"}))]
    assert len({form for text in refused for form in text.forms}) > 60
    for code in TRANSLATED:
        lacking = {
            f"{text.file}:{text.line}: {form}"
            for text in refused
            for form in left_as_it_is(text, code)
            if form not in NO_PROBLEM
        }
        assert lacking == set(), f"no message of the context evaluation in {code}.po has this form"


def test_what_is_left_out_is_there() -> None:
    assert [place for place in NO_REPORT if not (ROOT / place).exists()] == []
    said = {form for file in reaching() for text in code_texts(file) for form in text.forms}
    assert NOT_SHOWN.keys() - said == set()


SOURCE = '''
"""Not this."""
from bufferstand.evaluation.plausibility.signal_comparison.as_finding import CABLE

WHERE = {"a": "at the head", "b": "at the foot"}


def found(size, many, name):
    if size < 0:
        raise ValueError("not this either")
    where = WHERE.get(name)
    what = f"{many} cracks" if many > 1 else "a crack"
    text = f"{what} of {size:.3g} mm {where}"
    if many > 5:
        text += ", and it grows"
    return [f"{text}: {CABLE}", _turned("left"), _turned("right")]


def _turned(side):
    return f"turned to the {side}" + " by hand"
'''


def test_texts_are_followed_to_what_a_reader_sees(tmp_path: Path) -> None:
    forms = {form for text in code_texts(written_below_root(tmp_path, SOURCE)) for form in text.forms}
    assert "a crack of {size} mm at the foot, and it grows: look at its cable and plug" in forms
    assert "{many} cracks of {size} mm at the head: look at its cable and plug" in forms
    assert {"turned to the left by hand", "turned to the right by hand"} <= forms
    assert not {form for form in forms if "not this" in form.lower() or form.startswith("at the")}


def test_a_text_without_translation_would_be_named(tmp_path: Path) -> None:
    source = 'def why(force):\n    return f"the moon pulls with {force:.3g} kN"\n'
    (text,) = code_texts(written_below_root(tmp_path, source))
    for code in TRANSLATED:
        assert left_as_it_is(text, code) == ["the moon pulls with {force} kN"]


def written_below_root(folder: Path, source: str) -> Path:
    file = folder / "made.py"
    file.write_text(source, encoding="utf-8")
    return file
