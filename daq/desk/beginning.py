"""The guided beginning: a first stand, specimen and campaign, made by ``bufferstand init``."""

from __future__ import annotations

import re
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bufferstand.daq.desk.commands import word_of
from bufferstand.daq.desk.shell import Desk, Tab, refusal, text_of

OPTIONS = (
    "laboratory",
    "stand",
    "controller",
    "host",
    "port",
    "force-max",
    "stroke-max",
    "draw-wires",
    "thermometers",
    "specimen",
    "kind",
    "category",
    "elastic-system",
    "max-stroke",
    "campaign",
    "operator",
)
"""What the page asks, by the command's options; what is left empty is as the command has it."""
CALIBRATED = (("force", "kN"), ("stroke_1", "mm"), ("stroke_2", "mm"))
"""Channels whose certificates and coefficients are asked for, and their units."""
FURTHER = ("pressure", "acceleration")
"""Further channels that a controller can sample."""
RECORDED = "none"
"""Kind of controller of a stand that is recorded only: it has no campaign."""
FIRST_CAMPAIGNS = ("en15551", "sweeps", "warm-up")
AS_PROPOSED = (
    "--controller=ring",
    "--kind=buffer",
    "--category=A",
    "--elastic-system=elastomer",
    "--campaign=en15551",
    "--model",
    "--second-force",
)
"""What the page sends where nothing else was chosen, and the command does without."""
NUMBERS = ("force-max", "stroke-max", "max-stroke")
"""Options whose number may have a decimal comma here."""
_REFUSED = re.compile(
    r"(?:Invalid value for '--([a-z-]+)'|--([a-z-]+)): (.*?)(?: \([a-z ]+ --help\))?", re.DOTALL
)
_WORDS = (
    (re.compile(r"(\S+) is not in the range (\S+)<=x<=(\S+)"), r"\1 is not from \2 to \3"),
    (re.compile(r"'(.*)' is not a valid (?:float|integer)(?: range)?"), r"“\1” is no number"),
)
"""What the command says of an option, and how a page says it."""


class Beginning:
    """The page of the first files.

    Parameters
    ----------
    desk : Desk
    """

    tab = Tab("/new", "New")

    def __init__(self, desk: Desk) -> None:
        self._desk = desk

    def routes(self) -> list[Route]:
        """Return its routes."""
        return [
            self._desk.look("/new", self.show),
            self._desk.act("/new", self.make),
            self._desk.act("/new/command", self.command),
        ]

    async def show(self, request: Request) -> Response:
        """Ask the questions."""
        here = self._here()
        command = self._desk.commands.shown("init", "." if here else "FOLDER", "--yes")
        return self._desk.page(
            request,
            "new.html",
            title="New stand, specimen and campaign",
            where="." if here else "",
            calibrated=CALIBRATED,
            further=FURTHER,
            command=command,
        )

    async def command(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Give the command of what the form says by now, as one can type it."""
        words = [word for word in self._words(content) if word not in AS_PROPOSED]
        if not text_of(content, "where") and not self._here():
            words[1] = "FOLDER"
        return JSONResponse({"command": self._desk.commands.shown(*words)})

    def _here(self) -> bool:
        """Return whether the desk's own folder is still free for them."""
        return not (self._desk.folder.root / "stand.toml").exists()

    def _words(self, content: dict[str, Any]) -> list[str]:
        """Return the words of the command for what the form says.

        Raises
        ------
        BadInput
            If the folder lies outside the desk's.
        """
        where = text_of(content, "where") or "."
        self._desk.folder.within(where)
        words = ["init", word_of(where), "--yes"]
        given = {option: text_of(content, option) for option in OPTIONS}
        given |= {option: _number(content, option) for option in NUMBERS}
        words += [f"--{option}={said}" for option, said in given.items() if said]
        choices = [key for key in ("model", "second-force") if key in content]
        words += [f"--{key}" if content[key] is True else f"--no-{key}" for key in choices]
        words += [f"--further={name}" for name in FURTHER if content.get(f"further-{name}") is True]
        for channel, _ in CALIBRATED:
            number, until = text_of(content, f"certificate-{channel}"), text_of(content, f"until-{channel}")
            if number:
                words.append(f"--certificate={channel}={number}" + (f"@{until}" if until else ""))
            zero, slope = (_number(content, f"{key}-{channel}") for key in ("zero", "slope"))
            if slope:
                words.append(f"--coefficients={channel}={zero or '0'},{slope}")
        return words

    async def make(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Have the files made."""
        words = self._words(content)
        for channel, _ in CALIBRATED:
            if wrong := _wrong_coefficient(content, channel):
                return refusal(409, wrong[1], wrong[0])
        answer = await self._desk.commands.ask(*words)
        if answer.status:
            field, problem = in_page_words(answer.problem)
            return refusal(409, problem, field)
        where, campaign = words[1].removeprefix("./") or ".", text_of(content, "campaign")
        name = campaign if campaign in FIRST_CAMPAIGNS else FIRST_CAMPAIGNS[0]
        place = "" if where == "." else f"{where.rstrip('/')}/"
        if text_of(content, "controller") == RECORDED:
            return JSONResponse({"stand": f"{place}stand.toml", "command": answer.command})
        return JSONResponse({"campaign": f"{place}{name}.toml", "command": answer.command})


def in_page_words(problem: str) -> tuple[str, str]:
    """Return which field a message of ``init`` is about, and what it says of it.

    Parameters
    ----------
    problem : str
        As the command says it, such as ``Invalid value for '--port': 99999 is not in the range 1<=x<=65535``.

    Returns
    -------
    tuple of str
        The option without its dashes, empty where the message is about none of the page's; and the message.
    """
    match = _REFUSED.fullmatch(problem)
    field = (match[1] or match[2]) if match else ""
    if match is None or field not in OPTIONS:
        return "", problem
    said = match[3].rstrip(".")
    for pattern, words in _WORDS:
        said = pattern.sub(words, said)
    return field, said


def _number(content: dict[str, Any], key: str) -> str:
    return text_of(content, key).replace(",", ".")


def _wrong_coefficient(content: dict[str, Any], channel: str) -> tuple[str, str] | None:
    """Return the field of a coefficient that is none, and what is wrong; None where nothing is."""
    fields = (f"zero-{channel}", f"slope-{channel}")
    for field in fields:
        if said := _number(content, field):
            try:
                float(said)
            except ValueError:
                return field, f"“{text_of(content, field)}” is no number; write e.g. 9.54e-05"
    if _number(content, fields[0]) and not _number(content, fields[1]):
        return fields[
            1
        ], "is missing: a zero alone makes no measure of a reading; give the certificate's slope"
    return None
