"""The controller: its loop, its registers, its commands and the user program that watches the heartbeat."""

from __future__ import annotations

import random
import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace

from tests.peers.delta_rmc.addresses import AXIS_STATUS, MODELS, VARIABLES
from tests.peers.delta_rmc.axis import Axis, AxisFacts
from tests.peers.delta_rmc.plot import Plot
from tests.peers.delta_rmc.specimen import Specimen, SpecimenFacts
from tests.peers.delta_rmc.targets import RefusedError
from tests.peers.delta_rmc.unsaid import Unsaid

CONTROLLER_INFO = 7
PARAMETERS = 10
"""Registers of an axis in the command area: command and nine parameters (help “RMC Commands Overview”)."""
QUANTITIES = ("position", "force", "target", "force_2")


@dataclass(frozen=True)
class UserProgram:
    """The short program that a laboratory loads: it stops the axis when the heartbeat stands still.

    Parameters
    ----------
    heartbeat, timeout_s, tripped : int
        Variables that hold the heartbeat, the time allowed [s] (0: not armed), and 1 after a stop.
    stop_rate_mm_per_s2 : float
        Rate of the stop. After it the axis is disabled.
    """

    heartbeat: int = 0
    timeout_s: int = 1
    tripped: int = 2
    stop_rate_mm_per_s2: float = 2000.0


class RmcController:
    """An RMC with a position axis (0) and a reference force axis (1), which push a spring.

    Parameters
    ----------
    model : str
        "RMC75" or "RMC150".
    loop_s : float
        Loop time of the controller [s].
    plot_period_s : float
        Sample Period of every plot [s].
    plots : sequence of sequence of str
        For each plot the data sets of its template: "position" [mm], "force" [kN], "target" [mm].
    data_map : sequence of (int, int)
        Files and elements that the indirect data map gathers, as set up in RMCTools.
    program : UserProgram or None
        What was loaded.
    noise_kN : float
        Standard deviation of the force input's noise.
    force_sign : float
        −1 where compression reads negative at the input.
    seed : int
    """

    def __init__(
        self,
        model: str = "RMC150",
        *,
        loop_s: float = 1e-3,
        plot_period_s: float = 1e-3,
        plots: Sequence[Sequence[str]] = (("position", "force", "target"),),
        data_map: Sequence[tuple[int, int]] = (),
        program: UserProgram | None = None,
        axis: AxisFacts | None = None,
        specimen: SpecimenFacts | None = None,
        noise_kN: float = 0.02,
        force_sign: float = 1.0,
        unsaid: Unsaid | None = None,
        seed: int = 1,
    ) -> None:
        self.model, self.unsaid, self.loop_s = MODELS[model], unsaid or Unsaid(), loop_s
        self._plot_sets = tuple(tuple(names) for names in plots)
        self._period_loops = max(round(plot_period_s / loop_s), 1)
        self._data_map = dict(enumerate(data_map))
        self._program, self._axis_facts = program, axis or AxisFacts()
        self._specimen_facts, self._noise_kN = specimen or SpecimenFacts(), noise_kN
        self._force_sign, self._random = force_sign, random.Random(seed)
        self.boots = 0
        self.truth: list[tuple[float, float, float]] = []
        self.log: list[tuple[float, int, tuple[float, ...]]] = []
        self._boot(self._axis_facts.start_mm)

    @property
    def _information(self) -> dict[int, int]:
        """Product, state, CPU module and its revision (p. 1110, which shows the RMC150's)."""
        return {0: 2, 1: 1, 2: 16, 3: 256} if self.model.name == "RMC150" else {}

    def _boot(self, start_mm: float) -> None:
        self.boots += 1
        self.loops = 0
        self.axis = Axis(replace(self._axis_facts, start_mm=start_mm), self.unsaid)
        self.specimen = Specimen(self._specimen_facts)
        self.force_kN = self.specimen.force_kN(start_mm)
        self.felt_kN = self._force_sign * self.force_kN
        self.plots = [Plot(sets, self._period_loops, self.unsaid) for sets in self._plot_sets]
        self._command_area = [0.0] * (PARAMETERS * self.model.axes)
        self._variables = [0] * (4 * 256)
        self._beat, self._beat_age_s = 0, 0.0

    def reset(self) -> None:
        """Boot anew, as after a power cut: loop open, no plot, variables zero, the piston where it was."""
        self._boot(self.axis.position_mm)

    @property
    def time_s(self) -> float:
        """Time since the start, by the controller's loops [s]."""
        return self.loops * self.loop_s

    def step(self) -> None:
        """Advance by one loop."""
        self.loops += 1
        self.axis.step(self.loop_s, self.force_kN)
        self.force_kN = self.specimen.force_kN(self.axis.position_mm)
        self.felt_kN = self._force_sign * (self.force_kN + self._random.gauss(0.0, self._noise_kN))
        if self.loops % self._period_loops == 0:
            self.truth.append((self.time_s, self.axis.position_mm, self.force_kN))
            for plot in self.plots:
                plot.sample(tuple(self._quantity(name) for name in plot.sets))
        self._watch()
        self._show_sine()

    def _quantity(self, name: str) -> float:
        values = (self.axis.position_mm, self.felt_kN, self.axis.target_mm, self.felt_kN)
        return values[QUANTITIES.index(name)]

    def _watch(self) -> None:
        program = self._program
        if program is None:
            return
        beat = self._variables[program.heartbeat]
        self._beat_age_s = 0.0 if beat != self._beat else self._beat_age_s + self.loop_s
        self._beat = beat
        allowed = self.variable(program.timeout_s)
        if allowed > 0.0 and self._beat_age_s > allowed and self.axis.enabled:
            if self.axis.closed and self.variable(program.tripped) == 0.0:
                self.axis.stop(program.stop_rate_mm_per_s2)
                self.set_variable(program.tripped, 1.0)
            elif self.axis.status >> 9 & 1:
                self.axis.enable(False)

    def _show_sine(self) -> None:
        axis = self.axis
        if axis.sine is not None and axis.sine_block is not None:
            for step, value in enumerate(axis.sine.status()):
                self.set_variable(axis.sine_block + step, value)

    def variable(self, number: int) -> float:
        """Give a variable's current value, as REAL."""
        return _real(self._variables[number])

    def set_variable(self, number: int, value: float) -> None:
        """Set a variable, as REAL."""
        self._variables[number] = _bits(value)

    def read(self, file: int, element: int) -> int:
        """Give one register of 32 bits (of an upload area: `read_upload`)."""
        file, element = self.model.low(file, element)
        if file == self.model.data_map:
            place = self._data_map.get(element)
            return 0 if place is None else self.read(*place)
        if VARIABLES <= file < VARIABLES + 4:
            return self._variables[256 * (file - VARIABLES) + element]
        if AXIS_STATUS <= file < AXIS_STATUS + self.model.axes:
            return self._axis_register(file - AXIS_STATUS, element)
        if file == CONTROLLER_INFO or (file == self.model.controller and element == 10):
            time_or_info = self._information.get(element, 0) if file == CONTROLLER_INFO else self.time_s
            return _bits(float(time_or_info))  # _Time: p. 782
        number = file - self.model.plot_status
        if 0 <= number < len(self.plots):
            return self._plot_register(self.plots[number], element)
        return 0  # the command area is write-only

    def _axis_register(self, axis: int, element: int) -> int:
        if axis == 1:
            return _bits({8: self.felt_kN}.get(element, 0.0)) if element > 1 else 0
        if axis > 1:
            return 0
        if element == 0:
            return self.axis.status
        if element == 1:
            return self.axis.errors
        values = {
            2: float(self.axis.last_error),
            8: self.axis.position_mm,
            9: self.axis.speed_mm_per_s,
            33: max(-10.0, min(10.0, self.axis.speed_mm_per_s / 80.0)),
            53: self.axis.target_mm,
            56: self.axis.command_mm,  # Command Position (p. 899)
        }
        return _bits(values.get(element, 0.0))

    def _plot_register(self, plot: Plot, element: int) -> int:
        values = {2: plot.period_loops * self.loop_s, 8: plot.identity, 9: plot.state, 10: plot.captured}
        return _bits(float(values.get(element, 0)))

    def upload(self, file: int) -> Plot | None:
        """Give the plot whose upload area a file is, if it is one."""
        number = file - self.model.plot_upload
        return self.plots[number] if 0 <= number < len(self.plots) else None

    def read_upload(self, plot: Plot, count: int) -> list[int]:
        """Give an upload area from its register 0 on."""
        head, data = plot.read(count - 5)
        return (head + [_bits(value) for value in data] + [0] * count)[:count]

    def write(self, registers: Sequence[tuple[int, int, int]]) -> None:
        """Write registers (file, element, 32 bits); a command is issued once all have their values."""
        issued = set()
        for at_file, at_element, bits in registers:
            file, element = self.model.low(at_file, at_element)
            plot = self.upload(file)
            if plot is not None:
                plot.write(element, bits)
            elif file == self.model.commands and element < len(self._command_area):
                self._command_area[element] = _real(bits)
                if element % PARAMETERS == 0:
                    issued.add(element // PARAMETERS)
            elif VARIABLES <= file < VARIABLES + 4:
                self._variables[256 * (file - VARIABLES) + element] = bits
        for axis in sorted(issued):
            area = self._command_area[PARAMETERS * axis : PARAMETERS * (axis + 1)]
            self._issue(axis, round(area[0]), tuple(area[1:]))

    def _issue(self, axis: int, command: int, words: tuple[float, ...]) -> None:
        self.log.append((self.time_s, command, words))
        try:
            if axis == 0 or command in (0, 4, 7, 8, 98, 99, 103):
                self._carry_out(command, words)
        except RefusedError:
            self.axis.last_error = self.unsaid.command_error_number
            self.axis.errors |= 1 << self.unsaid.command_error_bit

    def _carry_out(self, command: int, words: tuple[float, ...]) -> None:
        axis = self.axis
        if command in (0, 98, 99):
            return
        stops = {1: 2000.0, 6: words[0]}
        simple = {
            4: axis.clear_faults,
            5: axis.hold,
            7: lambda: axis.enable(True),
            8: self._fault_controller,
            67: lambda: axis.enable(words[0] != 0.0),
            97: lambda: axis.enable(words[0] != 0.0),
            20: lambda: axis.move(words[0], words[1], words[2], words[3]),
            21: lambda: self._move_relative(words),
            72: lambda: self._start_sine(words),
            73: lambda: axis.running_sine().stop_at(round(words[0])),
            80: lambda: self._change_target(words),
            103: lambda: self._plot(words[0]).rearm(),
        }
        if command in simple:
            simple[command]()
        elif command in stops:
            axis.stop(stops[command])
        elif command in (2, 3, 9, 22):
            axis.direct_output_halt()
        else:
            raise RefusedError(f"command {command}")

    def _fault_controller(self) -> None:
        self.axis.direct_output_halt()
        self.axis.enable(False)

    def _move_relative(self, words: tuple[float, ...]) -> None:
        axis = self.axis
        base = {0: axis.command_mm, 1: axis.position_mm, 2: axis.target_mm}.get(round(words[4]))
        if base is None:
            raise RefusedError("relative to what")
        axis.move(base + words[0], words[1], words[2], words[3])

    def _start_sine(self, words: tuple[float, ...]) -> None:
        self.axis.start_sine(words[0], words[1], words[2], words[3], round(words[4]))
        number = round(words[5])
        # A register address as integer: file × 4096 + element, of the variable table (p. 779).
        self.axis.sine_block = None if number == 0 else 256 * (number // 4096 - VARIABLES) + number % 4096

    def _change_target(self, words: tuple[float, ...]) -> None:
        names, kinds = self.unsaid.target_parameters, self.unsaid.ramp_types
        which, kind = round(words[0]), round(words[2])
        if not (0 <= which < len(names) and 0 <= kind < len(kinds)):
            raise RefusedError("no such parameter or ramp")
        self.axis.running_sine().change(names[which], words[1], kinds[kind], words[3])

    def _plot(self, number: float) -> Plot:
        if not 0 <= round(number) < len(self.plots):
            raise RefusedError(f"plot {number}")
        return self.plots[round(number)]


def _bits(value: float) -> int:
    return int(struct.unpack(">I", struct.pack(">f", value))[0])


def _real(bits: int) -> float:
    return float(struct.unpack(">f", struct.pack(">I", bits))[0])
