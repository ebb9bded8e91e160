"""ROS 2 bags, opened: folders with their ``metadata.yaml``, or a single ``.mcap`` or ``.db3``."""

import hashlib
import sqlite3
from collections.abc import Collection, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from rosbags.rosbag2 import Reader, ReaderError
from ruamel.yaml import YAML

from sdt_tools.errors import RecordingError, SdtError
from sdt_tools.recording.container.file import MAGIC
from sdt_tools.recording.container.reader import McapReader
from sdt_tools.recording.exchange.about import About, about_from
from sdt_tools.recording.exchange.ros2.routes import BagTopic

METADATA: Final = "metadata.yaml"
_STORAGE: Final = {".db3": b"SQLite format 3\0", ".mcap": MAGIC}
"""How files of a bag end, and how they begin."""
_COMPRESSED: Final = ".zstd"
_INFORMATION: Final = "rosbag2"


@dataclass(frozen=True)
class Bag:
    """A bag that is open."""

    path: Path
    reader: Reader

    @property
    def topics(self) -> list[BagTopic]:
        """Its topics; one with several publishers comes once a type."""
        counts: dict[tuple[str, str], int] = {}
        for connection in self.reader.connections:
            key = (connection.topic, connection.msgtype)
            counts[key] = counts.get(key, 0) + connection.msgcount
        return [BagTopic(name, type_name, count) for (name, type_name), count in counts.items()]

    def messages(self, wanted: Collection[tuple[str, str]]) -> Iterator[tuple[str, str, int, bytes]]:
        """Topic, type, time of receipt in nanoseconds and CDR of all messages of topics ``wanted`` by name and type.

        A file or a chunk is in memory at a time, never a whole bag. Raises RecordingError where there are fewer than
        the bag says: its reader passes over some damage without a word.
        """
        chosen = [c for c in self.reader.connections if (c.topic, c.msgtype) in wanted]
        promised, found = sum(c.msgcount for c in chosen), 0
        with _refusals(self.path):
            for connection, received_ns, data in self.reader.messages(chosen) if chosen else ():
                found += 1
                yield connection.topic, connection.msgtype, received_ns, data
            if found < promised:
                raise RecordingError(
                    f"{self.path}: cannot be read as a ROS 2 bag: {promised - found} of its {promised} messages are "
                    f"missing; the bag is damaged{_advice(self.path)}"
                )

    def about(self) -> About | None:
        """What the recording said about itself that the bag was made from; None for bags of others."""
        with _refusals(self.path):
            return self._about()

    def _about(self) -> About | None:
        if self.path.is_dir():
            return about_from(_texts(_yaml(self.path / METADATA).get("rosbag2_bagfile_information")))
        if self.path.suffix != ".mcap":
            return None
        with McapReader(self.path) as file:
            texts = [
                record.metadata.get("serialized_metadata", "") for record in file.metadata if _is_information(record)
            ]
        return about_from(_texts(YAML(typ="safe").load(texts[-1]))) if texts else None

    def sha256(self) -> str:
        """Of all its files, in the order of their names."""
        digest = hashlib.sha256()
        for file in sorted(self.path.iterdir()) if self.path.is_dir() else [self.path]:
            if file.is_file():
                with file.open("rb") as stream:
                    digest.update(hashlib.file_digest(stream, "sha256").digest())
        return digest.hexdigest()


@contextmanager
def open_bag(path: Path) -> Iterator[Bag]:
    """The bag at ``path``.

    Raises RecordingError, in one line, for what is missing, no ROS 2 bag, without its metadata, or damaged; so do the
    bag's methods.
    """
    _check(path)
    _check_whole(path)
    with _refusals(path):
        reader = Reader(path)
        reader.open()
    with closing(reader):
        yield Bag(path, reader)


def _check(path: Path) -> None:
    if not path.exists():
        raise RecordingError(f"{path}: no such bag; check the path")
    if path.is_dir():
        if (path / METADATA).exists():
            return
        found = sorted(file.name for file in path.iterdir() if file.suffix in _STORAGE)
        advice = f"name {found[0]} itself, or `ros2 bag reindex` it" if found else "name the folder of one ROS 2 bag"
        raise RecordingError(f"{path}: has no {METADATA}; {advice}")
    if path.suffix == ".bag":
        raise RecordingError(f"{path}: a bag of ROS 1; convert it with `rosbags-convert` first")
    if path.suffix not in _STORAGE:
        raise RecordingError(f"{path}: not a ROS 2 bag; give its folder, or a .db3 or .mcap file")
    if path.stat().st_size == 0:
        raise RecordingError(f"{path}: is empty; nothing was recorded")
    with path.open("rb") as file:
        if not file.read(16).startswith(_STORAGE[path.suffix]):
            raise RecordingError(f"{path}: not a ROS 2 bag, whatever its name says; give a bag's folder or file")


def _check_whole(path: Path) -> None:
    """Refuse what was cut off: the library's words for it help nobody, and `sdt repair` does."""
    for file in sorted(path.glob("*.mcap")) if path.is_dir() else [path] if path.suffix == ".mcap" else []:
        with McapReader(file) as source:
            if source.truncated:
                raise RecordingError(
                    f"{file}: the bag was cut off; finish it first with `sdt repair {file} --out NEW.mcap`, "
                    "and import NEW.mcap"
                )


@contextmanager
def _refusals(path: Path) -> Iterator[None]:
    """Whatever the library raises over bad bags (it is as various as their bytes) as one error with a line."""
    try:
        yield
    except SdtError:
        raise
    except Exception as error:
        reason = " ".join(str(error).split()).rstrip(".")
        if not reason or not isinstance(error, ReaderError | OSError | sqlite3.Error):
            # It has stumbled over bytes: what it says of them is noise.
            reason = "it ends too early, or its bytes make no sense"
        if "Profile is not ros2" in reason:
            raise RecordingError(f"{path}: an MCAP, but not of ROS 2; `sdt inspect` says what it is") from None
        raise RecordingError(f"{path}: a ROS 2 bag that is damaged or unfinished: {reason}{_advice(path)}") from None


def _advice(path: Path) -> str:
    has_mcap = path.suffix == ".mcap" or (path.is_dir() and any(path.glob("*.mcap")))
    repair = "; `sdt repair` saves what can be read of a bag's .mcap" if has_mcap else ""
    return f"{repair}; `ros2 bag reindex` makes new metadata" if path.is_dir() else repair


def _yaml(path: Path) -> Mapping[str, Any]:
    loaded = YAML(typ="safe").load(path.read_text(encoding="utf-8"))
    return loaded if isinstance(loaded, dict) else {}


def _texts(information: object) -> dict[str, str]:
    custom = information.get("custom_data") if isinstance(information, dict) else None
    return {str(name): str(text) for name, text in custom.items()} if isinstance(custom, dict) else {}


def _is_information(record: Any) -> bool:
    return bool(record.name == _INFORMATION)
