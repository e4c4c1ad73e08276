"""Write the FMU: description, table and prebuilt libraries in one archive; no compiler is needed."""

from __future__ import annotations

import hashlib
import io
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Mapping
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path

import numpy as np

from bufferstand.foundation import BadInput
from bufferstand.model.export.description import IDENTIFIER, model_description, page
from bufferstand.model.export.options import FmuOptions
from bufferstand.model.export.variables import Variable, range_rows, start_values, variables
from bufferstand.model.file import save_model
from bufferstand.model.spring import SpringModel

LIBRARIES = {"linux64": f"{IDENTIFIER}.so", "win64": f"{IDENTIFIER}.dll"}
"""Prebuilt libraries by FMI's name of the platform."""
SOURCES = (
    "bufferstand_spring_fmu.c",
    "bufferstand_spring_resource.h",
    "bufferstand_spring.h",
    "fmi2_minimal.h",
)
"""Files of ``model/export/c`` that travel with the FMU."""
_NO_GUID = "{00000000-0000-0000-0000-000000000000}"
_NEVER = (1980, 1, 1, 0, 0, 0)  # the zip format's own beginning: the same model gives the same bytes


def export_fmu(model: SpringModel, path: Path, options: FmuOptions | None = None) -> tuple[str, ...]:
    """Write a spring as FMI 2.0 for Model Exchange and Co-Simulation, both in one FMU.

    Parameters
    ----------
    model : SpringModel
        The spring.
    path : Path
        The ``.fmu`` file; replaced whole, or not at all. The same model gives the same bytes.
    options : FmuOptions, optional
        Units, sign and temperatures.

    Returns
    -------
    tuple of str
        What a user of this FMU must know of the model.

    Raises
    ------
    BadInput
        If the file cannot be written.
    """
    chosen = options or FmuOptions()
    notes = model.warnings(model.temperature.reference_C, model.temperature.reference_C)
    content = _members(model, chosen, notes)
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as folder:
        for name, data in sorted(content.items()):
            entry = zipfile.ZipInfo(name, _NEVER)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = 0o644 << 16
            folder.writestr(entry, data)
    beside = path.with_name(path.name + ".part")
    try:
        beside.write_bytes(archive.getvalue())
        beside.replace(path)
    except OSError as error:
        beside.unlink(missing_ok=True)
        raise BadInput(f"cannot be written: {error.strerror}", file=path) from None
    return notes


def spring_table(model: SpringModel, options: FmuOptions, found: tuple[Variable, ...], guid: str) -> bytes:
    """Return ``resources/spring.bin``; its layout stands in ``c/bufferstand_spring_resource.h``."""
    tables = model.tables
    head = [tables.step_mm, tables.end_mm, tables.width_scale_max, model.temperature.reference_C]
    head += [options.mm_per_stroke, options.force_per_kN]
    head += [value for *_, value in range_rows(model, options)]
    for values in start_values(found):
        head += values
    body = guid.encode("ascii").ljust(40, b"\0")
    body += np.concatenate([np.array(head), tables.columns().ravel()]).astype("<f8").tobytes()
    return b"BSSPRNG2" + struct.pack("<IIII", 0x01020304, len(tables.A) - 1, zlib.crc32(body), 0) + body


def _members(model: SpringModel, options: FmuOptions, notes: tuple[str, ...]) -> Mapping[str, bytes]:
    """Return every file of the archive by its name."""
    found = variables(model, options)
    tool = f"bufferstand {version('bufferstand')}"
    content: dict[str, bytes] = {
        "documentation/index.html": page(model, found, options, notes).encode(),
        "documentation/model.toml": _model_file(model),
        "documentation/licenses/license.txt": _own("c/LICENSE.txt"),
    }
    content |= {f"sources/{name}": _own(f"c/{name}") for name in SOURCES}
    content |= {
        f"binaries/{platform}/{name}": _own(f"binaries/{platform}/{name}")
        for platform, name in LIBRARIES.items()
    }
    guid = _guid(
        model_description(model, found, _NO_GUID, tool),
        spring_table(model, options, found, _NO_GUID),
        *(content[name] for name in sorted(content)),
    )
    content["modelDescription.xml"] = model_description(model, found, guid, tool)
    content["resources/spring.bin"] = spring_table(model, options, found, guid)
    return content


def _guid(*parts: bytes) -> str:
    """Return a GUID of the content: the same FMU keeps its own."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(hashlib.sha256(part).digest())
    text = digest.hexdigest()
    return f"{{{text[:8]}-{text[8:12]}-{text[12:16]}-{text[16:20]}-{text[20:32]}}}"


def _own(name: str) -> bytes:
    return (files("bufferstand.model.export") / name).read_bytes()


def _model_file(model: SpringModel) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.toml"
        save_model(model, path)
        return path.read_bytes()
