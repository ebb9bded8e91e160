"""The scans of a recording as arrays: compiled code walks the chunks, and each range is copied once.

A message that is no scan, or whose time is no time, is left out and named in the file's damage.
"""

from collections.abc import Iterator, Set
from typing import Final

import numpy as np
from google.protobuf.message import DecodeError
from jaxtyping import Float64, Int64, UInt8

from sdt_tools.errors import RecordingError
from sdt_tools.frames import RAYS
from sdt_tools.recording.container.reader import McapReader, RawEntry, overlapping
from sdt_tools.recording.messages.topics import LIDAR_SCAN, TOPIC_BY_NAME
from sdt_tools.recording.messages.wire import decode_scan
from sdt_tools.recording.scan_kernel import END, LENGTH, LOG_NS, OFFSET, PUBLISH_NS, START, copy_scans, find_scans
from sdt_tools.recording.series import ScanSeries, empty_series

ROW_BYTES: Final = RAYS * 8
_SCHEMA: Final = TOPIC_BY_NAME[LIDAR_SCAN].schema
_LAST_NS: Final = 2**63 - 1
_BEYOND_TIME: Final = f"messages on {LIDAR_SCAN} that are stamped after the year 2262"
_OTHER_RAYS: Final = f"messages on {LIDAR_SCAN} whose number of rays is not {RAYS}"


def scan_batches(file: McapReader, channel_ids: Set[int], size: int) -> Iterator[ScanSeries]:
    """The scans on some channels of ``file`` in order of receipt, in batches of ``size``, the last one smaller.

    Raises RecordingError for a scan that has another number of rays than 541.
    """
    rays = _RayCheck(file)
    if overlapping(file.segments(channel_ids)):
        return _from_messages(file, channel_ids, size, rays)
    return _from_chunks(file, channel_ids, size, rays)


def _from_chunks(file: McapReader, channel_ids: Set[int], size: int, rays: "_RayCheck") -> Iterator[ScanSeries]:
    wanted = np.array(sorted(channel_ids), np.int64)
    batch, filled = empty_series(size), 0
    ranges = batch.ranges_m.view(np.uint8)
    for segment in file.segments(channel_ids):
        chunk = file.unpacked(segment)
        if chunk is None:
            continue
        buffer = np.frombuffer(chunk, np.uint8)
        found, usual = find_scans(buffer, wanted, ROW_BYTES)
        parsed: dict[int, Float64[np.ndarray, "rays"]] = {}
        if not usual:
            found, parsed = _sound(file, segment.offset, buffer, found, rays)
        rays.met_ours = rays.met_ours or len(found) > 0
        taken = 0
        while taken < len(found):
            rows = min(len(found) - taken, size - filled)
            copy_scans(buffer, found, taken, rows, batch.stamps_ns, batch.received_ns, ranges, filled)
            for row in parsed.keys() & range(taken, taken + rows):
                batch.ranges_m[filled + row - taken] = parsed[row]
            taken, filled = taken + rows, filled + rows
            if filled == size:
                yield batch
                batch, filled = empty_series(size), 0
                ranges = batch.ranges_m.view(np.uint8)
    if filled:
        yield _first(batch, filled)


def _from_messages(file: McapReader, channel_ids: Set[int], size: int, rays: "_RayCheck") -> Iterator[ScanSeries]:
    """The same where chunks overlap in time."""
    batch, filled = empty_series(size), 0
    for entry in file.entries(channel_ids):
        if max(entry.log_ns, entry.publish_ns) > _LAST_NS:
            file.lose(entry.offset, entry.start, entry.log_ns, _BEYOND_TIME)
            continue
        ranges_m = _parsed(file, entry)
        if ranges_m is None or not rays.fits(entry, ranges_m.size):
            continue
        batch.stamps_ns[filled], batch.received_ns[filled] = entry.publish_ns, entry.log_ns
        batch.ranges_m[filled] = ranges_m
        filled += 1
        if filled == size:
            yield batch
            batch, filled = empty_series(size), 0
    if filled:
        yield _first(batch, filled)


class _RayCheck:
    """Tells scans of another sensor, which are refused, from scans that are damaged, which are left out.

    Damage it is where no checksum vouches for the message and there are scans of 541 rays beside it.
    """

    def __init__(self, file: McapReader) -> None:
        self.met_ours = False
        self._file = file

    def fits(self, entry: RawEntry, rays: int) -> bool:
        """Whether the scan has 541 rays; where it has not and is not damaged either, RecordingError says so."""
        if rays == RAYS:
            self.met_ours = True
            return True
        if not self.met_ours or self._file.is_checked(entry.offset):
            raise RecordingError(
                f"{self._file.path}: {LIDAR_SCAN} at {entry.publish_ns} ns has {rays} rays, {RAYS} expected "
                "(270° in steps of 0.5°); record with that resolution"
            )
        self._file.lose(entry.offset, entry.start, entry.log_ns, _OTHER_RAYS)
        return False


def _sound(
    file: McapReader,
    offset: int,
    buffer: UInt8[np.ndarray, "bytes"],
    found: Int64[np.ndarray, "messages 6"],
    rays: _RayCheck,
) -> tuple[Int64[np.ndarray, "scans 6"], dict[int, Float64[np.ndarray, "rays"]]]:
    """Of what was ``found`` in the chunk at ``offset`` the scans, in order of receipt, and by row what was parsed."""
    rays.met_ours = rays.met_ours or bool(np.any(found[:, LENGTH] == ROW_BYTES))
    kept: list[Int64[np.ndarray, "6"]] = []
    parsed: dict[int, Float64[np.ndarray, "rays"]] = {}
    for row in found[np.argsort(found[:, LOG_NS], kind="stable")]:
        log_ns, publish_ns = (int(row[column]) % 2**64 for column in (LOG_NS, PUBLISH_NS))
        entry = RawEntry(log_ns, offset, int(row[START]), int(row[END]), publish_ns, 0, buffer.data)
        if max(log_ns, publish_ns) > _LAST_NS:
            file.lose(offset, entry.start, log_ns, _BEYOND_TIME)
            continue
        ranges_m = _parsed(file, entry) if row[OFFSET] < 0 else None
        if ranges_m is None and row[OFFSET] < 0:
            continue
        if not rays.fits(entry, int(row[LENGTH]) // 8 if ranges_m is None else ranges_m.size):
            continue
        if ranges_m is not None:
            parsed[len(kept)] = ranges_m
        kept.append(row)
    return np.array(kept, np.int64).reshape(-1, 6), parsed


def _parsed(file: McapReader, entry: RawEntry) -> Float64[np.ndarray, "rays"] | None:
    try:
        return decode_scan(entry.data).ranges_m
    except DecodeError:
        file.lose(entry.offset, entry.start, entry.log_ns, f"messages on {LIDAR_SCAN} that are not a valid {_SCHEMA}")
        return None


def _first(batch: ScanSeries, scans: int) -> ScanSeries:
    return ScanSeries(batch.stamps_ns[:scans], batch.received_ns[:scans], batch.ranges_m[:scans])
