"""The whole content of a report that sets specimens side by side."""

from __future__ import annotations

from collections.abc import Sequence

from bufferstand.evaluation.across_runs import Difference
from bufferstand.evaluation.report.build import lacks_of, notices_of
from bufferstand.evaluation.report.content import Block, Content, Section, Texts, fixed, in_language, numbered
from bufferstand.evaluation.report.pictures import comparison_pictures
from bufferstand.evaluation.report.sections import (
    ComparedFigures,
    amendment_section,
    appendix_sections,
    calibrations,
    compared_of,
    comparison_sections,
    conditions_section,
    data_section,
    deviations_section,
    head,
    identification,
    introduction_section,
    not_tested_section,
    opinions_section,
    recorded_section,
    remarks_section,
    rule_section,
    runs_section,
    setup_section,
    signatures,
    software_section,
    targets_section,
    warnings_section,
    why_unmatched,
)
from bufferstand.evaluation.report.source import (
    ComparedSpecimen,
    ComparedSpecimens,
    Condition,
    conditions_of,
)
from bufferstand.evaluation.wording import joined, said, said_count

_REST = said(
    "Cycle by cycle results, uncertainty budgets and the figures of each campaign are in the "
    "reports of the campaigns; this report compares them."
)

_GIVEN_BY_OPTION = said("Missing, to be given in a file of the comparison (--fields FILE.toml):")


def build_comparison(sides: ComparedSpecimens) -> Content:
    """Return the report's content.

    Parameters
    ----------
    sides : Sides
        Two or more specimens or campaigns; the first is the reference.

    Returns
    -------
    Content
        The same for the same sides, whenever and wherever it is built.
    """
    whole = sides.whole
    version = (whole.document.get("software") or {}).get("version")
    compared = compared_of(conditions_of(sides))
    specimens = [
        (said("Specimen {letter}: {name}", letter=side.letter, name=side.name), side.source)
        for side in sides.sides
    ]
    pictures = comparison_pictures(sides, compared)
    built = [
        amendment_section(whole),
        introduction_section(whole),
        *comparison_sections(sides, compared),
        Section("figures", said("Figures"), tuple(pictures[1:])) if pictures[1:] else None,
        identification(specimens),
        runs_section(whole),
        setup_section(whole),
        conditions_section(whole),
        deviations_section(whole),
        not_tested_section(whole, first_page=False),
        warnings_section(whole),
        rule_section(whole),
        calibrations(whole),
        opinions_section(whole),
        remarks_section(whole),
        recorded_section(whole),
        targets_section(whole),
        data_section(whole, {name: side.evaluation for name, side in sides.named.items()}),
        software_section(whole),
        *appendix_sections(whole),
    ]
    first_page: tuple[Block, ...] = (_summary(sides, compared), *pictures[:1], *signatures(whole))
    certificate, sections = numbered(first_page, [one for one in built if one is not None])
    ends = [run.ended for run in whole.runs if run.ended is not None]
    content = Content(
        title=said("Test report: comparison of specimens"),
        subtitle=joined(
            " · ", (said("{letter}: {name}", letter=side.letter, name=side.name) for side in sides.sides)
        ),
        notices=notices_of(whole),
        lacks=lacks_of(whole, _GIVEN_BY_OPTION),
        head=head(whole),
        sections=sections,
        ended=max(ends).isoformat() if ends else "",
        software=said("bufferstand {version}", version=version) if version else "bufferstand",
        certificate=certificate,
        detailed=whole.detailed,
        mark=whole.mark,
        accreditation=whole.accreditation,
        template=whole.template,
    )
    return in_language(content, whole.language)


def _summary(sides: ComparedSpecimens, compared: Sequence[ComparedFigures]) -> Texts:
    """Return a sentence for each of the others: how many differences are beyond U, and the clearest."""
    first = sides.sides[0]
    sentences = []
    for place, side in enumerate(sides.sides[1:], start=1):
        found = [(row, apart) for row in compared for at, apart in row.differences() if at == place]
        known = [(row, apart) for row, apart in found if apart.normalised is not None]
        beyond = [(row, apart) for row, apart in known if apart.beyond]
        if not found:
            sentences.append(_nothing_found(side, first, conditions_of(sides), place))
            continue
        sentence = said(
            "{letter} ({name}) against {letter_2} ({name_2}): {differences} of {steps}, {beyond} of them "
            "beyond their expanded uncertainty.",
            letter=side.letter,
            name=side.name,
            letter_2=first.letter,
            name_2=first.name,
            differences=said_count("{count} difference", "{count} differences", len(found)),
            steps=_steps(len({row.condition.number for row, _ in found})),
            beyond=len(beyond),
        )
        if beyond:
            sentence += said(" Clearest: {beyond}.", beyond=_clearest(beyond))
        if len(known) < len(found):
            sentence += said(
                " {count_of_found} have no uncertainty to be held against.",
                count_of_found=len(found) - len(known),
            )
        sentences.append(sentence)
    return Texts((*sentences, _REST))


def _steps(number: int) -> str:
    return said_count("{count} step", "{count} steps", number)


def _nothing_found(
    side: ComparedSpecimen, first: ComparedSpecimen, conditions: Sequence[Condition], place: int
) -> str:
    """Return why a specimen differs from the first in nothing: no shared step, or none with results."""
    named = said(
        "{letter} ({name}) and {letter_2} ({name_2})",
        letter=side.letter,
        name=side.name,
        letter_2=first.letter,
        name_2=first.name,
    )
    shared = [one for one in conditions if one.runs[0] is not None and one.runs[place] is not None]
    if shared:
        return said(
            "{named} cannot be compared: {steps} of both gave no result of both.",
            named=named,
            steps=_steps(len(shared)),
        )
    run = next((part for whole in side.source.runs for part in whole.parts), None)
    why = (
        ""
        if run is None
        else said(" Run {label}, for one: {why}.", label=run.label, why=why_unmatched(run, first))
    )
    return said("{named} cannot be compared: they share no step.{why}", named=named, why=why)


def _clearest(beyond: Sequence[tuple[ComparedFigures, Difference]]) -> str:
    row, apart = max(beyond, key=lambda one: abs(one[1].normalised or 0.0))
    share = ""
    if apart.relative is not None:
        sign = "+" if apart.relative > 0.0 else ""
        share = said(" {relative} %", relative=sign + fixed(100.0 * apart.relative, 1))
    normalised = (
        "" if apart.normalised is None else said(" (E_n {normalised})", normalised=fixed(apart.normalised, 1))
    )
    return said(
        "{words} of step {number},{share}{normalised}",
        words=row.words,
        number=row.condition.number,
        share=share,
        normalised=normalised,
    )
