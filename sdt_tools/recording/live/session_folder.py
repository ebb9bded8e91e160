"""A session's folder: its takes, and ``session.toml``, which says what they are and from which config they came."""

import os
import re
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import tomli_w

from sdt_tools.config import Config, dump_config, parse_config, read_toml
from sdt_tools.errors import ConfigError, RecordingError
from sdt_tools.recording.live.outcome import RecordingSummary
from sdt_tools.recording.trash import discard

SESSION_FILE: Final = "session.toml"


class TakeEntry(Config):
    """One recording of a session. An empty ``ending`` is one that was never closed: it runs, or was cut off."""

    name: str
    started_ns: int
    ending: str = ""
    seconds: float = 0.0
    messages: int = 0
    dropped: int = 0
    missing: int = 0
    trigger: str = ""
    """What had the ring written out, where this is what it held."""
    trash: str = ""
    """Where it lies since it was discarded."""


class SessionRecord(Config):
    """``session.toml``. ``worlds`` counts how often a source was started."""

    id: str
    config: dict[str, Any]
    worlds: int = 0
    takes: tuple[TakeEntry, ...] = ()


class ChangedConfigError(ConfigError):
    """A session that was begun with another config. ``differences`` are lines, one a key."""

    def __init__(self, folder: Path, differences: tuple[str, ...]) -> None:
        keys = ", ".join(line.split(":")[0] for line in differences)
        super().__init__(
            f"{folder}: the session was begun with another config ({keys}); "
            "resume it with the same options, or name another --session"
        )
        self.differences = differences


class SessionFolder:
    """A session's folder, open for recording. Safe for threads.

    ``session.toml`` is replaced as a whole each time, and on the disk before a method returns.
    """

    def __init__(self, folder: Path, record: SessionRecord) -> None:
        self.folder = folder
        self._record = record
        self._lock = threading.Lock()
        self._numbers: dict[str, int] = {}

    @classmethod
    def create(cls, folder: Path, config: Config, session_id: str) -> "SessionFolder":
        """A new session. Raises RecordingError where the folder holds one already or cannot be made."""
        if (folder / SESSION_FILE).exists():
            raise RecordingError(f"{folder}: holds a session already; add --resume, or name another --session")
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RecordingError(f"{folder}: cannot be made: {error.strerror}; name another --session") from None
        session = cls(folder, SessionRecord(id=session_id, config=_values(config)))
        session._save()
        return session

    @classmethod
    def resume(cls, folder: Path, config: Config) -> "SessionFolder":
        """The session in ``folder``, to be gone on with; takes that were restored from the trash are kept ones again.

        Raises RecordingError where there is none, ConfigError for one that cannot be read, ChangedConfigError for one
        that was begun with another config.
        """
        if not (folder / SESSION_FILE).exists():
            raise RecordingError(f"{folder}: no session to resume; leave --resume out to begin one")
        record = parse_config(SessionRecord, read_toml(folder / SESSION_FILE), str(folder / SESSION_FILE))
        differences = config_differences(record.config, _values(config))
        if differences:
            raise ChangedConfigError(folder, differences)
        return cls(folder, record.model_copy(update={"takes": tuple(_as_it_lies(folder, t) for t in record.takes)}))

    @property
    def record(self) -> SessionRecord:
        """What ``session.toml`` says."""
        return self._record

    @property
    def cut_off(self) -> tuple[Path, ...]:
        """Takes that were never closed."""
        takes = self._record.takes
        return tuple(self.folder / take.name for take in takes if not take.ending and not take.trash)

    def next_path(self, kind: str) -> Path:
        """A path that nothing has or had: ``<kind>_001.mcap`` and so on."""
        with self._lock:
            pattern = re.compile(rf"{re.escape(kind)}_(\d+)\.mcap")
            names = [take.name for take in self._record.takes] + [path.name for path in self.folder.iterdir()]
            used = [int(match[1]) for name in names if (match := pattern.fullmatch(name))]
            number = max([*used, self._numbers.get(kind, 0)]) + 1
            self._numbers[kind] = number
            return self.folder / f"{kind}_{number:03d}.mcap"

    def start_world(self) -> int:
        """A source is started; how many were before."""
        with self._changing():
            before = self._record.worlds
            self._record = self._record.model_copy(update={"worlds": before + 1})
        return before

    def started(self, path: Path, started_ns: int, trigger: str = "") -> None:
        """A take begins at ``path``."""
        entry = TakeEntry(name=path.name, started_ns=started_ns, trigger=trigger)
        with self._changing():
            self._record = self._record.model_copy(update={"takes": (*self._record.takes, entry)})

    def ended(self, path: Path, summary: RecordingSummary) -> None:
        """The take at ``path`` is closed."""
        self._update(
            path,
            {
                "ending": summary.ending.value,
                "seconds": round(summary.seconds, 3),
                "messages": sum(summary.frames.values()),
                "dropped": sum(summary.dropped.values()),
                "missing": sum(summary.missing.values()),
            },
        )

    def saved(self, path: Path, seconds: float, messages: int) -> None:
        """What a ring held is written to ``path``."""
        self._update(path, {"ending": "saved", "seconds": round(seconds, 3), "messages": messages})

    def discard(self, path: Path, reason: str, now_ns: int) -> None:
        """Move the take at ``path`` to the trash. Raises RecordingError where it cannot be moved."""
        self._update(path, {"trash": str(discard(path, reason, now_ns).relative_to(self.folder.resolve()))})

    def last_kept(self) -> Path | None:
        """The last take that is closed and lies where it was recorded; files of the ring are none."""
        kept = [take for take in self._record.takes if take.ending and not take.trash and not take.trigger]
        paths = (self.folder / take.name for take in reversed(kept))
        return next((path for path in paths if path.is_file()), None)

    def _update(self, path: Path, changes: Mapping[str, object]) -> None:
        with self._changing():
            takes = tuple(
                take.model_copy(update=dict(changes)) if take.name == path.name else take for take in self._record.takes
            )
            self._record = self._record.model_copy(update={"takes": takes})

    @contextmanager
    def _changing(self) -> Iterator[None]:
        with self._lock:
            yield
            self._save()

    def _save(self) -> None:
        path = self.folder / SESSION_FILE
        part = path.with_name(f".{SESSION_FILE}.part")
        try:
            with part.open("w", encoding="utf-8") as file:
                file.write(dump_config(self._record))
                file.flush()
                os.fsync(file.fileno())
            part.replace(path)
        except OSError as error:
            raise RecordingError(f"{path}: cannot be written: {error.strerror}; check rights and disk") from None


def config_differences(before: Mapping[str, Any], now: Mapping[str, Any]) -> tuple[str, ...]:
    """Lines as ``scene.rates.scan_hz: 50.0 before, 25.0 now``, one for each key that differs."""
    old, new = _flat(before), _flat(now)
    return tuple(
        f"{key}: {old.get(key, 'not set')} before, {new.get(key, 'not set')} now"
        for key in sorted(old.keys() | new.keys())
        if old.get(key) != new.get(key)
    )


def _as_it_lies(folder: Path, take: TakeEntry) -> TakeEntry:
    return take.model_copy(update={"trash": ""}) if take.trash and (folder / take.name).is_file() else take


def _values(config: Config) -> dict[str, Any]:
    return config.model_dump(mode="json", exclude_none=True)


def _flat(table: Mapping[str, Any], prefix: str = "") -> dict[str, str]:
    flat: dict[str, str] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            flat |= _flat(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = tomli_w.dumps({"v": value}).removeprefix("v = ").strip()
    return flat
