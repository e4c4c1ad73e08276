"""How well a foreign device fits a description: its constants, and what it shows where its values lie."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

from bufferstand.drivers.acquisition.modbus_io.description import Description
from bufferstand.drivers.acquisition.modbus_io.driver import expected_content, mismatch, scan_reads
from bufferstand.drivers.acquisition.modbus_io.points import Point, resolved_points
from bufferstand.drivers.acquisition.modbus_io.reads import Image
from bufferstand.drivers.descriptions import Answer
from bufferstand.drivers.modbus import Likeness, ModbusLink, ModbusRefusal

_STAND_INS: dict[str, Answer] = {"whole": 0, "number": 1.0, "text": "units"}
"""What stands for an answer that nobody has given yet: addresses as printed, raw counts."""

_LEAST, _MOST = 1e-12, 1e12
"""Between these lie the floats of a device that measures; other registers read so are mostly beyond."""


class _NonsenseError(Exception):
    """What is read can be no value."""


def likeness(found: Description, link: ModbusLink) -> Likeness:
    """Return how well the device behind a link fits a description.

    Read are its constants, and its first point with what belongs to it; nothing is written.

    Raises
    ------
    DeviceFault
        If no true reply comes; ModbusRefusal if the device refuses.
    """
    for expected in found.identity:
        if what := mismatch(expected, expected_content(link, expected)):
            return Likeness("does not fit", what)
    refused: list[ModbusRefusal] = []
    nonsense = ""
    for answers in _possible_answers(found):
        point = next(iter(resolved_points(found, answers).values()))
        try:
            shown = _shown(found, point, link)
        except ModbusRefusal as refusal:
            refused.append(refusal)
            continue
        except _NonsenseError as error:
            nonsense = str(error)
            continue
        with_ = "".join(
            f"; with {key} = “{value}”"
            for key, value in answers.items()
            if isinstance(value, str) and value != "units"
        )
        asked = f"; it will ask {', '.join(one.key for one in found.ask)}" if found.ask else ""
        if found.identity:
            constants = " and ".join(one.what for one in found.identity)
            return Likeness("fits", f"{constants} are there; {shown}{with_}{asked}")
        return Likeness("may fit", f"{shown}{with_}; no document says by what it is told from others{asked}")
    if nonsense:
        return Likeness("does not fit", nonsense)
    raise refused[-1]


def _possible_answers(found: Description) -> Iterator[dict[str, Answer]]:
    """Yield answers to what is asked: every choice, and stand-ins for the rest."""
    options = [list(one.choices) if one.kind == "choice" else [_STAND_INS[one.kind]] for one in found.ask]
    for values in itertools.product(*options):
        yield dict(zip((one.key for one in found.ask), values, strict=True))


def _shown(found: Description, point: Point, link: ModbusLink) -> str:
    image = Image()
    values, status = scan_reads([point], most_registers=found.most_registers, bridge=found.bridge)
    for read in (*values, *status):
        image.take(read, read.ask(link, point.name))
    content = image.at((*point.value_places, *point.status_places))
    reading = point.read(content)
    raw = point.raw_of(content[point.place])
    if point.type == "f32" and not (raw == 0.0 or _LEAST <= abs(raw) <= _MOST):
        raise _NonsenseError(
            f"{point.name} (address {point.place.address}) reads {raw:g}, which is no float of a measurement"
        )
    wrong = f" ({'; '.join(reading.what)})" if reading.what else ""
    return f"{point.name} (address {point.place.address}) reads {raw:g}{wrong}"
