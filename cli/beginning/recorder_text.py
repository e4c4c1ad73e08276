"""The first stand file of a stand that another controller moves: it is recorded only."""

from __future__ import annotations

from dataclasses import replace

import tomlkit

from bufferstand.cli.beginning.answers import FURTHER, UNITS, Answers, is_twin
from bufferstand.cli.beginning.campaign_text import quoted
from bufferstand.cli.beginning.stand_text import stand_text

_HEAD = """\
# Stand {stand}, as `bufferstand init` wrote it. Its own controller moves it and is left alone: what its
# transducers say is recorded by an acquisition device of its own (docs/how-to/record-only.md).
# `bufferstand check {file}` reads every device once; `bufferstand record {file} --out runs` records.
# It has a simulated twin: `bufferstand simulate-stand {file}` serves it at the addresses below.
# For the real one: put in the devices' addresses, which terminal is which, each channel's calibration and
# uncertainty from its certificate, and the ROMs of the thermometers; then drop [simulation]. What was not
# given is that of the twin, not of your transducers.

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
port = {port}{stream_port}
rate_Hz = 1000.0                 # scans a second
"""
_INPUT = """
[[acquisition.input]]
terminal = "AIN{number}"
channel = {{ name = "{channel}", quantity = "{quantity}", unit = "{unit}", {says} }}
"""
_UNIT = {"force": "kN", "stroke": "mm", "pressure": "bar", "acceleration": "m/s²"}
_PER_VOLT = {"kN": (0.0, 63.0), "mm": (0.0, 50.0), "bar": (0.0, 40.0), "m/s²": (0.0, 5.0)}
"""Unit → zero and slope per V of 630 kN, 500 mm, 400 bar, 50 m/s² at 10 V, as the twin has them."""
_UNCERTAINTY = {
    "force": "accuracy_percent = 0.5, reversibility_percent = 0.5, zero = 0.3, u_delay_s = 2e-5",
    "stroke": "linearity = 0.25, zero = 0.05, u_delay_s = 2e-5",
}
_SIMULATION = """
[simulation] # the twin: drop it for the real stand
model = "models/category-a-elastomer.toml"

[simulation.moves] # what the twin's own controller does, until it is ended
mean_mm = 40.0
amplitude_mm = 20.0
frequency_Hz = 1.0
"""


def recorder_text(sample: str, answers: Answers, file: str) -> str:
    """Return the text of a stand file without a controller.

    Parameters
    ----------
    sample : str
        Text of the shipped stand file: of its amplifier and thermometers.
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
        stream_port=f"\nstream_port = {answers.port + 1}             # a real one has 702"
        * is_twin(answers.host),
    )
    channels = ["force", *(f"stroke_{number}" for number in range(1, answers.draw_wires + 1))]
    channels += [f"{name}_1" for name in FURTHER if name in answers.further]
    inputs = "".join(_input(answers, number, channel) for number, channel in enumerate(channels))
    return f"{head}{inputs}\n{_beside(sample, answers, file).strip()}\n{_SIMULATION}"


def _beside(sample: str, answers: Answers, file: str) -> str:
    """Return the tables of amplifier and thermometers, as a stand with a controller has them."""
    whole = tomlkit.parse(stand_text(sample, replace(answers, controller="ring", further=()), file))
    own = tomlkit.document()
    for table in ("amplifier", "temperature"):
        if table in whole:
            own.add(table, whole[table])
    return tomlkit.dumps(own)


def _input(answers: Answers, number: int, channel: str) -> str:
    quantity = channel.rpartition("_")[0] or channel
    unit = UNITS.get(channel, _UNIT[quantity])
    zero, slope = answers.coefficients.get(channel, _PER_VOLT[unit])
    certificate = answers.certificates.get(channel)
    says = [f"id = {quoted('not calibrated yet' if certificate is None else certificate.number)}"]
    says.append(f"coefficients = [{zero!r}, {slope!r}]")
    if certificate is not None:
        says.append(f"certificate = {quoted(certificate.number)}")
        if certificate.valid_until is not None:
            says.append(f"valid_until = {quoted(certificate.valid_until.isoformat())}")
    stated = f", uncertainty = {{ {_UNCERTAINTY[quantity]} }}" if quantity in _UNCERTAINTY else ""
    return _INPUT.format(
        number=number,
        channel=channel,
        quantity=quantity,
        unit=unit,
        says=f"calibration = {{ {', '.join(says)} }}{stated}",
    )
