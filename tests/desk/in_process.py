"""The desk's application without a server: asked as a web server asks it (ASGI)."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Mapping, MutableMapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from bufferstand.daq.desk.app import desk_app
from bufferstand.daq.desk.folder import Folder
from bufferstand.daq.monitor import Access, new_tokens

ADDRESS = "127.0.0.1:8420"


@dataclass
class Answer:
    """What it answers."""

    status: int = 0
    headers: dict[str, str] = field(default_factory=dict)
    body: bytes = b""

    @property
    def text(self) -> str:
        return self.body.decode()

    @property
    def json(self) -> Any:
        return json.loads(self.body)


class DeskInProcess:
    """A desk over a folder, with the right to act."""

    def __init__(self, root: Path) -> None:
        tokens = new_tokens(loopback=True)
        self.access = Access(tokens, loopback=True)
        self.app, self.jobs = desk_app(Folder(root), self.access, "127.0.0.1", "desk")
        admitted = self.access.admit(tokens.control)
        assert admitted is not None
        self.session = admitted[0]

    def look(
        self, path: str, query: Any = "", *, client: str = "127.0.0.1", session: str | None = None
    ) -> Answer:
        """Ask for a page."""
        return self._ask("GET", path, query, b"", {}, client, self.session if session is None else session)

    def act(self, path: str, content: Any, *, client: str = "127.0.0.1", session: str | None = None,
            **headers: str) -> Answer:  # fmt: skip
        """Have something done, as one of our own pages asks."""
        own = {"origin": f"http://{ADDRESS}", "content-type": "application/json", **headers}
        body = json.dumps(content).encode()
        return self._ask("POST", path, "", body, own, client, self.session if session is None else session)

    def _ask(
        self,
        method: str,
        path: str,
        query: Any,
        body: bytes,
        headers: Mapping[str, str],
        client: str,
        session: str,
    ) -> Answer:
        answer = Answer()
        asked = False

        async def receive() -> dict[str, Any]:
            nonlocal asked
            if asked:
                await asyncio.Event().wait()  # who asks does not go away
            asked = True
            return {"type": "http.request", "body": body, "more_body": False}

        async def send(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                answer.status = message["status"]
                answer.headers = {name.decode(): value.decode() for name, value in message["headers"]}
            else:
                answer.body += message.get("body", b"")

        sent = {"host": ADDRESS, "cookie": f"desk={session}", "content-length": str(len(body)), **headers}
        scope = {
            "type": "http", "method": method, "path": path, "raw_path": path.encode(), "root_path": "",
            "query_string": urlencode(query, doseq=True).encode() if query else b"",
            "headers": [(name.encode(), value.encode()) for name, value in sent.items()],
            "server": ("127.0.0.1", 8420), "client": (client, 50000), "scheme": "http", "http_version": "1.1",
        }  # fmt: skip
        asyncio.run(self.app(scope, receive, send))
        return answer
