"""``bufferstand stand zero``: touch off the specimen by hand."""

from __future__ import annotations

from pathlib import Path

import click

from bufferstand.cli.arming import yes_move_option
from bufferstand.cli.options import EXISTING, FiniteRange, write_json

TRAVEL_MM = 10.0


@click.command("zero", epilog="Example:  bufferstand stand zero stand.toml --specimen A-0815")
@click.argument("stand", metavar="STAND.toml", type=EXISTING)
@click.option("--specimen", metavar="ID", default="", help="The specimen that is in the stand.")
@click.option("--operator", metavar="NAME", default="", help="Who does it; the login name if not given.")
@click.option(
    "--touch-force",
    metavar="KN",
    type=FiniteRange(min=0.2, max=2.0),
    help="Force over that at rest at which it turns back; by the force's noise if not given.",
)
@click.option(
    "--speed",
    metavar="MM/S",
    type=FiniteRange(min=0.05, max=1.0),
    default=0.5,
    show_default=True,
    help="Of the piston while it creeps.",
)
@click.option(
    "--travel",
    metavar="MM",
    type=FiniteRange(min=0.5, max=50.0),
    default=TRAVEL_MM,
    show_default=True,
    help="So far it creeps at most, from the piston's own zero.",
)
@click.option("--json", "as_json", is_flag=True, help="The zero as JSON on standard output.")
@yes_move_option("stand")
def command(
    stand: Path,
    specimen: str,
    operator: str,
    touch_force: float | None,
    speed: float,
    travel: float,
    as_json: bool,
    yes_move: str | None,
) -> int:
    """Creep to a small force, find first contact, back off: what the channels read there is zero.

    Written to STAND.zero.toml beside the stand file, with its uncertainty and the date; campaigns with
    “touch = false” in [zero] take it over for a day. Exit status 3 if no contact is found, or a channel is
    too far off to be taken for zero.
    """
    from bufferstand.cli.campaign import touch_rows
    from bufferstand.cli.closed_terminal import say
    from bufferstand.cli.stand_by_hand import consent, ended, moving, opened
    from bufferstand.daq.guards.kinds import DEFAULT_TILT_MM
    from bufferstand.daq.motions import Halt
    from bufferstand.daq.stand import FORCE_MAX_KN, RELEASE_SPEED_MM_PER_S, ManualLimits
    from bufferstand.daq.zero import BY_HAND, Zeroing, ZeroLimits, store_zero
    from bufferstand.foundation import ExitStatus
    from bufferstand.protocols.campaign_file import GuardTable, ZeroTable

    with opened(stand, "stand zero") as (stand_file, devices, clock):
        limits = ManualLimits(
            min(FORCE_MAX_KN, stand_file.limits.force_max_kN),
            min(travel + 5.0, stand_file.limits.stroke_max_mm),
        )
        table = ZeroTable(touch_force_kN=touch_force, speed_mm_per_s=speed, travel_max_mm=travel)
        stiffness = stand_file.limits.machine_stiffness_kN_per_mm or 0.0
        armed = consent(stand_file, limits, touch_rows(table, RELEASE_SPEED_MM_PER_S, stiffness), yes_move)
        tilt_mm = stand_file.stand.tilt_max_mm or DEFAULT_TILT_MM
        far = ZeroLimits(GuardTable().zero_force_max_kN, tilt_mm, RELEASE_SPEED_MM_PER_S, BY_HAND)
        try:
            with moving(devices, stand_file, clock, limits) as hand:
                zeroing = Zeroing(
                    hand.acquisition,
                    hand.driver,
                    table,
                    far,
                    say=say,
                    catch_up=hand.catch_up,
                    specimen=specimen,
                    operator=operator or armed.by,
                )
                zeroing.arrived = hand.set_limits
                zero = zeroing.touch()
        except Halt as halt:
            return ended(halt)
    path = store_zero(stand, zero)
    if as_json:
        write_json(zero.document(), "-")
    else:
        click.echo(f"{zero.sentence()}\nwritten to {path}")
    return ExitStatus.DONE
