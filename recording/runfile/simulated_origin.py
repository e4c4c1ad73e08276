"""Whether a run was made on a simulated stand: as its file states it, or by what an older file holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

KEY = "simulated"
"""Key of the document's table ``run``: true, or false. Imported records have none."""
HOW_KEY = "simulated_by"
"""How that is known, in words."""
SPEED_KEY = "speed"
"""Key of the table ``run``: stand time in multiples of real time, where that is not 1."""
RECORD_ONLY_KEY = "record_only"
"""Key of the document's table ``run``: true where another controller moved the stand, and it was recorded."""
_IN_PROCESS = "simulated controller"
"""What the simulated controller that is reached in process calls itself in ``stand.identity.device``."""
_WORD = "simulat"


def is_record_only(document: Mapping[str, Any]) -> bool:
    """Say whether a run was only recorded: another controller moved the stand.

    Parameters
    ----------
    document : mapping
        The run file's metadata document.
    """
    run = document.get("run")
    return isinstance(run, Mapping) and run.get(RECORD_ONLY_KEY) is True


def simulated_of(document: Mapping[str, Any]) -> bool | None:
    """Return whether a run was made on a simulated stand.

    A file without the key, of before 2026-11-24, is judged by what it holds: a campaign that was not armed
    was one on a stand that the program had started itself (``arming`` is there, and empty); the in-process
    controller names itself; and before campaigns were armed nothing but the stand's name can tell.

    Parameters
    ----------
    document : mapping
        The run file's metadata document.

    Returns
    -------
    bool or None
        None where nothing tells: an imported record, or an older file of a stand that is not called
        simulated.
    """
    run = document.get("run")
    stated = run.get(KEY) if isinstance(run, Mapping) else None
    if isinstance(stated, bool):
        return stated
    stand = document.get("stand")
    if not isinstance(stand, Mapping):
        return None
    identity = stand.get("identity")
    if isinstance(identity, Mapping) and identity.get("device") == _IN_PROCESS:
        return True
    arming = document.get("arming")
    if identity and isinstance(arming, Mapping) and not arming:
        return True
    about = stand.get("stand")
    names = [about.get(key) for key in ("id", "name")] if isinstance(about, Mapping) else []
    names += [stand.get("id"), stand.get("name"), identity]
    return True if any(_WORD in str(name).lower() for name in names) else None
