"""Exports of the spring to other tools: FMI 2.0, tables, C source. Each export says what it loses.

``docs/model-export.md`` is the page for users; the C core and the prebuilt libraries lie beside this file.
"""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.model.export.c_source import (
        export_c,
    )
    from bufferstand.model.export.choices import (
        Positive,
        Units,
    )
    from bufferstand.model.export.fmu import (
        export_fmu,
    )
    from bufferstand.model.export.multibody import (
        export_mbdyn,
        export_modelica,
    )
    from bufferstand.model.export.options import (
        FmuOptions,
    )
    from bufferstand.model.export.tables import (
        export_tables,
    )

__all__ = [
    "FmuOptions",
    "Positive",
    "Units",
    "export_c",
    "export_fmu",
    "export_mbdyn",
    "export_modelica",
    "export_tables",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
