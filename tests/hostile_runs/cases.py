"""The crafted files, by name; each is one change of a good run file."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tests.hostile_runs.crafting import crafted, put_document, replaced, with_document

C = "entry/controller"
FORCE = f"{C}/force"
Case = Callable[[Path], Path]


def _tree(change: Callable[[Any, Path], object], **how: bool) -> Case:
    return lambda folder: crafted(folder, change, **how)


def _document(*path: str | int, value: Any) -> Case:
    """Return a case in which one fact of the document is another."""

    def change(document: Any) -> None:
        for key in path[:-1]:
            document = document[key]
        document[path[-1]] = value

    return lambda folder: with_document(folder, change)


def _put(place: str, values: Any, **options: Any) -> Case:
    return _tree(lambda tree, _: replaced(tree, place, values, **options))


def _typed(place: str, dtype: Any) -> Case:
    return _tree(lambda tree, _: replaced(tree, place, np.zeros(len(tree[place]), dtype)))


def _external(tree: Any, folder: Path) -> None:
    """The numbers of the force are the bytes of another file of who evaluates."""
    rows = len(tree[FORCE])
    secret = folder / "secret.txt"
    secret.write_bytes(b"what nobody else may know ".ljust(4 * rows, b"."))
    del tree[FORCE]
    made = tree.create_dataset(FORCE, (rows,), "<i4", external=[(str(secret), 0, 4 * rows)])
    made.attrs["units"] = "count"


def _external_gone(tree: Any, folder: Path) -> None:
    rows = len(tree[FORCE])
    del tree[FORCE]
    tree.create_dataset(FORCE, (rows,), "<i4", external=[(str(folder / "gone"), 0, 4 * rows)])


def _other_file(folder: Path) -> Path:
    other = folder / "other.hdf"
    with h5py.File(other, "w") as tree:
        tree["force"] = np.arange(5000, dtype="<i4")
        tree["group/force"] = np.arange(5000, dtype="<i4")
    return other


def _linked(place: str, link: Callable[[Path], Any]) -> Case:
    def change(tree: Any, folder: Path) -> None:
        made = link(folder)
        if place in tree:
            del tree[place]
        tree[place] = made

    return _tree(change)


def _virtual(tree: Any, folder: Path, source: str | None = None) -> None:
    rows = len(tree[FORCE])
    layout = h5py.VirtualLayout((rows,), "<i4")
    name = str(_other_file(folder)) if source is None else source
    layout[:] = h5py.VirtualSource(name, "force", (rows,))
    del tree[FORCE]
    tree.create_virtual_dataset(FORCE, layout).attrs["units"] = "count"


def _virtual_pipe(tree: Any, folder: Path) -> None:
    """Whoever opens the source waits for somebody who never writes."""
    pipe = folder / "pipe"
    os.mkfifo(pipe)
    layout = h5py.VirtualLayout((1,), "<i4", maxshape=(None,))
    layout[: h5py.h5s.UNLIMITED] = h5py.VirtualSource(str(pipe), "force", (1,), maxshape=(None,))[
        : h5py.h5s.UNLIMITED
    ]
    del tree[FORCE]
    tree.create_virtual_dataset(FORCE, layout)


def _second_name(tree: Any, _: Path) -> None:
    tree[f"{C}/again"] = tree[FORCE]


def _circle(tree: Any, _: Path) -> None:
    tree[f"{C}/up"] = tree["entry"]


def _stated(rows: int, **options: Any) -> Case:
    def change(tree: Any, _: Path) -> None:
        del tree[FORCE]
        tree.create_dataset(FORCE, (rows,), **options).attrs["units"] = "count"

    return _tree(change)


def _bomb(tree: Any, _: Path) -> None:
    """A million rows whose few kilobytes HDF5 would take for two gigabytes, a chunk at a time."""
    del tree[FORCE]
    made = tree.create_dataset(FORCE, (1 << 31,), "i1", chunks=(1 << 20,), compression="gzip")
    made[: 1 << 21] = 0


def _foreign_filter(tree: Any, _: Path) -> None:
    rows = len(tree[FORCE])
    plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plist.set_chunk((rows,))
    plist.set_filter(32001, h5py.h5z.FLAG_OPTIONAL, ())
    del tree[FORCE]
    space = h5py.h5s.create_simple((rows,))
    h5py.h5d.create(tree[C].id, b"force", h5py.h5t.STD_I32LE, space, plist)
    tree[FORCE][:] = 1


def _of_type(kind: Any) -> Case:
    def change(tree: Any, _: Path) -> None:
        del tree[FORCE]
        h5py.h5d.create(tree[C].id, b"force", kind(), h5py.h5s.create_simple((10,)))

    return _tree(change, truthful=False)


def _null(tree: Any, _: Path) -> None:
    del tree[FORCE]
    tree.create_dataset(FORCE, data=h5py.Empty("<i4"))


def _references(tree: Any, _: Path) -> None:
    rows = len(tree[FORCE])
    del tree[FORCE]
    tree.create_dataset(FORCE, (rows,), h5py.ref_dtype)


def _attribute(value: Any, **how: Any) -> Case:
    def change(tree: Any, _: Path) -> None:
        del tree.attrs["metadata"]
        if value is not None:
            tree.attrs.create("metadata", value, **how)

    return _tree(change, truthful=False)


def _altered_numbers(tree: Any, _: Path) -> None:
    tree[FORCE][7] += 1


def _lying_hash(document: dict[str, Any]) -> None:
    document["datasets"][FORCE]["sha256"] = "0" * 64


def _units(place: str, unit: Any) -> Case:
    def change(tree: Any, _: Path) -> None:
        if unit is None:
            del tree[place].attrs["units"]
        else:
            tree[place].attrs["units"] = unit

    return _tree(change)


def _event(**data: Any) -> Case:
    return _event_text(json.dumps(data))


def _event_text(text: str | bytes) -> Case:
    raw = text.encode() if isinstance(text, str) else text

    def change(tree: Any, _: Path) -> None:
        rows = len(tree["entry/events/data"])
        replaced(tree, "entry/events/data", np.array([raw] * rows, f"S{len(raw)}"))

    return _tree(change)


def _gone(place: str) -> Case:
    def change(tree: Any, _: Path) -> None:
        del tree[place]

    return _tree(change)


def _deep(tree: Any, _: Path) -> None:
    tree.create_group(f"{C}/more/and/more")


def _both_clocks(tree: Any, _: Path) -> None:
    tree.create_dataset(f"{C}/time_s", data=tree[f"{C}/time_us"][:] * 1e-6).attrs["units"] = "s"


def _shared_storage(tree: Any, _: Path) -> None:
    """Two names and one object header each, but the document of another run."""
    document = json.loads(tree.attrs["metadata"])
    document["streams"]["controller"]["channels"] = document["streams"]["controller"]["channels"][:1] * 2
    put_document(tree, document)


STROKE = {
    "motion": "harmonic", "compensated": True, "by_force": False, "asked_mean_mm": 20.0,
    "asked_amplitude_mm": 20.0, "last_commanded_mean_mm": 20.0, "last_commanded_amplitude_mm": 20.0,
    "reached_mean_mm": 20.0, "reached_amplitude_mm": 20.0, "off_mm": 0.1, "off_percent": 0.1, "cycles": 3,
}  # fmt: skip
ROWS = np.arange(10)

REFUSED: dict[str, Case] = {
    "external storage": _tree(_external),
    "external storage, unsealed": _tree(_external, sealed=False),
    "external storage that is gone": _tree(_external_gone),
    "dataset in another file": _linked(FORCE, lambda f: h5py.ExternalLink(str(_other_file(f)), "/force")),
    "group in another file": _linked(C, lambda f: h5py.ExternalLink(str(_other_file(f)), "/group")),
    "link to no file": _linked(FORCE, lambda _: h5py.ExternalLink("/nowhere/x.h5", "/force")),
    "soft link": _linked(FORCE, lambda _: h5py.SoftLink(f"/{C}/stroke_1")),
    "soft link to nothing": _linked(FORCE, lambda _: h5py.SoftLink("/nothing")),
    "soft link to itself": _linked(FORCE, lambda _: h5py.SoftLink(f"/{FORCE}")),
    "one link more": _linked("entry/more", lambda _: h5py.SoftLink("/entry")),
    "second name": _tree(_second_name),
    "circle of groups": _tree(_circle),
    "virtual": _tree(_virtual),
    "virtual, of itself": _tree(lambda tree, folder: _virtual(tree, folder, ".")),
    "virtual, of a pipe": _tree(_virtual_pipe, truthful=False),
    "named type": _tree(lambda tree, _: tree.__setitem__("entry/type", np.dtype("<f8"))),
    "too deep": _tree(_deep),
    "group for a dataset": _tree(lambda tree, _: (tree.pop(FORCE), tree.create_group(FORCE))),
    "compound": _typed(FORCE, [("a", "<i4"), ("b", "<i4")]),
    "complex": _typed(FORCE, "<c16"),
    "half floats": _typed(FORCE, "<f2"),
    "booleans": _typed(FORCE, bool),
    "enumeration": _typed(FORCE, h5py.enum_dtype({"a": 0, "b": 1})),
    "opaque": _typed(FORCE, h5py.opaque_dtype(np.dtype("V4"))),
    "references": _tree(_references, truthful=False),
    "lists of numbers": _tree(
        lambda tree, _: (tree.pop(FORCE), tree.create_dataset(FORCE, (5,), h5py.vlen_dtype("i4"))),
        truthful=False,
    ),
    "texts of any length": _put("entry/events/text", ["a"], dtype=h5py.string_dtype()),
    "arrays": _of_type(lambda: h5py.h5t.array_create(h5py.h5t.STD_I32LE, (1000,))),
    "bit fields": _of_type(h5py.h5t.STD_B8LE.copy),
    "three dimensions": _put(FORCE, np.zeros((4, 4, 4), "<i4")),
    "wide rows": _put(FORCE, np.zeros((4, 9), "<i4")),
    "a table for a column": _put(FORCE, np.zeros((4, 3), "<i4")),
    "a number for a column": _put(FORCE, np.int32(3)),
    "no space": _tree(_null, truthful=False),
    "2^31 rows that are not there": _stated(1 << 31, dtype="i1", chunks=(1 << 16,)),
    "2^40 rows in one piece": _stated(1 << 40, dtype="<i8"),
    "2^31 rows, gzip": _tree(_bomb, truthful=False),
    "a chunk of 2 GB": _stated(1 << 31, dtype="i1", chunks=((1 << 31) - 8,), compression="gzip"),
    "a text of 2 GB": _stated(1, dtype=f"S{(1 << 31) - 8}"),
    "scale-offset": _put(FORCE, ROWS.astype("<i4"), scaleoffset=0, chunks=(10,)),
    "LZF": _put(FORCE, ROWS.astype("<i4"), compression="lzf"),
    "filter of somebody": _tree(_foreign_filter),
    "no document": _attribute(None),
    "document is a number": _attribute(5),
    "documents": _attribute(["{}", "{}"], dtype=h5py.string_dtype()),
    "document is no text": _attribute(np.bytes_(b"\xff\xfe{}")),
    "document is no JSON": _attribute("{"),
    "document is a list": _attribute("[]"),
    "document without end": _attribute("[" * 100_000),
    "document of 65 MB": _attribute('{"a": "' + "x" * (65 << 20) + '"}'),
    "other format": _document("format", value="other/run"),
    "newer format": _document("format_version", value=99),
    "no list of datasets": _document("datasets", value=None),
    "list of datasets is a list": _document("datasets", value=[1]),
    "facts of a dataset are a number": _document("datasets", FORCE, value=3),
    "other rows": _document("datasets", FORCE, "rows", value=3),
    "rows are text": _document("datasets", FORCE, "rows", value="3"),
    "hash is a number": _document("datasets", FORCE, "sha256", value=7),
    "hash is another": lambda folder: with_document(folder, _lying_hash),
    "numbers are others": _tree(_altered_numbers, truthful=False),
    "one dataset more": _tree(lambda tree, _: tree.__setitem__("entry/more", [1.0]), truthful=False),
    "one channel twice": _tree(_shared_storage),
    "run is a list": _document("run", value=[]),
    "id is a number": _document("run", "id", value=5),
    "kind is a list": _document("run", "kind", value=["harmonic"]),
    "reason is a list": _document("run", "reason", value=["a"]),
    "start is a number": _document("run", "started_utc", value=20260305),
    "step index is text": _document("run", "step_index", value="third"),
    "streams are a list": _document("streams", value=[]),
    "no channels": _document("streams", "controller", "channels", value=[]),
    "calibration is text": _document("streams", "controller", "channels", 0, "calibration", value="x"),
    "specimen is a list": _document("specimen", value=["B-17"]),
    "specimen's id is a table": _document("specimen", "id", value={"a": 1}),
    "specimen's stroke is text": _document("specimen", "max_stroke_mm", value="105"),
    "step is text": _document("step", value="sine"),
    "prestress is text": _document("step", "prestress_mm", value="20"),
    "frequency is a flag": _document("step", "frequency_Hz", value=True),
    "motions are a table": _document("step", "motions", value={"a": 1}),
    "an estimate is a number": _document("step", "estimates", value=[1]),
    "test is a list": _document("test", value=[1]),
    "stand is text": _document("stand", value="S-1"),
    "stand of the stand is a list": _document("stand", "stand", value=[1]),
    "thermometers are a number": _document("stand", "temperature", value=5),
    "thermometers are text": _document("stand", "temperature", value={"sensor": ["a"]}),
    "identity is a list": _document("stand", "identity", value=[1]),
    "campaign is a list": _document("campaign", value=["c"]),
    "limits are a number": _document("limits", value=3),
    "a limit is 10^308": _document("limits", value={"stand": {"force_max_kN": 1e308}}),
    "what is not guarded is text": _document("limits", value={"not_guarded": "all"}),
    "findings are a number": _document("original", value={"findings": 3}),
    "zero of another way": _document(
        "zero", value={"how": "guessed", "found": "", "taken_over": False, "channel": []}
    ),
    "zero without channels": _document("zero", value={"how": "touch"}),
    "software is a list": _document("software", value=["x"]),
    "edits are text": _document("edits", value="none"),
    "nested a thousand times": _document("note", value=json.loads("[" * 900 + "]" * 900)),
    "an event is no JSON": _event_text("{"),
    "an event is a list": _event_text("[]"),
    "an event is no text": _event_text(b"\xff{}"),
    "an event without end": _event_text("[" * 5000),
    "a stroke without its facts": _event(reached_mean_mm=3.0),
    "a stroke off by a text": _event(**{**STROKE, "off_mm": "much"}),
    "a stroke off by nothing": _event(**{**STROKE, "off_mm": None}),
    "forces without their facts": _event(reached_max_kN=3.0),
    "no events": _gone("entry/events"),
    "no anchors": _gone("entry/anchors"),
    "anchors without times": _gone("entry/anchors/host_s"),
    "events differ in length": _put("entry/events/at_s", np.zeros(99)),
    "an event at no time": _tree(
        lambda tree, _: replaced(tree, "entry/events/at_s", np.full(len(tree["entry/events/at_s"]), np.nan))
    ),
    "an anchor at the end of time": _tree(
        lambda tree, _: replaced(
            tree, "entry/anchors/device_us", np.full(len(tree["entry/anchors/host_s"]), 1 << 62)
        )
    ),
    "the kind of an event is a number": _typed("entry/events/kind", "<i4"),
    "segments begin late": _put(f"{C}/segments", np.array([[5, 0, 0]])),
    "segments go back": _put(f"{C}/segments", np.array([[0, 0, 0], [9, 9, 0], [4, 4, 0]])),
    "segments beyond the rows": _put(f"{C}/segments", np.array([[0, 0, 0], [10**9, 9, 0]])),
    "less than nothing lost": _put(f"{C}/segments", np.array([[0, 0, -3]])),
    "segments are floats": _put(f"{C}/segments", np.zeros((1, 3))),
    "segments are narrow": _put(f"{C}/segments", np.zeros((1, 2), "<i8")),
    "no segments": _gone(f"{C}/segments"),
    "no segment": _put(f"{C}/segments", np.zeros((0, 3), "<i8")),
    "shorter than its time": _put(FORCE, ROWS.astype("<i4")),
    "time is narrow": _typed(f"{C}/time_us", "<i4"),
    "time is text": _typed(f"{C}/time_us", "S4"),
    "two times": _tree(_both_clocks),
    "no time": _gone(f"{C}/time_us"),
    "force is text": _typed(FORCE, "S4"),
    "time in hours": _units(f"{C}/time_us", "h"),
    "force without unit": _units(FORCE, None),
    "unit is a number": _units(FORCE, 5),
}
"""What no command may read, whatever its seal says."""

ODD: dict[str, Case] = {
    "good": _tree(lambda *_: None, truthful=False),
    "force is always zero": _typed(FORCE, "<i4"),
    "force is no number": _tree(lambda tree, _: replaced(tree, FORCE, np.full(len(tree[FORCE]), np.nan))),
    "force is infinite": _tree(lambda tree, _: replaced(tree, FORCE, np.full(len(tree[FORCE]), np.inf))),
    "force of 10^300": _tree(lambda tree, _: replaced(tree, FORCE, np.full(len(tree[FORCE]), 1e300))),
    "time stands still": _typed(f"{C}/time_us", "<i8"),
    "time runs backwards": _tree(
        lambda tree, _: replaced(tree, f"{C}/time_us", np.flip(tree[f"{C}/time_us"][:]))
    ),
    "delay of an aeon": _document("streams", "controller", "channels", 0, "delay_s", value=1e15),
    "specimen's id is a number": _document("specimen", "id", value=815),
    "a kind that does not fit": _document("run", "kind", value="static"),
    "no facts at all": lambda folder: with_document(
        folder, lambda document: [document.pop(key) for key in ("stand", "specimen", "step", "limits")]
    ),
    "start before all time": _document("run", "started_utc", value="0000-00-00"),
    "a stroke as the report shows it": _event(**STROKE),
}  # fmt: skip
"""What is of the format, and means little: a result or a refusal, never a bug."""
