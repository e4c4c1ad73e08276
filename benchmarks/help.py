"""What ``bufferstand --help`` costs beside a bare Python.

    .venv/bin/python -m benchmarks.help [--rounds 15]

Both are started in turn; the least wall time of each counts, and only their ratio means anything on a machine
that is shared.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time

BARE = ("-c", "pass")
MOST_S, MOST_RATIO = 0.3, 8.0


def seconds(words: tuple[str, ...]) -> float:
    """Return how long a Python with these arguments takes [s]."""
    start = time.perf_counter()
    subprocess.run([sys.executable, *words], stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - start


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    for command in ("", "evaluate", "run", "report"):
        words = ("-P", "-m", "bufferstand", *command.split(), "--help")
        pairs = [(seconds(words), seconds(BARE)) for _ in range(rounds)]
        ours, bare = (min(pair[i] for pair in pairs) for i in (0, 1))
        limits = f" (at most {MOST_S:g} s, {MOST_RATIO:g} x)" if not command else ""
        name = " ".join(["bufferstand", *command.split(), "--help"])
        print(f"{name:30} {ours:6.3f} s = {ours / bare:5.2f} x python -c pass{limits}", flush=True)


if __name__ == "__main__":
    main()
