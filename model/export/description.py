"""The FMU's modelDescription.xml (FMI 2.0) and its page for people."""

from __future__ import annotations

import html
from xml.etree import ElementTree as ET

from bufferstand.model.export.losses import FMU
from bufferstand.model.export.options import FmuOptions
from bufferstand.model.export.variables import Variable
from bufferstand.model.spring import SpringModel

IDENTIFIER = "bufferstand_spring"
"""Model identifier of both interfaces: name of the libraries."""
SOURCE = "bufferstand_spring_fmu.c"
"""The one file to compile."""

_UNITS: dict[str, dict[str, str]] = {
    "m": {"m": "1"},
    "mm": {"m": "1", "factor": "0.001"},
    "m/s": {"m": "1", "s": "-1"},
    "mm/s": {"m": "1", "s": "-1", "factor": "0.001"},
    "N": {"kg": "1", "m": "1", "s": "-2"},
    "kN": {"kg": "1", "m": "1", "s": "-2", "factor": "1000"},
    "N/m": {"kg": "1", "s": "-2"},
    "kN/mm": {"kg": "1", "s": "-2", "factor": "1000000"},
    "J": {"kg": "1", "m": "2", "s": "-2"},
    "J/K": {"kg": "1", "m": "2", "s": "-2", "K": "-1"},
    "W/K": {"kg": "1", "m": "2", "s": "-3", "K": "-1"},
    "degC": {"K": "1", "offset": "273.15"},
    "1/K": {"K": "-1"},
    "Hz": {"s": "-1"},
    "s": {"s": "1"},
}
_ABILITIES = {
    "modelIdentifier": IDENTIFIER,
    "needsExecutionTool": "false",
    "canBeInstantiatedOnlyOncePerProcess": "false",
    "canNotUseMemoryManagementFunctions": "true",
    "canGetAndSetFMUstate": "true",
    "canSerializeFMUstate": "true",
    "providesDirectionalDerivative": "false",
}


def model_description(model: SpringModel, found: tuple[Variable, ...], guid: str, tool: str) -> bytes:
    """Return modelDescription.xml.

    Parameters
    ----------
    model : SpringModel
        The spring.
    found : tuple of Variable
        Its variables.
    guid : str
        GUID that the library compares with the one in its table.
    tool : str
        Name and version of this software.
    """
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=model.name,
        guid=guid,
        description="Spring with exact hysteresis, heat and temperature. " + " ".join(FMU),
        generationTool=tool,
        variableNamingConvention="structured",
        numberOfEventIndicators="3",
    )
    exchange = ET.SubElement(
        root, "ModelExchange", _ABILITIES | {"completedIntegratorStepNotNeeded": "false"}
    )
    simulation = ET.SubElement(
        root,
        "CoSimulation",
        _ABILITIES
        | {
            "canHandleVariableCommunicationStepSize": "true",
            "canInterpolateInputs": "false",
            "maxOutputDerivativeOrder": "0",
            "canRunAsynchronuously": "false",
        },
    )
    for interface in (exchange, simulation):
        ET.SubElement(ET.SubElement(interface, "SourceFiles"), "File", name=SOURCE)
    units = ET.SubElement(root, "UnitDefinitions")
    for name in sorted({v.unit for v in found if v.unit}):
        ET.SubElement(ET.SubElement(units, "Unit", name=name), "BaseUnit", _UNITS[name])
    categories = ET.SubElement(root, "LogCategories")
    for name in ("logStatusWarning", "logStatusDiscard", "logStatusError"):
        ET.SubElement(categories, "Category", name=name)
    ET.SubElement(root, "DefaultExperiment", startTime="0", stopTime="1", tolerance="1e-6", stepSize="0.001")
    _variables(ET.SubElement(root, "ModelVariables"), found)
    _structure(ET.SubElement(root, "ModelStructure"), found)
    ET.indent(root)
    return (
        b'<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode").encode() + b"\n"
    )


def page(model: SpringModel, found: tuple[Variable, ...], options: FmuOptions, notes: tuple[str, ...]) -> str:
    """Return the FMU's documentation (HTML): what it is, its variables, what it loses."""
    rows = "".join(
        f"<tr><td>{html.escape(v.name)}</td><td>{v.causality}</td><td>{html.escape(v.unit)}</td>"
        f"<td>{'' if v.start is None else v.start}</td><td>{html.escape(v.description)}</td></tr>\n"
        for v in found
    )
    sense = "extension" if model.sense == "extension" else "compression"
    sign = "negative" if options.inverted(model) else "positive"
    lost = "".join(f"<li>{html.escape(sentence)}</li>\n" for sentence in (*FMU, *notes))
    stated = "".join(f"<li>{html.escape(sentence)}</li>\n" for sentence in model.statements)
    known = f"<h2>Where it was identified</h2>\n<ul>\n{stated}</ul>\n" if stated else ""
    return (
        "<!DOCTYPE html>\n"
        f'<html lang="en"><head><meta charset="utf-8"><title>{html.escape(model.name)}</title></head><body>\n'
        f"<h1>{html.escape(model.name)}</h1>\n<p>{html.escape(model.origin)}</p>\n"
        f"<p>Loading is {sense}; stroke and force are {sign} then (parameter sign_inverted). "
        f"Stroke 0 is first contact; the tables end at {model.curves.end_mm:g} mm. "
        "model.toml beside this page is the model itself.</p>\n"
        f"{known}<h2>What is lost</h2>\n<ul>\n{lost}</ul>\n"
        "<h2>Variables</h2>\n<table>\n"
        f"<tr><th>name</th><th>causality</th><th>unit</th><th>start</th><th>meaning</th></tr>\n{rows}</table>\n"
        "</body></html>\n"
    )


def _variables(parent: ET.Element, found: tuple[Variable, ...]) -> None:
    index = {v.name: str(k + 1) for k, v in enumerate(found)}
    for v in found:
        attributes = {
            "name": v.name,
            "valueReference": str(v.reference),
            "causality": v.causality,
            "variability": v.variability,
            "description": v.description,
        }
        if v.start is None:
            attributes["initial"] = "calculated"
        elif v.causality == "parameter" or v.variability == "constant":
            attributes["initial"] = "exact"
        value: dict[str, str] = {}
        if v.unit:
            value["unit"] = v.unit
        if v.derivative_of:
            value["derivative"] = index[v.derivative_of]
        if v.start is not None:
            value["start"] = str(v.start).lower() if isinstance(v.start, bool) else repr(float(v.start))
        ET.SubElement(ET.SubElement(parent, "ScalarVariable", attributes), v.kind, value)


def _structure(parent: ET.Element, found: tuple[Variable, ...]) -> None:
    """Write outputs, derivatives and what is computed at the start.

    Temperatures, heat and work change at completed steps only: no input and no state acts on them at once.
    """
    index = {v.name: str(k + 1) for k, v in enumerate(found)}
    outputs = ET.SubElement(parent, "Outputs")
    for v in found:
        if v.causality == "output":
            unknown = ET.SubElement(outputs, "Unknown", index=index[v.name])
            if v.unit in ("degC", "J"):
                unknown.set("dependencies", "")
    for name in ("Derivatives", "InitialUnknowns"):
        element = ET.SubElement(parent, name)
        for v in found:
            if v.derivative_of or (name == "InitialUnknowns" and v.start is None):
                ET.SubElement(element, "Unknown", index=index[v.name])
