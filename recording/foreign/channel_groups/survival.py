"""Whether the library that reads MDF survives a file: tried in another process before this one reads it.

A part of asammdf is C that trusts lengths of the file: one turned bit ends the process with a segmentation
fault, which no ``except`` hears.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from bufferstand.foundation import BadInput, with_same_imports

LEAST_S = 120.0
"""So long it may take in any case, and a second more for so many bytes."""
BYTES_PER_S = 500_000
COPY_AGAIN = "copy it again from where it was recorded"
_MODULE = "bufferstand.recording.foreign.channel_groups.trial"


def demand_survived(path: Path) -> None:
    """Have another process read all channels of an MDF file; refuse the file where that one dies of it.

    Raises
    ------
    BadInput
        If the library crashes on it, or does not come to an end with it.
    """
    try:
        longest_s = LEAST_S + path.stat().st_size / BYTES_PER_S
        tried = subprocess.run(
            [sys.executable, "-P", "-m", _MODULE, str(path.absolute())],
            env=with_same_imports(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=longest_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        problem = f"damaged: its library does not come to an end with it in {longest_s:.0f} s"
        raise BadInput(problem, file=path, remedy=COPY_AGAIN) from None
    except OSError as error:
        raise BadInput(f"cannot be read: {error.strerror}", file=path) from None
    if tried.returncode < 0 or tried.returncode > 1:  # Windows has no signals, but large numbers
        raise BadInput("damaged: its library crashes on it", file=path, remedy=COPY_AGAIN)
