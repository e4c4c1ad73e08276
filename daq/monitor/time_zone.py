"""In which zone the page tells times: the laboratory's, wherever the browser is."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

STATED_IN = "report.toml"
"""Where a laboratory states its zone, for its reports (docs/report.md): ``time_zone``."""
_LINK = Path("/etc/localtime")


def laboratory_zone(folders: Iterable[Path]) -> dict[str, Any]:
    """Return name and offset of the laboratory's time zone.

    Parameters
    ----------
    folders : iterable of Path
        Where a ``report.toml`` may lie: the first that states a zone counts. Without one it is the zone of
        this computer, which stands in the laboratory.

    Returns
    -------
    dict
        ``name`` of the IANA data base, empty where the computer does not tell its own; ``offset_min``, what
        it is ahead of UTC now [min].
    """
    name = next((zone for folder in folders if (zone := _stated(folder / STATED_IN))), "")
    if name:
        now = datetime.now(ZoneInfo(name))
    else:
        now, name = datetime.now().astimezone(), _own_name()
    ahead = now.utcoffset()
    return {"name": name, "offset_min": 0 if ahead is None else round(ahead.total_seconds() / 60.0)}


def _stated(path: Path) -> str:
    """Return the zone that a file states, empty if it states none that this machine knows."""
    with suppress(OSError, ValueError, ZoneInfoNotFoundError):  # what is wrong with it, the report says
        zone = tomllib.loads(path.read_text(encoding="utf-8")).get("time_zone")
        if isinstance(zone, str) and zone:
            return ZoneInfo(zone).key
    return ""


def _own_name() -> str:
    """Return the name of this computer's zone, empty where it does not say it."""
    for name in (os.environ.get("TZ", "").lstrip(":"), *_linked()):
        with suppress(OSError, ValueError, ZoneInfoNotFoundError):
            if name:
                return ZoneInfo(name).key
    return ""


def _linked() -> tuple[str, ...]:
    with suppress(OSError):
        return (str(_LINK.resolve()).rpartition("/zoneinfo/")[2],)
    return ()
