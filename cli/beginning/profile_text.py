"""The register profile of a stand whose controller samples other channels than the shipped one says."""

from __future__ import annotations

import re

from bufferstand.cli.beginning.answers import Answers
from bufferstand.drivers.register_maps import SHIPPED
from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import read_text

PROFILE = "registers.toml"
"""Its name, beside the stand file."""
SHIPPED_WIRES = 2
_TYPES = {
    "ring": {"stroke": "u16", "pressure": "u16", "acceleration": "i16"},
    "rmc": {"stroke": "f32", "pressure": "f32", "acceleration": "f32"},
}
_HEAD = """\
# What the controller samples, as `bufferstand init` wrote it: a copy of bufferstand's own profile
# “{controller}” with other channels in it. How one is written for a PLC with other addresses:
# docs/how-to/add-a-register-map.md.
"""


def further_channels(answers: Answers) -> list[str]:
    """Return the names of the channels that are sampled beside those of the shipped stand."""
    wires = [f"stroke_{number}" for number in range(SHIPPED_WIRES + 1, answers.draw_wires + 1)]
    return [*wires, *(f"{name}_1" for name in answers.further)]


def profile_text(answers: Answers) -> str | None:
    """Return the text of the profile; None where the shipped one says it.

    Raises
    ------
    BadInput
        If a controller that is polled is to have further channels: their registers are not known.
    """
    further = further_channels(answers)
    if answers.draw_wires == SHIPPED_WIRES and not further:
        return None
    text = read_text(SHIPPED / f"{answers.controller}.toml")
    if answers.controller == "polling":
        if further:
            raise BadInput(
                "a polled controller has a register for each channel, and those of further ones are not "
                "known; nothing was written",
                file="--draw-wires, --further",
                remedy="leave them out, and add them to a register map of your own afterwards",
            )
        # registers of one read must follow each other without a hole
        changed = text.replace('["stroke_1", "stroke_2", ', '["stroke_1"], [')
    else:
        changed = re.sub(
            r"^sample = \[.*\]$", lambda found: _sample(found[0], answers), text, flags=re.MULTILINE
        )
    return _HEAD.format(controller=answers.controller) + re.sub(r"\A(#.*\n)+", "", changed)


def _sample(line: str, answers: Answers) -> str:
    """Return what is sampled, in its order: the wires beside each other, further channels at the end."""
    known = re.findall(r'"([^"]+)"', line)
    types = _TYPES[answers.controller]
    wires = [f"stroke_{number}:{types['stroke']}" for number in range(1, answers.draw_wires + 1)]
    first = next(at for at, one in enumerate(known) if one.startswith("stroke_"))
    others = [one for one in known if not one.startswith("stroke_")]
    further = [f"{name}_1:{types[name]}" for name in answers.further]
    listed = ", ".join(f'"{one}"' for one in (*others[:first], *wires, *others[first:], *further))
    return f"sample = [{listed}]"
