"""``python -m cli`` is the command ``bufferstand``."""

from cli.main import main

main()
