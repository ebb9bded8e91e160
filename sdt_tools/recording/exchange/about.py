"""What a recording says about itself, as the few texts that other formats have a place for."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from sdt_tools.recording.reader import Recording
from sdt_tools.recording.session import SESSION, STATS
from sdt_tools.recording.timing.pauses import PAUSES, pauses_text

CONFIG: Final = "sdt.config"


@dataclass(frozen=True)
class About:
    """The metadata ``sdt.session`` and ``sdt.stats`` of a recording, and its configuration."""

    session: Mapping[str, str]
    stats: Mapping[str, str]
    config_toml: str

    def texts(self) -> dict[str, str]:
        """The same as texts by name: JSON objects, and the TOML."""
        return {
            SESSION: json.dumps(dict(self.session)),
            STATS: json.dumps(dict(self.stats)),
            CONFIG: self.config_toml,
        }


def about_of(recording: Recording) -> About:
    """What ``recording`` says; where a cut has taken its stats, the pauses that its log tells of are in their place."""
    pauses = recording.pauses
    stats = recording.stats or ({PAUSES: pauses_text(pauses)} if pauses else {})
    return About(recording.session, stats, recording.config_toml)


def about_from(texts: Mapping[str, str]) -> About | None:
    """What ``texts`` gave; None where they are not of a recording."""
    if SESSION not in texts:
        return None
    return About(_entries(texts[SESSION]), _entries(texts.get(STATS, "{}")), texts.get(CONFIG, ""))


def _entries(text: str) -> dict[str, str]:
    try:
        value = json.loads(text)
    except ValueError:
        return {}
    return {str(key): str(entry) for key, entry in value.items()} if isinstance(value, dict) else {}
