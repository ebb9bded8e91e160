"""The scans of a recording as arrays: compiled code walks the chunks, and each range is copied once."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

import numpy as np
from google.protobuf.message import DecodeError
from jaxtyping import Float64, Int64

from sdt_tools.errors import RecordingError
from sdt_tools.frames import RAYS, LidarScan, Received
from sdt_tools.recording.messages.topics import LIDAR_SCAN
from sdt_tools.recording.messages.wire import decode_scan
from sdt_tools.recording.scan_kernel import copy_rows, find_messages, find_ranges
from sdt_tools.recording.series import ScanSeries, empty_series

ROW_BYTES: Final = RAYS * 8
_LAST_NS: Final = 2**63 - 1


def batches_from_chunks(
    chunks: Iterable[bytes | memoryview], channel_ids: Iterable[int], size: int, path: Path
) -> Iterator[ScanSeries]:
    """Batches of ``size`` scans, the last one smaller, from unpacked chunks that follow each other in time.

    Raises RecordingError, naming ``path``, for a scan that does not parse or has another number of rays than 541.
    """
    batch, filled = empty_series(size), 0
    wanted = np.array(sorted(channel_ids), dtype=np.int64)
    for chunk in chunks:
        found = _FoundScans(chunk, wanted, path)
        taken = 0
        while taken < len(found):
            rows = min(len(found) - taken, size - filled)
            found.copy(taken, rows, batch, filled, path)
            taken, filled = taken + rows, filled + rows
            if filled == size:
                yield batch
                batch, filled = empty_series(size), 0
    if filled:
        yield ScanSeries(batch.stamps_ns[:filled], batch.received_ns[:filled], batch.ranges_m[:filled])


def batches_from_messages(messages: Iterable[Received], size: int, path: Path) -> Iterator[ScanSeries]:
    """The same from decoded messages: for files whose chunks overlap in time."""
    batch, filled = empty_series(size), 0
    for received in messages:
        scan = received.message
        if not isinstance(scan, LidarScan):
            continue
        if scan.ranges_m.size != RAYS:
            raise _other_rays(path, scan.ranges_m.size, scan.stamp_ns)
        if max(scan.stamp_ns, received.received_ns) > _LAST_NS:
            raise _beyond_time(path)
        batch.stamps_ns[filled], batch.received_ns[filled] = scan.stamp_ns, received.received_ns
        batch.ranges_m[filled] = scan.ranges_m
        filled += 1
        if filled == size:
            yield batch
            batch, filled = empty_series(size), 0
    if filled:
        yield ScanSeries(batch.stamps_ns[:filled], batch.received_ns[:filled], batch.ranges_m[:filled])


class _FoundScans:
    """The scans in one unpacked chunk, in order of receipt."""

    def __init__(self, chunk: bytes | memoryview, channel_ids: Int64[np.ndarray, "channels"], path: Path) -> None:
        self._buffer = np.frombuffer(chunk, np.uint8)
        log_ns, publish_ns, starts, ends = find_messages(self._buffer, channel_ids)
        if np.any(log_ns < 0) or np.any(publish_ns < 0):  # what is beyond 63 bits
            raise _beyond_time(path)
        order = np.argsort(log_ns, kind="stable")
        self._log_ns, self._publish_ns = log_ns[order], publish_ns[order]
        self._starts, self._ends = starts[order], ends[order]
        self._offsets, self._lengths = find_ranges(self._buffer, self._starts, self._ends)

    def __len__(self) -> int:
        return len(self._log_ns)

    def copy(self, first: int, count: int, batch: ScanSeries, row: int, path: Path) -> None:
        """Copy ``count`` scans from ``first`` on into ``batch`` from ``row`` on."""
        source, target = slice(first, first + count), slice(row, row + count)
        offsets, lengths = self._offsets[source], self._lengths[source]
        wrong = np.flatnonzero((offsets >= 0) & (lengths != ROW_BYTES))
        if wrong.size:
            at = first + int(wrong[0])
            raise _other_rays(path, int(self._lengths[at]) // 8, int(self._publish_ns[at]))
        batch.stamps_ns[target] = self._publish_ns[source]
        batch.received_ns[target] = self._log_ns[source]
        copy_rows(self._buffer, offsets, batch.ranges_m[target].view(np.uint8))
        for place in np.flatnonzero(offsets < 0):
            batch.ranges_m[row + place] = self._parsed(first + int(place), path)

    def _parsed(self, at: int, path: Path) -> Float64[np.ndarray, "rays"]:
        stamp_ns = int(self._publish_ns[at])
        try:
            ranges = decode_scan(self._buffer[self._starts[at] : self._ends[at]].tobytes()).ranges_m
        except DecodeError as error:
            raise RecordingError(f"{path}: {LIDAR_SCAN} at {stamp_ns} ns: the data is damaged ({error})") from None
        if ranges.size != RAYS:
            raise _other_rays(path, ranges.size, stamp_ns)
        return ranges


def _beyond_time(path: Path) -> RecordingError:
    return RecordingError(
        f"{path}: a message on {LIDAR_SCAN} is stamped after the year 2262: its time is damaged; read it as messages"
    )


def _other_rays(path: Path, rays: int, stamp_ns: int) -> RecordingError:
    return RecordingError(
        f"{path}: {LIDAR_SCAN} at {stamp_ns} ns has {rays} rays, {RAYS} expected (270° in steps of 0.5°); "
        "record with that resolution"
    )
