"""The first stand file: the shipped one with the answers put in, so that there is one stand to keep right."""

from __future__ import annotations

import re
from typing import Any

import tomlkit

from bufferstand.cli.beginning.answers import MOST_FORCE_KN, Answers

HEAD = """\
# Stand {stand}, as `bufferstand init` wrote it; every key is explained in docs/drivers.md.
# It has a simulated twin: `bufferstand simulate-stand {file}` serves it at the address below, and
# `bufferstand check {file}` then reads every device once.
# For the real one: put in host and port of the controller, the serial devices, the ROMs of the thermometers,
# and each channel's calibration (`bufferstand calibration import CERTIFICATE.xml --stand {file}`), then drop
# [simulation]. The coefficients below are those of the twin, not of your transducers.
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
    controller["profile"] = answers.controller
    controller["host"], controller["port"] = answers.host, answers.port
    for channel in controller["channel"]:
        _calibrate(channel, answers)
    amplifier: Any = document["amplifier"]
    if answers.second_force:
        _calibrate(amplifier["channel"], answers)
    else:
        del document["amplifier"]
    document["simulation"]["model"] = "models/category-a-elastomer.toml"
    return tomlkit.dumps(document)


def _limits(limits: Any, answers: Answers) -> None:
    limits["force_max_kN"] = answers.force_max_kN
    limits["stroke_max_mm"] = answers.stroke_max_mm
    if answers.force_max_kN > MOST_FORCE_KN:  # the curve of the shipped stand's valve ends there
        del limits["force_speed"]


def _calibrate(channel: Any, answers: Answers) -> None:
    """Name a channel's certificate, or say that it has none; its coefficients are the twin's."""
    if channel["name"] == "command":
        return
    calibration = channel["calibration"]
    certificate = answers.certificates.get(str(channel["name"]))
    for key in ("certificate", "date", "valid_until"):
        calibration.pop(key, None)
    calibration["id"] = _CERTIFIED if certificate is None else certificate.number
    if certificate is not None:
        calibration["certificate"] = certificate.number
        if certificate.valid_until is not None:
            calibration["valid_until"] = certificate.valid_until.isoformat()


def _plain(text: str) -> str:
    """Return a text for a comment: one line."""
    return " ".join(text.split())
