"""What ``report.toml`` names besides facts: photos, the accreditation's mark, own texts."""

from __future__ import annotations

from typing import TypedDict

from bufferstand.evaluation.report.content import Image, OwnTemplate
from bufferstand.evaluation.report.source.fields import ReportFields
from bufferstand.evaluation.report.source.given_images import read_image
from bufferstand.evaluation.report.source.own_template import read_own_template
from bufferstand.evaluation.report.source.own_text import OwnText, read_own_text
from bufferstand.evaluation.wording import said


class OwnParts(TypedDict):
    """The parts, as :class:`~bufferstand.evaluation.report.source.source.ReportSource` names them."""

    setup_photo: Image | None
    accreditation: Image | None
    introduction: OwnText | None
    appendices: tuple[OwnText, ...]
    template: OwnTemplate | None


def own_parts(fields: ReportFields) -> OwnParts:
    """Read what the fields name.

    Raises
    ------
    BadInput
        If a picture, a text or the template cannot be used.
    """
    return {
        "setup_photo": read_image(fields.setup_photo, "setup_photo", said("Photo of the set-up")),
        "accreditation": read_image(fields.accreditation_mark, "accreditation_mark", said("Accreditation")),
        "introduction": read_own_text(fields.introduction) if fields.introduction else None,
        "appendices": tuple(map(read_own_text, fields.appendices)),
        "template": read_own_template(fields.template),
    }
