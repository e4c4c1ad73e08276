"""What a person has looked at before a stand moves: the laboratory's checklist, and the id that is typed."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Annotated

from pydantic import Field

from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import Settings, load_settings

CHECKLIST_NAME = "checklist.toml"
"""Beside the stand file."""
Item = Annotated[str, Field(min_length=1, max_length=200)]


class Checklist(Settings):
    """``checklist.toml``: what is looked at before a start, in this order."""

    items: Annotated[list[Item], Field(max_length=40)]


def checklist_of(stand: Path) -> tuple[str, ...]:
    """Return the items of the checklist beside a stand file; none where there is no such file.

    Raises
    ------
    BadInput
        If the file is none.
    """
    path = stand.with_name(CHECKLIST_NAME)
    if not path.exists():
        return ()
    return tuple(dict.fromkeys(load_settings(path, Checklist).items))


def demand_ticked(items: Collection[str], ticked: object) -> None:
    """Refuse a start while something of the checklist was not looked at.

    Raises
    ------
    BadInput
        If an item is not ticked.
    """
    done = {one for one in ticked if isinstance(one, str)} if isinstance(ticked, list) else set()
    left = [item for item in items if item not in done]
    if left:
        raise BadInput(
            f"nothing was moved: of the checklist is not ticked: {'; '.join(left)}",
            remedy="look at each, then tick it",
        )


def demand_id(given: str, meant: str, what: str, remedy: str) -> None:
    """Refuse a motion for which another id was typed than that of what is meant, before anything is started.

    Parameters
    ----------
    given, meant : str
        The id that was typed, and the one of the file.
    what : str
        What has it: ``stand``, ``specimen``.
    remedy : str
        What to do.

    Raises
    ------
    BadInput
        If they differ.
    """
    if given != meant:
        raise BadInput(
            f"nothing was moved, and no device was touched: “{given}” was given, and the {what} is “{meant}”",
            remedy=remedy,
        )
