"""How Sphinx builds the documentation site: ``python -m sphinx -W -b html docs site``."""

from importlib.metadata import version as installed

project = "bufferstand"
author = "The bufferstand maintainers"
copyright = "the bufferstand maintainers, BSD-3-Clause"  # noqa: A001 - Sphinx's own name
release = version = installed("bufferstand")

extensions = ["myst_parser"]
source_suffix = {".md": "markdown"}
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 4
exclude_patterns = ["notebooks"]
# Campaigns, samples and the licence lie outside the site: their links are for those who read in the checkout.
suppress_warnings = ["myst.xref_missing"]

html_theme = "furo"
html_title = "bufferstand"
html_show_sourcelink = False
