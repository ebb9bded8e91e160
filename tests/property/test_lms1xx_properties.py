"""Framings and values of the LiDAR's telegrams, under whatever may come over a wire."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdt_tools.robot.lms1xx.framing import LONGEST_BODY, Dialect, framed, splitter_for
from sdt_tools.robot.lms1xx.reading import TelegramError, TextReader, reader_for
from sdt_tools.robot.lms1xx.scan_telegram import (
    Channel,
    DeviceTime,
    Encoder,
    Event,
    Position,
    ScanTelegram,
    read_scan,
    write_scan,
)
from sdt_tools.robot.lms1xx.telegram import parse_telegram
from sdt_tools.robot.lms1xx.writing import writer_for

DIALECTS = st.sampled_from(Dialect)
U8, U16, U32 = (st.integers(0, (1 << bits) - 1) for bits in (8, 16, 32))
FLOATS = st.floats(width=32, allow_nan=False)
NAMES = st.text(st.characters(min_codepoint=0x20, max_codepoint=0x7A), max_size=16)


def channels(bits: int) -> st.SearchStrategy[list[tuple]]:
    """What a channel is made of; the channel itself is made in the test, where its types are checked at random."""
    values = st.lists(st.integers(0, (1 << bits) - 1), max_size=8)
    angle = st.integers(-(1 << 31), (1 << 31) - 1)
    return st.lists(st.tuples(st.sampled_from(["DIST1", "RSSI1"]), FLOATS, FLOATS, angle, U16, values), max_size=2)


PARTS = st.fixed_dictionaries(
    {
        "numbers": st.tuples(U16, U16, U32, U32),
        "wide": channels(16),
        "narrow": channels(8),
        "encoders": st.lists(st.tuples(U32, U16), max_size=2),
        "position": st.none() | st.tuples(st.tuples(*[FLOATS] * 3), st.tuples(*[FLOATS] * 3), U8),
        "texts": st.tuples(st.none() | NAMES, st.none() | NAMES),
        "time": st.none() | st.tuples(U16, U8, U8, U8, U8, U8, U32),
        "event": st.none() | st.tuples(st.just("FDIN"), U32, U32, st.integers(-(1 << 31), (1 << 31) - 1)),
    }
)


def scan_of(parts: dict) -> ScanTelegram:
    wide, narrow = (
        tuple(Channel(*head, np.array(values, np.int64)) for *head, values in parts[key]) for key in ("wide", "narrow")
    )
    name, comment = parts["texts"]
    return ScanTelegram(
        *parts["numbers"],
        wide,
        narrow,
        encoders=tuple(Encoder(*encoder) for encoder in parts["encoders"]),
        position=parts["position"] and Position(*parts["position"]),
        device_name=name,
        comment=comment,
        time=parts["time"] and DeviceTime(*parts["time"]),
        event=parts["event"] and Event(*parts["event"]),
    )


def scan_body(dialect: Dialect, scan: ScanTelegram) -> bytes:
    fields = writer_for(dialect)
    write_scan(fields, scan)
    return fields.body("sSN LMDscandata")


def same(one: ScanTelegram, other: ScanTelegram) -> bool:
    return str(one) == str(other)


@given(DIALECTS, PARTS)
def test_a_scan_with_any_parts_comes_back_as_it_was_written(dialect: Dialect, parts: dict) -> None:
    scan = scan_of(parts)
    fields = parse_telegram(dialect, scan_body(dialect, scan)).fields
    assert same(read_scan(fields), scan)
    assert fields.at_end


@given(DIALECTS, PARTS, st.data())
def test_a_scan_that_is_cut_off_raises_or_lacks_only_what_may_be_missing(
    dialect: Dialect, parts: dict, data: st.DataObject
) -> None:
    body = scan_body(dialect, scan_of(parts))
    cut = body[: data.draw(st.integers(0, len(body) - 1))]
    with suppress(TelegramError):
        assert len(read_scan(parse_telegram(dialect, cut).fields).channels_16bit) == len(parts["wide"])


def bodies(dialect: Dialect) -> st.SearchStrategy[bytes]:
    if dialect is Dialect.B:
        return st.binary(max_size=40).map(lambda rest: b"sAN" + rest)
    return st.binary(max_size=40).map(lambda rest: b"sAN" + rest.translate(None, b"\x02\x03"))


@given(DIALECTS, st.data())
def test_telegrams_split_and_merged_anywhere_are_all_found(dialect: Dialect, data: st.DataObject) -> None:
    sent = data.draw(st.lists(bodies(dialect), max_size=5))
    stream = b"".join(framed(dialect, body) for body in sent)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=8)))
    splitter = splitter_for(dialect)
    found = []
    for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        found += splitter.feed(stream[start:end])
    assert found == sent
    assert (splitter.damaged, splitter.skipped, splitter.pending) == (0, 0, b"")


@given(DIALECTS, st.binary(max_size=100), st.integers(1, 7))
def test_no_bytes_whatever_break_a_splitter_or_a_reader(dialect: Dialect, noise: bytes, step: int) -> None:
    splitter = splitter_for(dialect)
    for start in range(0, len(noise), step):
        for body in splitter.feed(noise[start : start + step]):
            with suppress(TelegramError):
                read_scan(parse_telegram(dialect, body).fields)
    assert len(splitter.pending) + splitter.skipped <= len(noise)


@given(DIALECTS, st.binary(max_size=60), st.lists(st.just(b"sAN Run 1"), min_size=2, max_size=3))
def test_behind_garbage_the_stream_is_found_again(dialect: Dialect, noise: bytes, sent: list[bytes]) -> None:
    splitter = splitter_for(dialect)
    found = splitter.feed(noise + b"".join(framed(dialect, body) for body in sent))
    assert found[-len(sent) + 1 :] == sent[1:]


@given(st.data())
def test_no_binary_telegram_with_a_byte_changed_is_taken(data: st.DataObject) -> None:
    frame = bytearray(framed(Dialect.B, scan_body(Dialect.B, scan_of(data.draw(PARTS)))))
    place = data.draw(st.integers(0, len(frame) - 1))
    frame[place] ^= data.draw(st.integers(1, 255))
    follower = framed(Dialect.B, b"sAN Run \x01")
    found = splitter_for(Dialect.B).feed(bytes(frame) + follower)
    assert found == [b"sAN Run \x01"]


@pytest.mark.parametrize("dialect", Dialect)
def test_a_telegram_without_an_end_is_given_up_at_last(dialect: Dialect) -> None:
    splitter = splitter_for(dialect)
    endless = b"\x02sAN" if dialect is Dialect.A else b"\x02\x02\x02\x02\x00\x00\xff\xffsAN"
    splitter.feed(endless)
    for _ in range(20):
        splitter.feed(b"x" * (LONGEST_BODY // 16))
    assert len(splitter.pending) < LONGEST_BODY
    assert splitter.damaged == 1
    assert splitter.feed(framed(dialect, b"sAN Run 1")) == [b"sAN Run 1"]


@given(st.integers(-(1 << 31), (1 << 31) - 1))
def test_numbers_are_the_same_in_hexadecimal_and_with_a_sign(value: int) -> None:
    assert TextReader(b"%X" % (value & 0xFFFFFFFF)).signed(32) == value
    assert TextReader(b"%+d" % value).signed(32) == value
    if value >= 0:
        assert TextReader(b"%+d" % value).unsigned(32) == value


@given(st.lists(st.tuples(U16, st.booleans()), min_size=1, max_size=20))
def test_lists_may_mix_both_ways_to_write_a_number(mixed: list[tuple[int, bool]]) -> None:
    text = b" ".join(b"%+d" % value if signed else b"%x" % value for value, signed in mixed)
    assert TextReader(text).array(16, len(mixed)).tolist() == [value for value, _ in mixed]


@given(DIALECTS, st.binary(max_size=30), st.sampled_from(["unsigned", "signed", "real", "string", "array"]))
@settings(max_examples=200)
def test_values_are_read_or_refused(dialect: Dialect, data: bytes, kind: str) -> None:
    reader = reader_for(dialect, data)
    arguments = {"unsigned": (16,), "signed": (32,), "array": (8, 3)}.get(kind, ())
    with suppress(TelegramError):
        getattr(reader, kind)(*arguments)
