"""``bufferstand run``: do what the campaign file says."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import click

from bufferstand.cli.arming import yes_move_option
from bufferstand.cli.campaign import nothing_moved
from bufferstand.cli.options import (
    EXISTING,
    JUDGED_TO_SPEED,
    FiniteRange,
    monitor_option,
    out_option,
    twin_option,
)
from bufferstand.foundation import BadInput, program

if TYPE_CHECKING:
    from bufferstand.daq.campaign import CampaignOutcome, UntilKnown
    from bufferstand.daq.campaign_folder import CampaignRecord
    from bufferstand.daq.monitor import Address


@click.command(
    "run",
    epilog="Example:  bufferstand run sample_runs/en15551.toml --out campaign --simulate --speed 10",
)
@click.argument("campaign", metavar="CAMPAIGN.toml", type=EXISTING)
@out_option("Folder of the campaign: one HDF5 file a run in DIR/runs, and what is needed to resume.")
@click.option(
    "--simulate",
    is_flag=True,
    help="On a simulated stand, started for this campaign; the spring in it is the specimen file's model.",
)
@click.option(
    "--speed",
    type=FiniteRange(min=0.01, max=100.0),
    default=1.0,
    help=f"Stand time in multiples of real time, for a simulated stand (default 1); {JUDGED_TO_SPEED}.",
)
@click.option(
    "--until",
    "goal",
    metavar="GOAL",
    help="Repeat the campaign's steps until the mean of each step's runs is known so well: "
    "“u(damping) < 0.002” (standard uncertainty; U(…): expanded, k = 2), or say that it cannot be.",
)
@click.option(
    "--rounds",
    type=click.IntRange(1, 50),
    help="With --until: so many rounds at most (default 5, at most 50).",
)
@click.option(
    "--hours",
    type=FiniteRange(min=0.01, max=72.0),
    help="With --until: so long at most by the plan (default 8, at most 72).",
)
@monitor_option
@twin_option
@yes_move_option("specimen")
def command(
    *,
    campaign: Path,
    out: Path,
    simulate: bool,
    speed: float,
    goal: str | None,
    rounds: int | None,
    hours: float | None,
    monitor: Address | None,
    twin: Path | None,
    yes_move: str | None,
) -> int:
    """Run a campaign with live progress; record one HDF5 file a run.

    On a real stand it shows what will move and asks for the specimen's id first. What is begun with
    --simulate is a rehearsal: its runs say that they are simulated, and resume goes on with it on a simulated
    stand only.

    With --simulate the true spring is the model of the campaign's specimen file, not [simulation] model of
    the stand file, which is for a stand that is served on its own. For a spring that is not as its model says
    set specimen_force_factor in [simulation] (0.9: 10 % softer).

    With --until all rounds are planned and judged by every limit before anything moves. After each the runs
    are evaluated; what errors of the channels leave, which are the same in every run, no repetition lowers,
    and then it says so and ends. resume goes on with the same goal. Not known in the end: exit status 3.

    Ctrl-C, SIGTERM and SIGHUP stop it: zero force, valve off, files whole. Exit status 0 when complete, 3
    when a limit or the operator stopped it, 4 on a fault of a device.
    """
    with nothing_moved():
        from bufferstand.cli.campaign import consent_to_move, demand_begun_anew, perform, prepare
        from bufferstand.daq.campaign_folder import load_record
        from bufferstand.daq.twin import demand_known

        until = _until(goal, rounds, hours)
        if twin is not None:
            demand_known(twin)
        prepared = prepare(campaign, rounds=1 if until is None else until.most_rounds)
        record = load_record(out)
        if record is not None:
            demand_begun_anew(record, out, simulate=simulate)
        consent = consent_to_move(prepared, out, None, simulate=simulate, speed=speed, yes_move=yes_move)
    outcome = perform(
        prepared,
        out,
        simulate=simulate,
        speed=speed,
        monitor=monitor,
        twin=twin,
        consent=consent,
        until=until,
    )
    return finish(outcome, out)


def _until(goal: str | None, rounds: int | None, hours: float | None) -> UntilKnown | None:
    """Return what is to be known; None without a goal."""
    if goal is None:
        if rounds is None and hours is None:
            return None
        option = "--rounds" if rounds is not None else "--hours"
        raise BadInput("has a meaning with --until only", file=option, remedy="add --until, or leave it out")
    from bufferstand.daq.campaign import HOURS, ROUNDS, UntilKnown

    return UntilKnown.parsed(goal, rounds or ROUNDS, hours or HOURS)


def finish(outcome: CampaignOutcome, out: Path) -> int:
    """Say in one line how it ended and what comes next; return the exit status."""
    from bufferstand.daq.campaign_folder import (
        load_record,
        read_as_run,
        replaced_sentence,
        rows_in_force,
        totals,
    )

    files = _kept(outcome, out)
    if outcome.status == "complete":
        report = quote(str(out / "report"))
        click.echo(f"campaign complete: {files}; next: {program()} report {quote(str(out))} --out {report}")
        if outcome.exit_status:
            click.echo(f"bufferstand: {outcome.reason}", err=True)
        record, rows = load_record(out), read_as_run(out)
        if not outcome.exit_status and record is not None and record.until:
            click.echo(record.until["sentence"])
        kept = rows if record is None else rows_in_force(rows, record.hashes)
        if kept:
            without = f"; {gone}" if (gone := replaced_sentence(rows, kept)) else ""
            click.echo(
                f"{totals(kept).sentence()}{without}; step by step: "
                f"{program()} plan … --against {quote(str(out))}"
            )
    else:
        safe = outcome.safe_stop.line if outcome.safe_stop is not None else "the stand was not touched"
        told = (
            outcome.reason
            if outcome.reason.startswith(outcome.status)
            else f"{outcome.status}: {outcome.reason}"
        )
        click.echo(f"bufferstand: {told}; {safe}; {files}; {_next(out)}", err=True)
    return int(outcome.exit_status)


def _kept(outcome: CampaignOutcome, out: Path) -> str:
    """Say how many run files lie in the campaign's folder, and how many of them this start has made."""
    from bufferstand.daq.campaign_folder import RUNS_NAME

    folder = out / RUNS_NAME
    there = len(list(folder.glob("*.h5")))
    kept = f"{there} run file{'' if there == 1 else 's'} in {folder}"
    return kept if there == len(outcome.runs) else f"{kept}, {len(outcome.runs)} of this start"


def nothing_left(record: CampaignRecord, out: Path) -> int:
    """Say that a campaign is complete and that no device is touched; return the exit status."""
    skipped = sum(step.status == "skipped" for step in record.steps)
    count, total = len(record.steps) - skipped, len(record.steps)
    steps = f"{count} of {total} step{'s' * (total > 1)} complete" + f", {skipped} skipped" * (skipped > 0)
    report = f"{program()} report {quote(str(out))} --out {quote(str(out / 'report'))}"
    click.echo(f"nothing is left to do ({steps}), and nothing was touched; next: {report}")
    return 0


def _next(out: Path) -> str:
    """Return what to do after a campaign that did not complete."""
    from bufferstand.daq.campaign_folder import load_record

    record = load_record(out)
    if record is not None and record.recorded_nothing(out):
        when = "to begin" if record.stopped_by == "operator" else "when it is mended"
        return f"nothing is recorded: give the same command again {when}"
    return f"go on with it: {program()} resume {quote(str(out))}"
