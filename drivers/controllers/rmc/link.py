"""An RMC behind the names of a ring controller: a gateway in this program, without a box between.

What asks for a ring controller's registers (:class:`RingController`, ``bufferstand check``) asks this link;
what goes over the wire are an RMC's own registers. What an RMC does not keep (the number of a command, why it
was refused) is kept here; what another program must see (who may give commands, the heartbeat, the limits)
lies in the controller's variables, and the watchdog program there acts on it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from bufferstand.drivers.controllers.rmc.addresses import MODELS, PRODUCT, VARIABLES
from bufferstand.drivers.controllers.rmc.axis import AxisCommand, RmcAxis
from bufferstand.drivers.controllers.rmc.identity import find_mismatch
from bufferstand.drivers.controllers.rmc.largest_read import MOST, find_largest_read
from bufferstand.drivers.controllers.rmc.motions import MotionBounds, MotionPort
from bufferstand.drivers.controllers.rmc.plot import PlotUpload, samples_per_read
from bufferstand.drivers.controllers.rmc.plot_window import PlotWindow
from bufferstand.drivers.controllers.rmc.program import RELEASE_SPEED_mm_per_s
from bufferstand.drivers.controllers.rmc.registers import RmcRegisters
from bufferstand.drivers.controllers.rmc.settings import RmcSettings
from bufferstand.drivers.controllers.rmc.shown_state import state_of, status_word
from bufferstand.drivers.controllers.rmc.variables import WatchdogVariables, milliseconds, whole
from bufferstand.drivers.interfaces import EndReason, Finding
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
_WHOLE = 1 << 32
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
        self._variables = WatchdogVariables(self._registers, settings.variables)
        self._axis = RmcAxis(self._registers, settings)
        self._port = MotionPort(
            self._axis,
            self._variables,
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
        self._window = PlotWindow(self._plot, profile, self._channels)
        self._control = 0
        self._kept_values: dict[str, float] = {}
        names = profile.registers.items()
        self._names = {at: name for name, r in names for at in range(r.address, r.address + r.words)}

    # --- the wire -----------------------------------------------------------------------------------

    def _read_rmc(self, address: int, count: int, what: str) -> list[int]:
        return super().read(address, count, what)

    def _write_rmc(self, address: int, values: Sequence[int], what: str, once: bool) -> None:
        super().write(address, values, what, hurry=once)

    # --- what only the hardware can tell ----------------------------------------------------------------

    def findings(self) -> Sequence[Finding]:
        """Find out, by reads alone, how many registers one read may have; the word order was seen before.

        Raises
        ------
        DeviceFault
            If the wire fails.
        """
        stated, order = self._settings.largest_read, self._settings.word_order
        found = find_largest_read(lambda count: self._read_rmc(VARIABLES.wire, count, "largest read"))
        remark = ""
        if found < 2 * (stated // 2):
            remark = f"the stand file says {stated}; write largest_read = {found} in [controller.rmc]"
        elif found > stated:
            remark = f"largest_read = {stated} asks for less than it answers: write {min(found + 1, MOST)}"
        return (
            Finding("word order", f"{order}, as the stand file says"),
            Finding(
                "largest read",
                f"{found} registers: {samples_per_read(found, len(self._channels))} samples of "
                f"{len(self._channels)} data sets",
                remark,
                {"largest_read": float(found)},
                is_wrong=found < 2 * (stated // 2),
            ),
        )

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
    def clock_doubt_s(self) -> float:
        """An RMC's status shows no clock: it is told by the sample of late that was read soonest [s]."""
        rate_Hz = self._window.rate_Hz
        return 2.0 * self._samples / rate_Hz if rate_Hz > 0.0 else 0.0

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
            return self._window.read(int(self._profile.decode("ring_acknowledge", exchange.values)))
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
        variables = self._variables.all()
        return {
            "force_limit": variables["force_limit"],
            "stroke_limit": variables["stroke_limit"],
            "writer": whole(variables["writer"]) % 0x10000,
            "watchdog_feed": whole(variables["beat"]) % 0x10000,
            "watchdog_time": milliseconds(variables["watchdog_s"]),
            "simulated": whole(variables["simulated"]) % 0x10000,
        }

    def _identity(self) -> Mapping[str, float]:
        """Get who answers; a wrong word order, and a program that is not loaded, are distinguished."""
        product, _, cpu, revision = self._registers.reals(PRODUCT, 4, "the controller's information")
        variables = self._variables.all()
        model = self._model
        if mismatch := find_mismatch(
            variables,
            product,
            expected=model.product,
            model=model.name,
            order=self._settings.word_order,
            test_at=self._variables.at("test"),
        ):
            raise DeviceFault(f"{self.name} at {self.address}: {mismatch}")
        if self._samples < 1:
            raise DeviceFault(
                f"{len(self._channels)} data sets do not fit one read; write a larger largest_read"
            )
        self._window.rate_Hz = self._plot.rate()
        if not self._window.is_uploading:
            self._say_what_it_carries()
        expected = self._profile.find
        return {
            "device_type": expected("device_type").expect or 0,
            "profile_version": WITHOUT_CHANGE if self._settings.change is None else WITH_CHANGE,
            "test_float": expected("test_float").expect or 0.0,
            "test_integer": expected("test_integer").expect or 0,
            "serial": (whole(variables["number"]) or whole(65536 * cpu + revision)) % _WHOLE,
            "sample_rate": self._window.rate_Hz,
            "simulated": whole(variables["simulated"]) % 0x10000,
        }

    def _say_what_it_carries(self) -> None:
        if self._window.rate_Hz > 0.0:
            self.note(
                f"a read of the plot gives {self._samples} samples of {len(self._channels)} data sets: "
                f"{self._window.rate_Hz / self._samples:.0f} reads a second are needed"
            )

    def _status(self) -> Mapping[str, float]:
        """Get one snapshot: the axis first, then what the program says of it."""
        status, variables = self._axis.look(), self._variables.all()
        cause = whole(variables["cause"])
        fault = cause or (_ACTUATOR if status.halted and status.enabled else 0)
        self._port.look(status, _CAUSES.get(fault, EndReason.DEVICE_LIMIT if fault else EndReason.NONE))
        port, motion = self._port, self._port.motion
        state = state_of(status, fault, self._control, None if motion is None else motion.state)
        return {
            "status_word": status_word(status, fault, self._control),
            "state": state,
            "fault_code": fault,
            "echo_sequence": port.echo or whole(variables["sequence"]) % 0x10000,
            "reject_code": port.reject,
            "done_sequence": port.done,
            "cycles_done": port.cycles_done,
            "heartbeat": whole(variables["alive"]) % 0x10000,
            "watchdog_remaining": milliseconds(variables["left_s"]),
            "watchdog_trips": whole(variables["trips"]) % 0x10000,
            "end_reason": port.end,
            "force": status.force_kN,
            "stroke": status.stroke_mm,
            "position": status.position_mm,
            "command": status.target_mm,
            "tick": self._plot.clock_us() % _WHOLE,
        }

    # --- acting -------------------------------------------------------------------------------------

    def _act(self, name: str, value: float) -> None:
        match name:
            case "control_word":
                self._switch(int(value))
            case "watchdog_feed":
                self._variables.set("beat", value)
            case "watchdog_time":
                self._variables.set("watchdog_s", value / 1000.0)
            case "writer":
                self._set_writer(int(value))
            case "execute":
                self._execute(int(value))

    def _set_limits(self, written: Mapping[str, float | int]) -> None:
        clear = {"clear": self._settings.clear_mm, "release_speed": RELEASE_SPEED_mm_per_s}
        for name, value in {**written, **clear}.items():
            if name in ("force_limit", "stroke_limit", *clear):
                self._variables.set(name, float(value))

    def _take_limits(self) -> None:
        """See by what limits a command is judged: those that the controller holds."""
        variables = self._variables.all()
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
        self._variables.set("sequence", float(sequence))

    def _switch(self, word: int) -> None:
        edge, self._control = word & ~self._control, word
        if edge & 0x80:
            self._axis.send(AxisCommand.CLEAR_FAULTS)
            self._variables.set("cause", 0.0)
        enabled = self._axis.look().enabled
        if word & 0x0B == 0x0B and not enabled:
            self._axis.enable(on=True)
        elif word & 0x0B != 0x0B and enabled:
            self._axis.enable(on=False)

    def _set_writer(self, number: int) -> None:
        """Write who may give commands; what another program holds is not taken."""
        holder = whole(self._variables.get("writer"))
        if number and holder not in (0, number):
            raise ModbusRefusal(
                f"{self.name} at {self.address}: program {holder} may give commands", ILLEGAL_VALUE
            )
        self._variables.set("writer", float(number))
        if number and not holder:
            self.sleep(SET_APART_S)
