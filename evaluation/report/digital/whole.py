"""The whole digital test report, in the schema of PTB's Digital Calibration Certificate.

Source: DCC 3.2.1, Physikalisch-Technische Bundesanstalt, https://ptb.de/dcc/v3.2.1/.
"""

from __future__ import annotations

from bufferstand.evaluation.report.content import Content
from bufferstand.evaluation.report.digital.administrative import add_administrative
from bufferstand.evaluation.report.digital.elements import root, written
from bufferstand.evaluation.report.digital.proof import add_proof
from bufferstand.evaluation.report.digital.results import add_results
from bufferstand.evaluation.report.source import ReportSource

_TITLE = "Digital test report {} (not a calibration certificate; the schema is that of PTB’s DCC)"


def render_digital(source: ReportSource, content: Content) -> bytes:
    """Return the digital test report of a source.

    Parameters
    ----------
    source : ReportSource
        Runs, their evaluation, and what the laboratory adds.
    content : Content
        The printed report of the same source: its id, notices, and what it lacks.

    Returns
    -------
    bytes
        XML, UTF-8; the same for the same source.

    Raises
    ------
    BadInput
        If no run says when it was made.
    """
    whole = root()
    add_administrative(whole, source, content)
    add_results(whole, source)
    add_proof(whole, source, content)
    return written(whole, [_TITLE.format(content.report_id)])
