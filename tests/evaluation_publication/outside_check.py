"""Checks a crate with roc-validator; run by the Python of the environment that has it (.ci/peers).

    python outside_check.py CRATE CONTEXT.jsonld CACHE

Nothing is fetched: the context that the crate names is answered from the file. Prints JSON: what is not as
the specification requires or recommends.
"""

from __future__ import annotations

import json
import sys
from io import BytesIO
from pathlib import Path

import requests
from requests.adapters import HTTPAdapter
from requests_cache import CachedSession
from rocrate_validator import services
from rocrate_validator.models import Severity, ValidationSettings
from urllib3 import HTTPResponse

VERSION = "1.3"
ADDRESS = f"https://w3id.org/ro/crate/{VERSION}/context"


class OneFile(HTTPAdapter):
    """Answers every request with one file, and sends none."""

    def __init__(self, content: bytes) -> None:
        super().__init__()
        self.content = content

    def send(self, request: requests.PreparedRequest, **_: object) -> requests.Response:
        raw = HTTPResponse(
            BytesIO(self.content),
            {"Content-Type": "application/ld+json"},
            200,
            preload_content=False,
            request_url=str(request.url),
        )
        return self.build_response(request, raw)


def main(crate: str, context: Path, cache: Path) -> None:
    with CachedSession(cache_name=str(cache), backend="sqlite", expire_after=-1) as session:
        session.mount("https://", OneFile(context.read_bytes()))
        session.get(ADDRESS, headers={"Accept": "application/ld+json, application/json"})
        session.get(ADDRESS)
    settings = ValidationSettings(
        rocrate_uri=crate,
        profile_identifier=f"ro-crate-{VERSION}",
        requirement_severity=Severity.RECOMMENDED,
        offline=True,
        cache_path=cache,
        cache_max_age=-1,
    )
    result = services.validate(settings)
    issues = [
        {"severity": issue.severity.name, "check": issue.check.identifier, "message": issue.message}
        for issue in result.get_issues()
    ]
    print(json.dumps({"passed": result.passed(Severity.REQUIRED), "issues": issues}))


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]))
