"""Exports of the spring to other tools: FMI 2.0, tables, C source. Each export says what it loses.

``docs/model-export.md`` is the page for users; the C core and the prebuilt libraries lie beside this file.
"""
