"""Making a report of what was chosen, saying which there are, verifying one, giving out its files."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bufferstand.daq.desk.chosen import Chosen, chosen_of
from bufferstand.daq.desk.commands import word_of
from bufferstand.daq.desk.jobs import Jobs
from bufferstand.daq.desk.reports.offered import key_files, model_files
from bufferstand.daq.desk.shell import Desk, text_of
from bufferstand.foundation import BadInput
from bufferstand.recording.finding import run_files

OUT = "report"
"""Folder of a campaign's report, in the campaign's folder."""
VERIFY_S = 300.0
"""Longest wait for a report to be verified [s]."""
LONGEST_PASSWORD = 4000
"""More characters than a key's password has."""
SHOWN = {
    ".html": "text/html; charset=utf-8",
    ".pdf": "application/pdf",
    ".xlsx": "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
    ".xml": "application/xml",
    ".json": "application/json",
    ".csv": "text/csv; charset=utf-8",
}
"""Files of a report that are given out."""
POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; font-src data:; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'; sandbox"
)
"""What a report may do when it is shown: it has all in itself, runs nothing, and asks for nothing."""
LANGUAGES = {"": "as the laboratory states", "en": "English", "de": "German", "cs": "Czech", "fr": "French"}
ANNEXES = ("", "short", "full")


@dataclass(frozen=True)
class ReportForm:
    """What the form of a page offers.

    Parameters
    ----------
    chosen : dict of str to list of str
        What the report is of, as the page sends it back.
    files : list of str
        Those that are there already, from the desk's folder.
    models, keys : list of str
        Spring models and keys in the desk's folder.
    languages : dict of str to str
    command : str
        What makes it, as one can type it.
    """

    chosen: dict[str, list[str]]
    files: list[str]
    models: list[str]
    keys: list[str]
    languages: dict[str, str]
    command: str


class Reports:
    """Its routes.

    Parameters
    ----------
    desk : Desk
    jobs : Jobs
        Pages watch what makes the report.
    """

    def __init__(self, desk: Desk, jobs: Jobs) -> None:
        self._desk = desk
        self._jobs = jobs

    def routes(self) -> list[Route]:
        """Return its routes."""
        return [
            self._desk.act("/report", self.make),
            self._desk.act("/report/verify", self.verify),
            self._desk.look("/report/made", self.listed),
            self._desk.look("/report/file", self.show),
        ]

    def form(self, chosen: Chosen) -> ReportForm:
        """Return what a page's form offers for the report of what was chosen; blocking."""
        root = self._desk.folder.root
        return ReportForm(
            chosen=chosen.named,
            files=self.made(chosen),
            models=model_files(root),
            keys=key_files(root),
            languages=LANGUAGES,
            command=self._desk.commands.shown(*self._words(chosen)),
        )

    def made(self, chosen: Chosen) -> list[str]:
        """Return the files of the report that was made last, from the desk's folder; blocking."""
        place = self._desk.folder.root / self._place(chosen)
        try:
            found = sorted(one for one in place.iterdir() if one.suffix in SHOWN and one.is_file())
        except OSError:
            return []
        return [self._desk.folder.name(one) for one in found]

    async def make(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Have the report of what was chosen made; the page watches it."""
        chosen = chosen_of(self._desk.folder, content)
        await asyncio.to_thread(run_files, chosen.places)  # what has recorded nothing is refused at once
        words = [*self._words(chosen), *self._options(content)]
        password = str(content.get("password") or "").partition("\n")[0]
        if len(password) > LONGEST_PASSWORD:
            raise BadInput("this password is longer than a key's can be")
        secret = ("--sign-password-file", password) if text_of(content, "key") else None
        job = self._jobs.begin(*words, secret=secret, aside=True)
        return JSONResponse({"job": job.key, "command": job.command})

    async def listed(self, request: Request) -> Response:
        """Say which files there are of the report of what was chosen."""
        chosen = chosen_of(self._desk.folder, request.query_params)
        return JSONResponse({"files": await asyncio.to_thread(self.made, chosen)})

    async def verify(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Say whether a report is as it was signed, and the runs beside it as they were then."""
        path = self._report_file(text_of(content, "path", 1000))
        words = ("verify", word_of(self._desk.folder.name(path)))
        answer = await self._desk.commands.ask(*words, patience_s=VERIFY_S)
        said = "\n".join(part for part in (answer.out.strip(), answer.problem) if part)
        return JSONResponse({"good": answer.status == 0, "said": said, "command": answer.command})

    async def show(self, request: Request) -> Response:
        """Give a file of a report."""
        path = self._report_file(request.query_params.get("path", ""))
        content = await asyncio.to_thread(path.read_bytes)
        headers = {"Content-Type": SHOWN[path.suffix]}
        if path.suffix == ".html":
            headers["Content-Security-Policy"] = POLICY
        else:
            how = "inline" if path.suffix == ".pdf" else "attachment"
            headers["Content-Disposition"] = f'{how}; filename="{_plain(path.name)}"'
        return Response(content, headers=headers)

    def _words(self, chosen: Chosen) -> list[str]:
        return ["report", *chosen.words, "--out", word_of(self._place(chosen))]

    def _options(self, content: dict[str, Any]) -> list[str]:
        """Return what the form says as options of the command."""
        words: list[str] = []
        for option, value, known in (
            ("--language", text_of(content, "language"), LANGUAGES),
            ("--annex", text_of(content, "annex"), ANNEXES),
        ):
            if value not in known:
                raise BadInput(f"{option} is one of {', '.join(filter(None, known))}")
            words += [option, value] if value else []
        folder = self._desk.folder
        if model := text_of(content, "model"):
            words += ["--model", word_of(folder.name(folder.inside(model, ".toml")))]
        if key := text_of(content, "key", 1000):
            on_token = key.startswith("pkcs11:")
            words += ["--sign", key if on_token else word_of(folder.name(folder.inside(key)))]
        return words

    def _place(self, chosen: Chosen) -> str:
        """Return the folder of a report, from the desk's folder: that of its campaign, or beside its runs."""
        first = chosen.places[0]
        home = first if first.is_dir() else first.parent
        alone = len(chosen.places) == 1 and first.is_dir()
        return self._desk.folder.name(home / (OUT if alone else f"{OUT}-{len(chosen.places)}-{first.stem}"))

    def _report_file(self, name: str) -> Path:
        path = self._desk.folder.inside(name)
        if path.suffix not in SHOWN or not path.is_file() or not path.parent.name.startswith(OUT):
            raise BadInput("this is no file of a report", file=path.name)
        return path


def _plain(name: str) -> str:
    return "".join(c if c.isascii() and (c.isalnum() or c in "._-") else "_" for c in name)
