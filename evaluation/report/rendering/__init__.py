"""Rendering of a report's content: HTML by Jinja2, PDF by typst."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.evaluation.report.rendering.html import (
        render_html,
    )
    from bufferstand.evaluation.report.rendering.pdf import (
        TypesetReport,
        render_pdf,
        typeset_pdf,
    )
    from bufferstand.evaluation.report.rendering.workbook import (
        render_workbook,
    )

__all__ = [
    "TypesetReport",
    "render_html",
    "render_pdf",
    "render_workbook",
    "typeset_pdf",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
