"""The page on which a campaign is prepared. The text is what counts; form and plan are views of it."""

from __future__ import annotations

import asyncio
import hashlib
import os
import re
import secrets
import tempfile
from collections import OrderedDict
from contextlib import suppress
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bufferstand.daq.desk.commands import word_of
from bufferstand.daq.desk.prepare.edits import NEW_STEPS, add_step, changed, toml_content_of, without_step
from bufferstand.daq.desk.prepare.fields import Field, Group, groups_of, value_of
from bufferstand.daq.desk.prepare.order import moved_step
from bufferstand.daq.desk.prepare.planned_steps import plan_view
from bufferstand.daq.desk.shell import Desk, Tab, text_of
from bufferstand.foundation import BadInput
from bufferstand.foundation.files import replaced_whole
from bufferstand.foundation.settings import read_text

PICTURES_KEPT = 12
_LINE = re.compile(r"^\s*(?:[^\s:]*: )?line (\d+)", re.MULTILINE)
_HEADING = re.compile(r"^\s*\[\[?\s*([^\]]+?)\s*\]")
_KEY = re.compile(r"^\s*([A-Za-z0-9_-]+)\s*=")


class Prepare:
    """The page and what it asks for.

    Parameters
    ----------
    desk : Desk
    """

    tab = Tab("/prepare", "Prepare")

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._pictures: OrderedDict[str, bytes] = OrderedDict()
        self._planning: dict[str, asyncio.Task[Response]] = {}
        self._writing = asyncio.Lock()

    def routes(self) -> list[Route]:
        """Return its routes."""
        return [
            self._desk.look("/prepare", self.show),
            self._desk.look("/prepare/picture/{key}", self.picture),
            self._desk.act("/prepare/edit", self.edit),
            self._desk.act("/prepare/plan", self.plan),
            self._desk.act("/prepare/save", self.save),
        ]

    async def show(self, request: Request) -> Response:
        """Show a campaign file, or the choice of one."""
        name = request.query_params.get("campaign", "")
        contents = await asyncio.to_thread(self._desk.folder.contents)
        if not name:
            found = contents.of_kind("campaign")
            return self._desk.page(
                request, "prepare_choice.html", title="Prepare a campaign", campaigns=found
            )
        path = self._desk.folder.inside(name, ".toml")
        text = await asyncio.to_thread(read_text, path)
        return self._desk.page(
            request,
            "prepare.html",
            title=f"Prepare {name}",
            name=name,
            text=text,
            base=_hash(text),
            form=await self._form(text, path),
            command=self._desk.commands.shown("plan", word_of(name)),
        )

    async def picture(self, request: Request) -> Response:
        """Give the picture of a plan that was made just now."""
        content = self._pictures.get(request.path_params["key"])
        if content is None:
            return Response("There is no such picture any more.\n", 404, media_type="text/plain")
        return Response(content, media_type="image/svg+xml")

    async def edit(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Change the text as the form says; return it, and the form where its fields have changed."""
        path = self._path(content)
        text = _whole_text(content)
        match content.get("what"):
            case "set":
                field = _field_at(text, content.get("path"))
                said = text_of(content, "value", 4000)
                try:
                    text = changed(text, field.path, value_of(field.kind, said))
                except BadInput as error:
                    return JSONResponse({"problem": str(error), "field": field.id}, 409)
                return JSONResponse({"text": text})
            case "add":
                text = add_step(text, text_of(content, "kind"))
            case "remove":
                index = content.get("index")
                text = without_step(text, index if isinstance(index, int) else -1)
            case "move":
                index, by = content.get("index"), content.get("by")
                text = moved_step(
                    text, index if isinstance(index, int) else -1, by if isinstance(by, int) else 0
                )
            case _:
                pass
        return JSONResponse({"text": text, "form": await self._form(text, path)})

    async def plan(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Plan the text as it stands, by the command, and return the plan or what is wrong at which place."""
        page = text_of(content, "page", 40)
        before = self._planning.get(page)
        if before is not None:
            before.cancel()  # the text has gone on: nobody waits for that plan any more
        mine = self._planning[page] = asyncio.create_task(
            self._plan(self._path(content), _whole_text(content))
        )
        try:
            return await mine
        except asyncio.CancelledError:
            if self._planning.get(page) is mine:
                raise
            return JSONResponse({"stale": True})
        finally:
            if self._planning.get(page) is mine:
                del self._planning[page]

    async def _plan(self, path: Path, text: str) -> Response:
        with tempfile.TemporaryDirectory(prefix="bufferstand-plan-") as folder:
            picture = Path(folder) / "plan.svg"
            draft = _draft(path, text)
            try:
                name = word_of(self._desk.folder.name(draft))
                answer = await self._desk.commands.ask("plan", name, "--json", "--picture", str(picture))
            finally:
                with suppress(OSError):
                    draft.unlink()
            plan = answer.json()
            if answer.status or not isinstance(plan, dict):
                said = answer.problem.replace(f"{name}: ", "").replace(draft.name, path.name)
                return JSONResponse({"wrong": said, **_place(said, text)})
            key = self._keep(picture)
        shown = self._desk.fragment("plan.html", picture=key, **plan_view(plan))
        return JSONResponse({"plan": shown})

    async def save(self, request: Request, content: dict[str, Any]) -> Response:  # noqa: ARG002 - its signature
        """Write the text, unless the file has been changed by another meanwhile."""
        text, new = _whole_text(content), text_of(content, "as")
        toml_content_of(text)
        async with self._writing:
            if new:
                path = self._desk.folder.new(new if new.endswith(".toml") else f"{new}.toml")
            else:
                path = self._path(content)
                now = await asyncio.to_thread(read_text, path)
                if _hash(now) != text_of(content, "base"):
                    raise BadInput(
                        "the file was changed by somebody else since it was opened here: nothing was written",
                        file=self._desk.folder.name(path),
                        remedy="save under another name, or open it again and repeat the change",
                    )
            with replaced_whole(path) as target:
                target.write_bytes(text.encode())
        name = self._desk.folder.name(path)
        return JSONResponse({"said": f"{name} is written", "name": name, "base": _hash(text)})

    async def _form(self, text: str, path: Path) -> str:
        """Return the form as HTML, or what keeps the text from having one."""
        try:
            groups = groups_of(toml_content_of(text))
        except BadInput as error:
            return self._desk.fragment("form.html", groups=[], problem=str(error), kinds=(), files={})
        contents = await asyncio.to_thread(self._desk.folder.contents)
        files: dict[str, list[tuple[str, str]]] = {}
        for kind in ("stand", "specimen"):
            found = contents.of_kind("stand" if kind == "stand" else "specimen")
            files[kind] = [
                (_from(path.parent, self._desk.folder.root / one.path), one.id or one.path)
                for one in found
                if not one.problem
            ]
        return self._desk.fragment("form.html", groups=groups, problem="", kinds=list(NEW_STEPS), files=files)

    def _path(self, content: dict[str, Any]) -> Path:
        return self._desk.folder.inside(text_of(content, "name"), ".toml")

    def _keep(self, picture: Path) -> str:
        key = secrets.token_urlsafe(9)
        self._pictures[key] = picture.read_bytes() if picture.exists() else b""
        while len(self._pictures) > PICTURES_KEPT:
            self._pictures.popitem(last=False)
        return key


def _draft(path: Path, text: str) -> Path:
    """Write a text beside a file, where its relative paths hold, under a name that nothing looks for."""
    draft = path.with_name(f".{path.stem[:80]}.draft-{secrets.token_hex(4)}.toml")
    try:
        draft.write_text(text, encoding="utf-8", newline="")
    except (OSError, UnicodeEncodeError) as error:
        why = getattr(error, "strerror", None) or error
        raise BadInput(
            f"the plan needs a file beside it, which cannot be written: {why}",
            file=path.name,
            remedy="make the folder writable",
        ) from None
    return draft


def _from(folder: Path, path: Path) -> str:
    """Return a path as a file in a folder names it."""
    return Path(os.path.relpath(path, folder)).as_posix()


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _whole_text(content: dict[str, Any]) -> str:
    text = content.get("text")
    if not isinstance(text, str):
        raise BadInput("the page has sent no text")
    return text.replace("\r\n", "\n")


def _fields(groups: list[Group]) -> dict[tuple[str | int, ...], Field]:
    return {field.path: field for group in groups for field in group.fields}


def _field_at(text: str, path: Any) -> Field:
    """Return the field at a place that the page names."""
    fields = _fields(groups_of(toml_content_of(text)))
    field = (
        fields.get(tuple(path))
        if isinstance(path, list) and all(isinstance(p, str | int) for p in path)
        else None
    )
    if field is None:
        raise BadInput("the file has no such place any more", remedy="change it in the text")
    return field


def _place(said: str, text: str) -> dict[str, Any]:
    """Return the line that a message names, and the fields of the form that may be meant."""
    found = _LINE.search(said)
    if found is None:
        return {}
    number = int(found[1])
    lines = text.splitlines()
    table, steps, key = "", -1, ""
    for at, line in enumerate(lines[:number], start=1):
        if heading := _HEADING.match(line):
            table, key = heading[1], ""
            steps += table == "step" and line.lstrip().startswith("[[")
        elif at == number and (named := _KEY.match(line)):
            key = named[1]
    group = f"g-step-{steps}" if table.startswith("step") else f"g-{table}"
    field = f"{group.replace('g-', 'f-', 1)}-{key}" if key else ""
    return {"line": number, "group": group, "field": field}
