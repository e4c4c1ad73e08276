"""``bufferstand demo``: the main job, end to end, on the simulated stand."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import click

from bufferstand.cli.options import FILE, FOLDER, JUDGED_TO_SPEED, FiniteRange, write_json
from bufferstand.cli.samples import sample
from bufferstand.foundation import BadInput, ExitStatus, duration_text, program

if TYPE_CHECKING:
    from bufferstand.cli.campaign import PreparedCampaign

SPEED = 6.0
"""Stand time in multiples of real time: nine minutes of testing in one and a half."""

_WHAT_NEXT = """
What next
  open the report above in a browser; its first page says what is still missing for a signature
  the recorded runs, and what was done in each
    {program} runs {folder}
  every figure with its uncertainty, for your own programs
    {program} evaluate {folder} --json -
  the spring model, for vehicle dynamics
    {program} model fit {folder}/runs --out spring.toml
  the campaign file behind it: copy it and make it yours
    {program} plan {folder}/inputs/demo.toml
  docs/tutorial.md: the same by hand; docs/how-to/connect-your-controller.md: your own stand"""


@click.command("demo", epilog="Example:  bufferstand demo --out my-first-campaign")
@click.option("--out", metavar="DIR", type=FOLDER, help="Folder for everything (default demo-output/<time>).")
@click.option(
    "--speed",
    type=FiniteRange(min=0.1, max=50.0),
    default=SPEED,
    help=f"Stand time in multiples of real time (default {SPEED:g}); {JUDGED_TO_SPEED}.",
)
@click.option("--truth", metavar="FILE", type=FILE, help="Write what really happened in the specimen (.npz).")
def command(out: Path | None, speed: float, truth: Path | None) -> int:
    """Run the paper's campaign, shortened, on the simulated stand; evaluate it and write the report.

    The stand is a process of its own on real wires (Modbus TCP, a serial line, a 1-Wire folder). The last
    step is meant to reach the 40 °C stop.
    """
    from bufferstand.cli.campaign import perform, prepare
    from bufferstand.cli.commands.campaign.run import finish
    from bufferstand.cli.evaluation import show_evaluation
    from bufferstand.daq.campaign_folder import load_record
    from bufferstand.evaluation.document import evaluate_paths
    from bufferstand.evaluation.report import formats_here, write_report

    folder = out or Path("demo-output") / f"{datetime.now().astimezone():%Y-%m-%dT%H-%M-%S}"
    if load_record(folder) is not None:
        raise BadInput("this folder holds a campaign already", file=folder, remedy="choose another")
    prepared = prepare(sample("demo.toml"))
    plan = prepared.plan
    click.echo(
        f"{plan.campaign.content.campaign.title}: {len(plan.steps)} steps, "
        f"{duration_text(plan.expected_duration_s)} on the stand, "
        f"about {duration_text(plan.expected_duration_s / speed)} at {speed:g} times real time.\n"
        "The last step is meant to reach the 40 °C stop. Ctrl-C stops safely at any time.",
        err=True,
    )
    outcome = perform(prepared, folder, simulate=True, speed=speed, truth=truth)
    if not _stopped_as_intended(prepared, folder):
        return finish(outcome, folder)
    click.echo(f"The stop was meant: {outcome.safe_stop.line if outcome.safe_stop else ''}", err=True)
    click.echo("Evaluating and writing the report ...", err=True)
    document = evaluate_paths([folder / "runs"])
    write_json(document, str(folder / "evaluation.json"))
    files = write_report(folder, folder / "report", formats=formats_here(), document=document)
    show_evaluation(document, warnings=False)
    click.echo(f"\nrun files    {folder / 'runs'}")
    click.echo(f"evaluation   {folder / 'evaluation.json'}")
    for file in files:
        click.echo(f"report       {file.resolve().as_uri() if file.suffix == '.html' else file}")
    click.echo(_WHAT_NEXT.format(program=program(), folder=quote(str(folder))))
    return ExitStatus.DONE


def _stopped_as_intended(prepared: PreparedCampaign, folder: Path) -> bool:
    """Return whether all steps but the last are complete, and the last was stopped by a warm specimen."""
    from bufferstand.daq.campaign_folder import load_record

    record = load_record(folder)
    if record is None:
        return False
    last = record.steps[-1]
    return (
        all(step.status == "complete" for step in record.steps[:-1])
        and last.status == "stopped"
        and last.stopped_by.startswith("temperature")
        and len(record.steps) == len(prepared.plan.steps)
    )
