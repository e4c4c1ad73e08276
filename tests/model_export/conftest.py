"""Exported FMUs, made once a module."""

from __future__ import annotations

import pytest

from bufferstand.model.export.fmu import export_fmu
from bufferstand.model.export.options import FmuOptions
from tests.model_export.cases import springs, unpack


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """Return a function that gives the path of a spring's FMU and the folder of its content."""
    made = {}

    def give(name="buffer", **options):
        key = (name, tuple(sorted(options.items())))
        if key not in made:
            folder = tmp_path_factory.mktemp("fmu")
            fmu = folder / f"{name}.fmu"
            export_fmu(springs()[name], fmu, FmuOptions(**options))
            made[key] = fmu, unpack(fmu, folder / "content")
        return made[key]

    return give
