"""Faults as they are written, when they hold, and what they do to packets on the wire."""

import pytest

from sdt_tools.emulation.p3at.faults import Fault, FaultKind, Faults, parse_fault
from sdt_tools.emulation.p3at.wire import FaultyWire
from sdt_tools.errors import UsageError
from sdt_tools.robot.p3at.packets import PacketSplitter, packet

PACKETS = [packet(bytes([0x32, number])) for number in range(100)]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("button", Fault(FaultKind.BUTTON)),
        ("drop=0.25", Fault(FaultKind.DROP, 0.25)),
        ("power@5-7.5", Fault(FaultKind.POWER, 1.0, 5.0, 7.5)),
        ("battery@30", Fault(FaultKind.BATTERY, 11.0, 30.0)),
        ("split=2@1-2", Fault(FaultKind.SPLIT, 2.0, 1.0, 2.0)),
    ],
)
def test_faults_as_they_are_written(text: str, fault: Fault) -> None:
    assert parse_fault(text) == fault


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("fire", "the kinds are split, merge"),
        ("drop=", "write KIND"),
        ("drop=1.5", "a share, from 0 to 1"),
        ("merge=0", "a count, from 1 on"),
        ("power=3", "power takes no value"),
        ("stall@3-2", "it ends before it begins"),
    ],
)
def test_faults_that_are_none(text: str, words: str) -> None:
    with pytest.raises(UsageError, match=words) as refused:
        parse_fault(text)
    assert f"'{text}'" in str(refused.value)


def test_a_planned_fault_holds_for_its_time() -> None:
    faults = Faults((Fault(FaultKind.STALL, 1.0, 2.0, 3.0),))
    assert [faults.value(FaultKind.STALL, at_s) for at_s in (1.9, 2.0, 2.9, 3.0)] == [None, 1.0, 1.0, None]


def through(kind: FaultKind, value: float) -> list[bytes]:
    """The pieces in which the packets come out, with time to spare."""
    wire = FaultyWire(Faults((Fault(kind, value),)), seed=1)
    pieces = []
    for number, one in enumerate(PACKETS):
        wire.put(one, number * 10**8, number / 10)
        pieces += wire.take((number + 1) * 10**8 - 1, number / 10)
    return pieces + list(wire.take(10**12, 100.0))


def test_split_packets_come_in_pieces_and_whole() -> None:
    pieces = through(FaultKind.SPLIT, 3.0)
    assert {len(piece) for piece in pieces} == {1, 3}
    assert b"".join(pieces) == b"".join(PACKETS)


def test_merged_packets_come_together_and_whole() -> None:
    pieces = through(FaultKind.MERGE, 2.0)
    assert len(pieces) == 50
    assert b"".join(pieces) == b"".join(PACKETS)


def test_delayed_packets_come_later() -> None:
    wire = FaultyWire(Faults((Fault(FaultKind.DELAY, 0.5),)))
    wire.put(PACKETS[0], 0, 0.0)
    assert list(wire.take(499_999_999, 0.4)) == []
    assert list(wire.take(500_000_000, 0.5)) == [PACKETS[0]]


def test_dropped_packets_are_gone() -> None:
    assert 20 < 100 - len(through(FaultKind.DROP, 0.3)) < 40
    assert through(FaultKind.DROP, 1.0) == []


def test_corrupt_packets_are_recognised_as_such() -> None:
    splitter = PacketSplitter()
    heard = list(splitter.feed(b"".join(through(FaultKind.CORRUPT, 0.3))))
    assert 20 < splitter.bad_checksums < 40
    assert len(heard) == 100 - splitter.bad_checksums


def test_garbage_hides_no_packet_for_good() -> None:
    heard = list(PacketSplitter().feed(b"".join(through(FaultKind.GARBAGE, 0.5)) + bytes(300)))
    assert [packet(body) for body in heard] == PACKETS
