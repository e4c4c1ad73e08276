"""A run as a pandas table or an xarray dataset, units included."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from bufferstand.foundation import BadInput, how_to_add
from bufferstand.foundation.channels import Channel
from bufferstand.recording.content import MAIN_STREAM
from bufferstand.recording.runfile.run import Run
from bufferstand.recording.runfile.stream import StreamData

if TYPE_CHECKING:
    import xarray as xr

_SUFFIX = {"kN": "kN", "mm": "mm", "mm/s": "mm_per_s", "°C": "C", "m/s²": "m_per_s2"}


def column_name(channel: Channel) -> str:
    """Return the name of a channel's column: with its unit, e.g. ``force_kN``, ``temperature_1_C``."""
    return f"{channel.name}_{_SUFFIX.get(channel.unit, channel.unit)}"


def main_stream(run: Run) -> str:
    """Return the name of the stream that holds the force, else of the first with samples.

    Raises
    ------
    BadInput
        If the run has no samples at all.
    """
    if run.has("force"):
        return run.stream_of("force").name
    for name in (MAIN_STREAM, *run.streams):
        if name in run.streams and run.streams[name].rows:
            return name
    raise BadInput("the run holds no samples", file=run.path)


def to_frame(run: Run, stream: str | None = None) -> pd.DataFrame:
    """Return a stream as a table: a row a sample, calibrated.

    Values stand at their time stamps: a channel's ``delay_s`` (``frame.attrs``) is not taken off, because
    one index serves all channels. The evaluation does, and
    ``bufferstand.evaluation.document.python_api.loops`` gives what it works on.

    Parameters
    ----------
    run : Run
        An opened run.
    stream : str, optional
        Which; by default the one that holds the force.

    Returns
    -------
    pandas.DataFrame
        Index ``time_s`` [s] of the run; columns as :func:`column_name`, NaN where there is no value; and
        ``segment``, which counts up at every interruption: never integrate from one segment into the next.
        ``attrs`` holds the run's ``id``, ``kind``, ``sha256``, the ``stream``, and ``units`` and ``delay_s``
        by column.

    Raises
    ------
    BadInput
        If there is no such stream or a dataset is damaged.
    """
    name = main_stream(run) if stream is None else stream
    data = _stream(run, name)
    columns: dict[str, Any] = {
        column_name(channel): channel.calibration.apply(data.counts[channel.name])
        for channel in data.channels.values()
    }
    starts = [segment.first_row for segment in data.segments]
    segment = np.searchsorted(starts, np.arange(data.rows), side="right") - 1
    index = pd.Index(_stamps_s(run, data), name="time_s")
    frame = pd.DataFrame(columns | {"segment": segment}, index=index)
    frame.attrs = {
        "id": run.id,
        "kind": run.kind,
        "sha256": run.sha256,
        "stream": name,
        "units": {column_name(channel): channel.unit for channel in data.channels.values()},
        "delay_s": {column_name(channel): channel.delay_s for channel in data.channels.values()},
    }
    return frame


def to_dataset(run: Run) -> xr.Dataset:
    """Return all streams of a run as one dataset; needs the extra ``xarray``.

    Returns
    -------
    xarray.Dataset
        A variable a channel, by its name, with ``units``, ``long_name``, ``delay_s``, ``place`` and
        ``calibration`` in its attributes; dimension ``time_s`` for the stream of the force and
        ``time_s_STREAM`` for the others, each with its times [s] of the run as coordinate. The run's facts
        are the dataset's attributes, so that it can be written as netCDF.

    Raises
    ------
    BadInput
        If xarray is not installed, or a dataset is damaged.
    """
    try:
        import xarray as xr  # noqa: PLC0415 - optional library
    except ImportError:
        raise BadInput(
            "a dataset needs the library xarray, which is not installed",
            remedy=f"install it: {how_to_add('xarray')}",
        ) from None
    main = main_stream(run)
    variables: dict[str, Any] = {}
    coordinates: dict[str, Any] = {}
    for name in (main, *(name for name in run.streams if name != main)):
        data = run.streams[name]
        if not data.rows:
            continue
        dimension = "time_s" if name == main else f"time_s_{name}"
        coordinates[dimension] = (dimension, _stamps_s(run, data), {"units": "s", "stream": name})
        for channel in data.channels.values():
            values = channel.calibration.apply(data.counts[channel.name])
            variables[channel.name] = (dimension, values, _attributes(channel))
    return xr.Dataset(variables, coordinates, _run_attributes(run))


def _stream(run: Run, name: str) -> StreamData:
    if name not in run.streams:
        raise BadInput(
            f"the run has no stream “{name}”", file=run.path, remedy=f"it has {', '.join(run.streams)}"
        )
    return run.streams[name]


def _stamps_s(run: Run, data: StreamData) -> Any:
    """Return a stream's time stamps on the run's time [s]: those of a channel, its delay given back."""
    channel = next(iter(data.channels.values()))
    return run.series(channel.name).time_s + channel.delay_s if data.rows else np.zeros(0)


def _attributes(channel: Channel) -> dict[str, Any]:
    return {
        "units": channel.unit,
        "long_name": f"{channel.quantity} ({channel.place})" if channel.place else channel.quantity,
        "delay_s": channel.delay_s,
        "calibration": channel.calibration.id,
        "certificate": channel.calibration.certificate,
    }


def _run_attributes(run: Run) -> dict[str, Any]:
    facts = run.metadata["run"]
    return {
        "id": run.id,
        "kind": run.kind,
        "status": run.status,
        "sha256": run.sha256,
        "specimen": str(run.specimen.get("id", "")),
        "started_utc": str(facts.get("started_utc") or ""),
        "operator": str(facts.get("operator") or ""),
        "software_version": str((run.metadata.get("software") or {}).get("version", "")),
    }
