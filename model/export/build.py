"""Build the prebuilt libraries from ``c/``: ``python -m bufferstand.model.export.build [--out DIR]``.

Needs ``gcc`` and, for Windows, ``x86_64-w64-mingw32-gcc``. The same compiler gives the same bytes.
``binaries/build.json`` tells which source and compiler they came from.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import shutil
import subprocess
import sys
from pathlib import Path

from bufferstand.model.export.fmu import LIBRARIES, SOURCES

HERE = Path(__file__).parent
SOURCE_FOLDER = HERE / "c"
BINARIES = HERE / "binaries"
COMPILERS = {"linux64": "gcc", "win64": "x86_64-w64-mingw32-gcc"}
WARNINGS = ("-Wall", "-Wextra", "-Werror", "-pedantic")
# No contraction, no fast-math: the library must compute what Python computes, bit by bit.
ARITHMETIC = ("-std=c99", "-O2", "-march=x86-64", "-ffp-contract=off")
_QUIET = ("-fno-ident", "-fvisibility=hidden", "-ffile-prefix-map=.=.", "-s", "-shared", "-static-libgcc")
_PLATFORM = {
    "linux64": ("-fPIC", "-Wl,--build-id=none", "-Wl,-z,relro,-z,now", "-Wl,--as-needed"),
    # A base of its own choice would be a hash of the output's path; the loader moves the library anyway.
    "win64": ("-Wl,--no-insert-timestamp,--build-id=none,--image-base,0x180000000,--dynamicbase,--nxcompat",),
}


def build(platform: str, folder: Path) -> Path:
    """Compile the library of one platform into a folder; return its path.

    Raises
    ------
    RuntimeError
        If the compiler refuses; its message is the text.
    """
    library = folder.resolve() / LIBRARIES[platform]
    library.parent.mkdir(parents=True, exist_ok=True)
    command = [COMPILERS[platform], *ARITHMETIC, *WARNINGS, *_QUIET, *_PLATFORM[platform]]
    command += ["-DBUFFERSTAND_FMI2_MINIMAL", SOURCES[0], "-o", str(library), "-lm"]
    done = subprocess.run(command, cwd=SOURCE_FOLDER, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{COMPILERS[platform]} fails:\n{done.stderr}")
    return library


def compiler(platform: str) -> str | None:
    """Return name and version of the platform's compiler, or None if there is none here."""
    if shutil.which(COMPILERS[platform]) is None:
        return None
    told = subprocess.run([COMPILERS[platform], "--version"], capture_output=True, text=True, check=True)
    return told.stdout.splitlines()[0]


def digests(folder: Path, names: tuple[str, ...]) -> dict[str, str]:
    """Return the SHA-256 of files in a folder by their names."""
    return {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in sorted(names)}


def main(arguments: list[str] | None = None) -> int:
    """Build both libraries and write down what they came from."""
    parser = argparse.ArgumentParser(
        prog="python -m bufferstand.model.export.build", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--out", type=Path, default=BINARIES, help="folder of the libraries")
    folder: Path = parser.parse_args(arguments).out
    record: dict[str, object] = {"sources": digests(SOURCE_FOLDER, SOURCES)}
    for platform, name in LIBRARIES.items():
        tool = compiler(platform)
        if tool is None:
            sys.stderr.write(f"{COMPILERS[platform]} is not here: nothing built for {platform}\n")
            return 1
        build(platform, folder / platform)
        record[platform] = {"compiler": tool, "sha256": digests(folder / platform, (name,))[name]}
    (folder / "build.json").write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8", newline="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
