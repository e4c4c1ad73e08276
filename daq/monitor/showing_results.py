"""Has the runs of a campaign that has ended evaluated by another process, and shows each when it is done."""

from __future__ import annotations

import asyncio
import json
import sys
from pathlib import Path
from typing import Any

from bufferstand.daq.monitor.view import View


async def show_results(folder: Path, view: View) -> None:
    """Put the section of the runs, and renew it run by run until all are evaluated.

    Parameters
    ----------
    folder : Path
        The campaign's.
    view : View
        Is kept up to date.
    """
    runs: list[dict[str, Any]] = []
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-P", "-m", "bufferstand.daq.monitor.results", str(folder),
        stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL, limit=1 << 24,
    )  # fmt: skip
    try:
        assert process.stdout is not None
        view.put("runs", {"runs": runs, "evaluating": True})
        while line := await process.stdout.readline():
            runs.append(json.loads(line))
            view.put("runs", {"runs": runs, "evaluating": True})
        broken = await process.wait() != 0
    finally:
        if process.returncode is None:
            process.kill()
    view.put("runs", {"runs": runs, "evaluating": False, "broken": broken})
