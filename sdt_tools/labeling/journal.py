"""Label journals on disk: append-only, one row an act, each act on disk before its call returns.

Several people, or programs, may append to one journal at once: each append holds the file's lock and continues the
numbering of whatever was appended meanwhile.
"""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType

import polars as pl

from sdt_tools.errors import LabelError
from sdt_tools.labeling.acts import BROKEN, COLUMNS, HEADER, Acts, fault_in, parse_acts, parse_journal
from sdt_tools.labeling.vocabulary import LabelSource, journal_kind


@dataclass(frozen=True)
class Label:
    """One act: ``labeler`` gives the frame at ``stamp_ns`` a ``label``; an empty one withdraws what he said before."""

    act_id: int
    recording_id: str
    stamp_ns: int
    label: str
    labeler: str
    source: LabelSource
    created_ns: int


def read_journal(path: Path, recording_id: str | None = None) -> Acts:
    """Everything in the journal at ``path``; lines that a crash broke off are reported in it, not raised.

    With ``recording_id``, all acts must belong to that recording. Raises LabelError, naming file and line, where the
    journal is missing or anything in it is not as ``Acts`` says.
    """
    try:
        with path.open("rb") as stream, _locked(stream.fileno(), fcntl.LOCK_SH):
            data = stream.read()
    except FileNotFoundError:
        raise LabelError(f"{path}: no such journal; label the recording first, as with 'sdt label auto'") from None
    except OSError as error:
        raise LabelError(f"{path}: the journal cannot be read: {error.strerror}") from None
    return parse_journal(data, path, recording_id)


class Journal:
    """The journal at ``path``, open for appending acts about one recording; it is created where it does not exist.

    Raises LabelError where the file is not a journal of ``recording_id``, or cannot be written.
    """

    def __init__(self, path: Path, recording_id: str) -> None:
        journal_kind(path)
        if not recording_id or set(recording_id) & set(',"\r\n'):
            raise LabelError(f"{path}: '{recording_id}' cannot be a recording's id; a journal needs one without commas")
        self.path = path
        self.recording_id = recording_id
        self._file: int | None = None
        self._news: list[pl.DataFrame] = []
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o644)
            with _locked(self._file, fcntl.LOCK_EX):
                self.opened = self._begin(self._file)
                """What the journal held when it was opened."""
        except OSError as error:
            self.close()
            raise LabelError(f"{path}: the journal cannot be opened for writing: {error.strerror}") from None
        except LabelError:
            self.close()
            raise
        self.broken_lines = self.opened.broken_lines
        """Lines that crashes had broken off when the journal was opened."""

    def append(self, *, stamp_ns: int, label: str, labeler: str, source: LabelSource, created_ns: int) -> Label:
        """Write one act; it is on disk when this returns. Raises LabelError, and writes nothing, for a wrong value."""
        row = f"{self.recording_id},{stamp_ns},{label},{labeler},{source.value},{created_ns}\n"
        (act_id,) = self._append([row])
        return Label(act_id, self.recording_id, stamp_ns, label, labeler, source, created_ns)

    def append_table(self, acts: pl.DataFrame) -> int:
        """Write many acts and wait for the disk once; returns how many.

        ``acts`` has the columns stamp_ns, label, labeler, source, created_ns. Raises LabelError, and writes nothing,
        for a wrong value in any of them.
        """
        columns = [pl.lit(self.recording_id), *map(pl.col, ("stamp_ns", "label", "labeler", "source", "created_ns"))]
        rows = acts.select(pl.concat_str([*columns], separator=",").fill_null("") + "\n").to_series().to_list()
        return len(self._append(rows)) if rows else 0

    @property
    def last_act(self) -> int:
        """The number of the last act that is known here."""
        return self._last_act

    def news(self) -> pl.DataFrame:
        """The acts that others have appended since the journal was opened, or since the last call; columns of COLUMNS.

        Raises LabelError where what they appended is wrong.
        """
        if self._file is None:
            raise LabelError(f"{self.path}: the journal is closed; open it again to read")
        try:
            if os.fstat(self._file).st_size != self._known_bytes or not self._is_in_place(self._file):
                with _locked(self._file, fcntl.LOCK_SH):
                    self._catch_up(self._file)
        except OSError as error:
            raise LabelError(f"{self.path}: the journal cannot be read: {error.strerror}") from None
        news, self._news = self._news, []
        return pl.concat([pl.DataFrame(schema=COLUMNS), *news])

    def read(self) -> Acts:
        """Everything in the journal now, acts that others appended included."""
        return read_journal(self.path, self.recording_id)

    def close(self) -> None:
        """Release the file; may be called twice."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def __enter__(self) -> "Journal":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _begin(self, file: int) -> Acts:
        """Read what is there; complete a header that is missing or was broken off."""
        data = _read_from(file, 0)
        acts = parse_journal(data, self.path, self.recording_id)
        if len(data) < len(HEADER):
            _write_durably(file, HEADER[len(data) :])
            _sync_folder(self.path.parent)
            data = HEADER
        self._known_bytes = data.rfind(b"\n") + 1
        self._known_lines = data.count(b"\n")
        self._last_act = int(acts.table["act_id"][-1]) if len(acts.table) else 0
        return acts

    def _append(self, rows: list[str]) -> range:
        if self._file is None:
            raise LabelError(f"{self.path}: the journal is closed; open it again to append")
        try:
            with _locked(self._file, fcntl.LOCK_EX):
                torn = self._catch_up(self._file)
                closing = BROKEN + b"\n" if torn else b""
                act_ids = range(self._last_act + 1, self._last_act + 1 + len(rows))
                lines = "".join(f"{act_id},{row}" for act_id, row in zip(act_ids, rows, strict=True)).encode()
                self._check(lines, len(rows), self._known_lines + (2 if torn else 1))
                _write_durably(self._file, closing + lines)
                self._advance(torn + closing + lines, act_ids[-1])
        except OSError as error:
            message = f"{self.path}: the label could not be written ({error.strerror}); make room and repeat the act"
            raise LabelError(message) from None
        return act_ids

    def _catch_up(self, file: int) -> bytes:
        """Take in what others appended; returns the last line if it is broken off, else nothing."""
        if not self._is_in_place(file) or os.fstat(file).st_size < self._known_bytes:
            raise LabelError(f"{self.path}: the journal was moved or rewritten while it was open; open it again")
        news = _read_from(file, self._known_bytes)
        whole = news[: news.rfind(b"\n") + 1]
        if whole:
            acts = parse_acts(whole, self.path, self.recording_id, self._known_lines + 1, self._last_act).table
            self._news.append(acts)
            self._advance(whole, int(acts["act_id"][-1]) if len(acts) else self._last_act)
        return news[len(whole) :]

    def _is_in_place(self, file: int) -> bool:
        """Whether the open file still is the one that ``path`` names; editors put another in its place."""
        try:
            return os.path.samestat(os.fstat(file), self.path.stat())
        except FileNotFoundError:
            return False

    def _check(self, lines: bytes, rows: int, first_line: int) -> None:
        """What is written must read back as the same number of acts."""
        if rows == 1:  # a person's usual act: the table's rules, without a table
            text = lines.decode().removesuffix("\n")
            fault = fault_in(text, journal_kind(self.path), self.recording_id, self._last_act)
            if fault is not None:
                raise LabelError(f"{self.path}:{first_line}: {fault}")
            if text.isprintable() and not text.endswith(BROKEN.decode()):
                return
        acts = parse_acts(lines, self.path, self.recording_id, first_line, self._last_act)
        if len(acts.table) != rows:
            raise LabelError(f"{self.path}: a labeler's name may not hold line ends; nothing was written")

    def _advance(self, data: bytes, last_act: int) -> None:
        self._known_bytes += len(data)
        self._known_lines += data.count(b"\n")
        self._last_act = last_act


@contextmanager
def _locked(file: int, operation: int) -> Iterator[None]:
    fcntl.flock(file, operation)
    try:
        yield
    finally:
        fcntl.flock(file, fcntl.LOCK_UN)


def _read_from(file: int, offset: int) -> bytes:
    size = os.fstat(file).st_size
    return os.pread(file, size - offset, offset) if size > offset else b""


def _write_durably(file: int, data: bytes) -> None:
    """Append ``data`` and wait for the disk; where that fails, take back the part that was written."""
    size = os.fstat(file).st_size
    try:
        left = memoryview(data)
        while left:
            left = left[os.write(file, left) :]
        os.fsync(file)
    except OSError:
        with suppress(OSError):
            os.ftruncate(file, size)
        raise


def _sync_folder(folder: Path) -> None:
    """Make a file's name in ``folder`` durable."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
