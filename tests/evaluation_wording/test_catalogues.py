"""The catalogues: every message in every language, with the facts that it has in English."""

from __future__ import annotations

import ast
import re
from itertools import pairwise
from pathlib import Path

import pytest

from bufferstand.drivers import MotionState
from bufferstand.evaluation.wording import Code
from bufferstand.evaluation.wording.language import EVALUATION, read_catalogue
from tests.evaluation_wording.code_texts import code_texts
from tests.evaluation_wording.messages import (
    CATALOGUES,
    ROOT,
    TRANSLATED,
    brought_up,
    said_messages,
    written,
)

FACT = re.compile(r"\{(\w+)\}")
NUMBER = re.compile("[0-9]+(?:[.,\u202f][0-9]+)*")
EVALUATING = ("evaluation", "daq", "drivers", "model", "recording", "foundation")
"""Rooms whose texts stand in evaluation documents and run files."""


def key(message: object) -> object:
    return tuple(message) if isinstance(message, list | tuple) else message


def facts(message: str) -> list[str]:
    return sorted(set(FACT.findall(message)))


@pytest.mark.parametrize("code", TRANSLATED)
def test_every_message_of_the_code_is_translated_and_no_other_is_there(code: Code) -> None:
    known = {key(one.id): one for one in read_catalogue(code) if one.id and not one.context}
    said = {key(message) for message in said_messages()}
    assert said - known.keys() == set(), "python -m tests.evaluation_wording.messages adds them"
    assert known.keys() - said == set(), "python -m tests.evaluation_wording.messages takes them out"
    assert [one.id for one in known.values() if one.fuzzy] == []
    texts = {
        id_: one.string if isinstance(one.string, tuple) else (one.string,) for id_, one in known.items()
    }
    assert [id_ for id_, forms in texts.items() if not all(forms)] == []


def numbers(message: str) -> list[str]:
    """Return the numbers that a message itself has, with a decimal point and without spaces in them."""
    found = NUMBER.findall(FACT.sub("", message))
    return sorted(number.replace(",", ".").replace("\u202f", "") for number in found)


@pytest.mark.parametrize("code", TRANSLATED)
def test_a_translation_has_the_facts_and_the_edges_of_its_message(code: Code) -> None:
    catalogue = read_catalogue(code)
    for one in catalogue:
        if not one.id:
            continue
        message = one.id[0] if isinstance(one.id, list | tuple) else one.id
        forms = one.string if isinstance(one.string, tuple) else (one.string,)
        assert len(forms) in {1, catalogue.num_plurals}
        counted = one.id if isinstance(one.id, list | tuple) else (message,)
        for form in forms:
            assert form, one.id  # nothing at all would be said
            assert facts(form) == facts(message), one.id
            assert numbers(form) in [numbers(each) for each in counted], one.id
            assert form.endswith(" ") == message.endswith(" "), one.id
            assert form.endswith(" ± U") == message.endswith(" ± U"), one.id
            if message[:1] not in ":;":
                assert form.startswith(" ") == message.startswith(" "), one.id


@pytest.mark.parametrize("code", TRANSLATED)
def test_a_catalogue_is_written_as_the_tool_writes_it(code: Code) -> None:
    assert (CATALOGUES / f"{code}.po").read_bytes() == written(brought_up(code))


def pairs(text: str) -> set[tuple[str, str]]:
    """Return the words that follow each other in a text."""
    words = re.findall(r"[\w'-]+", text)
    return set(pairwise(words))


def test_the_messages_of_the_evaluation_are_those_of_the_code() -> None:
    """A text of the evaluation that is worded anew would stay English without a word."""
    texts = [file.read_text(encoding="utf-8") for file in (ROOT / "evaluation").rglob("*.toml")]
    texts += [state.name.lower() for state in MotionState]  # as a safe stop names them
    for file in (file for room in EVALUATING for file in (ROOT / room).rglob("*.py")):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        nodes = [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)]
        texts += [text for text in nodes if isinstance(text, str)]
        texts += [FACT.sub("{}", form) for text in code_texts(file) for form in text.forms]
    words = {word for text in texts for word in re.findall(r"[\w'-]+", text)}
    following = {pair for text in texts for pair in pairs(text)}
    for one in read_catalogue("de"):
        if one.context != EVALUATION or not one.id:
            continue
        pieces = FACT.split(str(one.id))[::2]
        assert {word for piece in pieces for word in re.findall(r"[\w'-]{4,}", piece)} <= words, one.id
        own = {pair for piece in pieces for pair in pairs(piece)}
        assert not own or own & following, one.id


def test_all_languages_have_the_same_messages_of_the_evaluation() -> None:
    by_language = [
        {one.id for one in read_catalogue(code) if one.context == EVALUATION} for code in TRANSLATED
    ]
    assert by_language[0] == by_language[1] == by_language[2]


def test_the_catalogues_are_those_of_the_languages() -> None:
    assert {Path(file).stem for file in CATALOGUES.glob("*.po")} == set(TRANSLATED)
