"""Running a planned campaign, with signals caught and progress shown: the middle of run, resume and demo."""

from __future__ import annotations

import sys
import traceback
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from cli.campaigns import Prepared
from cli.options import warn
from cli.simulation import simulated_stand
from daq.keys import keys_from
from daq.metadata import CampaignFacts
from daq.monitor.process import Address, web_process
from daq.runner import CampaignOutcome, run_campaign
from daq.signals import StopRequest, stop_on_signals
from daq.terminal import progress_on
from drivers.connect import build_controller, build_sensors
from drivers.interfaces import Stand
from drivers.stand_file import StandFile
from foundation.clock import WallClock
from foundation.errors import BadInput


def perform(
    prepared: Prepared,
    out: Path,
    *,
    simulate: bool,
    speed: float,
    truth: Path | None = None,
    monitor: Address | None = None,
) -> CampaignOutcome:
    """Run (or go on with) a campaign on the real stand, or on a simulated one made for it.

    Parameters
    ----------
    prepared : Prepared
        Campaign, stand, specimen and plan.
    out : Path
        The campaign's folder.
    simulate : bool
        On a simulated stand instead of the addresses in the stand file.
    speed : float
        Stand time in multiples of real time; only a simulated stand can be faster than 1.
    truth : Path, optional
        Where the simulated stand leaves what really happened, for checks.
    monitor : Address, optional
        Where a live page is served.

    Raises
    ------
    BadInput
        If the folder or the speed cannot be used.
    """
    if not simulate and speed != 1.0:
        raise BadInput(
            f"a real stand cannot run at {speed:g} times real time", file="--speed", remedy="add --simulate"
        )
    source: AbstractContextManager[StandFile] = (
        simulated_stand(prepared, speed=speed, truth=truth) if simulate else nullcontext(prepared.wired)
    )
    facts = CampaignFacts(
        stand=prepared.stand_file.model_dump(mode="json"),
        watchdog_s=prepared.stand_file.controller.watchdog_s,
        operator=prepared.campaign.content.campaign.operator,
        test=prepared.specimen_file.test.model_dump(mode="json", exclude_defaults=True),
    )
    with (
        stop_on_signals(StopRequest()) as request,
        source as stand_file,
        nullcontext() if monitor is None else web_process(out, monitor, _say) as page,
        progress_on(sys.stderr) as progress,
        keys_from(sys.stdin, request, progress.message),
    ):
        if page is not None:
            page.watch(progress.message)
        clock = WallClock(speed)
        stand = Stand(build_controller(stand_file, clock), build_sensors(stand_file, clock))
        try:
            outcome = run_campaign(
                prepared.plan,
                stand,
                clock,
                out,
                facts,
                progress=progress,
                stop_request=request,
                predictor=prepared.predictor,
            )
        finally:
            stand.close()
    if outcome.error is not None:
        keep_bug(outcome.error, out)
    return outcome


def keep_bug(bug: BaseException, out: Path) -> None:
    """Keep the place of a bug of ours for whoever mends it; the stand is safe, the runs are closed."""
    text, file = "".join(traceback.format_exception(bug)), out / "internal-error.txt"
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        warn(f"a bug of bufferstand ended this; please report this ({file}: {error.strerror}):\n{text}")
    else:
        warn(f"a bug of bufferstand ended this; please report it with {file}")


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)  # noqa: T201 - before the live view begins
