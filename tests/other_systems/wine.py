"""A Python for Windows under Wine: put together from packages of the registries, for one test.

Bytedeco's jars of Maven Central hold CPython 3.11 for Windows and Microsoft's C runtime; wheels for Windows
come from the package index. Two small libraries, compiled here, fill what Wine 8 and the jar lack:
``bcryptprimitives`` (random numbers, for modules in Rust) and ``python3`` (the stable interface, which hands
on to ``python311``).
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.conftest import ROOT

NEEDED = ("wine", "mvn", "x86_64-w64-mingw32-gcc-win32", "x86_64-w64-mingw32-objdump", "pip")
_JARS = ("org.bytedeco:cpython:3.11.3-1.5.9", "org.bytedeco:javacpp:1.5.9")
_WHEELS = (
    *("babel", "click", "gtc", "h5py", "jinja2", "markdown-it-py", "matplotlib", "numpy<2.4", "openpyxl"),
    *("orjson", "pandas", "pydantic", "pymodbus<4", "pyserial", "rich", "scipy", "starlette", "tomlkit"),
    *("typing-extensions", "typst", "uvicorn", "websockets", "colorama", "tzdata"),
)
_RANDOM = r"""
#include <windows.h>
BOOLEAN NTAPI SystemFunction036(PVOID, ULONG);
__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE data, SIZE_T size)
{
    for (; size > 0; ) {
        ULONG part = size > 0x10000000 ? 0x10000000 : (ULONG)size;
        if (!SystemFunction036(data, part)) return FALSE;
        data += part; size -= part;
    }
    return TRUE;
}
BOOL WINAPI DllMain(HINSTANCE a, DWORD b, LPVOID c) { return TRUE; }
"""
_GCC = "x86_64-w64-mingw32-gcc-win32"


def lacking() -> list[str]:
    """Return the programs that are not here."""
    return [name for name in NEEDED if shutil.which(name) is None]


@dataclass(frozen=True)
class WindowsPython:
    """A Python for Windows that has bufferstand.

    Parameters
    ----------
    folder : Path
        What was put together.
    """

    folder: Path

    def run(self, *arguments: object, where: Path) -> subprocess.CompletedProcess[str]:
        """Run ``python -m bufferstand`` with these arguments in a folder."""
        environment = {
            **os.environ,
            "WINEPREFIX": str(self.folder / "prefix"),
            "WINEDEBUG": "-all",
            "WINEDLLOVERRIDES": "ucrtbase,msvcp140,vcruntime140,vcruntime140_1=n,b",
            "PYTHONPATH": f"{windows_path(self.folder / 'site')};{windows_path(ROOT)}",
            "PYTHONPYCACHEPREFIX": windows_path(self.folder / "pyc"),
        }
        return subprocess.run(
            ["wine", str(self._home / "python.exe"), "-m", "bufferstand", *map(str, arguments)],
            cwd=where,
            env=environment,
            input="",
            capture_output=True,
            encoding="utf-8",
            timeout=900,
            check=False,
        )

    @property
    def _home(self) -> Path:
        return self.folder / "org" / "bytedeco" / "cpython" / "windows-x86_64"

    def make(self) -> None:
        """Put it together.

        Raises
        ------
        subprocess.CalledProcessError
            If a registry or a compiler refuses.
        """
        for jar in _JARS:
            self._unpack(jar)
        runtime = self.folder / "org" / "bytedeco" / "javacpp" / "windows-x86_64"
        for library in ("ucrtbase", "msvcp140", "msvcp140_1", "vcruntime140", "vcruntime140_1"):
            shutil.copy(runtime / f"{library}.dll", self._home)
        self._compile()
        _checked(
            ["pip", "install", "-q", "--target", str(self.folder / "site"), "--platform", "win_amd64",
             "--python-version", "3.11", "--implementation", "cp", "--only-binary=:all:", *_WHEELS],
            self.folder,
        )  # fmt: skip
        facts = self.folder / "site" / "bufferstand-0.1.0.dist-info"
        facts.mkdir()
        (facts / "METADATA").write_text(
            "Metadata-Version: 2.1\nName: bufferstand\nVersion: 0.1.0\n", encoding="utf-8"
        )

    def _unpack(self, name: str) -> None:
        _, artifact, version = name.split(":")
        _checked(
            ["mvn", "-q", "dependency:copy", f"-Dartifact={name}:jar:windows-x86_64",
             f"-DoutputDirectory={self.folder}"],
            self.folder,
        )  # fmt: skip
        with zipfile.ZipFile(self.folder / f"{artifact}-{version}-windows-x86_64.jar") as jar:
            jar.extractall(self.folder)

    def _compile(self) -> None:
        (self.folder / "random.c").write_text(_RANDOM, encoding="ascii")
        _checked(
            [
                _GCC,
                "-shared",
                "-O1",
                "-o",
                str(self._home / "bcryptprimitives.dll"),
                "random.c",
                "-ladvapi32",
            ],
            self.folder,
        )
        listed = _checked(
            ["x86_64-w64-mingw32-objdump", "-p", str(self._home / "python311.dll")], self.folder
        )
        names = re.findall(r"^\s+\[ *\d+\] (?:\+base\[ *\d+\]  [0-9a-f]+ )?(_?Py\w+)$", listed, re.MULTILINE)
        lines = ["LIBRARY python3.dll", "EXPORTS", *(f"  {name}=python311.{name}" for name in names)]
        (self.folder / "python3.def").write_text("\n".join(lines) + "\n", encoding="ascii")
        (self.folder / "python3.c").write_text(
            "int DllMain(void *a, unsigned b, void *c) { return 1; }\n", encoding="ascii"
        )
        _checked(
            [_GCC, "-shared", "-nostdlib", "-e", "DllMain", "-o", str(self._home / "python3.dll"),
             "python3.c", "python3.def"],
            self.folder,
        )  # fmt: skip


def windows_path(path: Path) -> str:
    """Return a path as Wine shows it."""
    return "Z:" + str(path).replace("/", "\\")


def _checked(command: Sequence[str], folder: Path) -> str:
    done = subprocess.run(
        command,
        cwd=folder,
        stdout=subprocess.PIPE,
        text=True,
        timeout=900,
        check=True,
        stdin=subprocess.DEVNULL,
    )
    return done.stdout


if __name__ == "__main__":
    WindowsPython(Path(sys.argv[1])).make()
