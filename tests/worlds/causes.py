"""Which stop each trouble may cause: exit statuses, and the words of which one must be in the reason."""

from __future__ import annotations

import re
from collections.abc import Sequence

from tests.daq.test_fault_matrix import FAULTS
from tests.worlds.troubles import Trouble

WIRE = (
    r"controller or its wire failed|controller at in process|has not been reached|delivers no new samples|"
    r"no new samples|watchdog|heartbeat"
)
"""What a wire or a controller that does not answer, or not in time, is told as."""
BLIND = r"samples lost|samples were lost|were blind|behind the stand|ring was read too late|older than"
"""What a hole in the record is told as."""
CHANNEL = r"stroke|tilt|force|position|following error|plausib|speed|wire"
"""What a transducer is told as: by its own name, or by what it no longer agrees with."""
DISK_FULL = r"No space left on device|nearly full|cannot be recorded|could not be sealed|cannot be written"
MORE: dict[str, tuple[set[int], str]] = {
    **{
        f"controller={kind}": ({4}, f"{WIRE}|{BLIND}")
        for kind in ("lost", "drop", "delay", "corrupt", "reorder", "request-drop", "request-corrupt",
                     "exception", "duplicate", "overrun")
    },
    "controller=stuck": ({4}, f"{WIRE}|does not count|tick"),
    "controller=clock-jump": ({4}, r"ticks? steps? by|clock"),
    "controller=nan": ({4}, "no number|nan"),
    "controller=watchdog": ({4}, "watchdog"),
    **{
        f"{name}={kind}": ({3, 4}, CHANNEL)
        for name in ("force", "stroke_1", "stroke_2", "position")
        for kind in ("broken", "stuck")
    },
    **{
        f"amplifier={kind}": ({4}, "force_2|second force|amplifier")
        for kind in ("silent", "drop", "corrupt", "overload", "resync", "delay", "duplicate")
    },
}  # fmt: skip
"""Beside those of the matrix of single faults: what a fault can lead to in other phases, and with others."""
OTHERS: dict[str, tuple[set[int], str]] = {
    "disk: full": ({2, 4}, DISK_FULL),
    "disk: slow": ({4}, "the disk is slow"),
    "memory: append": ({4}, "MemoryError|no memory left"),
    "memory: request": ({4}, "MemoryError|no memory left"),
    "memory: record": ({4}, "MemoryError|no memory left"),
    "memory: seal": ({4}, "MemoryError|no memory left|could not be sealed"),
    "second program: enable": ({4}, "another program gives the controller commands"),
    "operator: stop now": ({3}, "stopped by the operator"),
    "operator: stop after cycle": ({3}, "stopped by the operator"),
    "operator: stop after step": ({3}, "stopped by the operator"),
}
"""Of the troubles that are no device's; what is in neither table stops nothing."""
TIGHT = ({3, 4}, r"force .*(above|exceeds|beyond|limit)|force limit|would (bring|need|break)|the plan")
"""What a force limit close to the expected force may lead to where the specimen is stiffer than its model."""


def allowed(trouble: Trouble) -> list[tuple[set[int], str]]:
    """Return what a trouble may lead to; empty for one that stops nothing."""
    if trouble.kind != "device":
        return [OTHERS[trouble.name]] if trouble.name in OTHERS else []
    found = [FAULTS[trouble.what], *([MORE[trouble.what]] if trouble.what in MORE else [])]
    return [(statuses - {0}, words) for statuses, words in found if statuses != {0} and words]


def explains(causes: Sequence[Trouble], status: int, reason: str, *, unsafe: bool, tight: bool) -> bool:
    """Return whether one of the causes, which have struck, is named by a stop.

    Parameters
    ----------
    causes : sequence of Trouble
    status : int
        Exit status.
    reason : str
        Its words.
    unsafe : bool
        Whether nobody saw the stand at rest: then the status is 4, whatever the cause.
    tight : bool
        Whether the force limit may be reached.
    """
    named = [pair for cause in causes for pair in allowed(cause)] + ([TIGHT] if tight else [])
    return any(
        (status in statuses or (unsafe and status == 4)) and re.search(words, reason)
        for statuses, words in named
    )
