"""Running a planned campaign, with signals caught and progress shown: the middle of run, resume and demo."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

from bufferstand.cli.arming import Consent, ask_to_move, check_given
from bufferstand.cli.campaign.movement import campaign_movement
from bufferstand.cli.campaign.preparation import PreparedCampaign
from bufferstand.cli.campaign.simulation import simulated_stand
from bufferstand.cli.options import warn
from bufferstand.daq.campaign import CampaignOutcome, RunSettings, UntilKnown, run_campaign
from bufferstand.daq.campaign_folder import CampaignMetadata, CampaignRecord, left_to_do
from bufferstand.daq.guards import unguarded_at
from bufferstand.daq.monitor import Address, web_process
from bufferstand.daq.operator import StopRequest, keys_from, progress_on, stop_on_signals
from bufferstand.daq.twin import twin_process
from bufferstand.daq.zero import stored_zero
from bufferstand.drivers import Stand, build_controller, build_sensors
from bufferstand.drivers.simulated.serving import NAME, SHOWN, WIRES, StandClock, is_waiting
from bufferstand.drivers.stand_file import StandFile
from bufferstand.foundation import BadInput, Clock, WallClock
from bufferstand.foundation.channels import Zero


def consent_to_move(
    prepared: PreparedCampaign,
    out: Path,
    before: CampaignRecord | None,
    *,
    simulate: bool,
    speed: float,
    yes_move: str | None,
) -> Consent | None:
    """Show what a start is about to move on a real stand and ask for it; None for a simulated one.

    A stand that a stand file leads to is real, whatever answers there: this program has not started it.

    Parameters
    ----------
    prepared : Prepared
        Campaign, stand, specimen and plan.
    out : Path
        The campaign's folder.
    before : CampaignRecord or None
        How far an earlier start came.
    simulate, speed
        As of :func:`perform`.
    yes_move : str or None
        What ``--yes-move`` says.

    Raises
    ------
    BadInput
        As :func:`perform` for the speed, and as :func:`bufferstand.cli.arming.ask_to_move`.
    """
    _check_speed(simulate, speed)
    movement = campaign_movement(prepared, left_to_do(prepared.plan, before, out))
    if simulate:
        check_given(movement, yes_move)
        return None
    return ask_to_move(movement, yes_move)


def perform(
    prepared: PreparedCampaign,
    out: Path,
    *,
    simulate: bool,
    speed: float,
    consent: Consent | None = None,
    edits: Mapping[str, Any] | None = None,
    changes: tuple[Mapping[str, Any], ...] = (),
    accepted_serial: str = "",
    truth: Path | None = None,
    monitor: Address | None = None,
    awaits_stand: bool = False,
    until: UntilKnown | None = None,
    twin: Path | None = None,
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
    consent : Consent, optional
        Who said that the real stand may move; not for a simulated one.
    edits : mapping, optional
        How edited files came to be taken, for the folder.
    changes : tuple of mapping
        What differs from the start before, as it was accepted
        (:mod:`bufferstand.cli.campaign.resume_checks`).
    accepted_serial : str
        Serial number of another controller that was accepted.
    truth : Path, optional
        Where the simulated stand leaves what really happened, for checks.
    monitor : Address, optional
        Where a live page is served.
    awaits_stand : bool
        Whether it waits for what a killed program has left on the stand to come to rest.
    until : UntilKnown, optional
        What is to be known; the campaign was prepared in so many rounds as it may take.
    twin : Path, optional
        File of a fitted model by which finished cycles are judged.

    Raises
    ------
    BadInput
        If the folder or the speed cannot be used.
    ValueError
        If a real stand is to move without consent: a fault of the caller.
    """
    _check_speed(simulate, speed)
    if not simulate and consent is None:
        raise ValueError("a real stand moves only with somebody's consent")
    served = not simulate and waits(prepared)
    source: AbstractContextManager[tuple[StandFile, Clock]] = (
        simulated_stand(prepared, speed=speed, truth=truth)
        if simulate
        else nullcontext((prepared.wired, _clock_of(prepared, served=served)))
    )
    facts = CampaignMetadata(
        stand=prepared.stand_file.model_dump(mode="json"),
        watchdog_s=prepared.stand_file.controller.watchdog_s,
        operator=prepared.campaign.content.campaign.operator,
        stored_zero=zero_to_offer(prepared),
        test=prepared.specimen_file.test.model_dump(mode="json", exclude_defaults=True),
        arming={} if consent is None else consent.as_dict(),
        edits=edits or {},
        started_here=simulate,
        speed=speed,
        changes=changes,
        accepted_serial=accepted_serial,
    )
    with (
        stop_on_signals(StopRequest()) as request,
        source as (stand_file, clock),
        nullcontext() if monitor is None else web_process(out, monitor, _say, stays=True) as page,
        nullcontext() if twin is None else twin_process(out, twin, _say),
        progress_on(sys.stderr) as progress,
        keys_from(sys.stdin, request, progress.message),
    ):
        if page is not None:
            page.watch(progress.message)
        doing = f"campaign “{prepared.campaign.content.campaign.id}” in {out.resolve()}"
        stand = Stand(build_controller(stand_file, clock, doing), build_sensors(stand_file, clock))
        speed = clock.speed if isinstance(clock, StandClock) else speed
        beside = unguarded_at(speed, prepared.stand_file)
        try:
            outcome = run_campaign(
                replace(prepared.plan, not_guarded=(*prepared.plan.not_guarded, *beside)),
                stand,
                clock,
                out,
                replace(facts, speed=speed),
                progress=progress,
                stop_request=request,
                settings=RunSettings(
                    waited_for=simulate,
                    says_it_waits=served,
                    awaits_stand=awaits_stand,
                    speed=speed,
                ),
                predictor=prepared.predictor,
                until=until,
            )
        finally:
            stand.close()
    if outcome.error is not None:
        keep_bug(outcome.error, out)
    return outcome


def waits(prepared: PreparedCampaign) -> bool:
    """Return whether the stand of the stand file is a served one that waits for its reader."""
    return is_waiting(prepared.stand_home.parent / WIRES / NAME, prepared.wired)


def _clock_of(prepared: PreparedCampaign, *, served: bool) -> Clock:
    """Return the wall's time, or that of a served stand that may go faster: its heat goes with it."""
    return StandClock(prepared.stand_home.parent / WIRES / SHOWN) if served else WallClock()


def zero_to_offer(prepared: PreparedCampaign) -> Zero | None:
    """Return the zero that is stored beside the stand file; None for a campaign that touches off.

    That one takes none over, so that a damaged file does not keep it from starting.

    Raises
    ------
    BadInput
        If the file is needed and is none.
    """
    return None if prepared.campaign.content.zero.touch else stored_zero(prepared.stand_home)


def _check_speed(simulate: bool, speed: float) -> None:
    if not simulate and speed != 1.0:
        raise BadInput(
            f"a real stand cannot run at {speed:g} times real time", file="--speed", remedy="add --simulate"
        )


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
