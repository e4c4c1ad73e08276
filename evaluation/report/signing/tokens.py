"""A key on a PKCS#11 token: a smart card, a stick, a security module. It never leaves the token."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

from bufferstand.foundation import BadInput

if TYPE_CHECKING:
    from pyhanko.sign.pkcs11 import PKCS11Signer

_FORM = "write pkcs11:token=NAME;object=NAME?module-path=LIBRARY"
_PATH = ("token", "serial", "object", "id")
_QUERY = ("module-path",)


@contextmanager
def open_token(where: str, password: Callable[[], str]) -> Iterator[PKCS11Signer]:
    """Open the key at an address after RFC 7512.

    Parameters
    ----------
    where : str
        ``pkcs11:`` with ``token`` (its label) or ``serial``, ``object`` (label of key and certificate) or
        ``id``, and ``module-path`` (the token's PKCS#11 library).
    password : callable
        Asked for the PIN.

    Raises
    ------
    BadInput
        If the address is not one, or library, token, PIN or key are wrong.
    """
    from pkcs11 import Mechanism  # noqa: PLC0415 - an extra
    from pkcs11.exceptions import PinIncorrect, PinLenRange, PinLocked, PKCS11Error  # noqa: PLC0415 - an extra
    from pyhanko.config.pkcs11 import TokenCriteria  # noqa: PLC0415
    from pyhanko.sign.general import SigningError  # noqa: PLC0415
    from pyhanko.sign.pkcs11 import PKCS11Signer, open_pkcs11_session  # noqa: PLC0415

    asked = _parts(where)
    module = Path(asked["module-path"])
    if not module.is_file():
        raise BadInput("no such library", file=module, place="module-path", remedy=_FORM)
    serial = bytes.fromhex(asked["serial"]) if "serial" in asked else None
    criteria = TokenCriteria(label=asked.get("token"), serial=serial)
    pin = password()
    try:
        session = open_pkcs11_session(str(module), token_criteria=criteria, user_pin=pin)
    except (PinIncorrect, PinLenRange):
        raise BadInput("the PIN does not open the token", file=where, remedy="give its own PIN") from None
    except PinLocked:
        raise BadInput("the token is locked", file=where, remedy="unlock it with its PUK") from None
    except (PKCS11Error, OSError, RuntimeError) as error:
        told = type(error).__name__ if not str(error) or "criteria" in str(error) else str(error)
        raise BadInput(
            f"no such token can be opened ({told})",
            file=where,
            remedy="see their names with pkcs11-tool --list-token-slots",
        ) from None
    with session:
        key = bytes.fromhex(asked["id"]) if "id" in asked else None
        label = asked.get("object")
        signer = PKCS11Signer(session, cert_label=label, key_label=label, key_id=key, cert_id=key)
        try:
            kind = str(signer.signing_cert.public_key.algorithm)  # looks it and the key up on the token
        except (PKCS11Error, SigningError) as error:
            told = str(error) or type(error).__name__
            raise BadInput(
                f"the token has no such key with its certificate: {told}",
                file=where,
                remedy="see their names with pkcs11-tool --list-objects",
            ) from None
        # A token that does not hash by itself signs the hash that is made here.
        hashing = {"ec": Mechanism.ECDSA_SHA256, "rsa": Mechanism.SHA256_RSA_PKCS}
        signer.use_raw_mechanism = hashing.get(kind) not in session.token.slot.get_mechanisms()
        yield signer


def _parts(where: str) -> Mapping[str, str]:
    """Return the parts of an address; a PIN in it is refused: other users of the machine could read it."""
    path, _, query = where.removeprefix("pkcs11:").partition("?")
    found: dict[str, str] = {}
    for part, known in (
        *((one, _PATH) for one in path.split(";") if one),
        *((one, _QUERY) for one in query.split("&") if one),
    ):
        name, _, value = part.partition("=")
        if name in ("pin-value", "pin-source"):
            raise BadInput(
                "a PIN has no place on the command line",
                file="--sign",
                place=name,
                remedy="leave it out: it is asked for, or read from --sign-password-file",
            )
        if name not in known or not value or name in found:
            raise BadInput(f"“{part}” is no part of a key's address", file="--sign", remedy=_FORM)
        found[name] = unquote(value)
    for choice in (("token", "serial"), ("object", "id"), ("module-path",)):
        if not set(choice) & set(found):
            raise BadInput(f"the key's address has no {' or '.join(choice)}", file="--sign", remedy=_FORM)
    for name in ("serial", "id"):
        try:
            bytes.fromhex(found.get(name, ""))
        except ValueError:
            raise BadInput(
                f"“{found[name]}” is no hexadecimal number", file="--sign", place=name, remedy=_FORM
            ) from None
    return found
