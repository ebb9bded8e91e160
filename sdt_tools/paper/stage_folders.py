"""How a stage's folder is laid out: each is filled by one function, from what the stages before have made."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

DATASET: Final = "data"
RECORDINGS: Final = "recordings"
LABELS: Final = "labels"
CERTIFICATE: Final = "certificate"
_NOTE: Final = "note.json"


def read_note(folder: Path) -> dict[str, Any]:
    """What a stage said of itself."""
    note: dict[str, Any] = json.loads((folder / _NOTE).read_text(encoding="utf-8"))
    return note


def write_note(out: Path, document: Mapping[str, object]) -> None:
    """Say what came out of a stage."""
    (out / _NOTE).write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
