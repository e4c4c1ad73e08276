"""A small host of FMI 2.0 over ctypes: the second tool that drives the prebuilt library, and misuses it."""

from __future__ import annotations

import ctypes
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

OK, WARNING, DISCARD, ERROR = range(4)
MODEL_EXCHANGE, CO_SIMULATION = range(2)

_Logger = ctypes.CFUNCTYPE(
    None,
    ctypes.c_void_p,
    ctypes.c_char_p,
    ctypes.c_int,
    ctypes.c_char_p,
    ctypes.c_char_p,
    ctypes.c_char_p,
)


class _Callbacks(ctypes.Structure):
    _fields_ = (
        ("logger", _Logger),
        ("allocate", ctypes.c_void_p),
        ("free", ctypes.c_void_p),
        ("finished", ctypes.c_void_p),
        ("environment", ctypes.c_void_p),
    )


class EventInfo(ctypes.Structure):
    _fields_ = (
        ("newDiscreteStatesNeeded", ctypes.c_int),
        ("terminateSimulation", ctypes.c_int),
        ("nominalsChanged", ctypes.c_int),
        ("valuesChanged", ctypes.c_int),
        ("nextEventTimeDefined", ctypes.c_int),
        ("nextEventTime", ctypes.c_double),
    )


class Refused(Exception):  # noqa: N818 - it names the fact
    """A call that did not return OK; the text holds the status and what the logger was told."""


class Host:
    """One instance of an unpacked FMU."""

    def __init__(self, folder: Path, kind: int, *, uri: str | None = None, guid: str | None = None) -> None:
        root = ET.parse(folder / "modelDescription.xml").getroot()
        self.references = {
            v.attrib["name"]: int(v.attrib["valueReference"]) for v in root.iter("ScalarVariable")
        }
        self.messages: list[str] = []
        self._library = ctypes.CDLL(str(folder / "binaries" / "linux64" / "bufferstand_spring.so"))
        self._library.fmi2Instantiate.restype = ctypes.c_void_p
        self._callbacks = _Callbacks(logger=_Logger(self._log))
        self.component = ctypes.c_void_p(
            self._library.fmi2Instantiate(
                b"spring",
                kind,
                (guid or root.attrib["guid"]).encode(),
                (uri or (folder / "resources").as_uri()).encode(),
                ctypes.byref(self._callbacks),
                0,
                0,
            )
        )
        if not self.component:
            raise Refused("; ".join(self.messages))

    def _log(self, _environment, _name, _status, _category, _form, text) -> None:
        self.messages.append(text.decode())

    def status(self, name: str, *arguments) -> int:
        """Call a function whatever it returns."""
        return int(getattr(self._library, name)(self.component, *arguments))

    def call(self, name: str, *arguments) -> None:
        status = self.status(name, *arguments)
        if status != OK:
            raise Refused(f"{name} returns {status}: {'; '.join(self.messages)}")

    def start(self, stroke: str = "", x: float = 0.0, **reals: float) -> Host:
        """Initialize with parameters, and a first stroke; Model Exchange goes on to continuous time."""
        self.call(
            "fmi2SetupExperiment", 0, ctypes.c_double(0.0), ctypes.c_double(0.0), 0, ctypes.c_double(0.0)
        )
        for name, value in reals.items():
            self.set(name, value)
        self.call("fmi2EnterInitializationMode")
        if stroke:
            self.set(stroke, x)
        self.call("fmi2ExitInitializationMode")
        return self

    def set(self, name: str, value: float) -> None:
        self.call("fmi2SetReal", self._reference(name), 1, ctypes.byref(ctypes.c_double(value)))

    def set_status(self, name: str, value: float) -> int:
        return self.status("fmi2SetReal", self._reference(name), 1, ctypes.byref(ctypes.c_double(value)))

    def switch(self, name: str, value: bool) -> None:
        self.call("fmi2SetBoolean", self._reference(name), 1, ctypes.byref(ctypes.c_int(value)))

    def get(self, name: str) -> float:
        found = ctypes.c_double()
        self.call("fmi2GetReal", self._reference(name), 1, ctypes.byref(found))
        return found.value

    def do_step(self, time: float, step: float) -> int:
        return self.status("fmi2DoStep", ctypes.c_double(time), ctypes.c_double(step), 1)

    def run(self, strokes: np.ndarray, step: float, units: str = "mm") -> np.ndarray:
        """Drive the end-of-step stroke; columns as :func:`tests.model_export.cases.stepped`."""
        force = "force_kN" if units == "mm" else "force_N"
        names = (force, "temperature_C", "sensor_temperature_C", "heat_J", "work_J", "band")
        references = (ctypes.c_uint * 6)(*(self.references[name] for name in names))
        stroke = self._reference(f"stroke_{units}")
        found, rows = (ctypes.c_double * 6)(), []
        for k, x in enumerate(strokes.tolist()):
            self.call("fmi2SetReal", stroke, 1, ctypes.byref(ctypes.c_double(x)))
            assert self.do_step(k * step, step) == OK
            self.call("fmi2GetReal", references, 6, found)
            rows.append(tuple(found))
        return np.array(rows)

    def snapshot(self) -> ctypes.c_void_p:
        kept = ctypes.c_void_p()
        self.call("fmi2GetFMUstate", ctypes.byref(kept))
        return kept

    def close(self) -> None:
        self._library.fmi2FreeInstance(self.component)

    def _reference(self, name: str):
        return ctypes.byref(ctypes.c_uint(self.references[name]))
