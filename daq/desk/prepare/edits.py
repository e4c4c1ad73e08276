"""Changing one value in a campaign file's text: everything else stays, to the letter, comments included."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import AoT, Comment, Table, Whitespace

from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import NotToml, toml_content

Path = Sequence[str | int]
"""Where a value stands: ``("limits", "force_max_kN")``, ``("step", 2, "cycles")``."""
IN_THE_TEXT = "change it in the text"
NEW_STEPS: dict[str, str] = {
    "static": "speed_mm_per_s = 5.0\ncycles = 3\npause_s = 60.0\n",
    "harmonic": "prestress_mm = 20.0\namplitude_mm = 10.0\nfrequency_Hz = 1.0\ncycles = 5\n",
    "sweep": "prestress_mm = [20.0]\namplitude_mm = [10.0]\nfrequency_Hz = [0.5, 1.0]\ncycles = 5\n",
    "warm-up": (
        "temperature_C = 25.0\nprestress_mm = 20.0\namplitude_mm = 10.0\nfrequency_Hz = 1.0\n"
        "timeout_s = 3600.0\n"
    ),
    "cool-down": "temperature_C = 22.0\ntimeout_s = 14400.0\n",
    "hold": "stroke_mm = 20.0\nduration_s = 60.0\n",
}
"""Kind of a step → what a new one says: values of a quiet first try, to be changed."""


def changed(text: str, path: Path, value: Any) -> str:
    """Return a text with one value set; None takes its key out, so that what holds without it is in force.

    Parameters
    ----------
    text : str
        TOML.
    path : sequence
        Tables, numbers in lists of tables, and the key.
    value : bool, int, float, str, list or None

    Raises
    ------
    BadInput
        If the text is no TOML, or has no such place.
    """
    document = _parsed(text)
    wanted = _set(toml_content(text), path, value)
    try:
        table = _table(document, path[:-1], make=value is not None)
        if table is None:
            return text
        key = str(path[-1])
        if value is None:
            table.pop(key, None)
        elif key in table:
            table[key] = value
        else:
            _append(table, key, value)
        result = tomlkit.dumps(document)
    except (TOMLKitError, KeyError, IndexError, TypeError, AttributeError, ValueError):
        raise BadInput("this place of the file cannot be changed here", remedy=IN_THE_TEXT) from None
    return checked(result, wanted)


def add_step(text: str, kind: str) -> str:
    """Return a text with a step of a kind added at the end of its steps.

    Raises
    ------
    BadInput
        If there is no such kind here, or the text is no TOML.
    """
    if kind not in NEW_STEPS:
        raise BadInput(f"no step of the kind “{kind}” is begun here", remedy="write it in the text")
    before = toml_content_of(text)
    added = f'[[step]]\nkind = "{kind}"\n{NEW_STEPS[kind]}'
    wanted = {**before, "step": [*before.get("step", []), *toml_content(added)["step"]]}
    joined = text.rstrip("\n") + ("\n\n" if text.strip() else "") + added
    return checked(joined, wanted)


def without_step(text: str, index: int) -> str:
    """Return a text without one of its steps; comments that stand above the next step stay.

    Raises
    ------
    BadInput
        If there is no such step, or the text is no TOML.
    """
    document, before = _parsed(text), toml_content(text)
    steps = document.get("step")
    if not isinstance(steps, AoT) or not 0 <= index < len(steps):
        raise BadInput("there is no such step", remedy=IN_THE_TEXT)
    above_next = _taken_off(steps[index])
    home = steps[index - 1] if index else _table_before(document)
    del steps[index]
    if not steps:
        del document["step"]
    if home is not None:
        home.value.body.extend(above_next)
    left = [step for number, step in enumerate(before["step"]) if number != index]
    wanted = {key: value for key, value in before.items() if key != "step"} | ({"step": left} if left else {})
    return checked(tomlkit.dumps(document), wanted)


def toml_content_of(text: str) -> dict[str, Any]:
    """Return what a text says.

    Raises
    ------
    BadInput
        If it is no TOML.
    """
    try:
        return toml_content(text)
    except NotToml as error:
        raise BadInput(error.problem, remedy=error.remedy) from None


def checked(text: str, wanted: dict[str, Any]) -> str:
    """Return a text if it says what it should and nothing else.

    Raises
    ------
    BadInput
        If it does not.
    """
    try:
        says = toml_content(text)
    except NotToml:
        says = None
    if says != wanted:
        raise BadInput("this place of the file cannot be changed here", remedy=IN_THE_TEXT)
    return text


def _parsed(text: str) -> Any:
    toml_content_of(text)  # its message is the one that commands have, too
    try:
        return tomlkit.parse(text)
    except TOMLKitError:
        raise BadInput("the text cannot be changed by the form", remedy=IN_THE_TEXT) from None


def _table(document: Any, path: Path, *, make: bool) -> Any:
    """Return the table at a place, made if need be; None where it is not there and not to be made."""
    table = document
    for at, part in enumerate(path):
        if isinstance(part, str) and part not in table:
            if not make:
                return None
            table[part] = tomlkit.table(is_super_table=at + 1 < len(path))
        table = table[part]
    return table


def _append(table: Any, key: str, value: Any) -> None:
    """Add a key behind the last one, above the comments that belong to what follows."""
    if not isinstance(table, Table):
        table[key] = value
        return
    below = _taken_off(table)
    table.append(key, value)
    table.value.body.extend(below)


def _taken_off(table: Any) -> list[Any]:
    """Take blank lines and comments off the end of a table, and return them."""
    body = table.value.body
    below: list[Any] = []
    while body and body[-1][0] is None and isinstance(body[-1][1], Whitespace | Comment):
        below.insert(0, body.pop())
    return below


def _table_before(document: Any) -> Any:
    """Return the last table above the steps."""
    found = None
    for key, item in document.body:
        if key is not None and key.key == "step":
            break
        if isinstance(item, Table):
            found = item
    return found


def _set(content: dict[str, Any], path: Path, value: Any) -> dict[str, Any]:
    """Set a value in plain data: what the new text must say."""
    table: Any = content
    try:
        for part in path[:-1]:
            if value is None and isinstance(part, str) and part not in table:
                return content
            table = table.setdefault(part, {}) if isinstance(part, str) else table[part]
        if value is None:
            table.pop(path[-1], None)
        else:
            table[path[-1]] = value
    except (KeyError, IndexError, TypeError, AttributeError):
        raise BadInput("the file has no such place", remedy=IN_THE_TEXT) from None
    return content
