"""``bufferstand init``: a guided beginning."""

from __future__ import annotations

import sys
from pathlib import Path
from shlex import quote
from typing import Any

import click

from bufferstand.cli.arming import is_terminal, user_name
from bufferstand.cli.beginning import (
    CAMPAIGNS,
    CHANNELS,
    CONTROLLERS,
    FURTHER,
    MOST_THERMOMETERS,
    MOST_WIRES,
    NONE,
    UNITS,
    Answers,
    is_like_shipped,
    is_twin,
    parse_certificate,
    parse_coefficients,
)
from bufferstand.cli.options import FOLDER, FiniteRange
from bufferstand.foundation import BadInput, ExitStatus, counted, program

_NEXT = (
    ("simulate-stand {stand}", "in a second terminal: the stand's simulated twin"),
    ("check {stand}", "reads every device once"),
    ("plan {campaign}", "what the campaign would do"),
    ("desk {folder}", "all of it in the browser"),
)
"""What comes next, and what it does."""
_NEXT_RECORDED = (
    ("simulate-stand {stand}", "in a second terminal: its simulated twin, which moves by itself"),
    ("check {stand}", "reads every device once"),
    ("record {stand} --out runs --specimen {campaign} --for 1min", ""),
    ("desk {folder}", "results and reports in the browser"),
)
_DEFAULTS = Answers()


@click.command("init", epilog="Example:  bufferstand init laboratory --yes --campaign warm-up")
@click.argument("folder", metavar="DIR", type=FOLDER)
@click.option("--yes", is_flag=True, help="Ask nothing: what no option says is as proposed.")
@click.option("--laboratory", metavar="NAME", help="Of the reports.")
@click.option("--stand", metavar="ID", help="Of the stand.")
@click.option(
    "--controller",
    type=click.Choice(list(CONTROLLERS)),
    help="Kind of controller: registers with a sample ring or polled, Delta RMC; none: recorded only.",
)
@click.option(
    "--host",
    metavar="HOST",
    help="Address of the controller, or of what records (default: of its simulated twin).",
)
@click.option("--port", type=click.IntRange(1, 65535), help="Its port.")
@click.option("--force-max", metavar="KN", type=FiniteRange(min=1.0, max=10000.0), help="Limit of the stand.")
@click.option("--stroke-max", metavar="MM", type=FiniteRange(min=1.0, max=1000.0), help="Limit of the stand.")
@click.option(
    "--second-force/--no-second-force",
    default=None,
    help="A second amplifier on the load cell (serial line).",
)
@click.option(
    "--draw-wires", type=click.IntRange(1, MOST_WIRES), help="Draw wires beside the specimen (default 2)."
)
@click.option(
    "--further",
    multiple=True,
    type=click.Choice(list(FURTHER)),
    help="A further channel that the controller samples; may be repeated.",
)
@click.option(
    "--thermometers",
    type=click.IntRange(1, MOST_THERMOMETERS),
    help="On the specimen (default 2), beside one in the air.",
)
@click.option(
    "--coefficients",
    "coefficients",
    multiple=True,
    metavar="CHANNEL=ZERO,SLOPE",
    help="Calibration: kN or mm, and kN or mm per count (default: of the twin).",
)
@click.option(
    "--certificate",
    "certificates",
    multiple=True,
    metavar="CHANNEL=NUMBER@DATE",
    help="Calibration certificate of a channel, and until when it is valid.",
)
@click.option("--specimen", metavar="ID", help="Of the first specimen.")
@click.option("--kind", type=click.Choice(["buffer", "draw-gear"]), help="Of the specimen.")
@click.option("--category", type=click.Choice(["A", "B", "C", "none"]), help="Of a buffer, EN 15551.")
@click.option(
    "--elastic-system",
    type=click.Choice(["elastomer", "rubber-steel", "ring-spring"]),
    help="Of the specimen.",
)
@click.option("--max-stroke", metavar="MM", type=FiniteRange(min=1.0, max=1000.0), help="Of the specimen.")
@click.option(
    "--model/--no-model",
    default=None,
    help="Plan force and heat with a shipped elastomer spring until its own is identified.",
)
@click.option("--campaign", type=click.Choice(list(CAMPAIGNS)), help="The first campaign.")
@click.option("--operator", metavar="NAME", help="Of the campaign.")
def command(
    folder: Path, yes: bool, certificates: tuple[str, ...], coefficients: tuple[str, ...], **given: Any
) -> int:
    """Make a first stand, specimen and campaign in DIR by questions: commented files that are valid.

    The stand has a simulated twin, so that all of it can be tried at once. No file that is there is written
    over. Without a terminal, or with --yes, nothing is asked.
    """
    from bufferstand.cli.beginning import write_first_files

    asks = not yes and is_terminal(sys.stdin)
    if not asks and not yes:
        raise BadInput(
            "there is no terminal to ask at", file="init", remedy="add --yes, and options for what differs"
        )
    given["certificates"] = dict(parse_certificate(text) for text in certificates)
    given["coefficients"] = dict(parse_coefficients(text) for text in coefficients)
    try:
        answers = _answers(given, asks=asks)
    except EOFError:
        raise BadInput("the questions were not answered: nothing was written", remedy="add --yes") from None
    written = write_first_files(folder, answers)
    where, stand, campaign = (quote(str(path)) for path in (folder, written[0], written[1]))
    click.echo(f"{counted(len(written), 'file')} in {where}. Next:")
    lines = [
        (f"{program()} {words.format(folder=where, stand=stand, campaign=campaign)}", what)
        for words, what in (_NEXT_RECORDED if answers.controller == NONE else _NEXT)
    ]
    width = max(len(words) for words, what in lines if what)
    for words, what in lines:
        click.echo(f"  {words:{width}}  {what}".rstrip())
    return ExitStatus.DONE


def _answers(given: dict[str, Any], *, asks: bool) -> Answers:
    """Return what was given, asked at the terminal where nothing was, or as proposed."""

    def one(key: str, question: str, default: Any, kind: Any = None) -> Any:
        if given.get(key) is not None:
            return given[key]
        if not asks:
            return default
        return click.prompt(question, default=default, type=kind, err=True)

    def choice(key: str, question: str, about: dict[str, str], default: str) -> str:
        if asks and given.get(key) is None:
            for name, text in about.items():
                click.echo(f"  {name:<9} {text}", err=True)
        return str(one(key, question, default, click.Choice(list(about))))

    def yes_no(key: str, question: str, *, default: bool) -> bool:
        if given.get(key) is not None:
            return bool(given[key])
        return click.confirm(question, default=default, err=True) if asks else default

    first: dict[str, Any] = {
        "laboratory": one("laboratory", "Laboratory", _DEFAULTS.laboratory),
        "stand": one("stand", "Id of the stand", _DEFAULTS.stand),
        "controller": choice("controller", "Kind of controller", CONTROLLERS, _DEFAULTS.controller),
        "host": one("host", "Its address (127.0.0.1: its simulated twin)", _DEFAULTS.host),
    }
    # Modbus TCP has its own port everywhere but on this computer, where no user may serve it.
    usual = _DEFAULTS.port if is_twin(str(first["host"])) else 502
    first |= {
        "port": one("port", "Its port", usual, click.IntRange(1, 65535)),
        "force_max_kN": one("force_max", "Largest force of the stand [kN]", _DEFAULTS.force_max_kN, float),
        "stroke_max_mm": one(
            "stroke_max", "Largest stroke of the stand [mm]", _DEFAULTS.stroke_max_mm, float
        ),
        "second_force": yes_no("second_force", "A second amplifier on the load cell?", default=True),
        "draw_wires": one("draw_wires", "Draw wires", _DEFAULTS.draw_wires, click.IntRange(1, MOST_WIRES)),
        "further": tuple(given["further"]) or _further(asks=asks),
        "thermometers": one(
            "thermometers",
            "Thermometers on the specimen",
            _DEFAULTS.thermometers,
            click.IntRange(1, MOST_THERMOMETERS),
        ),
        "specimen": one("specimen", "Id of the specimen", _DEFAULTS.specimen),
        "kind": one("kind", "Its kind", _DEFAULTS.kind, click.Choice(["buffer", "draw-gear"])),
        "elastic_system": one(
            "elastic_system",
            "Its elastic system",
            _DEFAULTS.elastic_system,
            click.Choice(["elastomer", "rubber-steel", "ring-spring"]),
        ),
        "max_stroke_mm": one("max_stroke", "Its largest stroke [mm]", _DEFAULTS.max_stroke_mm, float),
    }
    buffer = first["kind"] == "buffer"
    category = one(
        "category", "Its category (EN 15551)", "A" if buffer else "none", click.Choice([*"ABC", "none"])
    )
    alike = is_like_shipped(str(first["kind"]), str(first["elastic_system"]), float(first["max_stroke_mm"]))
    if asks and not (given["certificates"] or given["coefficients"]):
        _ask_calibrations(given, second_force=bool(first["second_force"]), wires=int(first["draw_wires"]))
    return Answers(
        **first,
        certificates=given["certificates"],
        coefficients=given["coefficients"],
        category="" if category == "none" else category,
        model=(alike or given.get("model") is True)
        and yes_no("model", "Plan with a shipped elastomer spring until its own is known?", default=True),
        campaign=choice("campaign", "First campaign", CAMPAIGNS, _DEFAULTS.campaign),
        operator=one("operator", "Operator", user_name()),
    )


def _further(*, asks: bool) -> tuple[str, ...]:
    """Return which further channels the controller samples."""
    if not asks:
        return ()
    return tuple(
        name
        for name, where in FURTHER.items()
        if click.confirm(f"Does it sample the {name} {where}?", default=False, err=True)
    )


def _ask_calibrations(given: dict[str, Any], *, second_force: bool, wires: int) -> None:
    """Ask for certificate and coefficients of every channel, if they are at hand."""
    if not click.confirm("Are calibration certificates at hand?", default=False, err=True):
        return
    stated = {"force", "position", *(f"stroke_{number}" for number in range(1, wires + 1))}
    stated |= {"force_2"} if second_force else set()
    for channel in (one for one in CHANNELS if one in stated):
        unit = UNITS[channel]
        click.echo(f"  {channel} (empty: as the twin has it)", err=True)
        _until_it_is_one(
            given["certificates"], channel, "certificate, NUMBER@YYYY-MM-DD of its end", parse_certificate
        )
        _until_it_is_one(
            given["coefficients"], channel, f"ZERO,SLOPE in {unit} and {unit} per count", parse_coefficients
        )


def _until_it_is_one(known: dict[str, Any], channel: str, question: str, parse: Any) -> None:
    """Ask until there is an answer that can be one, or none."""
    while text := click.prompt(f"    {question}", default="", show_default=False, err=True):
        try:
            known[channel] = parse(f"{channel}={text}")[1]
        except BadInput as error:
            click.echo(f"    {error}", err=True)
        else:
            return
