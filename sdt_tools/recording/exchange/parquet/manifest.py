"""``manifest.json``: what a folder of Parquet files is, and what the recording said about itself."""

from pathlib import Path
from typing import Final

from pydantic import ValidationError

from sdt_tools.config import Config
from sdt_tools.errors import RecordingError
from sdt_tools.recording.exchange.about import About

MANIFEST: Final = "manifest.json"


class TopicFile(Config):
    """The file of one topic: its name in the folder, the schema of its messages, and how many there are."""

    file: str
    topic_schema: str
    rows: int


class Manifest(Config):
    """The folder: the recording's metadata and configuration, and a file a topic."""

    software: str
    recording: str
    session: dict[str, str]
    stats: dict[str, str]
    config_toml: str
    topics: dict[str, TopicFile]

    @property
    def about(self) -> About:
        """What the recording said about itself."""
        return About(self.session, self.stats, self.config_toml)


def write_manifest(manifest: Manifest, folder: Path) -> None:
    """Write it into ``folder``."""
    (folder / MANIFEST).write_text(manifest.model_dump_json(indent=2) + "\n", encoding="utf-8")


def read_manifest(folder: Path) -> Manifest:
    """The manifest of ``folder``. Raises RecordingError where there is none, or another's."""
    if not folder.exists():
        raise RecordingError(f"{folder}: no such folder; check the path")
    path = folder / MANIFEST
    if not path.is_file():
        raise RecordingError(f"{folder}: has no {MANIFEST}; name a folder that `sdt export parquet` wrote")
    try:
        manifest = Manifest.model_validate_json(path.read_bytes())
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise RecordingError(
            f"{path}: not a manifest of a recording: {where or 'it'}: {first['msg'].lower()}"
        ) from None
    for topic, entry in manifest.topics.items():
        if Path(entry.file).name != entry.file:
            raise RecordingError(f"{path}: {topic} is said to lie in {entry.file}, outside of the folder")
    return manifest
