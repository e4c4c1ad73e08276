"""How a page is served away from loopback: encrypted, by a certificate of the laboratory's own choice.

Who can read along on a network reads a link's token, and with it may stop a test. So no other address than
loopback is served unencrypted, unless that is asked for by name. TLS is that of Python's ``ssl``: 1.2, 1.3.
"""

from __future__ import annotations

import ipaddress
import ssl
from dataclasses import dataclass
from pathlib import Path

from bufferstand.foundation import BadInput

CERTIFICATE_OPTION, KEY_OPTION, OPEN_OPTION = "--certificate", "--key", "--unencrypted"
"""Options of the commands that serve a page."""


@dataclass(frozen=True)
class Certificate:
    """Files that a page is encrypted by.

    Parameters
    ----------
    chain : Path
        PEM: the server's certificate, and those between it and the authority that browsers trust.
    key : Path
        PEM: the certificate's private key, without a password.
    """

    chain: Path
    key: Path

    def words(self) -> tuple[str, ...]:
        """Return the options that name it, whatever the folder they are read in."""
        return CERTIFICATE_OPTION, str(self.chain.resolve()), KEY_OPTION, str(self.key.resolve())


def certificate_of(chain: Path | None, key: Path | None) -> Certificate | None:
    """Return the certificate that two options name, after trying that it can be used; None without them.

    Raises
    ------
    BadInput
        If one of the two is missing or cannot be read, or the key has a password or is another one's.
    """
    if chain is None and key is None:
        return None
    if chain is None or key is None:
        missing = CERTIFICATE_OPTION if chain is None else KEY_OPTION
        raise BadInput(f"{missing} FILE.pem is missing: a certificate and its key go together", file=missing)
    for path in (chain, key):
        try:
            path.read_bytes()
        except OSError as error:
            raise BadInput(f"cannot be read: {error.strerror}", file=path) from None
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(chain, key, password=_no_password)
    except ssl.SSLError as error:
        other = error.reason == "KEY_VALUES_MISMATCH"
        raise BadInput(
            "this key is not that of the certificate" if other else f"no PEM file of a {_kinds(chain, key)}",
            file=key if other else chain,
            remedy="give the key that the certificate was made with"
            if other
            else "give the certificate and its private key, both as PEM",
        ) from None
    except _PasswordError:
        raise BadInput(
            "the key has a password, and nobody can type it when the page starts",
            file=key,
            remedy="give a key without one, in a file that only you can read",
        ) from None
    return Certificate(chain, key)


def is_name(host: str) -> bool:
    """Return whether a host is a name, not an address; a certificate is of a name, mostly."""
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return True
    return False


class _PasswordError(Exception):
    """A key asks for a password."""


def _no_password() -> str:
    raise _PasswordError


def _kinds(chain: Path, key: Path) -> str:
    return "certificate with its key" if chain == key else f"certificate, or {key.name} none of a private key"
