"""The simulated stand as a server: controller, instruments and thermometers on real wires.

The physics runs in stand time, ``speed`` times as fast as the wall. It is brought up to the present before
requests and by a task of its own; a process that was starved catches up in slices and drops nothing.
"""

from __future__ import annotations

import asyncio
import json
import os
import selectors
import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path

from bufferstand.drivers.controllers.rmc import RmcSettings
from bufferstand.drivers.instruments import FolderAddress, Instrument, Place, SerialAddress, TcpAddress
from bufferstand.drivers.register_maps import Profile
from bufferstand.drivers.simulated.build import demand_possible, make_device
from bufferstand.drivers.simulated.faults import SOCKET, FaultControl, FrameFaults, ScheduledFault
from bufferstand.drivers.simulated.machine import SimulatedDevice, TruthLog
from bufferstand.drivers.simulated.moved_stand import MovedStand, OwnController, moved_stand
from bufferstand.drivers.simulated.serving.clock import SHOWN, ShownTime
from bufferstand.drivers.simulated.serving.waiting_sign import NAME, WIRES, WaitingSign
from bufferstand.drivers.simulated.settings import Moves
from bufferstand.drivers.simulated.wires import (
    LabJackTwin,
    ModbusInstrumentWire,
    ModbusStandServer,
    RegisterBank,
    Responder,
    RmcBank,
    RtuStandServer,
    SensorWires,
    StandPace,
)
from bufferstand.drivers.stand_file import (
    Endpoints,
    StandFile,
    has_controller,
    load_recording_stand,
    load_stand,
)
from bufferstand.foundation import BadInput, Clock, WallClock

TICK_S = 0.005
"""Wall time between two looks of the background task [s]."""
LEAST_TICK_S = 0.0003
TICKS_A_POLL = 0.25
"""A stand that is polled is looked at so often in the time between two polls, within these bounds."""
SLOW_WIRES_S = 0.02
"""Time between two services of serial line and temperature files [s of the wall]; USB adapters do alike."""
FRESH_S = 0.0025
"""Age of the newest sample that a reading request is content with [s of the wall] …"""
FRESH_STAND_S = 0.05
"""… and at most [s of stand time]: a fast stand must not make its reader wait for the next look."""
CATCH_UP = 100
"""Most samples made up at once (some milliseconds), by a request or between requests."""
TURNS = 5
"""Turns of the event loop that are left to requests between two slices; pymodbus takes four for each."""


@dataclass(frozen=True)
class Served:
    """Where a simulated stand can be reached, as its endpoints file says.

    Parameters
    ----------
    host, port
        Of the controller's Modbus TCP server; empty and 0 where it is on a serial line, or answers nobody.
    w1_root, onewire_port : str or None
        Of the first thermometers, absolute, where they are a folder or on a serial line.
    speed : float
        Stand seconds in one second of the wall.
    pid : int
        Of the serving process.
    controller_serial : str or None
        The controller's serial device, absolute.
    faults_socket : str or None
        Where it takes faults (``bufferstand fault``), absolute.
    instruments : mapping
        By stream, of thermometers by the name of their wire: serial device or folder, absolute, or host and
        port.
    time_file : str or None
        Where it shows its time (:class:`bufferstand.drivers.simulated.serving.clock.StandClock`), absolute.
    acquisition : mapping
        Host and ports of acquisition devices, by stream.
    """

    host: str
    port: int
    w1_root: str | None
    speed: float
    pid: int
    controller_serial: str | None = None
    onewire_port: str | None = None
    faults_socket: str | None = None
    instruments: Mapping[str, str | tuple[str, int]] = field(default_factory=dict)
    time_file: str | None = None
    acquisition: Mapping[str, tuple[str, Sequence[int]]] = field(default_factory=dict)

    def endpoints(self) -> Endpoints:
        """Return what :func:`bufferstand.drivers.stand_file.schema.with_endpoints` needs to reach it."""
        return Endpoints(
            host=self.host,
            port=self.port,
            instruments={
                stream: Path(place) if isinstance(place, str) else TcpAddress(*place)
                for stream, place in self.instruments.items()
            },
            controller_serial=None if self.controller_serial is None else Path(self.controller_serial),
            acquisition={stream: (host, tuple(ports)) for stream, (host, ports) in self.acquisition.items()},
        )


@dataclass(frozen=True)
class ServerOptions:
    """How a stand is served.

    Parameters
    ----------
    model : Path, optional
        Spring model instead of the one that the stand file names.
    speed : float
        Stand seconds in one second of the wall.
    port : int, optional
        The controller's TCP port instead of the stand file's; 0 takes a free one, for instruments too.
    wires : Path, optional
        Folder for serial device and 1-Wire tree instead of the stand file's paths.
    truth : Path, optional
        File for what really happened, written at the end (``.npz``, else CSV).
    faults : tuple of ScheduledFault
        What shall fail, and when.
    fault_seed : int
        By which the frames are picked that a fault strikes.
    with_parent : bool
        End when standard input ends, so that no server outlives its starter.
    wait_for_reader : bool
        Let the stand wait for whoever reads its ring; above a speed of 1 it always does.
    """

    model: Path | None = None
    speed: float = 1.0
    port: int | None = None
    wires: Path | None = None
    truth: Path | None = None
    faults: tuple[ScheduledFault, ...] = ()
    fault_seed: int = 0
    with_parent: bool = False
    wait_for_reader: bool = False


class StandServer:
    """Every wire of one simulated stand.

    Parameters
    ----------
    stand_file : StandFile
    options : Options
    clock : Clock
        Stand time, ``options.speed`` times as fast as the wall's.

    Raises
    ------
    BadInput
        As :func:`bufferstand.drivers.simulated.build.make_device`.
    """

    def __init__(self, stand_file: StandFile, options: ServerOptions, clock: Clock) -> None:
        self._file = stand_file
        self._options = options
        self._truth = None if options.truth is None else TruthLog()
        self._pace = StandPace(clock, options.speed, waits=options.wait_for_reader or options.speed > 1.0)
        self.device: SimulatedDevice = make_device(
            stand_file,
            self._pace.lived_s,
            model=options.model,
            truth=self._truth,
            faults=options.faults,
            fault_seed=options.fault_seed,
        )
        profile = stand_file.profile()
        bank = self._make_bank(profile)
        device_id = stand_file.controller.device_id
        trouble = FrameFaults(self.device.faults, "controller", lambda: self.device.time_s)
        latency = self.device.latency
        responder = Responder(
            bank,
            self._before_request,
            self._cut,
            trouble,
            profile.read_write,
            lambda: latency.way_s() / options.speed,
        )
        self._pace.watch(
            self.device.ring,
            self.device.period_s,
            1 if profile.window is None else profile.ring.samples_per_block,
            lambda: responder.asker,
        )
        self._asked = asyncio.Event()
        self._tick_s = TICK_S
        self._holds = self._pace.waits and profile.poll is not None
        if profile.poll is not None:
            every_s = 1.0 / profile.poll.rate_Hz
            self._pace.expect_polls(every_s, lambda: latency.way_s() + latency.way_s())
            self._tick_s = max(LEAST_TICK_S, min(TICK_S, TICKS_A_POLL * every_s / options.speed))
        self._modbus = ModbusStandServer(responder, device_id)
        self._line = RtuStandServer(responder, device_id)
        self._sensors: SensorWires | None = None
        self._with_registers = tuple(self._register_wires())
        self._twins = tuple(
            LabJackTwin(self.device, one, self._before_request) for one in self.device.acquisition
        )
        folder = stand_file.folder / WIRES if options.wires is None else options.wires
        self._sign_file = (folder / NAME).absolute()
        self._sign: WaitingSign | None = None
        self._time_file = (folder / SHOWN).absolute()
        self._shown: ShownTime | None = None
        self._control = FaultControl(
            (folder / SOCKET).absolute(),
            self.device.faults,
            lambda: self.device.time_s,
            self._demand_possible,
        )
        self._bank = bank
        self._own_controller: OwnController | None = None
        if isinstance(stand_file, MovedStand):
            self._own_controller = OwnController(self.device, self.device.settings.moves or Moves())
        for fault in options.faults:
            self._demand_possible(fault)

    def _make_bank(self, profile: Profile) -> RegisterBank | RmcBank:
        """Return the controller's registers as its kind has them on the wire."""
        settings = self._file.controller.kind_settings
        if isinstance(settings, RmcSettings):
            names = [name for name, _ in profile.ring.sample if name != "tick"]
            return RmcBank(self.device, settings, names)
        return RegisterBank(self.device, profile, self._pace.now_s)

    def _register_wires(self) -> Iterator[tuple[Instrument, ModbusInstrumentWire]]:
        """Yield the wire of each instrument with registers."""
        for one, simulated in zip(self._file.instruments, self.device.instruments, strict=True):
            if simulated.registers is not None:
                unit = one.kind.unit(one.settings)
                yield (
                    one,
                    ModbusInstrumentWire(self.device, simulated, simulated.registers, unit, self.catch_up),
                )

    def _demand_possible(self, fault: ScheduledFault) -> None:
        demand_possible(self._file, fault)
        if isinstance(self._file, MovedStand):
            return
        self._bank.demand_register(fault)

    def _cut(self) -> bool:
        return self.device.faults.find("controller", "lost", self.device.time_s) is not None

    async def open(self) -> Served:
        """Open every wire; return where they are.

        Raises
        ------
        BadInput
            If a wire cannot be opened; none stays open then.
        """
        try:
            return await self._open()
        except BaseException:
            await self.close()
            raise

    async def _open(self) -> Served:
        wires, file = self._options.wires, self._file
        self._shown = self._show_time()
        self._sensors = SensorWires(file, self.device, wires)
        for descriptor in self._sensors.descriptors():
            asyncio.get_running_loop().add_reader(descriptor, self._serve_slow_wires)
        await self._control.start()
        ends = self._sensors.endpoints()
        places = {**ends.instruments, **await self._serve_registers()}
        line = file.controller_serial() if wires is None else wires / "controller"
        if not file.controller.serial or line is None:
            line = None
            host, port = await self._listen()
        else:
            host, port, line = "", 0, line.absolute()
            self._line.start(line)
        if self._pace.waits:
            self._sign = WaitingSign(self._sign_file, f"{host}:{port}" if line is None else str(line))
        return Served(
            host=host,
            port=port,
            w1_root=self._first_thermometers(FolderAddress, places),
            speed=self._options.speed,
            pid=os.getpid(),
            controller_serial=None if line is None else str(line),
            onewire_port=self._first_thermometers(SerialAddress, places),
            faults_socket=str(self._control.path),
            instruments={
                stream: str(place) if isinstance(place, Path) else (place.host, place.port)
                for stream, place in places.items()
            },
            time_file=str(self._time_file),
            acquisition={twin.stream: await self._serve_twin(twin) for twin in self._twins},
        )

    def _first_thermometers(
        self, wire: type[FolderAddress | SerialAddress], places: Mapping[str, Place]
    ) -> str | None:
        """Return where the first thermometers are reached, if their wire is such a one."""
        first = next(iter(self._file.thermometers), None)
        return str(places[first.stream]) if first is not None and isinstance(first.wire(), wire) else None

    def _show_time(self) -> ShownTime:
        try:
            return ShownTime(self._time_file, self._options.speed)
        except OSError as error:
            raise BadInput(f"cannot be made: {error.strerror}", file=self._time_file) from None

    async def _listen(self) -> tuple[str, int]:
        """Open the TCP port; return where it is."""
        file = self._file
        if isinstance(file, MovedStand):
            return "", 0  # it answers nobody
        port = file.controller.port if self._options.port is None else self._options.port
        host = self._own(file.controller.host, "controller.host")
        return host, await self._modbus.start(host, port)

    async def _serve_registers(self) -> dict[str, Place]:
        """Open the wires of the instruments with registers; return where they are."""
        found: dict[str, Place] = {}
        folder, port = self._options.wires, self._options.port
        for one, wire in self._with_registers:
            address, table = one.wire(), one.kind.table
            assert not isinstance(address, FolderAddress)
            if isinstance(address, TcpAddress):
                host = self._own(address.host, f"{table}.modbus.host")
                found[one.stream] = TcpAddress(
                    host, await wire.listen(host, 0 if port == 0 else address.port)
                )
            else:
                link = (address.path if folder is None else folder / one.stream).absolute()
                wire.start_line(link)
                found[one.stream] = link
        return found

    async def _serve_twin(self, twin: LabJackTwin) -> tuple[str, Sequence[int]]:
        """Open the ports of an acquisition device; return where they are."""
        settings = twin.settings
        host = self._own(settings.host, f"{twin.stream}.host")
        free = self._options.port == 0
        ports = (0, 0) if free else (settings.port, settings.stream_port)
        return host, await twin.listen(host, *ports)

    def _own(self, host: str, place: str) -> str:
        """Return the address of this machine that a stand file names; refuse any other."""
        host = "127.0.0.1" if host == "localhost" else host
        if host not in {"127.0.0.1", "::1"}:
            raise BadInput(
                f"the simulated stand serves this machine only, not {host}",
                file=self._file.path,
                place=place,
                remedy="write 127.0.0.1 there",
            )
        return host

    async def run(self, stop: asyncio.Event) -> None:
        """Keep the stand in step with the clock until ``stop`` is set."""
        loop = asyncio.get_running_loop()
        due_s = loop.time()
        while not stop.is_set():
            left = self.catch_up()
            if self._own_controller is not None:
                self._own_controller.act()
            if isinstance(self._bank, RmcBank):
                self._bank.run_program()
            for twin in self._twins:
                twin.pump()
            if loop.time() >= due_s:
                due_s = loop.time() + SLOW_WIRES_S
                self._serve_slow_wires()
            if left:
                for _ in range(TURNS):
                    await asyncio.sleep(0)
            elif self._holds:
                with suppress(TimeoutError):
                    await asyncio.wait_for(self._asked.wait(), self._tick_s)
                self._asked.clear()
            else:
                with suppress(TimeoutError):
                    await asyncio.wait_for(stop.wait(), self._tick_s)

    def _serve_slow_wires(self) -> None:
        if self._sensors is not None:
            self._sensors.serve(self.device.time_s)

    async def close(self) -> None:
        """Take every wire away and write the truth.

        Raises
        ------
        BadInput
            If the truth cannot be written.
        """
        if self._sign is not None:
            self._sign.close()
        await self._modbus.stop()
        self._line.stop()
        for _, wire in self._with_registers:
            await wire.stop()
        for twin in self._twins:
            await twin.stop()
        await self._control.stop()
        shown, self._shown = self._shown, None
        if shown is not None:
            shown.close()
        sensors, self._sensors = self._sensors, None
        if sensors is not None:
            for descriptor in sensors.descriptors():
                asyncio.get_running_loop().remove_reader(descriptor)
            sensors.close()
        if self._truth is not None and self._options.truth is not None:
            try:
                self._truth.write(self._options.truth)
            except OSError as error:
                raise BadInput(f"cannot be written: {error.strerror}", file=self._options.truth) from None
            self._truth = None

    def _before_request(self, acting: bool) -> None:
        """Bring the stand up to the present for a request.

        One that waits for who polls it stands still instead: the instant that it shows is the one at which
        its converters are read, and whoever stamps by it stamps right.
        """
        if self._holds:
            self._asked.set()
        else:
            self.catch_up(acting)

    def catch_up(self, acting: bool = True) -> int:
        """Advance towards the present by one slice; a mere reader is content with what is 2 ms old.

        Parameters
        ----------
        acting : bool
            Whether something is about to be done to the stand.

        Returns
        -------
        int
            Samples that are left to advance.
        """
        now_s = self._pace.now_s()
        if self._holds and self._shown is not None:
            # First, so that who stamps while it moves has the time at which it will be read.
            self._shown.show(min(now_s, self.device.time_s + CATCH_UP * self.device.period_s))
        fresh_s = min(FRESH_S * self._options.speed, FRESH_STAND_S)
        left = 0
        if acting or now_s - self.device.time_s >= fresh_s:
            left = self.device.advance_to(now_s, CATCH_UP)
        if self._shown is not None:
            self._shown.show(self.device.time_s)
        return left


def serve(
    stand_file: Path,
    options: ServerOptions,
    *,
    ready: Callable[[Served], None],
    signals: Sequence[signal.Signals] = (signal.SIGINT, signal.SIGTERM),
) -> None:
    """Serve a simulated stand until a signal comes (or its starter ends); blocks.

    Parameters
    ----------
    stand_file : Path
    options : Options
    ready : callable
        Told once where the stand can be reached, when every wire is open.
    signals : sequence of Signals
        What ends it.

    Raises
    ------
    BadInput
        If the stand file, the model or an option cannot be used, or a wire cannot be opened.
    """
    if not options.speed > 0.0:
        raise BadInput(f"a speed of {options.speed:g} is not possible", file="--speed", remedy="above 0")
    file = load_stand(stand_file) if has_controller(stand_file) else _moved(stand_file, options)

    async def main() -> None:
        server = StandServer(file, options, WallClock(options.speed))
        stop = asyncio.Event()
        loop = asyncio.get_running_loop()
        for number in signals:
            loop.add_signal_handler(number, stop.set)
        if options.with_parent:
            _watch_input(loop, stop)
        ready(await server.open())
        try:
            await server.run(stop)
        finally:
            await server.close()

    with asyncio.Runner(loop_factory=_quick_loop) as runner:
        runner.run(main())


def _moved(path: Path, options: ServerOptions) -> MovedStand:
    """Return a stand without ``[controller]``, which moves by itself in real time."""
    for option, wrong in (
        ("--speed", options.speed != 1.0),
        ("--wait-for-reader", options.wait_for_reader),
        ("--port", bool(options.port)),
    ):
        if wrong:
            raise BadInput(
                "a stand without [controller] moves by itself, in real time, with its devices at the ports "
                "of the stand file",
                file=option,
                remedy="leave it out" + (", or write 0 for free ports" if option == "--port" else ""),
            )
    return moved_stand(load_recording_stand(path))


def _quick_loop() -> asyncio.SelectorEventLoop:
    """Return an event loop that waits for parts of a millisecond, as epoll does not: replies take such."""
    return asyncio.SelectorEventLoop(selectors.SelectSelector())


def write_endpoints(served: Served, path: Path) -> None:
    """Write where a stand can be reached as JSON; a reader sees the whole file or none."""
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = path.with_name(f".{path.name}.new")
    fresh.write_text(json.dumps(asdict(served)) + "\n", encoding="utf-8")
    fresh.replace(path)


def _watch_input(loop: asyncio.AbstractEventLoop, stop: asyncio.Event) -> None:
    """Set ``stop`` when standard input ends: whoever held the other end is gone."""
    descriptor = sys.stdin.fileno()

    def look() -> None:
        if not os.read(descriptor, 4096):
            loop.remove_reader(descriptor)
            stop.set()

    loop.add_reader(descriptor, look)
