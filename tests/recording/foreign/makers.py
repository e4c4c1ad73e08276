"""Foreign records of one known motion, written in many formats by other people's libraries."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

RATE_HZ = 500.0
FREQUENCY_HZ = 1.0
CYCLES = 4
MEAN_MM, AMPLITUDE_MM = 45.0, 20.0
MEAN_KN, FORCE_KN, DELTA = 120.0, 60.0, 0.25
"""Force leads the stroke by DELTA [rad]: an ellipse whose area is π F x sin δ."""
NOISE_MM, NOISE_KN = 5e-4, 5e-3
TEMPERATURE_C = 23.5
ABSORBED_J = float(np.pi * FORCE_KN * AMPLITUDE_MM * np.sin(DELTA))
STARTED = datetime(2026, 3, 5, 14, 2, 11, tzinfo=UTC)

LBF_KN = 0.45359237 * 9.80665 / 1000.0


def motion() -> dict[str, Floats]:
    """Return time [s], stroke [mm], force [kN] and temperature [°C]."""
    time_s = np.arange(round(CYCLES * RATE_HZ / FREQUENCY_HZ) + 1) / RATE_HZ
    phase = 2.0 * np.pi * FREQUENCY_HZ * time_s - np.pi / 2.0
    noise = np.random.default_rng(7).normal(size=(2, time_s.size))  # so that no figure hangs on rounding
    return {
        "time": time_s,
        "stroke": MEAN_MM + AMPLITUDE_MM * np.sin(phase) + NOISE_MM * noise[0],
        "force": MEAN_KN + FORCE_KN * np.sin(phase + DELTA) + NOISE_KN * noise[1],
        "temperature": np.full(time_s.size, TEMPERATURE_C),
    }


def table(
    headers: Mapping[str, str],
    columns: Mapping[str, Floats],
    separator: str = ",",
    decimal: str = ".",
    end: str = "\n",
    quote: str = "",
) -> str:
    """Return columns as text with as many digits as each number has."""
    lines = [separator.join(headers.values())]
    rows = zip(*(columns[name].tolist() for name in headers), strict=True)
    lines += [separator.join(f"{quote}{v!r}{quote}".replace(".", decimal) for v in row) for row in rows]
    return end.join(lines) + end


METRIC = {
    "time": "time [s]",
    "stroke": "stroke [mm]",
    "force": "force [kN]",
    "temperature": "temperature [°C]",
}


def csv_comma(path: Path) -> Path:
    path.write_text(table(METRIC, motion()), encoding="utf-8")
    return path


def csv_decimal_comma(path: Path) -> Path:
    path.write_bytes(table(METRIC, motion(), ";", ",", "\r\n").encode("utf-8-sig"))
    return path


def tsv_latin_1(path: Path) -> Path:
    path.write_bytes(table(METRIC, motion(), "\t", ",").encode("latin-1"))
    return path


def csv_utf_16(path: Path) -> Path:
    """As Excel's “Unicode text”: UTF-16, tabs, and newtons and metres."""
    m = motion()
    columns = m | {"stroke": m["stroke"] / 1000.0, "force": m["force"] * 1000.0}
    headers = METRIC | {"stroke": "stroke [m]", "force": "force [N]"}
    path.write_bytes(table(headers, columns, "\t", ".", "\r\n").encode("utf-16"))
    return path


def csv_imperial(path: Path) -> Path:
    m = motion()
    columns = {
        "time": m["time"] * 1000.0,
        "stroke": m["stroke"] / 25.4,
        "force": m["force"] / (1000.0 * LBF_KN),
        "temperature": m["temperature"] * 1.8 + 32.0,
    }
    headers = {
        "time": "time (ms)",
        "stroke": "stroke (in)",
        "force": "force (kip)",
        "temperature": "temperature (°F)",
    }
    path.write_text(table(headers, columns, quote='"'), encoding="utf-8")
    return path


def csv_units_row(path: Path) -> Path:
    """A heading of several lines, names and units in rows of their own, pound-force, minutes and kelvin."""
    m = motion()
    columns = {
        "time": m["time"] / 60.0,
        "stroke": m["stroke"],
        "force": m["force"] / LBF_KN,
        "temperature": m["temperature"] + 273.15,
    }
    headers = dict(zip(METRIC, ("time", "stroke", "force", "temperature"), strict=True))
    rows = table(headers, columns, ";").splitlines()
    head = ["Test rig 3;release 2.1", "Operator;K. Test", "", rows[0], "min;mm;lbf;K"]
    path.write_text("\n".join([*head, *rows[1:]]) + "\n", encoding="utf-8")
    return path


def tdms(path: Path) -> Path:
    """Two groups, written in several segments; the temperature is sampled at a tenth of the rate."""
    from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

    m = motion()
    start = np.datetime64(STARTED.replace(tzinfo=None))

    def wave(step: int, unit: str) -> dict[str, object]:
        return {
            "wf_start_time": start,
            "wf_start_offset": 0.0,
            "wf_increment": step / RATE_HZ,
            "unit_string": unit,
        }

    with TdmsWriter(str(path)) as writer:
        for number, rows in enumerate(np.array_split(np.arange(m["time"].size), 3)):
            fast = [
                ChannelObject("Rig", "stroke", m["stroke"][rows], wave(1, "mm") if number == 0 else {}),
                ChannelObject("Rig", "force", m["force"][rows], wave(1, "kN") if number == 0 else {}),
            ]
            head = [RootObject({"name": "test"}), GroupObject("Rig")] if number == 0 else []
            writer.write_segment([*head, *fast])
        slow = ChannelObject("Slow", "temperature", m["temperature"][::10], wave(10, "°C"))
        writer.write_segment([GroupObject("Slow"), slow])
    return path


def mdf(path: Path, *, compression: int = 2, version: str = "4.10") -> Path:
    """Two channel groups with masters of their own; the force is stored as counts with a conversion."""
    from asammdf import MDF, Signal

    m = motion()
    file = MDF(version=version)
    file.start_time = STARTED
    fast = [
        Signal(m["stroke"], m["time"], name="stroke", unit="mm"),
        Signal(
            m["force"] * 0.5 - 3.0,
            m["time"],
            name="force",
            unit="kN",
            conversion={"a": 2.0, "b": 6.0},
        ),
    ]
    file.append(fast, acq_name="Rig")
    slow = Signal(m["temperature"][::10], m["time"][::10], name="temperature", unit="degC")
    file.append([slow], acq_name="Slow")
    saved = file.save(path, overwrite=True, compression=compression)
    file.close()
    return Path(saved)


def excel(path: Path) -> Path:
    from openpyxl import Workbook

    m = motion()
    book = Workbook()
    sheet = book.active
    sheet.title = "Data"
    sheet.append(["Test rig 3"])
    sheet.append([])
    sheet.append(["time", "stroke", "force", "temperature"])
    sheet.append(["s", "mm", "N", "°C"])
    for row in zip(m["time"], m["stroke"], m["force"] * 1000.0, m["temperature"], strict=True):
        sheet.append([float(value) for value in row])
    book.create_sheet("Empty")
    book.save(path)
    return path


FORMATS: Mapping[str, tuple[str, Callable[[Path], Path]]] = {
    "CSV": ("record.csv", csv_comma),
    "CSV with decimal comma": ("record.csv", csv_decimal_comma),
    "TSV in Latin-1": ("record.tsv", tsv_latin_1),
    "UTF-16": ("record.txt", csv_utf_16),
    "imperial and quoted": ("record.csv", csv_imperial),
    "units row": ("record.csv", csv_units_row),
    "TDMS": ("record.tdms", tdms),
    "MDF4": ("record.mf4", mdf),
    "Excel": ("record.xlsx", excel),
}
