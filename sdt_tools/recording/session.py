"""What a recording says about itself: the metadata ``sdt.session`` and ``sdt.stats``, and its identity."""

import hashlib
import uuid
from collections.abc import Mapping
from typing import Final

from sdt_tools import __version__
from sdt_tools.protocols import SourceInfo

SESSION: Final = "sdt.session"
STATS: Final = "sdt.stats"
CONFIG_NAME: Final = "config.toml"
CONFIG_MEDIA_TYPE: Final = "application/toml"
SOFTWARE: Final = f"sdt-tools {__version__}"
_NAMESPACE: Final = uuid.uuid5(uuid.NAMESPACE_DNS, "recording.sdt-tools")


def derived_id(*parts: str) -> str:
    """A UUID that depends on ``parts`` alone: what is made again from the same things is the same recording."""
    digest = hashlib.sha256("\0".join(parts).encode()).hexdigest()
    return str(uuid.uuid5(_NAMESPACE, digest))


def random_id() -> str:
    """A UUID for what happens once, as a drive in real time does."""
    return str(uuid.uuid4())


def session_metadata(info: SourceInfo, recording_id: str, operator: str, notes: Mapping[str, str]) -> dict[str, str]:
    """The entries of ``sdt.session``; ``notes`` are added under their own names."""
    return {
        "recording_id": recording_id,
        "source": info.source,
        "scenario": info.scenario,
        "seed": "" if info.seed is None else str(info.seed),
        "operator": operator,
        "software_version": SOFTWARE,
        **{f"device.{name}": device for name, device in sorted(info.devices.items())},
        **notes,
    }
