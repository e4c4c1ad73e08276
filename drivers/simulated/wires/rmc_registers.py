"""The simulated stand behind an RMC's registers, with the watchdog program loaded; knows no sockets.

Made of the same pages as the driver, so it proves none of them: that does the emulator of another author
(``tests/peers``). It lets a stand file of ``kind = "rmc"`` be rehearsed over the wire that it will have.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from bufferstand.drivers.controllers.rmc import (
    AT,
    MODELS,
    PRODUCT,
    TEST_VALUE,
    VARIABLES,
    VARIABLES_USED,
    AxisBit,
    AxisCommand,
    RmcAddress,
    RmcSettings,
    bytes_of,
    parse_address,
    words_of,
)
from bufferstand.drivers.interfaces import MotionState
from bufferstand.drivers.modbus import Table
from bufferstand.drivers.register_maps import SIMULATED_SIGN
from bufferstand.drivers.simulated.faults import ScheduledFault
from bufferstand.drivers.simulated.machine import (
    RATE_HZ,
    Command,
    CommandCode,
    SimulatedDevice,
    SingleWriterLock,
)
from bufferstand.foundation import BadInput

ILLEGAL_VALUE = 3
PLOT_HEAD = 5
COMMAND_ERROR = 1.0
"""Number of the last error after a command that was not obeyed: an RMC has one for each reason."""
_STEPS_ON, _STOP_AND_GO = (0x06, 0x07, 0x0F), (0x0B, 0x0F)


class RmcBank:
    """Reads and writes by an RMC's addresses; a :class:`Bank`.

    Parameters
    ----------
    device : SimulatedDevice
    settings : RmcSettings
    channels : sequence of str
        The plot's data sets.
    """

    def __init__(self, device: SimulatedDevice, settings: RmcSettings, channels: Sequence[str]) -> None:
        self._device, self._settings, self._channels = device, settings, tuple(channels)
        self._model = model = MODELS[settings.model]
        controller = device.controller
        controller.capabilities = replace(controller.capabilities, adjusts=settings.change is not None)
        self._upload, self._setup = model.upload(settings.plot), model.setup(settings.plot)
        self._writer = SingleWriterLock(device.wall_s)
        self._variables = dict.fromkeys(AT, 0.0)
        self._index, self._mode, self._asked = 0, 0, 0
        self._start = 0
        self._last_error = 0.0
        self._number = self._motion = 0
        self._requested_mm: float | None = None
        self._sine: dict[str, float] = {}
        self._transducers: dict[RmcAddress, Callable[[], float]] = {
            parse_address(settings.force): lambda: device.measured_force_kN
        }
        if settings.stroke is not None:
            self._transducers[parse_address(settings.stroke)] = lambda: device.measured_stroke_mm
        files = {7, model.commands, self._upload.file, self._setup.file, 56, 57, 58, 59}
        files |= {model.status(axis).file for axis in range(model.axes)}
        self._addresses = frozenset(
            at for file in files for at in range(RmcAddress(file, 0).wire, RmcAddress(file, 0).wire + 512)
        )

    @property
    def readable(self) -> Mapping[Table, frozenset[int]]:
        """Addresses that exist."""
        return {"holding": self._addresses, "input": frozenset()}

    @property
    def writable(self) -> frozenset[int]:
        """Addresses that can be written."""
        return self._addresses

    def is_harmless(self, address: int, count: int) -> bool:
        """Return whether a write is of the plot's upload alone."""
        start = self._upload.wire
        return start <= address and address + count <= start + 2 * PLOT_HEAD

    def is_momentary(self, addresses: range, table: Table) -> bool:
        """Return whether a read wants an axis' present state."""
        del table
        status = self._model.status(0).wire
        return status <= addresses.start < status + 512 * self._model.axes

    def demand_register(self, fault: ScheduledFault) -> None:
        """Refuse a fault of a register of the ring's profile.

        Raises
        ------
        BadInput
            If it is one.
        """
        if fault.target == "controller" and fault.kind in {"stuck", "nan"}:
            raise BadInput(
                "an RMC has no register of that name to fail",
                place=f"fault {fault}",
                remedy="take a fault of the wire or of a channel",
            )

    def run_program(self) -> None:
        """Do what the watchdog program does at each of its loops besides what the machine does by itself."""
        turn_kN, device = self._variables["turn_force"], self._device
        if turn_kN > 0.0 and device.controller.valve_on and device.measured_force_kN >= turn_kN:
            self._variables["turn_force"] = 0.0
            self._command((AxisCommand.MOVE, 0.0, self._variables["turn_speed"]))

    # --- reading ------------------------------------------------------------------------------------

    def read_packed(self, address: int, count: int, table: Table = "holding") -> bytes:
        """Return registers as they are on the wire."""
        del table
        self.run_program()
        first, skipped = divmod(address, 2)
        elements = (skipped + count + 1) // 2
        file, element = divmod(first, 256)
        values = self._elements(RmcAddress(file, element), elements)
        words = words_of(b"".join(values), self._settings.word_order)[skipped : skipped + count]
        return struct.pack(f">{count}H", *words)

    def _elements(self, at: RmcAddress, count: int) -> list[bytes]:
        if at.file == self._upload.file and at.element == 0:
            return self._plot(count)
        return [self._value(at.plus(number)) for number in range(count)]

    def _value(self, at: RmcAddress) -> bytes:
        if at == self._model.status(self._settings.axis):
            return struct.pack(">I", self._bits())
        return struct.pack(">f", self._real(at))

    def _real(self, at: RmcAddress) -> float:
        device, controller, number = self._device, self._device.controller, self._variable_number(at)
        if number is not None:
            return self._variable(number)
        if at in self._transducers:
            return self._transducers[at]()
        if at.file == PRODUCT.file:
            return float({0: self._model.product or 0, 1: 1, 3: 256}.get(at.element, 0))
        if at.file == self._setup.file:
            return {1: 4096.0, 2: 1.0 / RATE_HZ, 8: 1.0}.get(at.element, 0.0)
        if at.file != self._model.status(self._settings.axis).file:
            return 0.0
        standing = controller.command_mm if self._requested_mm is None else self._requested_mm
        return {
            2: self._last_error,
            8: device.actuator.position_mm,
            53: controller.command_mm,
            56: standing,
        }.get(at.element, 0.0)

    def _bits(self) -> int:
        controller, bits = self._device.controller, AxisBit(0)
        moves = controller.state in (MotionState.RAMPING, MotionState.WAVEFORM, MotionState.RELEASING)
        if controller.valve_on:
            bits |= AxisBit.ENABLED
        settling = self._motion and controller.valve_on and controller.done_sequence != self._motion
        if not (moves or settling):
            bits |= AxisBit.DONE | AxisBit.STOPPED
        return int(bits)

    def _variable_number(self, at: RmcAddress) -> int | None:
        number = 256 * (at.file - VARIABLES.file) + at.element - self._settings.variables
        return number if 0 <= number < VARIABLES_USED else None

    def _variable(self, number: int) -> float:
        """Return what the watchdog program has in a variable."""
        controller = self._device.controller
        name = list(AT)[number]
        own: dict[str, Callable[[], float]] = {
            "test": lambda: TEST_VALUE,
            "edition": lambda: 1.0,
            "left_s": lambda: controller.watchdog.remaining_ms / 1000.0,
            "watchdog_s": lambda: controller.watchdog.time_ms / 1000.0,
            "trips": lambda: float(controller.watchdog.trips),
            "force_limit": lambda: controller.force_limit_kN,
            "stroke_limit": lambda: controller.stroke_limit_mm,
            "cause": lambda: float(controller.fault),
            "writer": lambda: float(self._writer.number),
            "alive": lambda: float(self._device.heartbeat),
            "simulated": lambda: float(SIMULATED_SIGN),
            "number": lambda: float(self._device.settings.seed % (1 << 24)),
            "cycle": self._cycle,
        }
        return own[name]() if name in own else self._variables[name]

    def _cycle(self) -> float:
        begun = self._sine.get("begun", 0.0)
        done = self._device.controller.cycles_done
        return float(done + (done > 0)) if begun else self._variables["cycle"]

    def _plot(self, count: int) -> list[bytes]:
        """Return what the dynamic upload gives: nothing where not enough was captured."""
        ring, status = self._device.ring, 0
        wanted = self._start + self._index
        given = self._asked if ring.total - wanted >= self._asked > 0 else 0
        if self._mode == 2 and wanted < ring.oldest:
            status, given = 2, 0
        head = (self._mode | status << 4, self._asked, self._index, 1, given)
        found = [struct.pack(">I", value) for value in head]
        if given:
            _, columns = ring.window(wanted, given)
            for name in self._channels:
                found += [struct.pack(">f", float(one)) for one in columns[name]]
            self._index += given
            ring.acknowledge((wanted + given) % (1 << 32))
        return (found + [bytes(4)] * count)[:count]

    # --- writing ------------------------------------------------------------------------------------

    def write(self, address: int, values: Sequence[int]) -> int:
        """Write registers; return 0, or the exception code."""
        first, skipped = divmod(address, 2)
        if skipped or len(values) % 2:
            return ILLEGAL_VALUE
        file, element = divmod(first, 256)
        raw = bytes_of(values, self._settings.word_order)
        at = RmcAddress(file, element)
        if at == self._model.command(self._settings.axis):
            self._command(struct.unpack(f">{len(raw) // 4}f", raw))
            return 0
        for number in range(len(raw) // 4):
            self._set(at.plus(number), raw[4 * number : 4 * number + 4])
        return 0

    def _set(self, at: RmcAddress, raw: bytes) -> None:
        (whole,), (real,) = struct.unpack(">I", raw), struct.unpack(">f", raw)
        if at.file == self._upload.file:
            if at.element == 0:
                self._mode, self._index, self._start = whole & 0xF, 0, self._device.ring.total
            elif at.element == 1:
                self._asked = whole
            elif at.element == 2:
                if whole == 0:  # restarted
                    self._start = self._device.ring.total
                self._index = whole
            return
        number = self._variable_number(at)
        if number is not None:
            self._set_variable(list(AT)[number], real)

    def _set_variable(self, name: str, value: float) -> None:
        controller = self._device.controller
        self._variables[name] = value
        match name:
            case "beat":
                controller.watchdog.feed(int(value))
                self._writer.keep()
            case "watchdog_s":
                controller.watchdog.set_time(round(value * 1000.0))
            case "force_limit":
                controller.set_force_limit(value)
            case "stroke_limit":
                controller.set_stroke_limit(value)
            case "writer":
                self._writer.write(int(value))
            case "cause" if value == 0.0:
                controller.control(0)
                controller.control(0x80)
                controller.control(0)
            case "cycle":
                self._sine.pop("begun", None)

    # --- commands -----------------------------------------------------------------------------------

    def _command(self, values: Sequence[float]) -> None:
        code, parameters = int(values[0]), values[1:]
        controller = self._device.controller
        match code:
            case AxisCommand.ENABLE:
                self._motion = 0
                on = int(parameters[0]) == self._settings.enable_value
                for word in _STEPS_ON if on else (0,):
                    controller.control(word)
                self._requested_mm = None
            case AxisCommand.MOVE:
                clear = parameters[0] <= self._settings.clear_mm
                code = CommandCode.RELEASE if clear else CommandCode.RAMP
                self._begin(code, target_mm=parameters[0], speed_mm_per_s=parameters[1])
                if self._last_error == 0.0:
                    self._requested_mm = parameters[0]
            case AxisCommand.SINE:
                self._requested_mm = None
                self._begin(
                    CommandCode.HARMONIC,
                    mean_mm=parameters[0],
                    amplitude_mm=parameters[1],
                    frequency_Hz=parameters[2],
                    cycles=int(parameters[3]) - 2,  # its first and last fade in and out
                )
                if self._last_error == 0.0:
                    self._sine = {"begun": 1.0, "mean": parameters[0], "amplitude": parameters[1]}
            case AxisCommand.CHANGE:
                self._change(int(parameters[0]), parameters[1])
            case AxisCommand.STOP | AxisCommand.HOLD_HERE:
                self._requested_mm = None
                self._begin(CommandCode.HOLD)

    def _change(self, which: int, value: float) -> None:
        """Change amplitude or offset of the sine: both together, as the machine takes them."""
        codes = self._settings.change
        if codes is None or which not in (codes.amplitude, codes.offset):
            self._last_error = COMMAND_ERROR
            return
        self._sine["amplitude" if which == codes.amplitude else "next mean"] = value
        if which == codes.offset:
            self._begin(
                CommandCode.ADJUST,
                mean_mm=value,
                amplitude_mm=self._sine["amplitude"],
            )

    def _begin(self, code: CommandCode, **parameters: float) -> None:
        """Have the machine begin a motion; an RMC begins one whatever runs."""
        if code in (CommandCode.RAMP, CommandCode.HARMONIC) and self._device.controller.valve_on:
            for word in _STOP_AND_GO:
                self._device.controller.control(word)
        self._last_error = 0.0 if self._give(code, **parameters) else COMMAND_ERROR

    def _give(self, code: CommandCode, **parameters: float) -> bool:
        controller = self._device.controller
        self._number = self._number % 0xFFFF + 1
        given = {**parameters, "cycles": int(parameters.get("cycles", 0))}
        command = Command(sequence=self._number, code=code, **given)  # type: ignore[arg-type]
        taken = not controller.arm(command) and not controller.execute(self._number)
        if taken and code is not CommandCode.ADJUST:  # which stays the same motion
            self._motion = self._number
        return taken
