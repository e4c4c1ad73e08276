"""An RMC behind the names of a ring controller: a gateway in this program, without a box between.

What asks for a ring controller's registers (:class:`RingController`, ``bufferstand check``) asks this link;
what goes over the wire are an RMC's own registers. What an RMC does not keep (the number of a command, why it
was refused) is kept here; what another program must see (who may give commands, the heartbeat, the limits)
lies in the controller's variables, and the watchdog program there acts on it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

from bufferstand.drivers.controllers.rmc.addresses import MODELS, PRODUCT, VARIABLES
from bufferstand.drivers.controllers.rmc.axis import AxisCommand, AxisStatus, RmcAxis
from bufferstand.drivers.controllers.rmc.identity import find_mismatch
from bufferstand.drivers.controllers.rmc.motions import MotionBounds, MotionPort
from bufferstand.drivers.controllers.rmc.plot import PlotBlock, PlotUpload, samples_per_read
from bufferstand.drivers.controllers.rmc.program import (
    AT,
    SINE_BLOCK,
    VARIABLES_USED,
    RELEASE_SPEED_mm_per_s,
)
from bufferstand.drivers.controllers.rmc.registers import RmcRegisters
from bufferstand.drivers.controllers.rmc.settings import RmcSettings
from bufferstand.drivers.interfaces import EndReason, MotionState
from bufferstand.drivers.modbus import Exchange, ModbusLink, ModbusRefusal, Table, Wire
from bufferstand.drivers.register_maps import COMMAND, IDENTITY, STATUS, Profile
from bufferstand.foundation import DeviceFault

SET_APART_S = 0.02
"""Between writing who may give commands and looking whether it stayed so [s]: nothing compares and sets."""
ILLEGAL_VALUE = 3
WITHOUT_CHANGE, WITH_CHANGE = 1, 2
"""Editions that the gateway shows: whether a running sine can be changed."""
Check = Callable[[Sequence[int]], str]
"""Says what is doubtful about registers that were read; empty where nothing is."""
_US, _WHOLE = 1_000_000, 1 << 32
_CAUSES = {1: EndReason.WATCHDOG}
"""Why a motion has ended, by the program's ``cause``; all others are limits of the device."""
_ACTUATOR = 4


class RmcLink(ModbusLink):
    """The link of a controller, whose registers are those of the profile and whose wire is an RMC's.

    Parameters
    ----------
    wire : Wire
    profile : Profile
        Names and channels: a ring controller's, as ``rmc``. Its ring's channels are the plot's data sets.
    settings : RmcSettings
    bounds : MotionBounds
        What may be sent to the axis.
    now_s : callable
        Stand time [s].
    device_id : int
    timeout_s : float
    """

    def __init__(
        self,
        wire: Wire,
        profile: Profile,
        settings: RmcSettings,
        bounds: MotionBounds,
        *,
        now_s: Callable[[], float],
        device_id: int = 1,
        timeout_s: float = 0.5,
    ) -> None:
        super().__init__(wire, device_id=device_id, timeout_s=timeout_s, read_write=False)
        model = MODELS[settings.model]
        self._profile, self._settings, self._model = profile, settings, model
        self._registers = RmcRegisters(self._read_rmc, self._write_rmc, settings.word_order)
        self._base = VARIABLES.plus(settings.variables)
        self._axis = RmcAxis(self._registers, settings)
        self._port = MotionPort(
            self._axis,
            _Block(self),
            bounds,
            settings.change,
            now_s=self.now_s,
            sleep=self.sleep,
            note=self.note,
            patience_s=timeout_s,
        )
        self._channels = [name for name, _ in profile.ring.sample if name != "tick"]
        fits = samples_per_read(settings.largest_read, len(self._channels))
        self._samples = min(fits, profile.ring.samples_per_block)
        self._plot = PlotUpload(
            self._registers,
            model.setup(settings.plot),
            model.upload(settings.plot),
            sets=len(self._channels),
            samples=self._samples,
            now_s=now_s,
            note=self.note,
        )
        self._rate_Hz = 0.0
        self._uploading = False
        self._block: PlotBlock | None = None
        self._asked = 0
        self._control = 0
        self._kept_values: dict[str, float] = {}
        names = profile.registers.items()
        self._names = {at: name for name, r in names for at in range(r.address, r.address + r.words)}

    # --- the wire -----------------------------------------------------------------------------------

    def _read_rmc(self, address: int, count: int, what: str) -> list[int]:
        return super().read(address, count, what)

    def _write_rmc(self, address: int, values: Sequence[int], what: str, once: bool) -> None:
        super().write(address, values, what, hurry=once)

    def variable(self, name: str) -> float:
        """Get one of the program's variables."""
        return self._registers.reals(self._base.plus(AT[name]), 1, f"variable {name}")[0]

    def set_variable(self, name: str, value: float) -> None:
        """Set one of the program's variables."""
        self._registers.set_reals(self._base.plus(AT[name]), (value,), f"variable {name}")

    @cached_property
    def sine_block(self) -> int:
        """Number of the first register of the sine's status block."""
        return self._base.plus(SINE_BLOCK).number

    def _variables(self) -> dict[str, float]:
        found = self._registers.reals(self._base, VARIABLES_USED, "the watchdog program's variables")
        return dict(zip(AT, found, strict=True))

    # --- what a ring controller's driver asks -------------------------------------------------------

    @property
    def exchanges(self) -> bool:
        """An exchange is one call here, whatever it takes on the wire."""
        return True

    @property
    def trips_of_exchange(self) -> int:
        """Round trips that an exchange takes, as its reader sees it."""
        return 1

    @property
    def can_ask_ahead(self) -> bool:
        """Nothing is asked ahead: each read of a plot moves its index."""
        return False

    @property
    def has_asked_ahead(self) -> bool:
        """Nothing is."""
        return False

    def ask_ahead(self, exchange: Exchange) -> None:
        """Do nothing."""

    def read(
        self, address: int, count: int, what: str, *, table: Table = "holding", check: Check = lambda _: ""
    ) -> list[int]:
        """Get registers of the profile; see :meth:`ModbusLink.read`.

        Raises
        ------
        DeviceFault
            If the wire fails, or what answers is no RMC with the watchdog program.
        """
        del what, table
        words: list[int] = []
        found = self._values_of({self._names[at] for at in range(address, address + count)})
        at = address
        while at < address + count:
            name = self._names[at]
            words += self._profile.encode(name, found[name])
            at += self._profile.find(name).words
        if doubt := check(words):
            raise DeviceFault(f"{self.name} at {self.address}: {doubt}")
        return words[:count]

    def write(self, address: int, values: Sequence[int], what: str, *, hurry: bool = False) -> None:
        """Set registers of the profile, and do what they mean; see :meth:`ModbusLink.write`.

        Raises
        ------
        DeviceFault
            If the wire fails; ModbusRefusal if another program may give commands.
        """
        del what, hurry
        at, end, written = address, address + len(values), {}
        while at < end:
            name = self._names[at]
            words = self._profile.find(name).words
            written[name] = self._profile.decode(name, values[at - address : at - address + words])
            at += words
        self._kept_values |= written
        if "force_limit" in written or "stroke_limit" in written:
            self._set_limits(written)
        if "command_sequence" in written:
            self._arm()
        for name, value in written.items():
            self._act(name, float(value))

    def exchange(self, exchange: Exchange, *, check: Check = lambda _: "") -> list[int]:
        """Set registers of the profile and get others; see :meth:`ModbusLink.exchange`.

        Raises
        ------
        DeviceFault
            As :meth:`read` and :meth:`write`.
        """
        if exchange.read_address == self._profile.ring.address:
            return self._window(int(self._profile.decode("ring_acknowledge", exchange.values)))
        self.write(exchange.write_address, exchange.values, exchange.what)
        return self.read(exchange.read_address, exchange.read_count, exchange.what, check=check)

    # --- values -------------------------------------------------------------------------------------

    def _values_of(self, names: set[str]) -> Mapping[str, float]:
        if names & set(STATUS):
            return self._status()
        if names & (set(IDENTITY) - {"simulated"}):
            return self._identity()
        if names & set(COMMAND) or names <= {"execute", "control_word", "ring_acknowledge"}:
            return {name: self._kept_values.get(name, 0.0) for name in self._profile.registers}
        variables = self._variables()
        return {
            "force_limit": variables["force_limit"],
            "stroke_limit": variables["stroke_limit"],
            "writer": _whole(variables["writer"]) % 0x10000,
            "watchdog_feed": _whole(variables["beat"]) % 0x10000,
            "watchdog_time": _milliseconds(variables["watchdog_s"]),
            "simulated": _whole(variables["simulated"]) % 0x10000,
        }

    def _identity(self) -> Mapping[str, float]:
        """Get who answers; a wrong word order, and a program that is not loaded, are told apart."""
        product, _, cpu, revision = self._registers.reals(PRODUCT, 4, "the controller's information")
        variables = self._variables()
        model = self._model
        if mismatch := find_mismatch(
            variables,
            product,
            expected=model.product,
            model=model.name,
            order=self._settings.word_order,
            test_at=self._base.plus(AT["test"]),
        ):
            raise DeviceFault(f"{self.name} at {self.address}: {mismatch}")
        if self._samples < 1:
            raise DeviceFault(
                f"{len(self._channels)} data sets do not fit one read; write a larger largest_read"
            )
        self._rate_Hz = self._plot.rate()
        if not self._uploading:
            self._say_what_it_carries()
        expected = self._profile.find
        return {
            "device_type": expected("device_type").expect or 0,
            "profile_version": WITHOUT_CHANGE if self._settings.change is None else WITH_CHANGE,
            "test_float": expected("test_float").expect or 0.0,
            "test_integer": expected("test_integer").expect or 0,
            "serial": (_whole(variables["number"]) or _whole(65536 * cpu + revision)) % _WHOLE,
            "sample_rate": self._rate_Hz,
            "simulated": _whole(variables["simulated"]) % 0x10000,
        }

    def _say_what_it_carries(self) -> None:
        if self._rate_Hz > 0.0:
            self.note(
                f"a read of the plot gives {self._samples} samples of {len(self._channels)} data sets: "
                f"{self._rate_Hz / self._samples:.0f} reads a second are needed"
            )

    def _status(self) -> Mapping[str, float]:
        """Get one snapshot: the axis first, then what the program says of it."""
        status, variables = self._axis.look(), self._variables()
        cause = _whole(variables["cause"])
        fault = cause or (_ACTUATOR if status.halted and status.enabled else 0)
        self._port.look(status, _CAUSES.get(fault, EndReason.DEVICE_LIMIT if fault else EndReason.NONE))
        port, state = self._port, self._state(status, fault)
        return {
            "status_word": self._word(status, fault),
            "state": state,
            "fault_code": fault,
            "echo_sequence": port.echo or _whole(variables["sequence"]) % 0x10000,
            "reject_code": port.reject,
            "done_sequence": port.done,
            "cycles_done": port.cycles_done,
            "heartbeat": _whole(variables["alive"]) % 0x10000,
            "watchdog_remaining": _milliseconds(variables["left_s"]),
            "watchdog_trips": _whole(variables["trips"]) % 0x10000,
            "end_reason": port.end,
            "force": status.force_kN,
            "stroke": status.stroke_mm,
            "position": status.position_mm,
            "command": status.target_mm,
            "tick": self._plot.clock_us() % _WHOLE,
        }

    def _state(self, status: AxisStatus, fault: int) -> MotionState:
        if fault:
            return MotionState.RELEASING if status.enabled else MotionState.FAULT
        if not status.enabled:
            return MotionState.READY if self._control & 0x06 == 0x06 else MotionState.OFF
        if self._port.motion is not None:
            return self._port.motion.state
        return MotionState.HOLDING if status.done else MotionState.RAMPING

    def _word(self, status: AxisStatus, fault: int) -> int:
        """Return the state as CiA 402 has it."""
        if fault:
            return 0x022F if status.enabled else 0x0228
        if status.enabled:
            return 0x0237
        control = self._control
        if control & 0x06 != 0x06:
            return 0x0260
        return 0x0233 if control & 0x01 else 0x0231

    # --- acting -------------------------------------------------------------------------------------

    def _act(self, name: str, value: float) -> None:
        match name:
            case "control_word":
                self._switch(int(value))
            case "watchdog_feed":
                self.set_variable("beat", value)
            case "watchdog_time":
                self.set_variable("watchdog_s", value / 1000.0)
            case "writer":
                self._set_writer(int(value))
            case "execute":
                self._execute(int(value))

    def _set_limits(self, written: Mapping[str, float | int]) -> None:
        clear = {"clear": self._settings.clear_mm, "release_speed": RELEASE_SPEED_mm_per_s}
        for name, value in {**written, **clear}.items():
            if name in ("force_limit", "stroke_limit", *clear):
                self.set_variable(name, float(value))

    def _take_limits(self) -> None:
        """See by what limits a command is judged: those that the controller holds."""
        variables = self._variables()
        self._port.force_limit_kN = variables["force_limit"]
        self._port.stroke_limit_mm = variables["stroke_limit"]
        self._ready = self._axis.look()
        self._is_ready = self._ready.enabled and not self._ready.halted and not variables["cause"]

    def _arm(self) -> None:
        self._take_limits()
        values = {name: float(self._kept_values.get(name, 0.0)) for name in COMMAND}
        self._port.arm(values, self._ready, ready=self._is_ready)

    def _execute(self, sequence: int) -> None:
        self._take_limits()
        self._port.look(self._ready, EndReason.NONE)
        self._port.execute(sequence, self._ready, ready=self._is_ready)
        self.set_variable("sequence", float(sequence))

    def _switch(self, word: int) -> None:
        edge, self._control = word & ~self._control, word
        if edge & 0x80:
            self._axis.send(AxisCommand.CLEAR_FAULTS)
            self.set_variable("cause", 0.0)
        enabled = self._axis.look().enabled
        if word & 0x0B == 0x0B and not enabled:
            self._axis.enable(on=True)
        elif word & 0x0B != 0x0B and enabled:
            self._axis.enable(on=False)

    def _set_writer(self, number: int) -> None:
        """Write who may give commands; what another program holds is not taken."""
        holder = _whole(self.variable("writer"))
        if number and holder not in (0, number):
            raise ModbusRefusal(
                f"{self.name} at {self.address}: program {holder} may give commands", ILLEGAL_VALUE
            )
        self.set_variable("writer", float(number))
        if number and not holder:
            self.sleep(SET_APART_S)

    # --- samples ------------------------------------------------------------------------------------

    def _window(self, acknowledged: int) -> list[int]:
        """Return the window of a ring that begins where it is asked for."""
        if not self._uploading:
            self._plot.begin()
            self._uploading = True
        if self._block is None or self._asked != acknowledged:  # else it is asked for once more
            self._block, self._asked = self._plot.read(), acknowledged
        block = self._block
        header = {
            "first_sequence": (self._plot.next if block is None else block.first) % _WHOLE,
            "count": 0 if block is None else len(block.rows),
            "overruns": self._plot.overruns,
            "status_word": 0,
        }
        ring = self._profile.ring
        words = self._profile.ring_header.encode({name: header[name] for name, _ in ring.header})
        if block is not None:
            words += self._sample_words(block)
        return words + [0] * (ring.registers - len(words))

    def _sample_words(self, block: PlotBlock) -> list[int]:
        period_us, words = _US / self._rate_Hz, []
        layout = self._profile.ring_sample
        for number, row in enumerate(block.rows.tolist()):
            sample = dict(zip(self._channels, row, strict=True))
            sample["tick"] = round((block.first + number) * period_us) % _WHOLE
            words += layout.encode(sample)
        return words


def _whole(value: float) -> int:
    """Return a variable as a whole number; 0 for what is no number."""
    return round(value) if math.isfinite(value) else 0


def _milliseconds(seconds: float) -> int:
    """Return seconds as a register of 16 bits has them [ms]."""
    return min(0xFFFF, max(0, _whole(1000.0 * seconds)))


class _Block:
    """The status block of Sine Start, and the turn, among the program's variables."""

    def __init__(self, link: RmcLink) -> None:
        self._link = link

    @property
    def number(self) -> int:
        """Of its first register."""
        return self._link.sine_block

    def reset(self) -> None:
        """Write that no sine has begun."""
        self._link.set_variable("cycle", -1.0)

    def cycles(self) -> float:
        """Get how many cycles are done."""
        return self._link.variable("cycle")

    def set_turn(self, force_kN: float, speed_mm_per_s: float) -> None:
        """Write where a static stroke turns back by itself; the speed first."""
        self._link.set_variable("turn_speed", speed_mm_per_s)
        self._link.set_variable("turn_force", force_kN)

    def has_turned(self) -> bool:
        """Whether the watchdog program has turned since."""
        return self._link.variable("turn_force") == 0.0
