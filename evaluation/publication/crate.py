"""The crate's metadata: an RO-Crate 1.3, written by the library of its makers (extra ``publish``)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import quote

from bufferstand.evaluation.publication.entities import (
    SOFTWARE_LICENCE,
    Entity,
    PublishedRun,
    author_entities,
    citation_entity,
    licence_entity,
    organisation_entity,
    ref,
    run_action,
    software_entity,
    specimen_entities,
    stand_entities,
)
from bufferstand.evaluation.publication.fields import Publication
from bufferstand.foundation import BadInput, how_to_add
from bufferstand.foundation.files import file_hash
from bufferstand.recording.runfile import simulated_of

CRATE_VERSION = "1.3"
"""The newest edition that the library writes; it brings its context, so that a crate is checked offline."""
_EVALUATION = "Energies, damping, stiffness and requirements of every run, with their uncertainty"
_REPORT = "Results, conditions, uncertainty and calibrations of the runs"
_FORMATS = {
    ".h5": "application/x-hdf5",
    ".json": "application/json",
    ".html": "text/html",
    ".pdf": "application/pdf",
}


def check_library() -> None:
    """Refuse to begin without the library.

    Raises
    ------
    BadInput
        With the command that adds it.
    """
    if find_spec("rocrate") is None:
        raise BadInput(
            "a publication needs the package rocrate, which is not installed",
            remedy=f"install it ({how_to_add('publish')})",
        )


def write_crate(
    folder: Path,
    publication: Publication,
    runs: Sequence[PublishedRun],
    evaluation: Path,
    report: Sequence[Path],
    version: str,
) -> None:
    """Write the metadata of a crate, and its page for people, into the folder that holds its files.

    Parameters
    ----------
    folder : Path
        The crate's folder.
    publication : Publication
        What the laboratory says of it.
    runs : sequence of PublishedRun
        Its runs.
    evaluation, report : Path, sequence of Path
        Its other files.
    version : str
        Of the software that evaluated.
    """
    from rocrate.rocrate import ROCrate  # noqa: PLC0415 - optional, and it loads much

    crate = ROCrate(version=CRATE_VERSION, gen_preview=True)
    described = _Described(crate)
    own = software_entity(version, publication.software_url)
    others = sorted({run.recorded_with for run in runs} - {version})
    software = {version: own} | {name: software_entity(name) for name in others}
    described.add([licence_entity(publication.licence), licence_entity(SOFTWARE_LICENCE), *software.values()])
    for run in runs:
        described.add_file(folder / run.place, run.place, _of_run(run))
        described.add([_content_hash(run)])
    results = {evaluation: ("Evaluation of all runs", _EVALUATION)}
    results |= {path: (f"Test report ({path.suffix.lstrip('.').upper()})", _REPORT) for path in report}
    for path, (name, text) in results.items():
        described.add_file(path, path.relative_to(folder).as_posix(), {"name": name, "description": text})
    actions = [run_action(run, software[run.recorded_with]) for run in runs]
    actions.append(_evaluation_action(folder, own, runs, list(results)))
    described.add(actions)
    cited = [own] if publication.software_url else []
    for key, value in _root(described, publication, runs, cited, actions).items():
        crate.root_dataset[key] = _single(value)
    crate.metadata["name"] = "Metadata of this crate"
    crate.preview["name"] = "This crate for people"
    crate.metadata.write(folder)
    crate.preview.write(folder)


class _Described:
    """Adds entities to a crate, each id once."""

    def __init__(self, crate: Any) -> None:
        self._crate = crate

    def add(self, entities: Iterable[Entity]) -> list[Entity]:
        """Add things; return the references to them."""
        from rocrate.model.contextentity import ContextEntity  # noqa: PLC0415 - as above

        added = []
        for entity in entities:
            if entity["@id"] not in self._crate:
                facts = {key: _single(value) for key, value in entity.items()}
                self._crate.add(ContextEntity(self._crate, entity["@id"], properties=facts))
            added.append(ref(entity))
        return added

    def add_file(self, path: Path, place: str, more: Entity) -> None:
        """Add a file that lies in the crate's folder."""
        facts = {
            "encodingFormat": _FORMATS[path.suffix],
            "contentSize": str(path.stat().st_size),
            "sha256": file_hash(path),
        }
        self._crate.add_file(path, place, properties=facts | more)


def _single(value: Any) -> Any:
    """Return the one value of a list of one, as JSON-LD is to be written (RO-Crate, appendix on JSON-LD)."""
    return value[0] if isinstance(value, list) and len(value) == 1 else value


def _of_run(run: PublishedRun) -> Entity:
    step = (run.document.get("step") or {}).get("name")
    simulated = simulated_of(run.document)
    kind = run.document["run"]["kind"]
    held = f"{kind} run, as recorded, with its calibrations and events"
    if run.document.get("withheld"):
        held = (
            f"copy of a recorded {kind} run, with calibrations and events, without what names the computers"
            " of the laboratory; its metadata “withheld” list the keys, and the SHA-256 of the recorded file"
        )
    return {
        "name": f"Run {run.id}" + (f": {step}" if step else ""),
        "description": ("SIMULATED: " if simulated else "") + held,
        "identifier": ref(_content_hash(run)),
    }


def _content_hash(run: PublishedRun) -> Entity:
    return {
        "@id": f"#content-{run.document['content_sha256']}",
        "@type": "PropertyValue",
        "name": "content hash",
        "propertyID": "content_sha256",
        "description": "SHA-256 of the run's whole content: it survives repacking of the file",
        "value": run.document["content_sha256"],
    }


def _evaluation_action(
    folder: Path, own: Entity, runs: Sequence[PublishedRun], results: Sequence[Path]
) -> Entity:
    return {
        "@id": "#evaluation",
        "@type": "CreateAction",
        "name": "Evaluation and report of the runs",
        "instrument": ref(own),
        "object": [{"@id": quote(run.place)} for run in runs],
        "result": [{"@id": quote(path.relative_to(folder).as_posix())} for path in results],
    }


def _root(
    described: _Described,
    publication: Publication,
    runs: Sequence[PublishedRun],
    cited: Sequence[Entity],
    actions: Sequence[Entity],
) -> Entity:
    """Return what is said of the whole crate."""
    mark, remark = simulated_words(runs)
    people = author_entities(publication.author)
    specimens, stands = specimen_entities(runs), stand_entities(runs)
    described.add(organisation for _, organisation in people)
    described.add(one for group in (*specimens, *stands) for one in group)
    channels = {
        f"{channel['quantity']} [{channel['unit']}]"
        for run in runs
        for stream in (run.document.get("streams") or {}).values()
        for channel in stream["channels"]
    }
    root = {
        "name": f"{mark}{publication.title}",
        "description": f"{remark}{publication.description}",
        "datePublished": publication.published.isoformat(),
        "license": ref(licence_entity(publication.licence)),
        "author": described.add(person for person, _ in people),
        "keywords": list(publication.keywords),
        "version": publication.version,
        "citation": [*described.add(citation_entity(one) for one in publication.citation), *map(ref, cited)],
        "about": [ref(group[0]) for group in specimens],
        "mentions": [*(ref(group[0]) for group in stands), *map(ref, actions)],
        "variableMeasured": sorted(channels),
    }
    if publication.publisher:
        (root["publisher"],) = described.add([organisation_entity(publication.publisher)])
    return {key: value for key, value in root.items() if value}


def simulated_words(runs: Sequence[PublishedRun]) -> tuple[str, str]:
    """Return what goes before title and description where runs were made on a simulated stand.

    Parameters
    ----------
    runs : sequence of PublishedRun
        Those of the crate.

    Returns
    -------
    (str, str)
        Both empty where no run is known to be simulated.
    """
    simulated = [run for run in runs if simulated_of(run.document)]
    if not simulated:
        return "", ""
    if len(simulated) == len(runs):
        return "SIMULATED: ", "These data are simulated: no specimen was tested. "
    which = ", ".join(run.id for run in simulated)
    return "PARTLY SIMULATED: ", (
        f"Of the {len(runs)} runs {len(simulated)} are simulated, without a specimen: {which}. "
    )
