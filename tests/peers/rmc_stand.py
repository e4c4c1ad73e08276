"""A stand with the RMC of another author: the watchdog program in its loop, and a laboratory's stand file.

The program is that of ``drivers/controllers/rmc/watchdog_program.txt``, step by step, as RMCTools runs it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from bufferstand.drivers.controllers.rmc.program import AT, EDITION, TEST_VALUE
from tests.peers.delta_rmc import RmcController, RmcServer, SpecimenFacts, Unsaid

VARIABLES = 100
SETS = ("force", "position", "target", "position")
"""Data sets of plot 0: the draw wire is the position here."""
REARM, MOVE, ENABLE = 103, 20, 97
RATE_mm_per_s2 = 5000.0


class WatchedRmc(RmcController):
    """An RMC with the watchdog program loaded.

    Parameters
    ----------
    with_program : bool
        Whether the laboratory has loaded it.
    **facts
        Of :class:`RmcController`.
    """

    def __init__(self, *, with_program: bool = True, simulated: float = 0.0, **facts: object) -> None:
        self._loaded, self._simulated = with_program, simulated
        super().__init__(plots=(SETS,), **facts)  # type: ignore[arg-type]
        self._start()

    def reset(self) -> None:
        """Boot anew: the program starts from its first step."""
        super().reset()
        self._start()

    def _start(self) -> None:
        """Steps 0 and 0a."""
        self._last, self._left_s, self._silent_s, self._part_s, self._step = 0.0, 0.0, 0.0, 0.0, 1
        self._last_writer = 0.0
        if not self._loaded:
            return
        for name, value in (
            ("test", TEST_VALUE),
            ("edition", float(EDITION)),
            ("simulated", self._simulated),
        ):
            self._put(name, value)
        self._issue(0, REARM, (0.0,))

    def _get(self, name: str) -> float:
        return self.variable(VARIABLES + AT[name])

    def _put(self, name: str, value: float) -> None:
        self.set_variable(VARIABLES + AT[name], value)

    def _watch(self) -> None:
        """Run one loop of the program; the emulator calls it at each."""
        if not self._loaded:
            return
        self._count()
        enabled = self.axis.enabled
        if self._step == 1 and enabled:
            if self._get("cause") == 0.0:
                self._look()
            turn_kN = self._get("turn_force")
            if self._get("cause") == 0.0 and turn_kN > 0.0 and self.felt_kN >= turn_kN:
                back = (0.0, self._get("turn_speed"), RATE_mm_per_s2, RATE_mm_per_s2, 0.0)
                self._issue(0, MOVE, back)
                self._put("turn_force", 0.0)
            if self._get("cause") > 0.0:
                self._issue(
                    0,
                    MOVE,
                    (self._get("clear"), self._get("release_speed"), RATE_mm_per_s2, RATE_mm_per_s2, 0.0),
                )
                self._step = 3
        elif self._step == 3 and self.axis.status >> 9 & 1:
            self._issue(0, ENABLE, (0.0,))
            self._step = 1

    def _count(self) -> None:
        self._part_s += self.loop_s
        if self._part_s >= 0.01:
            self._part_s -= 0.01
            self._put("alive", (self._get("alive") + 1.0) % 65536.0)
        beat = self._get("beat")
        if beat != self._last:
            self._last, self._left_s, self._silent_s = beat, self._get("watchdog_s"), 0.0
        else:
            self._left_s, self._silent_s = max(0.0, self._left_s - self.loop_s), self._silent_s + self.loop_s
        self._put("left_s", self._left_s)
        if self._get("writer") != self._last_writer:
            self._last_writer, self._silent_s = self._get("writer"), 0.0
        if self._silent_s > 10.0:
            self._put("writer", 0.0)

    def _look(self) -> None:
        if self._get("watchdog_s") > 0.0 and self._left_s == 0.0:
            self._put("cause", 1.0)
            self._put("trips", self._get("trips") + 1.0)
        if self.felt_kN > 1.02 * self._get("force_limit"):
            self._put("cause", 2.0)
        if self.axis.position_mm > self._get("stroke_limit") + 1.0:
            self._put("cause", 3.0)
        if self.axis.halted:
            self._put("cause", 4.0)


PROFILE_SAMPLE = '["tick:u32", "force:f32", "position:f32", "command:f32", "stroke_1:f32"]'
_CHANNEL = """
[[controller.channel]]
name = "{name}"
quantity = "{quantity}"
unit = "{unit}"
place = "of the peer"
calibration = {{ id = "{name}", coefficients = [0.0, 1.0], certificate = "peer", date = "2026-01-15", \
valid_until = "2099-01-15" }}
uncertainty = {{ zero = 0.05, u_delay_s = 2e-5 }}
"""


def write_rmc_stand(
    folder: Path,
    port: int,
    *,
    word_order: str = "little",
    change: str = "change = { amplitude = 1, offset = 2, ramp_cycles = 1 }",
    more: Sequence[str] = (),
) -> Path:
    """Write the stand file, and the profile that says what the plot samples; give the former."""
    shipped = Path(__file__).parents[2] / "drivers" / "register_maps" / "profiles" / "rmc.toml"
    text = shipped.read_text(encoding="utf-8")
    before, _, after = text.partition("sample = ")
    (folder / "plot.toml").write_text(
        before + f"sample = {PROFILE_SAMPLE}\n" + after.partition("\n")[2], encoding="utf-8"
    )
    extra = "\n".join(more)
    stand = f"""
[stand]
id = "peer-rmc"
name = "An RMC that was written from the manual"
laboratory = "peers"

[limits]
force_max_kN = 600.0
stroke_max_mm = 110.0
frequency_max_Hz = 2.55
speed_max_mm_per_s = 800.0

[controller]
kind = "rmc"
profile = "plot.toml"
host = "127.0.0.1"
port = {port}
timeout_s = 0.5
watchdog_s = 2.0

[controller.rmc]
model = "rmc150"
axis = 0
plot = 0
word_order = "{word_order}"
variables = {VARIABLES}
force = "%MD9.8"
clear_mm = -5.0
acceleration_mm_per_s2 = {RATE_mm_per_s2}
{change}
{extra}
"""
    for name, quantity, unit in (
        ("force", "force", "kN"),
        ("position", "position", "mm"),
        ("command", "command", "mm"),
        ("stroke_1", "stroke", "mm"),
    ):
        stand += _CHANNEL.format(name=name, quantity=quantity, unit=unit)
    path = folder / "stand.toml"
    path.write_text(stand, encoding="utf-8")
    return path


@dataclass(frozen=True)
class RmcStand:
    """An emulator that runs, and the stand file that leads to it."""

    server: RmcServer
    path: Path

    @property
    def rmc(self) -> WatchedRmc:
        """What is behind the wire."""
        assert isinstance(self.server.controller, WatchedRmc)
        return self.server.controller


@contextmanager
def rmc_stand(
    folder: Path,
    unsaid: Unsaid | None = None,
    *,
    with_program: bool = True,
    specimen: SpecimenFacts | None = None,
    **stand: str,
) -> Iterator[RmcStand]:
    """Run the emulator in this process, with a stand file in a folder."""
    rmc = WatchedRmc(with_program=with_program, unsaid=unsaid or Unsaid(), specimen=specimen)
    with RmcServer(rmc) as server:
        yield RmcStand(server, write_rmc_stand(folder, server.address[1], **stand))  # type: ignore[arg-type]
