"""The desk as a process of its own, and what a test asks of it."""

from __future__ import annotations

import http.client
import json
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

SAMPLES = Path(__file__).resolve().parents[2] / "sample_runs"
PATIENCE_S = 180.0
HACK = '<img src=x onerror="window.hacked=1"><script>window.hacked=1</script>'
"""What a file or a name might say by somebody with bad intentions."""


@dataclass
class Served:
    """A desk that is being served."""

    process: subprocess.Popen[str]
    folder: Path
    port: int
    token: str
    cookie: str = ""

    @property
    def origin(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def link(self) -> str:
        return f"{self.origin}/#{self.token}"

    def request(
        self, method: str, path: str, content: Any = None, **headers: str
    ) -> tuple[int, dict[str, str], str]:
        """Make a request as our own page would, unless headers say otherwise (an empty one is left out)."""
        wire = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        body = content if isinstance(content, bytes) else json.dumps(content).encode()
        sent = {"Host": f"127.0.0.1:{self.port}"}
        if method == "POST":
            sent |= {"Origin": self.origin, "Content-Type": "application/json"}
        if self.cookie:
            sent["Cookie"] = self.cookie
        sent |= {name.replace("_", "-"): value for name, value in headers.items()}
        try:
            wire.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            for name, value in sent.items():
                if value:
                    wire.putheader(name, value)
            if method == "POST":
                wire.putheader("Content-Length", str(len(body)))
            wire.endheaders(body if method == "POST" else None)
            answer = wire.getresponse()
            return answer.status, {k.lower(): v for k, v in answer.getheaders()}, answer.read().decode()
        finally:
            wire.close()

    def enter(self) -> None:
        """Show the token; keep the cookie."""
        status, headers, _ = self.request("POST", "/session", {"token": self.token})
        assert status == 200
        self.cookie = headers["set-cookie"].split(";")[0]

    def post(self, path: str, content: Any) -> tuple[int, dict[str, Any]]:
        """Act; return the status and what is answered."""
        status, _, text = self.request("POST", path, content)
        return status, json.loads(text)


@contextmanager
def served(folder: Path, *options: str) -> Iterator[Served]:
    """While inside, the command serves a folder's desk on loopback."""
    process = subprocess.Popen(
        [
            sys.executable,
            "-P",
            "-m",
            "bufferstand",
            "desk",
            str(folder),
            "--address",
            "127.0.0.1:0",
            *options,
        ],
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stderr is not None
        said = "".join(process.stderr.readline() for _ in range(3))
        found = re.search(r"http://127\.0\.0\.1:(\d+)/#(\S+)", said)
        assert found is not None, said
        yield Served(process, folder, int(found[1]), found[2])
    finally:
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=PATIENCE_S)
        assert "Traceback" not in said, said


def laboratory(folder: Path) -> Path:
    """Fill a folder as a small laboratory's: the samples' stand, specimens, models and two campaigns."""
    for name in ("specimens", "models"):
        shutil.copytree(SAMPLES / name, folder / name)
    for name in ("stand.toml", "demo.toml", "en15551.toml"):
        shutil.copy(SAMPLES / name, folder)
    return folder


def until(what: Any, patience_s: float = PATIENCE_S) -> Any:
    """Wait until something is true; return it."""
    end_s = time.monotonic() + patience_s
    while not (found := what()):
        assert time.monotonic() < end_s, "not in time"
        time.sleep(0.1)
    return found
