"""The zero between two starts: in the campaign's folder, or beside the stand file."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path

from bufferstand.foundation import BadInput
from bufferstand.foundation.channels import Zero
from bufferstand.foundation.files import typed_json, write_whole
from bufferstand.foundation.settings import load_settings, read_text
from bufferstand.protocols.campaign_file import ZeroTable

STORED_SUFFIX = ".zero.toml"
"""``stand.toml`` has its zero in ``stand.zero.toml``."""
CLOCK_OFF_H = 0.1
"""A zero may be dated so far ahead: two computers' clocks differ by minutes [h]."""
ZERO_NAME = "zero.json"
"""The zero in force, in the campaign's folder."""


def keep_zero(folder: Path, zero: Zero) -> None:
    """Keep the zero in force in a campaign's folder and bring it to the disk.

    Raises
    ------
    OSError
        If the disk does not take it.
    """
    text = json.dumps(zero.document(), indent=1, ensure_ascii=False)
    write_whole(folder / ZERO_NAME, text.encode())


def kept_zero(folder: Path) -> Zero | None:
    """Return the zero that an earlier start of a campaign left, marked as taken over; None without one.

    Raises
    ------
    BadInput
        If the file is none.
    """
    path = folder / ZERO_NAME
    if not path.exists():
        return None
    found = typed_json(
        Zero, read_text(path), path, remedy="take the file away: the campaign touches off then"
    )
    return found.model_copy(update={"taken_over": True})


def zero_to_take(
    table: ZeroTable, folder: Path, stored: Zero | None, specimen: str
) -> tuple[Zero | None, str]:
    """Return the zero that a start of a campaign takes over, if any, and why it cannot if it should.

    Parameters
    ----------
    table : ZeroTable
        ``[zero]`` of the campaign.
    folder : Path
        The campaign's folder, in which an earlier start has left its zero.
    stored : Zero or None
        What ``bufferstand stand zero`` or ``tare`` has left for the stand.
    specimen : str
        Id of the specimen of the campaign.

    Raises
    ------
    BadInput
        If what an earlier start has left is no zero.
    """
    if (table.on_resume == "take-over" or not table.touch) and (kept := kept_zero(folder)) is not None:
        return kept, ""
    if table.touch or stored is None:
        return None, ""
    age_h = (datetime.now(UTC) - stored.found).total_seconds() / 3600.0
    if age_h < -CLOCK_OFF_H:
        return None, (
            f"the zero of the stand is dated {-age_h:.1f} h from now, so its age is not known: put this "
            "computer's clock right, then run “bufferstand stand zero” (or tare) again, or let the campaign "
            "touch off ([zero] touch = true)"
        )
    if age_h > table.stored_max_age_h:
        return None, (
            f"the zero of the stand is {age_h:.0f} h old, more than [zero] stored_max_age_h = "
            f"{table.stored_max_age_h:g} h: run “bufferstand stand zero” (or tare) again, or let the "
            "campaign touch off ([zero] touch = true)"
        )
    if stored.specimen and stored.specimen != specimen:
        return None, (
            f"the zero of the stand was found with the specimen {stored.specimen}, this campaign tests "
            f"{specimen}: run “bufferstand stand zero” again, or let the campaign touch off"
        )
    return stored.model_copy(update={"taken_over": True}), ""


def stored_path(stand: Path) -> Path:
    """Return where the zero of a stand is stored: beside its file."""
    return stand.with_suffix(STORED_SUFFIX)


def stored_zero(stand: Path) -> Zero | None:
    """Return what ``bufferstand stand zero`` or ``tare`` has left beside a stand file; None without it.

    Raises
    ------
    BadInput
        If the file is none.
    """
    path = stored_path(stand)
    return load_settings(path, Zero) if path.exists() else None


def store_zero(stand: Path, zero: Zero) -> Path:
    """Write a zero beside a stand file, as a whole, and bring it to the disk; return its path.

    Raises
    ------
    BadInput
        If it cannot be written.
    """
    path = stored_path(stand)
    try:
        write_whole(path, zero_toml(zero).encode())
    except OSError as error:
        raise BadInput(f"the zero cannot be stored: {error.strerror}", file=path) from None
    return path


def zero_toml(zero: Zero) -> str:
    """Return a zero as TOML, which :func:`stored_zero` reads back."""
    lines = [
        "# Written by “bufferstand stand”; taken over by campaigns with [zero] touch = false.",
        f"how = {json.dumps(zero.how)}",
        f"found = {zero.found.astimezone(UTC).isoformat()}",
        f"specimen = {json.dumps(zero.specimen, ensure_ascii=False)}",
        f"operator = {json.dumps(zero.operator, ensure_ascii=False)}",
    ]
    for one in zero.channel:
        lines += ["", "[[channel]]", *_rows(one.model_dump())]
    if zero.touch is not None:
        lines += ["", "[touch]", *_rows(zero.touch.model_dump())]
    return "\n".join(lines) + "\n"


def _rows(content: dict[str, object]) -> list[str]:
    return [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in content.items()]
