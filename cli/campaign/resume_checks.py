"""``resume`` continues a campaign as it was begun: on the same kind of stand, with changes announced.

What differs in the campaign's files is shown before anything is connected
(:mod:`bufferstand.cli.campaign.edits`). Controller and software come after the consent to move: until then no
device is touched. All that is done here reads only."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from shlex import quote
from typing import Any

import click

from bufferstand.cli.arming import Consent, is_terminal, typed_line, user_name
from bufferstand.cli.campaign.preparation import PreparedCampaign
from bufferstand.daq.campaign_folder import (
    OWN_WORD,
    REAL,
    SERIAL,
    WAITS,
    CampaignRecord,
    CampaignStart,
    StandOrigin,
    StartChange,
    begun,
    controller_changes,
    mixing,
    software_changes,
    software_version,
)
from bufferstand.drivers import ControllerAnswer, look_at_controller
from bufferstand.foundation import BadInput, DeviceFault, program

OPTION = "--accept-controller"
BEGUN_REAL = "this campaign was begun on the stand that its stand file leads to"
BEGUN_SIMULATED = "this campaign was begun with --simulate"
NEVER_MIXED = "real and simulated runs never come into one folder"


def going_on_simulated(
    record: CampaignRecord, folder: Path, *, simulate: bool, speed: float | None
) -> tuple[bool, float]:
    """Return whether a campaign goes on on a stand that the program starts, and how fast; say why.

    Parameters
    ----------
    record, folder
        The campaign.
    simulate, speed
        What the options say; None: no speed was given.

    Raises
    ------
    BadInput
        If it was begun on the stand that its stand file leads to and is to go on on a simulated one, or if a
        speed is given for it.
    """
    known = begun(record, folder)
    if known.simulate is None:
        return simulate, speed or 1.0
    if known.simulate:
        speed = known.speed if speed is None else speed
        if not simulate:
            click.echo(
                f"{BEGUN_SIMULATED}: it goes on on a simulated stand, at {speed:g} "
                "times real time; the real stand is not touched",
                err=True,
            )
        return True, speed
    if simulate:
        raise BadInput(
            f"{BEGUN_REAL}, and goes on there only: {NEVER_MIXED}",
            file="--simulate",
            remedy="resume without it, or rehearse in another folder: bufferstand run … --simulate --out",
        )
    if speed not in (None, 1.0):
        raise BadInput(
            f"{BEGUN_REAL}: a real stand cannot go at {speed:g} times real time",
            file="--speed",
            remedy="resume without it",
        )
    return False, 1.0


def demand_begun_anew(record: CampaignRecord, out: Path, *, simulate: bool) -> None:
    """Say that a start which recorded nothing is begun anew; refuse a folder that holds a campaign.

    Raises
    ------
    BadInput
        If something was recorded, or as :func:`demand_same_kind`.
    """
    if not record.recorded_nothing(out):
        over, total = sum(step.over for step in record.steps), len(record.steps)
        whole = f"write its report ({program()} report {quote(str(out))} --out {quote(str(out / 'report'))})"
        next_is = f"go on with it ({program()} resume {quote(str(out))})" if over < total else whole
        raise BadInput(
            f"this folder holds a campaign already ({over} of {total} steps complete)",
            file=out,
            remedy=f"{next_is}, or choose another folder",
        )
    demand_same_kind(record, out, simulate=simulate)
    why = f": {record.reason}" if record.reason else ""
    click.echo(
        f"the start before recorded nothing ({record.status}{why}): "
        "it begins anew with the files as they are now",
        err=True,
    )


def demand_same_kind(record: CampaignRecord, folder: Path, *, simulate: bool) -> None:
    """Refuse to begin a campaign anew on another kind of stand, also where nothing was recorded.

    Parameters
    ----------
    record, folder
        The campaign.
    simulate : bool
        Whether it is to begin on a stand that the program starts.

    Raises
    ------
    BadInput
        With what to do.
    """
    if begun(record, folder).simulate in (None, simulate):
        return
    raise BadInput(
        f"{BEGUN_REAL if simulate else BEGUN_SIMULATED}: {NEVER_MIXED}",
        file=folder,
        remedy="give --out another folder",
    )


def accepted_changes(
    prepared: PreparedCampaign,
    known: CampaignStart,
    *,
    simulate: bool,
    served: bool,
    consent: Consent | None,
    accept: str | None,
) -> tuple[dict[str, Any], ...]:
    """Look at the controller, show what differs from the start before, and return it as it was accepted.

    Parameters
    ----------
    prepared : Prepared
        With the stand's addresses.
    known : Begun
        How the campaign was begun.
    simulate : bool
        On a stand that the program starts: only the software can differ, and nothing is asked.
    served : bool
        Whether a served stand that waits is at the stand's address.
    consent : Consent or None
        Who has said that it may move.
    accept : str or None
        Serial number of a controller that is accepted beforehand.

    Returns
    -------
    tuple of dict
        What differs, with how and by whom it was accepted; for ``campaign.json`` and the runs.

    Raises
    ------
    BadInput
        If a simulated stand answers where a real one did, or the other way round; if it is another
        controller and nobody says that it is meant; or if the answer is no.
    """
    changes = software_changes(known.software, software_version())
    if simulate:
        return _recorded(changes, "simulated: not asked")
    if known.controller or known.simulated is not None:
        look = _look(prepared)
        if look is not None:
            reached = _reached(look, served=served)
            if why := mixing(reached, known.simulated):
                raise BadInput(why, file=prepared.stand_file.path)
            if not reached.simulated:  # a simulated one is no device that could be another
                changes = (*controller_changes(known.controller, look.identity), *changes)
    if not changes:
        _refuse_needless(accept, known)
        return ()
    click.echo("since the start before, this has changed:", err=True)
    for change in changes:
        click.echo(f"  {change.text()}", err=True)
    return _recorded(changes, _asked(changes, consent, accept))


def accepted_serial(changes: Sequence[Mapping[str, Any]]) -> str:
    """Return the serial number of another controller that was accepted; empty where none was."""
    return next((str(change["now"]) for change in changes if change["what"] == SERIAL), "")


def _look(prepared: PreparedCampaign) -> ControllerAnswer | None:
    """Return who answers at the stand's address; None where nobody does: the start will say so."""
    try:
        return look_at_controller(prepared.wired)
    except DeviceFault:
        return None


def _reached(look: ControllerAnswer, *, served: bool) -> StandOrigin:
    if look.simulated or served:
        return StandOrigin(simulated=True, by=OWN_WORD if look.simulated else WAITS)
    return StandOrigin(simulated=False, by=REAL)


def _asked(changes: Sequence[StartChange], consent: Consent | None, accept: str | None) -> str:
    """Return how the changes were accepted; ask who can be asked."""
    serial = next((change.now for change in changes if change.what == SERIAL), None)
    if accept is not None:
        if serial != accept:
            raise BadInput(
                f"nothing was moved or written: “{accept}” was given, and the controller "
                f"that answers is “{serial or 'the one of this campaign'}”",
                file=OPTION,
                remedy="see which controller moves the stand",
            )
        return OPTION
    there = is_terminal(sys.stdin) and is_terminal(sys.stderr)
    typed = consent is None or consent.how == "typed"
    if serial is not None:
        if not there:
            raise BadInput(
                f"nothing was moved or written: another controller answers, with the serial number {serial}",
                file=OPTION,
                remedy=f"see that it is the one that moves this stand, then add {OPTION} {serial}",
            )
        if (
            typed_line("Type the serial number of the controller that the campaign is to go on with: ")
            != serial
        ):
            raise BadInput("nothing was moved or written: that is not the serial number that was read")
        return "typed"
    if not there or not typed:
        return "not asked: recorded"
    if typed_line("Type yes to go on with it: ").lower() != "yes":
        raise BadInput(
            "nothing was moved or written: yes was not answered", remedy="resume again when it is clear"
        )
    return "typed"


def _refuse_needless(accept: str | None, known: CampaignStart) -> None:
    """Refuse a serial number that is neither another one's nor the campaign's own."""
    if accept is None or accept == known.controller.get("serial"):
        return
    raise BadInput(
        f"nothing was moved or written: “{accept}” was given, and no such controller answers",
        file=OPTION,
        remedy="leave it out: the controller is the one of this campaign, or none answers",
    )


def _recorded(changes: Sequence[StartChange], how: str) -> tuple[dict[str, Any], ...]:
    return tuple({**change.as_dict(), "accepted": how, "by": user_name()} for change in changes)
