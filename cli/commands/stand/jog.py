"""``bufferstand stand jog``: move the piston slowly by hand."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bufferstand.cli.arming import is_terminal, yes_move_option
from bufferstand.cli.options import EXISTING, FiniteFloat, FiniteRange
from bufferstand.foundation import BadInput

if TYPE_CHECKING:
    from bufferstand.daq.operator import DeadManSwitch
    from bufferstand.daq.stand import ManualStand
    from bufferstand.drivers.stand_file import StandFile
    from bufferstand.foundation.channels import Channel

STEP_MAX_MM = 1.0
"""Without a terminal, in which a key can be held, one command moves so far at most."""
SHOWN_S = 0.1
"""Where it is is shown this often while it moves [s of the wall]."""
SHOWN = ("position", "force", "stroke")
"""Quantities that are shown, in this order."""


@click.command("jog", epilog="Example:  bufferstand stand jog stand.toml --to 0 --to 50 --to 100")
@click.argument("stand", metavar="STAND.toml", type=EXISTING)
@click.option("--by", metavar="MM", type=FiniteFloat(), help="So far from where it stands.")
@click.option(
    "--to",
    "targets",
    metavar="MM",
    type=FiniteFloat(),
    multiple=True,
    help="To this position; several in turn.",
)
@click.option(
    "--speed",
    metavar="MM/S",
    type=FiniteRange(min=0.05, max=5.0),
    default=1.0,
    show_default=True,
    help="Of the piston.",
)
@click.option(
    "--force-max",
    metavar="KN",
    type=FiniteRange(min=1.0, max=50.0),
    default=20.0,
    show_default=True,
    help="It is stopped at this force.",
)
@click.option(
    "--for",
    "seconds",
    metavar="S",
    type=FiniteRange(min=0.2, max=60.0),
    default=2.0,
    show_default=True,
    help="So long it stands at each position while the channels are read.",
)
@yes_move_option("stand")
def command(
    stand: Path,
    by: float | None,
    targets: tuple[float, ...],
    speed: float,
    force_max: float,
    seconds: float,
    yes_move: str | None,
) -> int:
    """Move the piston to positions on the controller's scale, and read every channel there.

    It moves only while a key is held in the terminal: half a second after it is let go of, it holds; q ends.
    Without a terminal one command moves by 1 mm at most (--by), and is given again. At the end the stand is
    unloaded and its valve switched off; where there is no force the piston stays.
    """
    from bufferstand.cli.stand_by_hand import consent, ended, moving, opened
    from bufferstand.daq.motions import Halt
    from bufferstand.daq.stand import ManualLimits, watchdog_s
    from bufferstand.foundation import ExitStatus

    held_key = is_terminal(sys.stdin)
    _demand_orders(by, targets, held_key=held_key)
    with opened(stand, "stand jog") as (stand_file, devices, clock):
        limits = ManualLimits(min(force_max, stand_file.limits.force_max_kN), stand_file.limits.stroke_max_mm)
        _demand_within(targets, stand_file, stand)
        where = f"by {by:g} mm" if by is not None else "to " + ", ".join(f"{mm:g}" for mm in targets) + " mm"
        gone_mm = speed * watchdog_s(stand_file)
        killed = f"if this program dies, the controller stops it after {gone_mm:.2g} mm more"
        consent(stand_file, limits, (("motion", f"jog {where} at {speed:g} mm/s; {killed}"),), yes_move)
        try:
            with moving(devices, stand_file, clock, limits) as hand:
                goals = targets if by is None else (hand.acquisition.latest.values["position"] + by,)
                if held_key:
                    _while_held(hand, goals, speed, seconds, clock.wall_s)
                else:
                    _show_header(hand)
                    hand.jog(goals[0], speed, lambda: True)
                    _show_row(hand, goals[0], seconds)
        except Halt as halt:
            return ended(halt)
    return ExitStatus.DONE


def _demand_orders(by: float | None, targets: tuple[float, ...], *, held_key: bool) -> None:
    """Refuse orders that are none, or too much for one that cannot be let go of."""
    if (by is None) == (not targets):
        raise BadInput("where to?", file="--by, --to", remedy="give one of --by and --to")
    if held_key:
        return
    if by is None or abs(by) > STEP_MAX_MM:
        raise BadInput(
            f"no terminal in which a key could be held: one command moves by {STEP_MAX_MM:g} mm at most",
            file="--by" if by is not None else "--to",
            remedy=f"give --by of at most {STEP_MAX_MM:g}, again and again; or use a terminal",
        )


def _demand_within(targets: tuple[float, ...], stand_file: StandFile, path: Path) -> None:
    most_mm = stand_file.limits.stroke_max_mm
    for target in targets:
        if target > most_mm:
            raise BadInput(
                f"{target:g} mm is beyond stroke_max_mm = {most_mm:g} mm",
                file=path,
                place="limits.stroke_max_mm",
                remedy="give a smaller --to",
            )


def _while_held(
    hand: ManualStand, goals: tuple[float, ...], speed: float, seconds: float, wall_s: Callable[[], float]
) -> None:
    """Move from goal to goal while a key is held."""
    from bufferstand.cli.closed_terminal import say
    from bufferstand.daq.operator import DeadManSwitch, characters_from

    dead_man = DeadManSwitch(wall_s)
    with characters_from(sys.stdin, dead_man.press):
        say("hold any key to move, let go to hold; q ends")
        _show_header(hand)
        for goal in goals:
            if not _reached(hand, goal, speed, dead_man):
                return
            _show_row(hand, goal, seconds)


def _reached(hand: ManualStand, goal: float, speed: float, dead_man: DeadManSwitch) -> bool:
    """Return whether the goal was reached; False where it was ended by key or for idleness."""
    from bufferstand.cli.stand_by_hand import show_there

    shown_s, names = [float("-inf")], [channel.name for channel in _shown(hand)]

    def watch() -> None:
        now_s = hand.acquisition.clock.wall_s()
        if now_s - shown_s[0] < SHOWN_S:
            return
        shown_s[0] = now_s
        values = hand.acquisition.latest.values
        text = ", ".join(f"{name} {values[name]:.2f}" for name in names if name in values)
        show_there(f"to {goal:g} mm: {text}")

    while not (dead_man.quit or dead_man.idle()):
        if not dead_man.held():
            hand.driver.pump()
            watch()
        elif hand.jog(goal, speed, dead_man.held, watch):
            show_there("")
            return True
    return False


def _shown(hand: ManualStand) -> list[Channel]:
    """Return the controller's channels that are shown."""
    channels = hand.acquisition.stand.controller.facts.channels
    shown = [one for one in channels if one.quantity in SHOWN]
    return sorted(shown, key=lambda one: (SHOWN.index(one.quantity), one.name))


def _show_header(hand: ManualStand) -> None:
    names = [channel.name for channel in _shown(hand)]
    click.echo(f"{'target mm':>10}" + "".join(f"{name:>12}{'counts':>12}" for name in names))


def _show_row(hand: ManualStand, goal: float, seconds: float) -> None:
    """Stand still, and print the means of the channels there: in their unit and in counts."""
    from bufferstand.daq.acquisition import CollectedSamples

    samples = CollectedSamples()
    hand.acquisition.observers.append(samples.take)
    try:
        hand.driver.wait(seconds)
    finally:
        hand.acquisition.observers.remove(samples.take)
    cells = [f"{goal:10.3f}"]
    for channel in _shown(hand):
        values = samples.column(channel.name)
        mean = float(values.mean()) if values.size else float("nan")
        try:
            counts = f"{channel.calibration.invert_linear(mean):12.1f}"
        except ValueError:  # a polynomial without an inverse
            counts = f"{'–':>12}"
        cells.append(f"{mean:12.4f}{counts}")
    click.echo("".join(cells))
