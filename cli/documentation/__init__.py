"""The documentation that travels with the program: pages, a search in them, and a site on this computer."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.cli.documentation.pages import (
        Page,
        Section,
        read_pages,
    )
    from bufferstand.cli.documentation.search import (
        Hit,
        find,
    )
    from bufferstand.cli.documentation.site import (
        documentation_site,
    )

__all__ = [
    "Hit",
    "Page",
    "Section",
    "documentation_site",
    "find",
    "read_pages",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
