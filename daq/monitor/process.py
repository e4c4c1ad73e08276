"""Start the web process beside a campaign, say where it is, and say it if it dies; the campaign goes on."""

from __future__ import annotations

import importlib.util
import json
import os
import select
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import IO

from bufferstand.daq.monitor.access import Tokens, is_loopback, new_tokens
from bufferstand.daq.monitor.encryption import (
    CERTIFICATE_OPTION,
    KEY_OPTION,
    OPEN_OPTION,
    Certificate,
    is_name,
)
from bufferstand.daq.monitor.staying import end_page, rule_in_words
from bufferstand.foundation import BadInput, how_to_add, program

DEFAULT_HOST = "127.0.0.1"
DEFAULT_PORT = 8420
STAYS = b"stays\n"
"""What the web process says where it stays behind its campaign."""
END_S = 10.0
"""Longest wait for the web process to end [s]: longer than it may hear out the campaign and tell its pages
(``HEAR_OUT_S`` and ``LAST_WORD_S`` of :mod:`bufferstand.daq.monitor.server`)."""


@dataclass(frozen=True)
class Address:
    """Where the page is served; port 0 is any that is free, and ``exact`` says that no other will do."""

    host: str = DEFAULT_HOST
    port: int = DEFAULT_PORT
    exact: bool = False
    certificate: Certificate | None = None
    """What it is encrypted by; None: not at all."""
    unencrypted: bool = False
    """Whether it was asked for that another address than loopback is served unencrypted."""

    @property
    def names(self) -> tuple[str, ...]:
        """The name that it was asked for by, if it is one: links say it, and a certificate is of it."""
        return (self.host.lower(),) if is_name(self.host) and not is_loopback(self.host) else ()

    def demand_encryption(self) -> None:
        """Refuse to serve another address than loopback unencrypted, unless that was asked for.

        Raises
        ------
        BadInput
            If it is one.
        """
        if is_loopback(self.host) or self.certificate is not None or self.unencrypted:
            return
        raise BadInput(
            f"the page would be served at {self.host} unencrypted: who reads along on the network could act",
            file="--monitor",
            remedy=f"give {CERTIFICATE_OPTION} FILE.pem {KEY_OPTION} FILE.pem, or {OPEN_OPTION} where nobody "
            "else is on that network",
        )

    def encryption_words(self) -> tuple[str, ...]:
        """Return the options that have another page served in the same way."""
        if self.certificate is not None:
            return self.certificate.words()
        return (OPEN_OPTION,) if self.unencrypted else ()


def parse_address(text: str) -> Address:
    """Return an address from ``HOST:PORT``, ``HOST`` or ``:PORT``; empty is the default on loopback.

    Raises
    ------
    BadInput
        If it is none.
    """
    if not text:
        return Address()
    host, _, port = text.rpartition(":") if ":" in text.rpartition("]")[2] else (text, "", str(DEFAULT_PORT))
    if not port.isascii() or not port.isdigit() or int(port) > 65535:
        raise BadInput(
            f"“{text}” is no HOST:PORT", file="--monitor", remedy="write e.g. 192.168.1.5:8420, or nothing"
        )
    return Address(host.strip("[]") or DEFAULT_HOST, int(port), exact=True)


def demand_libraries() -> None:
    """Say which libraries are missing, before anything moves.

    Raises
    ------
    BadInput
        If one is.
    """
    missing = [n for n in ("starlette", "uvicorn", "websockets") if importlib.util.find_spec(n) is None]
    if missing:
        raise BadInput(f"the live monitor needs {', '.join(missing)}", remedy=how_to_add("monitor"))


def bind(address: Address) -> socket.socket:
    """Return a socket that listens at an address.

    Raises
    ------
    BadInput
        If the address cannot be had; for one that was not asked for by its port, any free port is taken.
    """
    tries = [address.port] if address.exact else [address.port, 0]
    for port in tries:
        try:
            family, kind, _, _, place = socket.getaddrinfo(
                address.host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
            )[0]
            listener = socket.socket(family, kind)
        except OSError as error:
            raise BadInput(
                f"“{address.host}” is no address of this machine ({error.strerror})", file="--monitor"
            ) from None
        try:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(place)
            listener.listen(64)
        except OSError as error:
            listener.close()
            if port == tries[-1]:
                raise BadInput(
                    f"the page cannot be served at {address.host}:{port}: {error.strerror}",
                    file="--monitor",
                    remedy="give another address, or :0 for any free port",
                ) from None
            continue
        return listener
    raise AssertionError("there is at least one port to try")


def links(
    listener: socket.socket,
    tokens: Tokens,
    *,
    what: str = "live monitor",
    acting: str = "with stop and notes",
    address: Address | None = None,
) -> list[str]:
    """Return what the operator is told: where the page is, and what opens it. Said once.

    Parameters
    ----------
    listener : socket
        Bound.
    tokens : Tokens
        What opens the page.
    what, acting : str
        The page, and what can be done with the link for control.
    address : Address, optional
        As it was asked for; without it the page is not encrypted.
    """
    address = address or Address()
    host, port = listener.getsockname()[:2]
    everywhere = host in ("0.0.0.0", "::")
    name = socket.gethostname() if everywhere else f"[{host}]" if ":" in host else host
    name = address.names[0] if address.names else name
    base = f"{'http' if address.certificate is None else 'https'}://{name}:{port}/"
    said = []
    if tokens.free_view:
        said.append(f"{what}, to look on (from this computer): {base}")
    elif tokens.view:
        said.append(f"{what}, to look on: {base}#{tokens.view}")
    if tokens.control:
        said.append(f"{what}, {acting}: {base}#{tokens.control}")
    if not is_loopback(host) and address.certificate is None:
        said.append("whoever has a link can use it, and the network can read along: use it in the lab only")
    elif not is_loopback(host):
        said.append("whoever has a link can use it; the connection is encrypted")
    return said


class WebProcess:
    """A running web process.

    Parameters
    ----------
    process : Popen
        Its standard input is a pipe.
    errors : file
        What it writes to standard error.
    """

    def __init__(self, process: subprocess.Popen[bytes], errors: IO[bytes]) -> None:
        self._process = process
        self._errors = errors
        self._ending = False
        self.stays = False
        """Whether it has stayed behind the campaign, because somebody has the page open."""

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def watch(self, say: Callable[[str], object]) -> None:
        """From now on, say it if the process ends before its time."""

        def wait() -> None:
            status = self._process.wait()
            if not self._ending:
                say(
                    f"the live monitor's web process has ended ({self._why(status)}); the campaign goes on; "
                    "“bufferstand monitor” on its folder brings the page back"
                )

        threading.Thread(target=wait, name="monitor", daemon=True).start()

    def _why(self, status: int) -> str:
        self._errors.seek(0)
        lines = self._errors.read().decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else f"signal {-status}" if status < 0 else f"status {status}"

    def end(self) -> None:
        """Let it end with the campaign; it tells its pages first, or stays for them."""
        if self._ending:
            return
        self._ending = True
        if self._process.stdin is not None:
            with suppress(OSError):
                self._process.stdin.close()
        self.stays = self._says_it_stays()
        if self.stays:
            self._process.returncode = 0  # it is nobody's child any more once this program has ended
        else:
            try:
                self._process.wait(END_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._errors.close()

    def _says_it_stays(self) -> bool:
        """Return whether it says that it stays; it says nothing where it ends."""
        out = self._process.stdout
        if out is None or not select.select([out], [], [], END_S)[0]:
            return False
        return os.read(out.fileno(), len(STAYS)) == STAYS


@contextmanager
def web_process(
    folder: Path,
    address: Address,
    say: Callable[[str], object],
    tokens: Tokens | None = None,
    *,
    stays: bool = False,
) -> Iterator[WebProcess]:
    """While inside, a web process serves a campaign's page.

    Parameters
    ----------
    folder : Path
        The campaign's folder; it need not be there yet.
    address : Address
        Where.
    say : callable
        Tells the operator the links, once.
    tokens : Tokens, optional
        What opens the page; fresh ones if not given.
    stays : bool
        Whether it stays behind the campaign while somebody has the page open
        (:mod:`bufferstand.daq.monitor.staying`); one that has stayed in this folder before is ended.

    Raises
    ------
    BadInput
        If the address cannot be had, may not be served so, or a library is missing.
    """
    demand_libraries()
    address.demand_encryption()
    if stays:
        end_page(folder)
    with bind(address) as listener:
        place = links(listener, Tokens(free_view=True), address=address)[0].rpartition(" ")[2]
        tokens = tokens or new_tokens(loopback=is_loopback(listener.getsockname()[0]))
        settings = {
            "folder": str(folder.absolute()),
            "socket": str(listener.fileno()),
            "view": tokens.view,
            "control": tokens.control,
            "free_view": "yes" if tokens.free_view else "",
            "stays": "yes" if stays else "",
            "names": " ".join(address.names),
            "chain": "" if address.certificate is None else str(address.certificate.chain.resolve()),
            "key": "" if address.certificate is None else str(address.certificate.key.resolve()),
        }
        errors = tempfile.TemporaryFile()  # noqa: SIM115 - it lives as long as the process
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "bufferstand.daq.monitor"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            pass_fds=[listener.fileno()],
            start_new_session=True,  # Ctrl-C in the terminal is for the campaign
        )
        for line in links(listener, tokens, address=address):
            say(line)
    running = WebProcess(process, errors)
    try:
        assert process.stdin is not None
        with suppress(OSError):
            process.stdin.write(json.dumps(settings).encode() + b"\n")
            process.stdin.flush()
        yield running
    finally:
        running.end()
        if running.stays:
            say(
                f"the live page stays open with the results: {place} ({rule_in_words()}; to end it now: "
                f"“{program()} monitor {quote(str(folder))} --end”)"
            )
