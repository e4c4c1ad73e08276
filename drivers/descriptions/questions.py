"""Sources of a description, what its documents do not say, and the answers of a stand file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from bufferstand.foundation import BadInput
from bufferstand.foundation.settings import Settings, Within, nearest_key

Answer = int | float | str
"""What a stand file answers."""
GivenAnswers = dict[
    str,
    Annotated[int | float | str, Within(-1e12, 1e12, "no address, scale or setting of a device is larger")],
]
"""Answers by the keys of the questions, in a stand file."""
Asked = Annotated[str, Field(pattern=r"^\?[a-z][a-z0-9_]*$", description="“?key” of an [[ask]]")]
"""Stands for the answer of a stand file to the question of that key."""
as_entries = BeforeValidator(lambda v: tuple(v) if isinstance(v, list) else v)
"""Lets a TOML array be a tuple."""
Texts = Annotated[tuple[str, ...], as_entries]
"""A TOML array of texts."""


class Source(Settings):
    """A public document that a description was made from."""

    document: str = Field(min_length=1)
    edition: str = Field(min_length=1)
    """Edition, version or date; “not stated” where the document has none."""
    place: str = Field(min_length=1)
    """Pages, tables."""

    @property
    def sentence(self) -> str:
        """Document, edition and place in words."""
        return f"{self.document}, {self.edition}, {self.place}"


class Question(Settings):
    """What the document does not say, and the laboratory has to."""

    key: str = Field(pattern=r"^[a-z][a-z0-9_]*$")
    kind: Literal["whole", "number", "choice", "text"]
    choices: Texts = ()
    why: str = Field(min_length=10)
    """What is asked, why it cannot be known here, and where the laboratory finds it."""


def checked_answers(
    asked_by: str, questions: Sequence[Question], answers: Mapping[str, Answer]
) -> dict[str, Answer]:
    """Return the answers of a stand file to a description's questions.

    Parameters
    ----------
    asked_by : str
        Id of the description.
    questions : sequence of Question
    answers : mapping of str to number or text

    Raises
    ------
    BadInput
        If one is missing (with the description's reason why it is asked), is of another kind, or belongs to
        no question.
    """
    asked = {one.key: one for one in questions}
    for key in answers:
        if key not in asked:
            near = nearest_key(key, list(asked))
            known = f"it asks {', '.join(asked)}" if asked else "it asks nothing"
            raise BadInput(
                f"description “{asked_by}” does not ask “{key}”",
                place=f"answers.{key}",
                remedy=f"did you mean {near}?" if near else f"leave it out; {known}",
            )
    for key, question in asked.items():
        if key not in answers:
            example = _example(question)
            raise BadInput(
                f"description “{asked_by}” needs answers.{key}, which its documents do not say: "
                f"{question.why}",
                place="answers",
                remedy=f"write answers = {{ {key} = {example} }}",
            )
        _demand_kind(question, answers[key])
    return dict(answers)


def _example(question: Question) -> str:
    return {
        "whole": "0",
        "number": "0.1",
        "text": '"kg"',
        "choice": f'"{question.choices[0]}"' if question.choices else '""',
    }[question.kind]


def _demand_kind(question: Question, answer: Answer) -> None:
    fits = {
        "whole": isinstance(answer, int) and not isinstance(answer, bool),
        "number": isinstance(answer, int | float) and math.isfinite(answer),
        "text": isinstance(answer, str) and bool(answer),
        "choice": answer in question.choices,
    }[question.kind]
    if not fits:
        wanted = {
            "whole": "a whole number",
            "number": "a number",
            "text": "a text",
            "choice": " or ".join(f"“{one}”" for one in question.choices),
        }
        raise BadInput(
            f"answers.{question.key} = {answer!r} is not {wanted[question.kind]}",
            place=f"answers.{question.key}",
            remedy=question.why,
        )
