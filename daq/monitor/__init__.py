"""The live monitor: the acquiring process tells, a process of its own shows it to browsers."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.monitor.access import (
        Access,
        Rights,
        Tokens,
        is_loopback,
        new_tokens,
    )
    from bufferstand.daq.monitor.app import (
        Gate,
        static_files,
    )
    from bufferstand.daq.monitor.campaign_view import (
        TWIN_NAME,
        TWIN_SCHEMA,
        note_words,
        page_words,
    )
    from bufferstand.daq.monitor.encryption import (
        CERTIFICATE_OPTION,
        KEY_OPTION,
        OPEN_OPTION,
        Certificate,
        certificate_of,
    )
    from bufferstand.daq.monitor.posted import (
        posted_object,
    )
    from bufferstand.daq.monitor.process import (
        Address,
        bind,
        demand_libraries,
        links,
        parse_address,
        web_process,
    )
    from bufferstand.daq.monitor.publisher import (
        BUFFER_BYTES,
        LIVE_NAME,
        publishing,
    )
    from bufferstand.daq.monitor.server import (
        serve,
        web_server,
    )
    from bufferstand.daq.monitor.staying import (
        end_page,
    )

__all__ = [
    "BUFFER_BYTES",
    "CERTIFICATE_OPTION",
    "KEY_OPTION",
    "LIVE_NAME",
    "OPEN_OPTION",
    "TWIN_NAME",
    "TWIN_SCHEMA",
    "Access",
    "Address",
    "Certificate",
    "Gate",
    "Rights",
    "Tokens",
    "bind",
    "certificate_of",
    "demand_libraries",
    "end_page",
    "is_loopback",
    "links",
    "new_tokens",
    "note_words",
    "page_words",
    "parse_address",
    "posted_object",
    "publishing",
    "serve",
    "static_files",
    "web_process",
    "web_server",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
