"""Reading JSON that others wrote, or that a killed program or a bad disk has left: bounded, one message."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn

from bufferstand.foundation.errors import BadInput
from bufferstand.foundation.files.trees import MOST_VALUES, TOO_MANY_DIGITS, out_of_form, too_deep

LONGEST_LINE = 16 << 20
"""Bytes of a line of a file of JSON lines; one of a step of 10,000 cycles has two million."""


class NotJson(ValueError):  # noqa: N818 - it names the fact
    """A text is no JSON that can be worked with; the text of the exception says why."""


def json_content(text: str | bytes, most_values: int = MOST_VALUES) -> Any:
    """Return what a JSON text says.

    Parameters
    ----------
    text : str or bytes
        The JSON.
    most_values : int
        So many values it may have.

    Raises
    ------
    NotJson
        If it is no JSON (RFC 8259; NaN and Infinity are none), or nested deeper, longer, or with larger
        numbers than any document of bufferstand's.
    """
    try:
        content = json.loads(text, parse_constant=_no_constant)
    except RecursionError:
        raise NotJson(too_deep()[0]) from None
    except json.JSONDecodeError as error:
        raise NotJson(f"not valid JSON: {error}") from None
    except UnicodeDecodeError as error:
        raise NotJson(f"not UTF-8 text (byte {error.start})") from None
    except NotJson:
        raise
    except ValueError:  # Python's guard against numbers of thousands of digits
        raise NotJson(TOO_MANY_DIGITS[0]) from None
    if (wrong := out_of_form(content, most_values)) is not None:
        place = ".".join(map(str, wrong.path))
        raise NotJson(f"{place}: {wrong.problem}" if place else wrong.problem)
    return content


def json_object(
    text: str | bytes, file: Path, *, place: str = "", remedy: str = "", most_values: int = MOST_VALUES
) -> dict[str, Any]:
    """Return the object that a JSON text of a file is; ``most_values`` as of :func:`json_content`.

    Raises
    ------
    BadInput
        If it is no JSON (:func:`json_content`), or no object.
    """
    try:
        content = json_content(text, most_values)
    except NotJson as error:
        raise BadInput(str(error), file=file, place=place, remedy=remedy) from None
    if not isinstance(content, dict):
        raise BadInput("a JSON object is expected here", file=file, place=place, remedy=remedy)
    return content


def json_lines(path: Path) -> Iterator[tuple[int, Any]]:
    """Yield number (from 1) and content of each line of a file of JSON lines; none where there is no file.

    A line that is cut off, by a program that was killed or by a loss of power, is left out.

    Raises
    ------
    BadInput
        If the file cannot be read.
    """
    try:
        with path.open("rb") as stream:
            for number, line in enumerate(iter(lambda: stream.readline(LONGEST_LINE), b""), start=1):
                with suppress(NotJson):
                    yield number, json_content(line.decode("utf-8", "replace"))
    except FileNotFoundError:
        return
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path) from None


def _no_constant(name: str) -> NoReturn:
    raise NotJson(f"{name} is no number of JSON")
