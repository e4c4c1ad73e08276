"""The first stand file: the shipped one with the answers put in, so that there is one stand to keep right."""

from __future__ import annotations

import re
from typing import Any

import tomlkit

from bufferstand.cli.beginning.answers import FURTHER, MOST_FORCE_KN, UNITS, Answers
from bufferstand.cli.beginning.profile_text import PROFILE, SHIPPED_WIRES, further_channels, profile_text

HEAD = """\
# Stand {stand}, as `bufferstand init` wrote it; every key is explained in docs/keys.md.
# It has a simulated twin: `bufferstand simulate-stand {file}` serves it at the address below, and
# `bufferstand check {file}` then reads every device once.
# For the real one: put in host and port of the controller, the serial devices, the ROMs of the thermometers,
# and each channel's calibration (`bufferstand calibration import CERTIFICATE.xml --stand {file}`), then drop
# [simulation]. Coefficients that were not given are those of the twin, not of your transducers.
"""
_RMC = """
# What an RMC's documents leave open: docs/how-to/connect-a-delta-rmc.md says where each is found.
[controller.rmc]
model = "rmc150"                 # or rmc75
axis = 0                         # of the position
plot = 7                         # its data sets: force, stroke_1, stroke_2, position, command
word_order = "little"            # which word of 32 bits comes first: check says if it is the other
variables = 100                  # first of the watchdog program's 24 variables
force = "%MD9.8"                 # register of the force in kN
clear_mm = -5.0                  # where the piston is clear of the specimen
acceleration_mm_per_s2 = 5000.0  # of moves and stops

"""
_CERTIFIED = "not calibrated yet"
"""Id of a calibration that no certificate is named of."""


def stand_text(sample: str, answers: Answers, file: str) -> str:
    """Return the text of the stand file.

    Parameters
    ----------
    sample : str
        Text of the shipped stand file.
    answers : Answers
    file : str
        Its name, for the comments.
    """
    body = re.sub(r"\A(#.*\n)+", "", sample)
    document = tomlkit.parse(HEAD.format(stand=_plain(answers.stand), file=file) + body)
    stand: Any = document["stand"]
    stand["id"] = answers.stand
    stand["name"] = f"Servo-hydraulic stand {answers.stand}"
    stand["laboratory"] = answers.laboratory
    _limits(document["limits"], answers)
    controller: Any = document["controller"]
    controller["host"], controller["port"] = answers.host, answers.port
    if answers.draw_wires < SHIPPED_WIRES:
        numbers = {str(one["name"]): at for at, one in enumerate(controller["channel"])}
        del controller["channel"][numbers["stroke_2"]]
    for name in further_channels(answers):
        controller["channel"].append(_further(name))
    for channel in controller["channel"]:
        _calibrate(channel, answers)
    _thermometers(document["temperature"], answers)
    amplifier: Any = document["amplifier"]
    if answers.second_force:
        _calibrate(amplifier["channel"], answers)
    else:
        del document["amplifier"]
    document["simulation"]["model"] = "models/category-a-elastomer.toml"
    text = re.sub(r"^(calibration = .*\])\s+\}$", r"\1 }", tomlkit.dumps(document), flags=re.MULTILINE)
    return _of_kind(text, answers)


def _of_kind(text: str, answers: Answers) -> str:
    """Put the kind of controller in: a register profile, or a kind with a table of its own."""
    shipped = 'profile = "ring"\n'
    before, found, after = text.partition(shipped)
    assert found, "the shipped stand has a controller with a ring"
    own = profile_text(answers) is not None
    if answers.controller != "rmc":
        return f'{before}profile = "{PROFILE if own else answers.controller}"\n{after}'
    head, watchdog, rest = after.partition("watchdog_s = 2.0\n")
    assert watchdog, "the shipped stand states its watchdog"
    profile = f'profile = "{PROFILE}"\n' if own else ""
    return f'{before}kind = "rmc"\n{profile}{head}{watchdog}{_RMC}{rest}'


def _further(name: str) -> Any:
    """Return a channel that the shipped stand has not: a draw wire, or a further quantity."""
    quantity = name.rpartition("_")[0]
    wire = quantity == "stroke"
    table = tomlkit.table()
    table["name"], table["quantity"] = name, quantity
    table["unit"] = {"stroke": "mm", "pressure": "bar", "acceleration": "m/s²"}[quantity]
    table["place"] = f"draw wire {name[-1]}: say where" if wire else FURTHER[quantity]
    calibration = tomlkit.inline_table()
    calibration["id"] = _CERTIFIED
    calibration["coefficients"] = [-50.0, 0.00762939453125] if wire else [0.0, 0.01]
    table["calibration"] = calibration
    if wire:
        uncertainty = tomlkit.inline_table()
        uncertainty.update({"linearity": 0.25, "zero": 0.05, "u_delay_s": 2e-5})
        table["uncertainty"] = uncertainty
    table.add(tomlkit.nl())
    return table


def _thermometers(table: Any, answers: Answers) -> None:
    """Leave, or make, so many thermometers on the specimen, beside the one in the air."""
    sensors = table["sensor"]
    on_it = [number for number, one in enumerate(sensors) if one["role"] == "specimen"]
    for number in reversed(on_it[answers.thermometers :]):
        del sensors[number]
    for number in range(len(on_it) + 1, answers.thermometers + 1):
        further = tomlkit.table()
        further["rom"] = f"28-0000000000{number:02x}"
        further["name"] = f"temperature_{number + 1}"
        further["place"] = f"specimen, thermometer {number}: say where"
        further["role"] = "specimen"
        uncertainty = tomlkit.inline_table()
        uncertainty["zero"] = 0.5
        further["uncertainty"] = uncertainty
        further.add(tomlkit.nl())
        sensors.append(further)


def _limits(limits: Any, answers: Answers) -> None:
    limits["force_max_kN"] = answers.force_max_kN
    limits["stroke_max_mm"] = answers.stroke_max_mm
    if answers.force_max_kN > MOST_FORCE_KN:  # the curve of the shipped stand's valve ends there
        del limits["force_speed"]


def _calibrate(channel: Any, answers: Answers) -> None:
    """Name a channel's certificate, or say that it has none; its coefficients are the twin's."""
    calibration = channel["calibration"]
    if channel["name"] == "command":
        if answers.controller == "rmc":
            calibration["coefficients"] = [0.0, 1.0]
        return
    certificate = answers.certificates.get(str(channel["name"]))
    for key in ("certificate", "date", "valid_until"):
        calibration.pop(key, None)
    if answers.controller == "rmc" and channel["name"] != "force_2":
        calibration["coefficients"] = [0.0, 1.0]
        channel.trivia.comment_ws, channel.trivia.comment = " ", "# as RMCTools scales it"
    if (given := answers.coefficients.get(str(channel["name"]))) is not None:
        calibration["coefficients"] = [given[0], given[1]]
        unit = UNITS[str(channel["name"])]
        channel.trivia.comment_ws, channel.trivia.comment = " ", f"# {unit} = zero + slope × reading"
    calibration["id"] = _CERTIFIED if certificate is None else certificate.number
    if certificate is not None:
        calibration["certificate"] = certificate.number
        if certificate.valid_until is not None:
            calibration["valid_until"] = certificate.valid_until.isoformat()


def _plain(text: str) -> str:
    """Return a text for a comment: one line."""
    return " ".join(text.split())
