"""Digital calibration certificates as a laboratory would write them: one item, tables of points."""

from __future__ import annotations

from pathlib import Path

MV_PER_V = r"\milli\volt\per\volt"
KN = r"\kilo\newton"
FORCES_KN = (0.0, 63.0, 315.0, 630.0)
SIGNALS = (0.0, 0.2, 1.0, 2.0)


def uncertainty(values: str, k: str = "2") -> str:
    """Return U of a list as D-SI 2.1 has it."""
    return (
        f"<si:expandedUncXMLList><si:uncertaintyXMLList>{values}</si:uncertaintyXMLList>"
        f"<si:coverageFactorXMLList>{k}</si:coverageFactorXMLList>"
        "<si:coverageProbabilityXMLList>0.95</si:coverageProbabilityXMLList></si:expandedUncXMLList>"
    )


def newer_uncertainty(values: str, k: str = "2") -> str:
    """Return U of a list as D-SI 2.2 has it."""
    return (
        "<si:measurementUncertaintyUnivariateXMLList><si:expandedMUXMLList>"
        f"<si:valueExpandedMUXMLList>{values}</si:valueExpandedMUXMLList>"
        f"<si:coverageFactorXMLList>{k}</si:coverageFactorXMLList>"
        "<si:coverageProbabilityXMLList>0.95</si:coverageProbabilityXMLList>"
        "</si:expandedMUXMLList></si:measurementUncertaintyUnivariateXMLList>"
    )


def listed(values: tuple[float, ...], unit: str, spread: str = "") -> str:
    """Return a list of values."""
    numbers = " ".join(map(str, values))
    return (
        f"<si:realListXMLList><si:valueXMLList>{numbers}</si:valueXMLList>"
        f"<si:unitXMLList>{unit}</si:unitXMLList>{spread}</si:realListXMLList>"
    )


def quantity(kind: str, content: str) -> str:
    return f'<dcc:quantity refType="{kind}">{content}</dcc:quantity>'


def table(reference: str, shown: str, error: str = "") -> str:
    """Return a table of points."""
    inside = quantity("basic_referenceValue", reference) + quantity("basic_measuredValue", shown)
    inside += quantity("basic_measurementError", error) if error else ""
    return (
        "<dcc:result><dcc:name><dcc:content>Points</dcc:content></dcc:name>"
        f"<dcc:data><dcc:list>{inside}</dcc:list></dcc:data></dcc:result>"
    )


TRANSDUCER = table(listed(FORCES_KN, KN), listed(SIGNALS, MV_PER_V, uncertainty("0.001")))
CHAIN = table(
    listed(FORCES_KN, KN),
    listed((0.1, 63.2, 315.5, 629.0), KN),
    listed((0.1, 0.2, 0.5, -1.0), KN, uncertainty("0.1 0.1 0.4 0.8")),
)


RECALIBRATION = '<dcc:statement refType="basic_recalibration"><dcc:date>2028-03-02</dcc:date></dcc:statement>'


def certificate(
    *results: str,
    version: str = "3.2.1",
    space: str = "https://ptb.de/dcc",
    before: str = "",
    items: int = 1,
    number: str = "DKD-K-12345 2026-03",
    statements: str = RECALIBRATION,
) -> str:
    """Return the text of a certificate with some results."""
    item = (
        "<dcc:item><dcc:name><dcc:content>Load cell</dcc:content></dcc:name><dcc:model>K-630</dcc:model>"
        "<dcc:identifications><dcc:identification><dcc:issuer>manufacturer</dcc:issuer>"
        "<dcc:value>0001</dcc:value></dcc:identification></dcc:identifications></dcc:item>"
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
{before}<dcc:digitalCalibrationCertificate xmlns:dcc="{space}" xmlns:si="https://ptb.de/si"
  schemaVersion="{version}">
<dcc:administrativeData>
<dcc:coreData><dcc:uniqueIdentifier>{number}</dcc:uniqueIdentifier>
<dcc:beginPerformanceDate>2026-03-01</dcc:beginPerformanceDate>
<dcc:endPerformanceDate>2026-03-02</dcc:endPerformanceDate></dcc:coreData>
<dcc:items>{item * items}</dcc:items>
<dcc:calibrationLaboratory><dcc:contact>
<dcc:name><dcc:content>Kraft &amp; Söhne</dcc:content></dcc:name>
</dcc:contact></dcc:calibrationLaboratory>
<dcc:statements>{statements}</dcc:statements>
</dcc:administrativeData>
<dcc:measurementResults><dcc:measurementResult><dcc:results>{"".join(results)}</dcc:results></dcc:measurementResult>
</dcc:measurementResults></dcc:digitalCalibrationCertificate>"""


def written(folder: Path, text: str | bytes) -> Path:
    """Write a certificate and return its path."""
    path = folder / "certificate.xml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path
