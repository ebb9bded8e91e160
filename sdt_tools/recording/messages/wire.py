"""LaserScan and CompressedImage straight to and from protobuf's wire format.

A scan is 541 doubles; building a protobuf object for it costs ten times what copying its bytes does. What is written
here is what protobuf itself would write (fields in ascending order, defaults left out), and every layout that the
specification allows is read: what is not the usual one is left to protobuf.
"""

import struct
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from google.protobuf.message import DecodeError
from jaxtyping import Float64

SECOND_NS: Final = 1_000_000_000
_VARINT, _FIXED64, _LENGTH = 0, 1, 2
_SECONDS_TAG: Final = 1 << 3 | _VARINT  # the two fields of Timestamp
_NANOS: Final = bytes((2 << 3 | _VARINT,))
_STAMP_TAG: Final = 1 << 3 | _LENGTH  # LaserScan.timestamp and CompressedImage.timestamp
_SCAN_FRAME_TAG: Final = 2 << 3 | _LENGTH
_SCAN_START_TAG: Final = 4 << 3 | _FIXED64
_SCAN_END_TAG: Final = 5 << 3 | _FIXED64
_SCAN_RANGES_TAG: Final = 6 << 3 | _LENGTH
_IMAGE_DATA_TAG: Final = 2 << 3 | _LENGTH
_IMAGE_FORMAT_TAG: Final = 3 << 3 | _LENGTH
_IMAGE_FRAME_TAG: Final = 4 << 3 | _LENGTH
_DOUBLE: Final = struct.Struct("<d")
_ZERO: Final = bytes(8)


class ScanFields(NamedTuple):
    """What we use of a foxglove.LaserScan."""

    frame_id: str
    start_angle_rad: float
    end_angle_rad: float
    ranges_m: Float64[np.ndarray, "rays"]


def varint(value: int) -> bytes:
    """``value`` ≥ 0 in base 128, least significant group first."""
    if value < 0x80:
        return bytes((value,))
    if value < 0x4000:
        return bytes((value & 0x7F | 0x80, value >> 7))
    if value < 0x20_0000:
        return bytes((value & 0x7F | 0x80, value >> 7 & 0x7F | 0x80, value >> 14))
    groups = bytearray()
    while value > 0x7F:
        groups.append(value & 0x7F | 0x80)
        value >>= 7
    groups.append(value)
    return bytes(groups)


def encode_scan(stamp_ns: int, frame_id: str, start_rad: float, end_rad: float, ranges: memoryview) -> bytes:
    """A foxglove.LaserScan; ``ranges`` are the bytes of little-endian doubles, in metres."""
    fixed = _scan_geometry(frame_id, _DOUBLE.pack(start_rad), _DOUBLE.pack(end_rad), len(ranges))
    return b"".join((_stamp_field(stamp_ns), fixed, ranges))


def encode_image(stamp_ns: int, frame_id: str, data: bytes, image_format: str) -> bytes:
    """A foxglove.CompressedImage."""
    return b"".join(
        (
            _stamp_field(stamp_ns),
            bytes((_IMAGE_DATA_TAG,)) + varint(len(data)) if data else b"",
            data,  # copied once
            _image_kind(frame_id, image_format),
        )
    )


def decode_scan(data: bytes) -> ScanFields:
    """The fields of a foxglove.LaserScan of any number of rays. Raises DecodeError where ``data`` is not one."""
    start_at, end_at, frame, ranges = -1, -1, b"", None
    at, size = 0, len(data)
    try:
        while at < size:
            tag = data[at]
            if tag in (_SCAN_START_TAG, _SCAN_END_TAG):
                if tag == _SCAN_START_TAG:
                    start_at = at + 1
                else:
                    end_at = at + 1
                at += 9
                continue
            if tag & 0x87 != _LENGTH:
                return _decode_any_scan(data)
            length, at = _read_varint(data, at + 1)
            if at + length > size:
                raise DecodeError("LaserScan: a field reaches beyond the message")
            if tag == _SCAN_FRAME_TAG:
                frame = data[at : at + length]
            elif tag == _SCAN_RANGES_TAG:
                if ranges is not None or length % 8:
                    return _decode_any_scan(data)
                ranges = np.frombuffer(data, "<f8", length // 8, at)
            at += length
        return ScanFields(
            frame.decode(),
            _DOUBLE.unpack_from(data, start_at)[0] if start_at >= 0 else 0.0,
            _DOUBLE.unpack_from(data, end_at)[0] if end_at >= 0 else 0.0,
            np.empty(0) if ranges is None else ranges,
        )
    except (IndexError, struct.error, UnicodeDecodeError):
        raise DecodeError("LaserScan: the message is cut or malformed") from None


def _decode_any_scan(data: bytes) -> ScanFields:
    scan = LaserScan.FromString(data)
    return ScanFields(scan.frame_id, scan.start_angle, scan.end_angle, np.array(scan.ranges, dtype=np.float64))


def _stamp_field(stamp_ns: int) -> bytes:
    seconds, nanos = divmod(stamp_ns, SECOND_NS)
    body = _seconds_field(seconds) + (_NANOS + varint(nanos) if nanos else b"")
    return bytes((_STAMP_TAG, len(body))) + body


@lru_cache(maxsize=4)
def _seconds_field(seconds: int) -> bytes:
    return bytes((_SECONDS_TAG,)) + varint(seconds & 0xFFFF_FFFF_FFFF_FFFF) if seconds else b""


def _bytes_field(tag: int, value: bytes) -> bytes:
    return bytes((tag,)) + varint(len(value)) + value if value else b""


def _double_field(tag: int, packed: bytes) -> bytes:
    return bytes((tag,)) + packed if packed != _ZERO else b""


@lru_cache
def _image_kind(frame_id: str, image_format: str) -> bytes:
    """What stands behind the data of an image: the same for all images of a camera."""
    return _bytes_field(_IMAGE_FORMAT_TAG, image_format.encode()) + _bytes_field(_IMAGE_FRAME_TAG, frame_id.encode())


@lru_cache
def _scan_geometry(frame_id: str, start: bytes, end: bytes, ranges_size: int) -> bytes:
    """What stands between the stamp and the ranges of a scan: the same for all scans of a sensor."""
    ranges_head = bytes((_SCAN_RANGES_TAG,)) + varint(ranges_size) if ranges_size else b""
    frame = _bytes_field(_SCAN_FRAME_TAG, frame_id.encode())
    return frame + _double_field(_SCAN_START_TAG, start) + _double_field(_SCAN_END_TAG, end) + ranges_head


def _read_varint(data: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        group = data[at]
        at += 1
        value |= (group & 0x7F) << shift
        if group < 0x80:
            return value, at
        shift += 7
        if shift > 63:
            raise DecodeError("LaserScan: a length of more than ten bytes")
