"""Reading TOML that others wrote: bounded in length, nesting and numbers before anything is made of it."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable
from typing import Any

from bufferstand.foundation import has_controls
from bufferstand.foundation.files import DEEPEST, TOO_MANY_DIGITS, out_of_form, too_deep

LONGEST_SETTINGS = 1 << 20
"""Characters of a settings file; a spring model of 1,000 points has 60,000."""
MOST_SETTINGS = 200_000
"""Values of a settings file."""
_PART = r"(?:[A-Za-z0-9_-]++|\"[^\"\n]*+\"|'[^'\n]*+')[ \t]*+"
_LONG_KEY = re.compile(rf"(?<![A-Za-z0-9_-]){_PART}(?:\.[ \t]*+{_PART}){{{DEEPEST},}}+")
"""A dotted key of too many parts: to read it takes the square of their number."""


class NotToml(ValueError):  # noqa: N818 - it names the fact
    """A text is no TOML that can be worked with.

    Parameters
    ----------
    problem, remedy : str
        What is wrong, and what to do.
    path : tuple of str and int
        Where, if that is known.
    """

    def __init__(self, problem: str, remedy: str, path: tuple[str | int, ...] = ()) -> None:
        self.problem, self.remedy, self.path = problem, remedy, path
        super().__init__(problem)


def toml_content(text: str) -> dict[str, Any]:
    """Return what a TOML text says.

    Raises
    ------
    NotToml
        If it is no TOML, or nested deeper, longer, or with larger numbers than any settings file.
    """
    if len(text) > LONGEST_SETTINGS:
        raise NotToml(
            f"longer than {LONGEST_SETTINGS} characters", "this is no settings file: check the path"
        )
    if (key := _LONG_KEY.search(text)) is not None:
        line = text.count("\n", 0, key.start()) + 1
        raise NotToml(f"line {line}: a key of more than {DEEPEST} parts", too_deep()[1])
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise NotToml(f"not valid TOML: {error}", "mend the syntax at that line") from None
    except RecursionError:
        raise NotToml(*too_deep()) from None
    except ValueError:  # Python's guard against numbers of thousands of digits
        raise NotToml(*TOO_MANY_DIGITS) from None
    if (wrong := out_of_form(content, MOST_SETTINGS, finite=False)) is not None:
        raise NotToml(wrong.problem, wrong.remedy, wrong.path)
    if (path := _with_controls(content)) is not None:
        raise NotToml("a text with control characters", "write it without escape sequences", path)
    return content


def _with_controls(content: Any, path: tuple[str | int, ...] = ()) -> tuple[str | int, ...] | None:
    """Return where the first text lies that a terminal would obey; None where there is none."""
    if isinstance(content, str):
        return path if has_controls(content) else None
    if isinstance(content, dict):
        if any(map(has_controls, content)):
            return path or ("(key)",)
        parts: Iterable[tuple[str | int, Any]] = content.items()
    else:
        parts = enumerate(content) if isinstance(content, list) else ()
    return next(
        (found for key, one in parts if (found := _with_controls(one, (*path, key))) is not None), None
    )
