"""A campaign at 1 kHz in real time by the commands, with the live page open in Chromium."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.common.processes import holds
from benchmarks.monitor_hour import SETTLE_S, campaign, lost_of, page_served, pages_open
from tests.soak.curves import Curves

S_PER_H = 3600.0
LIMITS = {
    "run_memory_MB": 1.05,
    "run_handles": 1.0,
    "run_threads": 1.0,
    "server_memory_MB": 1.05,
    "server_handles": 1.0,
    "server_threads": 1.0,
    "page_scripts_MB": 1.1,
    "page_nodes": 1.1,
    "page_listeners": 1.05,
    "recorded_bytes_a_second": 1.05,
    "other_bytes": 1.5,
}
"""What is flat: the largest ratio of the last quarter to the second."""


def campaign_with_page(
    hours: float, look_s: float, tell: Callable[[str], object], save: Callable[[Curves], object]
) -> tuple[Curves, list[str]]:
    """Run a campaign with a page open, and look at what each process holds.

    Parameters
    ----------
    hours, look_s : float
        How long the page is open, and how often it is looked at.
    tell, save : callable
        Get a line, and the curves until now, after each look.

    Returns
    -------
    Curves
        One look each ``look_s``.
    list of str
        What is wrong besides: lost samples.
    """
    curves = Curves()
    begun_s = time.monotonic()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        with (
            campaign(folder, hours * S_PER_H + SETTLE_S) as run,
            page_served(folder / "out") as (server, link),
            pages_open(link, 1) as look,
        ):
            began_s = seen_s = time.monotonic()
            while seen_s - began_s < hours * S_PER_H:
                time.sleep(look_s)
                (page,) = look()
                seen_s, now = time.monotonic(), _sizes(folder / "out")
                curves.add(
                    (seen_s - began_s) / S_PER_H,
                    {
                        **{f"run_{name}": value for name, value in holds(run.pid).items()},
                        **{f"server_{name}": value for name, value in holds(server).items()},
                        "page_scripts_MB": page["JSHeapUsedSize"] / 2**20,
                        "page_nodes": page["Nodes"],
                        "page_listeners": page["JSEventListeners"],
                        "recorded_bytes_a_second": now[0] / (seen_s - begun_s),
                        "other_bytes": now[1],
                    },
                )
                save(curves)
                last = {name: looks[-1] for name, looks in curves.values.items()}
                tell(f"{curves.at_h[-1]:.3f} h: " + ", ".join(f"{k} {v:.6g}" for k, v in last.items()))
        lost, samples = lost_of(folder / "out")
    tell(f"{samples} samples, {lost} lost")
    return curves, [f"{lost} of {samples + lost} samples are lost"] if lost else []


def _sizes(out: Path) -> tuple[int, int]:
    """Return the bytes of the runs' files, and of all others of a campaign's folder."""
    runs = others = 0
    for one in out.rglob("*"):
        try:
            size = one.stat().st_size if one.is_file() else 0
        except FileNotFoundError:  # taken away while it was looked at
            continue
        if one.parent.name == "runs":
            runs += size
        else:
            others += size
    return runs, others
