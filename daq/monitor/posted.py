"""What a page sends: a JSON object of bounded size, in bounded time."""

from __future__ import annotations

import asyncio
import json
from typing import Any

from starlette.requests import ClientDisconnect, Request


async def posted_object(
    request: Request, most_bytes: int, patience_s: float
) -> dict[str, Any] | tuple[int, str]:
    """Return the object that a page has sent, or the status and the reason with which it is refused.

    Parameters
    ----------
    request : Request
    most_bytes : int
    patience_s : float
        Longest wait for the whole of it [s].
    """
    if request.headers.get("content-type", "").partition(";")[0] != "application/json":
        return 415, "JSON is expected"
    body = bytearray()
    try:
        async with asyncio.timeout(patience_s):
            async for part in request.stream():
                body += part
                if len(body) > most_bytes:
                    return 413, "this is too long"
    except TimeoutError:
        return 408, "this took too long"
    except ClientDisconnect:  # nobody is there any more to be told
        return 400, "this broke off"
    try:
        content = json.loads(body)
    except (ValueError, RecursionError):
        content = None
    return content if isinstance(content, dict) else (400, "a JSON object is expected")
