"""Recordings that were discarded, kept until somebody empties the trash."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import tomli_w

from sdt_tools.clock import SECOND_NS
from sdt_tools.errors import RecordingError

TRASH: Final = ".trash"


def discard(recording: Path, reason: str, now_ns: int) -> Path:
    """Move ``recording`` into ``.trash/<time>-<name>/`` beside it, with a record of why; that folder.

    Raises RecordingError where it cannot be moved.
    """
    moment = datetime.fromtimestamp(now_ns / SECOND_NS, UTC)
    folder = recording.parent / TRASH / f"{moment:%Y%m%dT%H%M%S}{now_ns % SECOND_NS:09d}-{recording.stem}"
    try:
        folder.mkdir(parents=True)
        record = {"original": recording.name, "reason": reason, "discarded_ns": now_ns}
        (folder / "trash.toml").write_text(tomli_w.dumps(record), encoding="utf-8")
        recording.rename(folder / recording.name)
    except OSError as error:
        raise RecordingError(f"{recording}: cannot be moved to the trash: {error.strerror}; it is kept") from None
    return folder
