"""What the project is made of: ``python -m tests.supply sbom FILE.json|validate FILE.json|licences``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from tests.supply.licences import faults, known, licence_of
from tests.supply.locks import ALL, ROOT, RUN, pins
from tests.supply.sbom import text
from tests.supply.validating import problems


def main(words: list[str] | None = None) -> int:
    """Do what is asked for; return 1 if a licence or a file is not what it should be."""
    parser = argparse.ArgumentParser(prog="python -m tests.supply", description=__doc__)
    tasks = parser.add_subparsers(dest="task", required=True)
    sbom = tasks.add_parser("sbom", help="write the bill of materials of what runs (CycloneDX)")
    sbom.add_argument("file", type=Path, metavar="FILE.json")
    tasks.add_parser("licences", help="list every package of both locks with its licence, and what is wrong")
    validate = tasks.add_parser("validate", help="hold a bill of materials to CycloneDX's own schema")
    validate.add_argument("file", type=Path, metavar="FILE.json")
    asked = parser.parse_args(words)
    if asked.task == "sbom":
        asked.file.write_text(text(), encoding="utf-8", newline="\n")
        print(f"{asked.file}: {len(pins(ROOT / RUN))} components")
        return 0
    if asked.task == "validate":
        found = problems(asked.file)
        print("\n".join(found) or f"{asked.file}: valid")
        return int(bool(found))
    rules, wrong = known(), []
    for lock in (RUN, ALL):
        pinned = pins(ROOT / lock)
        names = sorted({pin.name for pin in pinned})
        print(f"{lock}: {len(names)} packages")
        print("\n".join(f"  {name:28} {licence_of(name, rules)}" for name in names))
        wrong += faults(pinned, rules)
    print("\n".join(wrong), file=sys.stderr)
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
