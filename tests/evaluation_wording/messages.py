"""The messages that the code says, as they are found in it, and the catalogues brought up to them.

``python -m tests.evaluation_wording.messages`` adds new messages to every catalogue, without a translation
yet, and takes out those that nothing says any more. What is left is to translate them; the tests say which.
"""

from __future__ import annotations

import ast
import io
import re
from collections.abc import Iterator
from pathlib import Path

from babel.messages.catalog import Catalog
from babel.messages.pofile import write_po

from bufferstand.evaluation.catalogue import QUANTITIES, Quantity
from bufferstand.evaluation.wording import LANGUAGES, Code
from bufferstand.evaluation.wording.language import EVALUATION, read_catalogue

ROOT = Path(__file__).resolve().parents[2]
CATALOGUES = ROOT / "evaluation" / "wording" / "catalogues"
TRANSLATED: tuple[Code, ...] = LANGUAGES[1:]
_SAYING = {"said": 1, "said_count": 2}
"""How many of its arguments are messages."""
_IMPORTED = re.compile(r"from bufferstand\.evaluation\.wording\S* import")

Message = str | tuple[str, str]


def said_messages() -> set[Message]:
    """Return the messages of the code, and the names of the quantities; of counted ones both forms."""
    messages = {message for file in (ROOT / "evaluation").rglob("*.py") for message in _said_in(file)}
    return messages | {name for entry in QUANTITIES for name in _names(entry)}


def _said_in(file: Path) -> Iterator[Message]:
    """Return what a file says; Babel's own extraction does not look into the facts of a message."""
    text = file.read_text(encoding="utf-8")
    if not _IMPORTED.search(text):
        return
    for node in ast.walk(ast.parse(text)):
        name = node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""
        if name in _SAYING and isinstance(node, ast.Call):
            texts = node.args[: _SAYING[name]]
            words = [ast.literal_eval(text) for text in texts]
            yield words[0] if len(words) == 1 else (words[0], words[1])


def _names(entry: Quantity) -> Iterator[str]:
    shown = entry.shown
    settled = shown.settled.heading if shown.settled else ""
    trend = (entry.trended.caption, entry.trended.axis) if shown.trend else ()
    yield from filter(None, (entry.label, shown.heading, shown.compared, settled, *trend))


def brought_up(code: Code) -> Catalog:
    """Return a catalogue with the messages of today: new ones are empty, old ones are gone."""
    known, today = read_catalogue(code), Catalog(locale=code, fuzzy=False)
    for one in known:
        if one.context == EVALUATION and one.id:
            today.add(one.id, one.string, context=EVALUATION)
    for message in said_messages():
        before = known.get(message[0] if isinstance(message, tuple) else message)
        today.add(message, before.string if before is not None else "")
    return today


def written(catalogue: Catalog) -> bytes:
    """Return a catalogue as text: in the order of its messages, without dates and places in the code."""
    out = io.BytesIO()
    write_po(out, catalogue, width=110, omit_header=False, no_location=True, sort_output=True)
    lines = out.getvalue().decode().splitlines(keepends=True)
    kept = [line for line in lines if not line.startswith(_OF_THE_DAY)]
    return "".join(kept).encode()


_OF_THE_DAY = (
    '"POT-Creation-Date',
    '"PO-Revision-Date',
    '"Generated-By',
    '"Last-Translator',
    '"Report-Msgid',
    '"Language-Team',
    '"Project-Id',
    "# ",
    "#\n",
)


if __name__ == "__main__":
    for language in TRANSLATED:
        (CATALOGUES / f"{language}.po").write_bytes(written(brought_up(language)))
