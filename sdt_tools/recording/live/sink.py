"""Where a recording's messages go: straight into the file, or through queues to a thread that writes it."""

import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Final, Protocol, runtime_checkable

from sdt_tools.frames import LogEntry, Received
from sdt_tools.recording.live.disk import DiskSpace, DiskWatch
from sdt_tools.recording.live.drops import DropLog
from sdt_tools.recording.live.pressure import QueueLimits, StreamQueues
from sdt_tools.recording.messages.topics import topic_of
from sdt_tools.recording.writer import RecordingWriter

_IDLE_S: Final = 0.1
_GIVE_UP_S: Final = 2.0


@runtime_checkable
class Sink(Protocol):
    """Takes messages for one file. ``finish`` comes once, after the last of them."""

    path: Path
    recording_id: str

    @property
    def size(self) -> int:
        """Bytes in the file so far."""
        ...

    @property
    def counts(self) -> Mapping[str, int]:
        """Messages written so far, by topic."""
        ...

    @property
    def dropped(self) -> Mapping[str, int]:
        """Messages given up so far, by topic."""
        ...

    @property
    def space(self) -> DiskSpace | None:
        """Room on the disk, where it is watched."""
        ...

    @property
    def failure(self) -> Exception | None:
        """What the file's writer has raised in a thread, if it has."""
        ...

    def write(self, received: Received) -> None:
        """Take one message. Raises what the file's writer raised."""
        ...

    def drop(self, topic: str, received_ns: int) -> None:
        """Count a message that was given up on its way here."""
        ...

    def keep_safe(self) -> None:
        """To be called often, also when nothing arrives. Raises what the file's writer raised."""
        ...

    def bursts(self, now_ns: int, at_end: bool = False) -> list[LogEntry]:
        """Entries about what was dropped, one a burst."""
        ...

    def finish(self) -> None:
        """Wait until all that was taken is with the writer, which is the caller's to close. Never raises."""
        ...


class DirectSink:
    """Writes at once: for recordings that run as fast as they can, where waiting costs nothing."""

    space: DiskSpace | None = None
    failure: Exception | None = None

    def __init__(self, writer: RecordingWriter) -> None:
        self.path = writer.path
        self.recording_id = writer.recording_id
        self._drops = DropLog()
        self._writer = writer

    @property
    def size(self) -> int:
        """Bytes in the file so far."""
        return self._writer.size

    @property
    def counts(self) -> Mapping[str, int]:
        """Messages written so far, by topic."""
        return dict(self._writer.counts)

    @property
    def dropped(self) -> Mapping[str, int]:
        """Messages given up on their way here: none, where pictures are encoded at once."""
        return dict(self._drops.counts)

    def write(self, received: Received) -> None:
        """Write one message."""
        self._writer.write(received)

    def drop(self, topic: str, received_ns: int) -> None:
        """Count it."""
        self._drops.drop(topic, received_ns)

    def keep_safe(self) -> None:
        """Flush and sync where it is time."""
        self._writer.keep_safe()

    def bursts(self, now_ns: int, at_end: bool = False) -> list[LogEntry]:
        """Entries about what was dropped, one a burst."""
        return self._drops.due(now_ns, at_end)

    def finish(self) -> None:
        """Nothing waits."""


class QueuedSink:
    """Compresses and writes in a thread of its own, so that the disk does not delay who calls.

    The queues and who gives way in them are described in ``pressure``. Until ``finish`` the writer belongs to the
    thread. Where the writer fails, what waits and what still comes is dropped, and ``write`` and ``keep_safe`` raise
    the failure.
    """

    def __init__(
        self, writer: RecordingWriter, limits: QueueLimits | None = None, disk: DiskWatch | None = None
    ) -> None:
        self.path = writer.path
        self.recording_id = writer.recording_id
        self._writer = writer
        self._disk = disk or DiskWatch(writer.path)
        self._changed = threading.Condition()
        self._queues = StreamQueues(limits)
        self._drops = DropLog()
        self.failure: Exception | None = None
        """What the writer raised in the thread."""
        self._ending = False
        self._thread = threading.Thread(target=self._run, name="recording-writer", daemon=True)
        self._thread.start()

    @property
    def size(self) -> int:
        """Bytes in the file so far."""
        return self._writer.size

    @property
    def counts(self) -> Mapping[str, int]:
        """Messages written so far, by topic."""
        return dict(self._writer.counts)

    @property
    def dropped(self) -> Mapping[str, int]:
        """Messages given up so far, by topic."""
        with self._changed:
            return dict(self._drops.counts)

    @property
    def space(self) -> DiskSpace | None:
        """Room on the disk as the thread saw it last."""
        return self._disk.space

    def write(self, received: Received) -> None:
        """Queue one message; never waits."""
        with self._changed:
            victim = received if self.failure is not None else self._queues.put(received)
            if victim is not None:
                self._drop(victim)
            self._changed.notify()
        self.keep_safe()

    def drop(self, topic: str, received_ns: int) -> None:
        """Count a message that was given up on its way here."""
        with self._changed:
            self._drops.drop(topic, received_ns)

    def keep_safe(self) -> None:
        """Raise what the thread has met; it flushes by itself."""
        if self.failure is not None:
            raise self.failure

    def bursts(self, now_ns: int, at_end: bool = False) -> list[LogEntry]:
        """Entries about what was dropped, one a burst."""
        with self._changed:
            return self._drops.due(now_ns, at_end)

    def finish(self) -> None:
        """Wait until the queues are empty and the thread has ended; a second Ctrl-C gives up what waits."""
        with self._changed:
            self._ending = True
            self._changed.notify()
        try:
            self._thread.join()
        except BaseException:
            with self._changed:
                self._give_up()
            self._thread.join(_GIVE_UP_S)
            raise

    def _drop(self, received: Received) -> None:
        self._drops.drop(topic_of(received.message).name, received.received_ns)

    def _give_up(self) -> None:
        while (waiting := self._queues.take()) is not None:
            self._drop(waiting)

    def _run(self) -> None:
        try:
            while self._write_next():
                self._writer.keep_safe()
                with self._changed:
                    waiting_bytes = self._queues.size_bytes
                self._disk.look(self._writer.size, self._writer.owed_bytes + waiting_bytes)
        except Exception as failure:
            with self._changed:
                self.failure = failure
                self._give_up()

    def _write_next(self) -> bool:
        """Write what has waited longest, or wait a moment for something to come; whether to go on."""
        with self._changed:
            received = self._queues.take()
            if received is None:
                if self._ending:
                    return False
                self._changed.wait(_IDLE_S)
                return True
        self._writer.write(received)
        return True
