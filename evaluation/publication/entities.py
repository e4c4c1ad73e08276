"""Things that a crate describes, as schema.org has them: people, works, stand, sensors, specimen, runs.

Each function returns flat entities of JSON-LD: what one says of another is a reference to its ``@id``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote

from bufferstand.evaluation.publication.fields import Author, Citation

Entity = dict[str, Any]

_SPDX = "https://spdx.org/licenses/"
SOFTWARE_LICENCE = "BSD-3-Clause"


@dataclass(frozen=True)
class PublishedRun:
    """A run as it is published: its place in the crate, and the metadata document of that file."""

    place: str
    document: Mapping[str, Any]

    @property
    def id(self) -> str:
        """Get the run's id."""
        return str(self.document["run"]["id"])

    @property
    def recorded_with(self) -> str:
        """Get the version of the software that recorded or imported it."""
        return str((self.document.get("software") or {}).get("version") or "of unknown version")


def ref(entity: Entity) -> Entity:
    """Return a reference to an entity."""
    return {"@id": entity["@id"]}


def named(kind: str, name: str) -> str:
    """Return the id of a thing that has no address of its own, unique by kind and name."""
    return f"#{kind}-{quote(name, safe='')}"


def licence_entity(spdx: str) -> Entity:
    """Return a licence of SPDX's list."""
    return {
        "@id": f"{_SPDX}{spdx}",
        "@type": "CreativeWork",
        "name": spdx,
        "identifier": spdx,
        "description": f"The licence that SPDX lists as {spdx}.",
        "url": f"{_SPDX}{spdx}.html",
    }


def author_entities(authors: Sequence[Author]) -> list[list[Entity]]:
    """Return of each author the person and the affiliation, in their order."""
    found = []
    for author in authors:
        organisation = organisation_entity(author.affiliation, author.ror)
        person = {
            "@id": f"https://orcid.org/{author.orcid}" if author.orcid else named("person", author.name),
            "@type": "Person",
            "name": author.name,
            "affiliation": ref(organisation),
        }
        found.append([person, organisation])
    return found


def organisation_entity(name: str, ror: str | None = None) -> Entity:
    """Return an organisation."""
    entity: Entity = {"@id": ror or named("organisation", name), "@type": "Organization", "name": name}
    return entity | ({"url": ror} if ror else {})


def citation_entity(citation: Citation) -> Entity:
    """Return a work that is cited."""
    address = f"https://doi.org/{quote(citation.doi, safe='/:;()._-')}" if citation.doi else citation.url
    return {
        "@id": address,
        "@type": "ScholarlyArticle" if citation.doi else "CreativeWork",
        "name": citation.text,
        "identifier": address,
        "url": address,
    }


def software_entity(version: str, address: str | None = None) -> Entity:
    """Return bufferstand in a version; ``address`` is where it can be had, if that is known."""
    entity: Entity = {
        "@id": address or named("bufferstand", version),
        "@type": "SoftwareApplication" if address else "CreativeWork",
        "name": f"bufferstand {version}",
        "description": "Test-stand data acquisition and evaluation for railway buffers and draw gear",
        "version": version,
        "license": {"@id": f"{_SPDX}{SOFTWARE_LICENCE}"},
    }
    return entity | ({"softwareVersion": version, "url": address} if address else {})


def specimen_entities(runs: Iterable[PublishedRun]) -> list[list[Entity]]:
    """Return of each specimen what it is, and its properties."""
    found: dict[str, list[Entity]] = {}
    for run in runs:
        facts = run.document.get("specimen") or {}
        identity = str(facts.get("id") or "")
        if not identity or identity in found:
            continue
        head = _without_nothing(
            {
                "@id": named("specimen", identity),
                "@type": "IndividualProduct",
                "name": f"Specimen {identity}",
                "identifier": identity,
                "description": facts.get("description"),
                "category": facts.get("kind"),
                "serialNumber": facts.get("serial"),
                "productionDate": None if facts.get("year") is None else str(facts["year"]),
            }
        )
        found[identity] = _with_properties(
            head,
            {
                "category of EN 15551": facts.get("category"),
                "elastic system": facts.get("elastic_system"),
                "largest stroke": (facts.get("max_stroke_mm"), "mm"),
                "maker": facts.get("maker"),
                "assembled": facts.get("assembled"),
            },
        )
    return list(found.values())


def stand_entities(runs: Iterable[PublishedRun]) -> list[list[Entity]]:
    """Return of each stand: the stand, its devices and sensors, and their properties; the stand first."""
    found: dict[str, dict[str, Entity]] = {}
    for run in runs:
        stand = run.document.get("stand")
        if not isinstance(stand, Mapping) or not stand:
            continue
        about = stand.get("stand") or {}
        parts = found.setdefault(stand_id(run), {})
        if not parts:
            head = _without_nothing(
                {
                    "@id": stand_id(run),
                    "@type": "IndividualProduct",
                    "name": about.get("name") or f"Test stand {about.get('id')}",
                    "identifier": about.get("id"),
                    "description": _at(about.get("laboratory")),
                }
            )
            _add(parts, _with_properties(head, _limits(stand.get("limits") or {})))
            _add(parts, [_controller(stand_id(run), stand)])
        for stream, facts in (run.document.get("streams") or {}).items():
            _add(parts, _sensors(stand_id(run), stream, facts))
    for owner, parts in found.items():
        products = [
            one for one in parts.values() if one["@type"] == "IndividualProduct" and one["@id"] != owner
        ]
        parts[owner]["isRelatedTo"] = [ref(one) for one in products]
    return [list(parts.values()) for parts in found.values()]


def stand_id(run: PublishedRun) -> str:
    """Return the ``@id`` of a run's stand."""
    about = (run.document.get("stand") or {}).get("stand") or {}
    return named("stand", str(about.get("id") or about.get("name") or "stand"))


def run_action(run: PublishedRun, software: Entity) -> Entity:
    """Return the test that a run is the record of: stand, software, specimen, times, result."""
    about = run.document["run"]
    step = (run.document.get("step") or {}).get("name")
    specimen = (run.document.get("specimen") or {}).get("id")
    instruments = [{"@id": stand_id(run)}] if run.document.get("stand") else []
    instruments.append(ref(software))
    ended = "Completed" if about["status"] in ("complete", "imported") else "Failed"
    return _without_nothing(
        {
            "@id": named("run", run.id),
            "@type": "CreateAction",
            "name": f"Run {run.id}" + (f": {step}" if step else ""),
            "description": f"{about['kind']} run, {about['status']}"
            + (f": {about['reason']}" if about.get("reason") else ""),
            "startTime": about.get("started_utc"),
            "endTime": about.get("ended_utc"),
            "actionStatus": f"http://schema.org/{ended}ActionStatus",
            "instrument": instruments,
            "object": {"@id": named("specimen", str(specimen))} if specimen else None,
            "result": {"@id": quote(run.place)},
        }
    )


def _controller(owner: str, stand: Mapping[str, Any]) -> Entity:
    identity = stand.get("identity")
    facts = identity if isinstance(identity, Mapping) else {}
    return _without_nothing(
        {
            "@id": f"{owner}/controller",
            "@type": "IndividualProduct",
            "name": f"Controller {facts.get('device') or ''}".strip(),
            "serialNumber": None if facts.get("serial") is None else str(facts["serial"]),
            "model": facts.get("profile"),
        }
    )


def _sensors(owner: str, stream: str, facts: Mapping[str, Any]) -> list[Entity]:
    """Return the sensors of a stream with their calibrations; one that was calibrated anew is another."""
    found: list[Entity] = []
    for channel in facts.get("channels") or ():
        calibration = channel.get("calibration") or {}
        occasion = "-".join(str(calibration.get(key) or "") for key in ("id", "certificate", "date"))
        head = _without_nothing(
            {
                "@id": f"{owner}/{quote(stream)}/{quote(str(channel['name']))}/{quote(occasion, safe='')}",
                "@type": "IndividualProduct",
                "name": f"{channel['name']} [{channel['unit']}]",
                "description": channel.get("place"),
                "identifier": calibration.get("id"),
                "category": f"{channel['quantity']} channel of {stream}",
            }
        )
        properties = {f"calibration: {key}": value for key, value in calibration.items() if key != "tare"}
        properties |= {
            f"uncertainty: {key}": value for key, value in (channel.get("uncertainty") or {}).items()
        }
        properties["delay"] = (channel.get("delay_s"), "s")
        found += _with_properties(head, properties)
    return found


def _limits(limits: Mapping[str, Any]) -> dict[str, Any]:
    units = {
        "force_max_kN": "kN",
        "stroke_max_mm": "mm",
        "speed_max_mm_per_s": "mm/s",
        "frequency_max_Hz": "Hz",
    }
    return {key: (limits.get(key), unit) for key, unit in units.items()}


def _with_properties(head: Entity, properties: Mapping[str, Any]) -> list[Entity]:
    """Return a thing and its properties: a value, or a value with its unit; what is not known is left out."""
    found = []
    for name, given in properties.items():
        value, unit = given if isinstance(given, tuple) else (given, None)
        if value in (None, "", [], {}):
            continue
        if not isinstance(value, str | int | float):
            value = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
        entity = {"@id": f"{head['@id']}/{quote(name, safe='')}", "@type": "PropertyValue", "name": name}
        found.append(entity | {"value": value} | ({"unitText": unit} if unit else {}))
    return [head | ({"additionalProperty": [ref(one) for one in found]} if found else {}), *found]


def _add(parts: dict[str, Entity], entities: Iterable[Entity]) -> None:
    for entity in entities:
        parts.setdefault(entity["@id"], entity)


def _at(laboratory: Any) -> str | None:
    return f"Test stand of {laboratory}" if laboratory else None


def _without_nothing(entity: Entity) -> Entity:
    return {key: value for key, value in entity.items() if value not in (None, "", [])}
