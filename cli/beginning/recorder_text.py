"""The first stand file of a stand that another controller moves: it is recorded only."""

from __future__ import annotations

from bufferstand.cli.beginning.answers import UNITS, Answers
from bufferstand.cli.beginning.campaign_text import quoted

_HEAD = """\
# Stand {stand}, as `bufferstand init` wrote it. Its own controller moves it and is left alone: what its
# transducers say is recorded by an acquisition device of its own (docs/how-to/record-only.md).
# `bufferstand check {file}` reads every device once; `bufferstand record {file} --out runs` records.
# Put in: the device's address, which terminal is which, and each channel's calibration from its certificate.

[stand]
id = {id}
name = {name}
laboratory = {laboratory}

[limits] # they warn, and hold nothing
force_max_kN = {force_max_kN}
stroke_max_mm = {stroke_max_mm}

[[acquisition]]
kind = "labjack"                 # docs/keys.md explains every key
model = "T7"
host = {host}
port = {port}
rate_Hz = 1000.0                 # scans a second
"""
_INPUT = """
[[acquisition.input]]
terminal = "AIN{number}"
channel = {{ name = "{channel}", quantity = "{quantity}", unit = "{unit}", calibration = {calibration} }}
"""
_PER_VOLT = {"kN": (0.0, 63.0), "mm": (0.0, 50.0)}
"""Unit → zero and slope per V of 630 kN and 500 mm at 10 V: to be replaced by the certificate's."""


def recorder_text(answers: Answers, file: str) -> str:
    """Return the text of a stand file without a controller.

    Parameters
    ----------
    answers : Answers
    file : str
        Its name, for the comments.
    """
    head = _HEAD.format(
        stand=" ".join(answers.stand.split()),
        file=file,
        id=quoted(answers.stand),
        name=quoted(f"Stand {answers.stand}, moved by its own controller"),
        laboratory=quoted(answers.laboratory),
        force_max_kN=answers.force_max_kN,
        stroke_max_mm=answers.stroke_max_mm,
        host=quoted(answers.host),
        port=answers.port,
    )
    channels = ["force", *(f"stroke_{number}" for number in range(1, answers.draw_wires + 1))]
    return head + "".join(_input(answers, number, channel) for number, channel in enumerate(channels))


def _input(answers: Answers, number: int, channel: str) -> str:
    zero, slope = answers.coefficients.get(channel, _PER_VOLT[UNITS[channel]])
    certificate = answers.certificates.get(channel)
    says = [f"id = {quoted('not calibrated yet' if certificate is None else certificate.number)}"]
    says.append(f"coefficients = [{zero!r}, {slope!r}]")
    if certificate is not None:
        says.append(f"certificate = {quoted(certificate.number)}")
        if certificate.valid_until is not None:
            says.append(f"valid_until = {quoted(certificate.valid_until.isoformat())}")
    return _INPUT.format(
        number=number,
        channel=channel,
        quantity="force" if channel == "force" else "stroke",
        unit=UNITS[channel],
        calibration=f"{{ {', '.join(says)} }}",
    )
