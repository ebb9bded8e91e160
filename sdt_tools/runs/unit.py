"""One unit of long work: what it is made from, and whether it is already done.

A unit is a function of the module level that fills a folder. Its inputs are hashed; the finished folder carries the
hash in ``unit.json``. A folder appears under its name only when the work is whole: an interrupted unit leaves nothing
that could be taken for a result.
"""

import hashlib
import json
import os
import shutil
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum
from pathlib import Path

from pydantic import BaseModel

from sdt_tools.errors import RunError, SdtError
from sdt_tools.runs.code import code_version

RECORD = "unit.json"
"""The file in a finished folder that says what it was made from."""


@dataclass(frozen=True)
class Unit:
    """``function(folder, **arguments)`` fills the folder ``name``.

    Arguments are values that can be hashed: numbers, strings, configurations, frozen dataclasses, sequences and
    mappings of them. A ``Path`` stands for the content of the file or folder it names; a finished unit's folder for its
    record. ``context`` is passed on likewise but does not shape the result, and is not hashed.
    """

    name: str
    function: Callable[..., None]
    arguments: Mapping[str, object]
    context: Mapping[str, object] = field(default_factory=dict)

    def fingerprint(self) -> str:
        """SHA-256 over the function's name, the code that it depends on, and all arguments."""
        digest = hashlib.sha256()
        for part in (self.function.__module__, self.function.__qualname__, code_version(self.function.__module__)):
            digest.update(part.encode() + b"\0")
        for key in sorted(self.arguments):
            digest.update(key.encode() + b"\0")
            digest.update(_canonical(self.arguments[key]).encode() + b"\0")
        return digest.hexdigest()


def finished(unit: Unit, root: Path) -> bool:
    """Whether ``root/unit.name`` was made by this unit from these inputs."""
    return _recorded_fingerprint(root / unit.name) == unit.fingerprint()


def execute(unit: Unit, root: Path) -> Path:
    """Do the unit's work unless it is done already; return its folder.

    A folder of the same name from other inputs is replaced, after the new one is whole. Raises RunError, naming the
    unit, for a failure that the work itself does not explain.
    """
    folder = root / unit.name
    fingerprint = unit.fingerprint()
    if finished(unit, root):
        return folder
    _sweep(folder)
    scratch = folder.with_name(f".{folder.name}.{os.getpid()}.part")
    scratch.mkdir(parents=True)
    started = time.monotonic()
    try:
        unit.function(scratch, **unit.arguments, **unit.context)
    except SdtError:
        shutil.rmtree(scratch, ignore_errors=True)
        raise
    except Exception as error:
        shutil.rmtree(scratch, ignore_errors=True)
        raise RunError(f"unit '{unit.name}' failed: {type(error).__name__}: {error}") from error
    record = {
        "fingerprint": fingerprint,
        "version": code_version(unit.function.__module__),
        "seconds": round(time.monotonic() - started, 3),
    }
    _write_durably(scratch / RECORD, json.dumps(record, indent=2) + "\n")
    if folder.exists():
        shutil.rmtree(folder)
    scratch.rename(folder)
    return folder


def content_hash(path: Path) -> str:
    """SHA-256 of a file, or of a folder's files by relative name (records of units left out)."""
    digest = hashlib.sha256()
    if path.is_dir():
        for file in sorted(p for p in path.rglob("*") if p.is_file() and p.name != RECORD):
            digest.update(str(file.relative_to(path)).encode() + b"\0" + content_hash(file).encode())
        return digest.hexdigest()
    with path.open("rb") as stream:
        while block := stream.read(1 << 20):
            digest.update(block)
    return digest.hexdigest()


def _recorded_fingerprint(folder: Path) -> str | None:
    try:
        return str(json.loads((folder / RECORD).read_text(encoding="utf-8"))["fingerprint"])
    except (OSError, ValueError, KeyError):
        return None


def _sweep(folder: Path) -> None:
    """Remove what processes that are gone have left half done; another one that is at work keeps its own."""
    for scratch in folder.parent.glob(f".{folder.name}.*.part"):
        pid = int(scratch.name.split(".")[-2])
        if pid == os.getpid() or not _alive(pid):
            shutil.rmtree(scratch, ignore_errors=True)


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def _canonical(value: object) -> str:
    if isinstance(value, Path) and (value / RECORD).is_file():
        return f"unit:{_recorded_fingerprint(value)}"
    if isinstance(value, Path):
        return f"content:{content_hash(value) if value.exists() else 'missing'}"
    if isinstance(value, BaseModel):
        return f"{type(value).__qualname__}:{value.model_dump_json()}"
    if is_dataclass(value) and not isinstance(value, type):
        return _canonical({field.name: getattr(value, field.name) for field in fields(value)})
    if isinstance(value, Enum):
        return f"{type(value).__qualname__}.{value.name}"
    if isinstance(value, Mapping):
        return "{" + ",".join(f"{_canonical(k)}:{_canonical(value[k])}" for k in sorted(value)) + "}"
    if isinstance(value, str | int | float | bool | None):
        return repr(value)
    if isinstance(value, Iterable):
        return "[" + ",".join(_canonical(item) for item in value) + "]"
    raise TypeError(f"a unit's argument cannot be hashed: {value!r}")


def _write_durably(path: Path, text: str) -> None:
    with path.open("w", encoding="utf-8") as stream:
        stream.write(text)
        stream.flush()
        os.fsync(stream.fileno())
