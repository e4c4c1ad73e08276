"""The right to give commands: taken, kept, fed and lost, register by register."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from bufferstand.drivers.controllers.writer_lock import ELSEWHERE, LOOK_S, WriterLock
from bufferstand.drivers.controllers.writer_notice import NoticeBoard
from bufferstand.drivers.modbus import Exchange, ModbusRefusal
from bufferstand.foundation import DeviceFault, NotInCharge

OWN, OTHER = 17, 4711
WRITER, FEED = 100, 200


class Controller:
    """Stands where the registers do: writer, heartbeat and watchdog, and who asked for what."""

    def __init__(self, writer: int | None = 0) -> None:
        self.writer = writer
        self.asked: list[str] = []
        self.now_s = 10.0
        self.exchanges = True
        self.refuses: set[str] = set()
        self.replies: list[int] = []
        self.status: dict[str, Any] = {}
        self.profile = SimpleNamespace(
            has=lambda name: name == "writer" and writer is not None,
            find=lambda name: SimpleNamespace(address={"writer": WRITER, "watchdog_feed": FEED}[name]),
        )
        self.name, self.address = "controller", "127.0.0.1:502 unit 1"
        self.fed: list[int] = []

    @property
    def link(self) -> Any:
        return SimpleNamespace(
            name=self.name,
            address=self.address,
            exchanges=self.exchanges,
            now_s=lambda: self.now_s,
            read=self._read,
            exchange=self._exchange,
        )

    def _read(self, address: int, count: int, what: str) -> list[int]:  # noqa: ARG002
        assert (address, count) == (WRITER, 1)
        self.asked.append("look")
        return [self.replies.pop(0) if self.replies else self.writer or 0]

    def _exchange(self, exchange: Exchange) -> list[int]:
        assert (exchange.read_address, exchange.read_count, exchange.write_address) == (WRITER, 1, FEED)
        self.asked.append("exchange")
        if "exchange" in self.refuses:
            raise ModbusRefusal("function 23 is not taken", 1)
        self.fed += exchange.values
        return [self.replies.pop(0) if self.replies else self.writer or 0]

    def ask_again(self, ask: Callable[[], Any]) -> Any:
        return ask()

    def let_it_look(self) -> None:
        self.asked.append("wait")

    def set(self, name: str, value: int) -> None:
        self.asked.append(f"{name} = {value}")
        if name in self.refuses:
            raise ModbusRefusal("no", 3)
        if name == "writer":
            self.writer = value
        else:
            self.fed.append(value)

    def read_status(self) -> dict[str, Any]:
        return self.status

    def read_back(self, first: str, last: str) -> list[int]:
        assert first == last
        return {"watchdog_feed": [55, 0], "watchdog_time": [2500, 0]}[first]

    def fault(self, problem: str) -> DeviceFault:
        return DeviceFault(f"{self.name} at {self.address}: {problem}")


def lock_of(controller: Controller, board: NoticeBoard | None = None, number: int | None = OWN) -> WriterLock:
    return WriterLock(controller, number, board)  # type: ignore[arg-type]


def held(controller: Controller, board: NoticeBoard | None = None) -> WriterLock:
    lock = lock_of(controller, board)
    lock.claim()
    controller.asked.clear()
    return lock


def boards(folder: Path) -> tuple[NoticeBoard, NoticeBoard]:
    address = "127.0.0.1:502 unit 1"
    return NoticeBoard(address, "this", folder), NoticeBoard(address, "that", folder)


def test_a_free_lock_is_taken_and_seen_to_be_taken() -> None:
    controller = Controller()
    lock = lock_of(controller)
    assert not lock.held
    lock.claim()
    assert lock.held
    assert controller.asked == ["look", f"writer = {OWN}", "wait", "look"]
    assert controller.writer == OWN


def test_a_number_that_was_left_in_the_controller_is_taken_again() -> None:
    controller = Controller(OWN)
    held(controller)
    assert controller.writer == OWN


@pytest.mark.parametrize("drawn", [0, 0xFFFE])
def test_a_program_without_a_number_draws_one_that_is_not_0(
    drawn: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def below(most: int) -> int:
        assert most == 0xFFFF
        return drawn

    monkeypatch.setattr("secrets.randbelow", below)
    assert lock_of(Controller(), number=None).number == drawn + 1
    assert lock_of(Controller(), number=5).number == 5


def test_another_programs_lock_is_left_alone_and_said() -> None:
    controller = Controller(OTHER)
    lock = lock_of(controller)
    with pytest.raises(DeviceFault, match=rf"another program \(number {OTHER}, this one is {OWN}\)") as said:
        lock.claim()
    assert f"{ELSEWHERE} (number {OTHER}); end that program, or wait" in str(said.value)
    assert controller.asked == ["look"]
    assert controller.writer == OTHER
    assert not lock.held


def test_a_program_that_was_quicker_has_it() -> None:
    controller = Controller()
    controller.refuses.add("writer")
    controller.replies = [0, OTHER]
    with pytest.raises(DeviceFault, match=f"number {OTHER}"):
        lock_of(controller).claim()


def test_a_register_that_takes_nothing_is_a_wrong_profile() -> None:
    controller = Controller()
    controller.refuses.add("writer")
    with pytest.raises(DeviceFault, match="it does not take register writer; look at the register profile"):
        lock_of(controller).claim()


def test_who_has_it_looks_and_takes_nothing_again() -> None:
    controller = Controller()
    lock = held(controller)
    lock.claim()
    assert controller.asked == ["look"]


def test_one_wrong_reply_loses_nothing_and_two_lose_the_lock() -> None:
    controller = Controller()
    lock = held(controller)
    controller.replies = [OTHER]
    lock.confirm()
    assert lock.held
    assert controller.asked == ["look", "look"]
    controller.replies = [OTHER, OTHER]
    with pytest.raises(NotInCharge, match=f"number {OTHER}.* has taken over; nothing more is sent to it"):
        lock.confirm()
    assert not lock.held


def test_a_lost_lock_stays_lost_until_it_is_claimed_anew() -> None:
    controller = Controller()
    lock = held(controller)
    controller.writer = 0
    with pytest.raises(NotInCharge, match="it has dropped this program's right to give commands"):
        lock.claim()
    for forbidden in (
        lock.claim,
        lock.confirm,
        lock.keep,
        lock.demand,
        lock.demand_recent,
        lambda: lock.feed(1),
    ):
        controller.asked.clear()
        with pytest.raises(NotInCharge, match="dropped"):
            forbidden()
        assert controller.asked == []
    assert controller.fed == []
    lock.claim_anew()
    assert (lock.held, controller.writer) == (True, OWN)


def test_a_start_takes_it_whatever_was_known_of_it() -> None:
    controller = Controller()
    lock = held(controller)
    lock.take()
    assert controller.asked == ["look", "look"], "it has it"
    controller.writer = 0
    lock.take()
    assert (lock.held, controller.writer) == (True, OWN)
    fresh = Controller()
    other = lock_of(fresh)
    other.take()
    assert fresh.asked == ["look", f"writer = {OWN}", "wait", "look"]
    assert other.held


def test_without_the_lock_nothing_is_demanded_of_the_controller() -> None:
    controller = Controller()
    lock = lock_of(controller)
    for demand in (lock.demand, lock.demand_recent, lock.confirm, lambda: lock.feed(1)):
        with pytest.raises(
            NotInCharge, match="this program has not the right to give it commands; nothing was sent"
        ) as said:
            demand()
        assert str(said.value).startswith("controller at 127.0.0.1:502 unit 1: this program")
    assert controller.asked == []
    lock.keep()
    assert (lock.held, controller.writer) == (True, OWN)


def test_the_lock_is_asked_for_again_where_it_was_seen_too_long_ago() -> None:
    assert LOOK_S == 1.0
    controller = Controller()
    lock = held(controller)
    for call in (lock.demand_recent, lock.keep):
        controller.now_s += LOOK_S
        call()
        assert controller.asked == [], "just so long ago is recent"
        controller.now_s += 0.125
        call()
        assert controller.asked == ["look"]
        controller.asked.clear()
    controller.now_s += 5.0
    controller.writer = OTHER
    with pytest.raises(NotInCharge):
        lock.keep()


def test_behind_a_pause_the_lock_is_seen_before_the_heartbeat_is_written() -> None:
    controller = Controller()
    lock = held(controller)
    lock.feed(7)
    assert (controller.asked, controller.fed) == (["exchange"], [7])
    controller.now_s += 0.9
    lock.feed(8)
    controller.now_s += 0.9
    lock.feed(9)
    assert controller.asked == ["exchange"] * 3, "each heartbeat has seen it"
    controller.now_s += 1.1
    lock.feed(10)
    assert controller.asked == ["exchange"] * 3 + ["look", "exchange"]
    controller.now_s += 1.1
    controller.writer = OTHER
    with pytest.raises(NotInCharge):
        lock.feed(11)
    assert controller.fed == [7, 8, 9, 10]


def test_a_heartbeat_that_sees_another_is_confirmed_before_the_lock_counts_as_lost() -> None:
    controller = Controller()
    lock = held(controller)
    controller.replies = [OTHER]
    lock.feed(1)
    assert controller.asked == ["exchange", "look"]
    assert lock.held
    controller.writer = OTHER
    with pytest.raises(NotInCharge):
        lock.feed(2)
    assert not lock.held


def test_where_function_23_is_refused_the_heartbeat_goes_by_itself_from_then_on() -> None:
    controller = Controller()
    lock = held(controller)
    controller.refuses.add("exchange")
    lock.feed(1)
    lock.feed(2)
    assert controller.asked == ["exchange", "watchdog_feed = 1", "watchdog_feed = 2"]
    without = Controller()
    without.exchanges = False
    lock = held(without)
    lock.feed(3)
    assert without.asked == ["watchdog_feed = 3"]
    none = Controller(None)
    lock = held(none)
    lock.feed(4)
    assert none.asked == ["watchdog_feed = 4"]


def test_giving_back_frees_only_the_own_lock() -> None:
    controller = Controller()
    lock = held(controller)
    lock.give_back()
    assert controller.asked == ["look", "writer = 0", "wait"]
    assert (controller.writer, lock.held) == (0, False)
    controller.asked.clear()
    lock.give_back()
    assert controller.asked == [], "it has none any more"
    lock.claim()
    controller.asked.clear()
    controller.writer = OTHER
    lock.give_back()
    assert (controller.writer, controller.asked) == (OTHER, ["look"])


def test_who_else_has_it_is_only_read() -> None:
    controller = Controller(OTHER)
    lock = lock_of(controller)
    assert lock.other_holder() == OTHER
    controller.status = {"watchdog_remaining": 1500}
    seen = lock.seen()
    assert (seen.number, seen.who) == (OTHER, f"{ELSEWHERE} (number {OTHER})")
    assert (seen.process_lives, seen.feed, seen.watchdog_s, seen.left_s) == (None, 55, 2.5, 1.5)
    controller.status, controller.writer = {}, 0
    seen = lock.seen()
    assert (seen.number, seen.who, seen.left_s) == (0, "", None)
    controller.writer = OWN
    assert lock.other_holder() == 0
    assert lock_of(Controller(None)).other_holder() is None
    assert lock_of(Controller(None)).seen().number is None
    assert not any("=" in asked for asked in controller.asked)


def test_the_notice_says_which_program_has_it(tmp_path: Path) -> None:
    own, other = boards(tmp_path)
    other.put(OTHER)
    controller = Controller(OTHER)
    lock = lock_of(controller, own)
    seen = lock.seen()
    assert seen.process_lives is True
    assert ", that, since " in seen.who
    assert seen.who.endswith(f"(number {OTHER})")
    with pytest.raises(DeviceFault, match="that, since"):
        lock.claim()
    controller.writer = 0
    lock.claim()
    assert other.find(OWN) is not None
    lock.give_back()
    assert other.find(OWN) is None


def test_a_lock_that_is_lost_takes_its_notice_away(tmp_path: Path) -> None:
    own, other = boards(tmp_path)
    controller = Controller()
    lock = held(controller, own)
    assert other.find(OWN) is not None
    controller.writer = OTHER
    with pytest.raises(NotInCharge):
        lock.confirm()
    assert other.find(OWN) is None


def test_without_a_register_a_file_locks_for_the_programs_of_this_computer(tmp_path: Path) -> None:
    own, other = boards(tmp_path)
    controller = Controller(None)
    first, second = lock_of(controller, own), lock_of(controller, other)
    first.claim()
    assert first.held
    assert second.other_holder() == OWN
    assert first.other_holder() is None
    first.confirm()
    assert controller.asked == [], "there is no register to look at"
    with pytest.raises(
        DeviceFault, match=r"another program gives it commands: .*, this, since .*; end that program"
    ):
        second.claim()
    assert not second.held
    assert second.seen().who.endswith(f"(number {OWN})")
    first.give_back()
    assert controller.asked == []
    second.claim()
    assert second.held
    second.give_back()


def test_one_who_locks_and_has_posted_nothing_is_an_unknown_program(tmp_path: Path) -> None:
    own, other = boards(tmp_path)
    assert other.lock()
    lock = lock_of(Controller(None), own)
    with pytest.raises(DeviceFault, match="an unknown program of this computer, which has posted no notice"):
        lock.claim()
    other.remove()
    plain = lock_of(Controller(None))
    plain.claim()
    assert plain.held, "without a board nobody knows of anybody"
    plain.give_back()
