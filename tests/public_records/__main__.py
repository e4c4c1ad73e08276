"""``python -m tests.public_records FOLDER``: what becomes of each record, a row each."""

from __future__ import annotations

import sys
from pathlib import Path

from tests.public_records.sources import every_record
from tests.public_records.study import evaluate

if __name__ == "__main__":
    for record in every_record(Path(sys.argv[1])):
        result = evaluate(record)
        print(f"{record.source.repository} | {record.name} | {result.text}", flush=True)
