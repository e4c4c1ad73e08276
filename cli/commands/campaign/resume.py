"""``bufferstand resume``: go on where a campaign ended."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.arming import yes_move_option
from bufferstand.cli.campaign import nothing_moved
from bufferstand.cli.options import (
    EXISTING,
    JUDGED_TO_SPEED,
    FiniteRange,
    edits_choice,
    edits_options,
    monitor_option,
    twin_option,
)
from bufferstand.foundation import BadInput

if TYPE_CHECKING:
    from bufferstand.daq.monitor import Address


@click.command("resume", epilog="Example:  bufferstand resume campaign --simulate --speed 10")
@click.argument("folder", metavar="DIR", type=EXISTING)
@click.option(
    "--simulate",
    is_flag=True,
    help="As the campaign was begun: one begun with it goes on so by itself, one begun without it never.",
)
@click.option(
    "--speed",
    type=FiniteRange(min=0.01, max=100.0),
    default=None,
    help="Stand time in multiples of real time, for a simulated stand (default: as it was begun); "
    f"{JUDGED_TO_SPEED}.",
)
@monitor_option
@twin_option
@yes_move_option("specimen")
@edits_options
@click.option(
    "--accept-controller",
    metavar="SERIAL",
    help="Go on with another controller, which has this serial number, without asking.",
)
def command(
    folder: Path,
    simulate: bool,
    speed: float | None,
    monitor: Address | None,
    twin: Path | None,
    yes_move: str | None,
    *,
    take_edits: bool,
    keep: bool,
    accept_controller: str | None,
) -> int:
    """Go on with a stopped, crashed or too hot campaign; DIR is its folder.

    Steps that are complete are not repeated. After a temperature stop the specimen must have cooled to the
    resume temperature of the campaign file. What a killed program has left on the stand is waited for, until
    the controller has come to rest by itself (some 10 s, with a countdown). If the campaign's files were
    edited since they were taken, it shows the differences and asks whether to go on with them; a limit that
    was made looser needs a campaign of its own.

    It goes on as it was begun: with --simulate, or on the stand at the stand file's addresses. What is
    another than at the start before (controller, its profile, this software) is shown, asked about at a
    terminal, and recorded. A controller with another serial number needs an answer or --accept-controller.
    """
    with nothing_moved():
        from bufferstand.cli.campaign import (
            accepted_changes,
            accepted_serial,
            consent_to_move,
            going_on,
            going_on_simulated,
            perform,
            taken_without_a_start,
            waits,
        )
        from bufferstand.cli.commands.campaign.plan import show_what_is_learned
        from bufferstand.cli.commands.campaign.run import finish, nothing_left
        from bufferstand.daq.campaign_folder import begun, left_to_do, load_record
        from bufferstand.daq.twin import demand_known

        if twin is not None:
            demand_known(twin)
        choice = edits_choice(take_edits=take_edits, keep=keep)
        record = load_record(folder)
        if record is None:
            raise BadInput(
                "no campaign.json in this folder",
                file=folder,
                remedy="give the --out folder of a run",
            )
        going = going_on(folder, record, choice)
        if record.status == "complete" and not left_to_do(going.prepared.plan, record, folder):
            return nothing_left(taken_without_a_start(going, folder) or record, folder)
        simulate, pace = going_on_simulated(record, folder, simulate=simulate, speed=speed)
        show_what_is_learned(going.prepared.plan, folder, record)
        consent = consent_to_move(
            going.prepared, folder, record, simulate=simulate, speed=pace, yes_move=yes_move
        )
        changes = accepted_changes(
            going.prepared,
            begun(record, folder),
            simulate=simulate,
            served=not simulate and waits(going.prepared),
            consent=consent,
            accept=accept_controller,
        )
    outcome = perform(
        going.prepared,
        folder,
        simulate=simulate,
        speed=pace,
        monitor=monitor,
        twin=twin,
        consent=consent,
        edits=going.edits,
        awaits_stand=True,
        changes=changes,
        accepted_serial=accepted_serial(changes),
    )
    return finish(outcome, folder)
