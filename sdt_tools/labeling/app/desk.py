"""What the app works on: the recording's frames, one read at a time, and the journal, written before anything moves."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Protocol, runtime_checkable

import numpy as np
import polars as pl

from sdt_tools.errors import RecordingError
from sdt_tools.frames import CameraImage, LidarScan, Received
from sdt_tools.labeling.app.state import State, Turn, applied, heard
from sdt_tools.labeling.frame_labels import UNSAID, Speaker, class_numbers, labels_of, rows_of
from sdt_tools.labeling.history import History, history_of
from sdt_tools.labeling.journal import Journal
from sdt_tools.labeling.labelled_frames import labelled_frames
from sdt_tools.labeling.predicted import read_predicted
from sdt_tools.labeling.review import suspects_in
from sdt_tools.labeling.suspects import read_suspects
from sdt_tools.labeling.vocabulary import SETTLED_BY, LabelKind, LabelSource, check_labeler, journal_path
from sdt_tools.recording.frames import Frames
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, LIDAR_SCAN
from sdt_tools.recording.reader import Recording

NEIGHBOUR_NS = 500_000_000
"""A scan or picture is shown beside a frame unless they were taken further apart than this."""


@dataclass(frozen=True)
class Task:
    """What is to be labelled, by whom, with which help."""

    recording: Path
    kind: LabelKind
    labels_dir: Path
    labeler: str
    predictions: Path | None = None
    model: str | None = None
    suspects: Path | None = None


@runtime_checkable
class Beside(Protocol):
    """Something beside the terminal that shows the same frame."""

    def show(self, messages: Sequence[Received], stamp_ns: int) -> None:
        """Show what was measured at ``stamp_ns``."""
        ...

    def close(self) -> None:
        """The app has ended."""
        ...


class Desk:
    """A task being worked on; close it, or use it in a ``with`` statement.

    Raises LabelError or RecordingError where recording, journal, predictions or suspects do not serve.
    """

    def __init__(self, task: Task) -> None:
        check_labeler(task.labeler)
        self.task = task
        self._recording = Recording.open(task.recording)
        try:
            self._frames = labelled_frames(self._recording, task.kind)
            self._scans = self._stream(LIDAR_SCAN)
            self._images = self._stream(CAMERA_IMAGE)
            self._journal = Journal(journal_path(task.labels_dir, task.recording.stem, task.kind), self.recording_id)
        except BaseException:
            self._recording.close()
            raise
        try:
            self._opened = self._open()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> "Desk":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Let go of journal and recording; may be called twice."""
        self._journal.close()
        self._recording.close()

    @property
    def recording_id(self) -> str:
        """The recording's id."""
        return self._recording.recording_id

    @property
    def opened(self) -> State:
        """The state in which the app begins: where the labeler left."""
        return self._opened

    @property
    def has_scans(self) -> bool:
        """Whether there is any scan to show."""
        return len(self._scans) > 0

    @property
    def has_images(self) -> bool:
        """Whether there is any picture to show."""
        return len(self._images) > 0

    def perform(self, turn: Turn) -> State:
        """Write the deed of ``turn``, if it has one, to the disk; the state to show then.

        Raises LabelError where it could not be written: then nothing has changed.
        """
        if turn.deed is None:
            return turn.state
        self._journal.append_table(turn.deed.rows(self.task.kind))
        return self.catch_up(applied(turn.state, turn.deed, self._journal.last_act))

    def catch_up(self, state: State) -> State:
        """Take in what others have appended to the journal meanwhile. Raises LabelError where that is wrong."""
        news = self._journal.news()
        if news.is_empty():
            return state
        state = heard(state, news)
        if news["labeler"].is_in([state.labeler, SETTLED_BY + state.labeler]).any():  # the same person, elsewhere
            return replace(state, history=self._history(self._journal.read().table))
        return state

    def scan_at(self, stamp_ns: int) -> LidarScan | None:
        """The scan taken at, or next to, ``stamp_ns``. Raises RecordingError where it is damaged."""
        received = _near(self._scans, stamp_ns)
        return received.message if received and isinstance(received.message, LidarScan) else None

    def image_at(self, stamp_ns: int) -> CameraImage | None:
        """The picture taken at, or next to, ``stamp_ns``. Raises RecordingError where it is damaged."""
        received = _near(self._images, stamp_ns)
        return received.message if received and isinstance(received.message, CameraImage) else None

    def messages_at(self, stamp_ns: int) -> tuple[Received, ...]:
        """Both, as they were received, without what is damaged."""
        found = []
        for frames in (self._scans, self._images):
            try:
                found.append(_near(frames, stamp_ns))
            except RecordingError:
                continue
        return tuple(received for received in found if received is not None)

    def _stream(self, topic: str) -> Frames:
        return self._frames if self._frames.topic == topic else self._recording.frames(topic)

    def _open(self) -> State:
        task, acts = self.task, self._journal.opened
        labels = labels_of(task.kind, self._frames.stamps_ns, acts.table)
        state = State(labels, task.labeler, self._history(acts.table))
        notes = []
        if acts.broken_lines:
            notes.append(f"{acts.path.name}:{acts.broken_lines[0]} is broken off; it is kept, and counts for nothing")
        if labels.strangers:
            notes.append(f"{labels.strangers:,} acts in the journal are about no frame of this recording")
        if task.predictions is not None:
            state = replace(state, predicted=self._predicted(task.predictions))
        if task.suspects is not None:
            found = suspects_in(labels, read_suspects(task.suspects, self.recording_id))
            state = replace(state, suspects=found)
        row = _left_at(state)
        if row is not None:
            notes.append(f"you go on where you left, at frame {row + 1:,}")
        return replace(state, cursor=row or 0, words="; ".join(notes) or "? shows the keys")

    def _history(self, acts: pl.DataFrame) -> History:
        """What the labeler has done to frames of this recording."""
        known = pl.Series(rows_of(self._frames.stamps_ns, acts["stamp_ns"].to_numpy()) >= 0, dtype=pl.Boolean)
        return history_of(acts.filter(known), self.task.kind, self.task.labeler)

    def _predicted(self, path: Path) -> np.ndarray:
        table = read_predicted(path, self.recording_id, self.task.kind, self.task.model)
        rows = rows_of(self._frames.stamps_ns, table["stamp_ns"].to_numpy())
        predicted = np.full(len(self._frames), UNSAID, np.int8)
        numbers = class_numbers(table["label"], self.task.kind).to_numpy()
        predicted[rows[rows >= 0]] = numbers[rows >= 0]
        return predicted


def _near(frames: Frames, stamp_ns: int) -> Received | None:
    if not len(frames):
        return None
    row = frames.nearest(stamp_ns)
    if abs(int(frames.stamps_ns[row]) - stamp_ns) > NEIGHBOUR_NS:
        return None
    return frames.at(row)


def _left_at(state: State) -> int | None:
    """The frame of the labeler's last act; None for one who begins."""
    voices = [
        state.labels.voices.get(Speaker(LabelSource.HUMAN, name))
        for name in (state.labeler, SETTLED_BY + state.labeler)
    ]
    acts = np.max([voice.acts for voice in voices if voice is not None] or [np.zeros(1)], axis=0)
    return int(np.argmax(acts)) if acts.any() else None
