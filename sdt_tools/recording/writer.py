"""Recordings, written.

What is written opens again, however the process ends: in real time the open chunk goes to the operating system twice a
second and to the disk each second. A recording that runs as fast as it can leaves chunks to their size, so that equal
input gives equal bytes.
"""

import time
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Final

from sdt_tools.clock import FAST_EPOCH_NS, SECOND_NS
from sdt_tools.errors import DiskRefusedError, RecordingError
from sdt_tools.frames import CameraImage, Received
from sdt_tools.protocols import SourceInfo
from sdt_tools.recording.container.file import CHUNK_BYTES, McapFile
from sdt_tools.recording.container.reader import McapReader
from sdt_tools.recording.messages.codec import encode
from sdt_tools.recording.messages.schemas import schema_data
from sdt_tools.recording.messages.topics import topic_of
from sdt_tools.recording.session import (
    CONFIG_MEDIA_TYPE,
    CONFIG_NAME,
    SESSION,
    SOFTWARE,
    STATS,
    derived_id,
    session_metadata,
)
from sdt_tools.recording.timing.pauses import pauses_of
from sdt_tools.recording.timing.stamps import StampLog, read_stamps
from sdt_tools.recording.timing.summary import timing_entries, timing_of

FLUSH_NS: Final = SECOND_NS // 2
SYNC_NS: Final = SECOND_NS
SYNC_BYTES: Final = 16 << 20
"""As fast as it can, a recording has the disk take so much at a time while it goes on, not all of it at close."""


class RecordingWriter:
    """A recording being written; use it in a ``with`` statement, which closes the file validly whatever happens.

    ``config_toml`` is attached. Without a ``recording_id`` one is derived from source, scenario, seed, config and
    notes: give a random one to what happens once. ``realtime`` chooses crash safety (above) over equal bytes.

    Raises OutputExistsError where ``path`` exists, RecordingError naming path and cause where the disk refuses.
    """

    def __init__(
        self,
        path: Path,
        info: SourceInfo,
        config_toml: str,
        *,
        recording_id: str | None = None,
        operator: str = "",
        notes: Mapping[str, str] | None = None,
        start_ns: int = FAST_EPOCH_NS,
        realtime: bool = False,
        chunk_bytes: int = CHUNK_BYTES,
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        notes = notes or {}
        identity = (info.source, info.scenario, str(info.seed), config_toml, *(f"{k}={v}" for k, v in notes.items()))
        self.recording_id = recording_id or derived_id(*identity)
        self.path = path
        self.counts: Counter[str] = Counter()
        """Messages taken so far, by topic."""
        self._stats: dict[str, str] = {}
        self._stamps = StampLog()
        self._channels: dict[str, int] = {}
        self._realtime = realtime
        self._monotonic_ns = monotonic_ns
        self._flushed_ns = self._synced_ns = monotonic_ns()
        self._syncer = ThreadPoolExecutor(1, "recording-sync")
        self._sync: Future[None] | None = None
        self._synced_bytes = 0
        self._closed = False
        self._refused = False
        self._file = McapFile(path, SOFTWARE, chunk_bytes)
        try:
            self._file.add_metadata(SESSION, session_metadata(info, self.recording_id, operator, notes))
            self._file.add_attachment(CONFIG_NAME, CONFIG_MEDIA_TYPE, config_toml.encode(), start_ns)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> "RecordingWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    @property
    def size(self) -> int:
        """Bytes in the file so far."""
        return self._file.size

    @property
    def owed_bytes(self) -> int:
        """Bytes that the end of the file needs, and what waits in memory: about, and rather too many."""
        return self._file.end_bytes + self._file.pending

    def write(self, received: Received) -> None:
        """Take one message; it reaches the file with its chunk."""
        message = received.message
        topic = topic_of(message)
        channel_id = self._channels.get(topic.name)
        if channel_id is None:
            channel_id = self._channels[topic.name] = self._file.add_channel(
                topic.name, topic.schema, schema_data(topic.schema)
            )
        compress = not isinstance(message, CameraImage)  # JPEG does not compress
        self.counts[topic.name] += 1
        self._stamps.see(topic.name, received.received_ns, message.stamp_ns)
        try:
            self._file.add_message(channel_id, received.received_ns, message.stamp_ns, encode(message), compress)
        except DiskRefusedError:
            self._refused = True
            raise
        if self._realtime:
            self.keep_safe()
        elif self._file.size - self._synced_bytes >= SYNC_BYTES:
            self._start_sync()

    def keep_safe(self) -> None:
        """In real time, flush where half a second has passed, sync where one has; call it also when nothing arrives."""
        if not self._realtime:
            return
        now_ns = self._monotonic_ns()
        if now_ns - self._flushed_ns < FLUSH_NS:
            return
        try:
            self._file.finish_chunks()
        except DiskRefusedError:
            self._refused = True
            raise
        self._flushed_ns = now_ns
        if now_ns - self._synced_ns >= SYNC_NS and self._start_sync():
            self._synced_ns = now_ns

    def note(self, stats: Mapping[str, str]) -> None:
        """Entries for ``sdt.stats``, which is written at close."""
        self._stats.update(stats)

    def close(self) -> None:
        """Write ``sdt.stats`` and the summary, and close; may be called twice.

        Where the disk has no room for them, the last chunks are given up until there is: the file is always whole.
        """
        if self._closed:
            return
        self._closed = True
        try:
            self._syncer.shutdown(wait=True)
            self._check_sync()
        finally:
            try:
                refusal = self._finish()
            finally:
                self._file.close()
        if refusal is not None and not self._refused:
            raise refusal

    def _finish(self) -> DiskRefusedError | None:
        """End the file; what the disk said where it refused, whether or not room was made then."""
        refusal = None
        while True:
            try:
                self._file.finish_chunks()
                self._file.add_metadata(STATS, self._final_stats())
                self._file.finish()
            except DiskRefusedError as error:
                refusal = refusal or error
                if self._file.drop_last_chunk() or self._file.pending:
                    continue
            return refusal

    def _final_stats(self) -> dict[str, str]:
        kept = self._file.counts
        lost = self.counts.total() - sum(kept.values())
        timing = timing_of(self._stamps_in_file() if lost else self._stamps, pauses_of(self._stats))
        stats = {f"count.{topic}": str(count) for topic, count in kept.items()} | timing_entries(timing) | self._stats
        return stats | {"lost": str(lost)} if lost else stats

    def _stamps_in_file(self) -> StampLog:
        """For a file that holds less than was written, which only the file can tell."""
        with McapReader(self.path) as file:
            return read_stamps(file, {number: topic for topic, number in self._channels.items()})

    def _start_sync(self) -> bool:
        """Have the disk take what was handed over, in a thread; False while it is still at it."""
        if self._sync is not None and not self._sync.done():
            return False
        self._check_sync()
        self._sync = self._syncer.submit(self._file.sync)
        self._synced_bytes = self._file.size
        return True

    def _check_sync(self) -> None:
        error = self._sync.exception() if self._sync is not None else None
        if error is not None:
            raise RecordingError(f"{self.path}: the disk failed to keep what was written: {error}") from None
