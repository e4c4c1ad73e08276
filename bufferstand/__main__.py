"""``python -m bufferstand`` is the command ``bufferstand``."""

from bufferstand.cli.main import main

if __name__ == "__main__":
    main()
