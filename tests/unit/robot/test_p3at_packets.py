"""ARCOS framing: known packets, any splitting, any garbage, any damage."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdt_tools.robot.p3at.commands import Code, decode, encode, wheels_argument, wheels_of
from sdt_tools.robot.p3at.packets import MAX_BODY, PacketSplitter, packet
from sdt_tools.robot.p3at.settings import decode_settings
from sdt_tools.robot.p3at.status import decode_status

bodies = st.binary(min_size=1, max_size=MAX_BODY)


@pytest.mark.parametrize(
    ("made", "wire"),
    [
        (packet(b"\x00"), "fa fb 03 00 00 00"),
        (packet(b"\x02"), "fa fb 03 02 00 02"),
        (encode(Code.OPEN), "fa fb 03 01 00 01"),
        (encode(Code.ENABLE, 1), "fa fb 06 04 3b 01 00 05 3b"),
        (encode(Code.VEL, 300), "fa fb 06 0b 3b 2c 01 37 3c"),
        (encode(Code.VEL, -300), "fa fb 06 0b 1b 2c 01 37 1c"),
        (packet(bytes.fromhex("32 01 02")), "fa fb 05 32 01 02 32 03"),
    ],
)
def test_known_packets(made: bytes, wire: str) -> None:
    assert made == bytes.fromhex(wire)


@given(st.lists(bodies, max_size=6), st.lists(st.integers(1, 60), min_size=1))
def test_packets_arrive_whole_wherever_the_stream_is_cut(sent: list[bytes], cuts: list[int]) -> None:
    stream, splitter, heard = b"".join(map(packet, sent)), PacketSplitter(), []
    while stream:
        cut = cuts[len(heard) % len(cuts)]
        heard += splitter.feed(stream[:cut])
        stream = stream[cut:]
    assert heard == sent
    assert (splitter.bad_checksums, splitter.skipped_bytes) == (0, 0)


@given(st.lists(st.tuples(st.binary(max_size=30).map(lambda noise: noise.replace(b"\xfa", b"\xfb")), bodies)))
def test_garbage_between_packets_is_skipped_and_counted(sent: list[tuple[bytes, bytes]]) -> None:
    splitter = PacketSplitter()
    heard = list(splitter.feed(b"".join(noise + packet(body) for noise, body in sent)))
    assert heard == [body for _, body in sent]
    assert splitter.skipped_bytes == sum(len(noise) for noise, _ in sent)


headers = st.one_of(st.binary(max_size=20), st.just(b"\xfa\xfb"), st.just(b"\xfa\xfb\x03"), bodies.map(packet))


@given(st.lists(headers, max_size=20).map(b"".join))
def test_whatever_comes_nothing_is_accepted_that_is_not_there_with_its_checksum(stream: bytes) -> None:
    for body in PacketSplitter().feed(stream):
        assert packet(body) in stream
        decode(body), decode_status(body), decode_settings(body)  # none of them raises


@given(bodies, st.data())
def test_a_packet_with_a_wrong_bit_is_not_accepted(body: bytes, data: st.DataObject) -> None:
    whole = packet(body)
    bit = data.draw(st.integers(24, 8 * len(whole) - 1))
    damaged = bytearray(whole)
    damaged[bit // 8] ^= 1 << bit % 8
    splitter = PacketSplitter()
    assert [heard for heard in splitter.feed(bytes(damaged)) if heard == body or len(heard) == len(body)] == []
    assert splitter.bad_checksums >= 1


@given(bodies)
def test_a_header_in_the_garbage_costs_no_packet(body: bytes) -> None:
    stream = b"\xfa\xfb\xc8" + packet(body) + packet(b"\x32" * 100) * 4
    assert body in PacketSplitter().feed(stream)


@given(st.integers(0, 255), st.integers(-0xFFFF, 0xFFFF))
def test_commands_come_back(code: int, argument: int) -> None:
    (body,) = PacketSplitter().feed(encode(code, argument))
    command = decode(body)
    assert command is not None
    assert (command.code, command.argument) == (code, argument)


@pytest.mark.parametrize("body", ["0b 3b 2c", "0b 77 2c 01", "0b 3b"])
def test_a_command_whose_argument_is_cut_off_or_unknown_is_none(body: str) -> None:
    assert decode(bytes.fromhex(body)) is None


@pytest.mark.parametrize(("left_mps", "right_mps"), [(0.2, -0.2), (2.54, -2.56), (0.0, 0.02)])
def test_wheel_speeds_go_in_steps_of_20_mm_a_second(left_mps: float, right_mps: float) -> None:
    assert wheels_of(wheels_argument(left_mps, right_mps)) == pytest.approx((left_mps, right_mps))


def test_left_is_the_high_byte() -> None:
    assert wheels_argument(0.2, -0.2) == 0x0AF6
