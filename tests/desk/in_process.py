"""The desk's application without a server, with the right to act."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from bufferstand.daq.desk.app import desk_app
from bufferstand.daq.desk.folder import Folder
from bufferstand.daq.monitor import Access, new_tokens
from tests.asgi import ADDRESS, Answer, ask


class DeskInProcess:
    """A desk over a folder."""

    def __init__(self, root: Path) -> None:
        tokens = new_tokens(loopback=True)
        access = Access(tokens, loopback=True)
        self.app, self.jobs = desk_app(Folder(root), access, "127.0.0.1", "desk")
        admitted = access.admit(tokens.control)
        assert admitted is not None
        self.session = admitted[0]

    def look(self, path: str, query: Any = "") -> Answer:
        """Ask for a page."""
        return ask(self.app, path, query, headers={"cookie": f"desk={self.session}"})

    def act(
        self,
        path: str,
        content: Any,
        *,
        client: str = "127.0.0.1",
        session: str | None = None,
        **headers: str,
    ) -> Answer:
        """Have something done, as one of our own pages asks."""
        own = {
            "cookie": f"desk={self.session if session is None else session}",
            "origin": f"http://{ADDRESS}",
            "content-type": "application/json",
        }
        body = json.dumps(content).encode()
        return ask(self.app, path, method="POST", body=body, headers={**own, **headers}, client=client)
