"""One thing that was looked at, and how it is shown to strangers."""

import getpass
import os
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from pathlib import Path


class Level(StrEnum):
    """How well it is: WARN is no reason to stop, FAIL is one."""

    OK = "ok"
    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True)
class Finding:
    """``what`` was looked at, what was ``seen``, and, where it is not ok, what to ``do``."""

    section: str
    what: str
    level: Level
    seen: str
    do: str = ""

    def document(self) -> dict[str, str]:
        """For machines."""
        return asdict(self)

    def line(self) -> str:
        """For people."""
        todo = f" → {self.do}" if self.do else ""
        return f"{self.level:<4}  {self.section:<8}  {self.what}: {self.seen}{todo}"


def finding_of(document: Mapping[str, str]) -> Finding:
    """The finding that ``document`` writes."""
    return Finding(document["section"], document["what"], Level(document["level"]), document["seen"], document["do"])


def ok(section: str, what: str, seen: str) -> Finding:
    """All is well."""
    return Finding(section, what, Level.OK, seen)


def warn(section: str, what: str, seen: str, do: str) -> Finding:
    """Something works less well, or is not there and may not be needed."""
    return Finding(section, what, Level.WARN, seen, do)


def fail(section: str, what: str, seen: str, do: str) -> Finding:
    """Something does not work."""
    return Finding(section, what, Level.FAIL, seen, do)


def without_names(finding: Finding) -> Finding:
    """``finding`` as it may be shown to anybody: the home folder is ~, and no path holds the user's name."""
    what, seen, do = (anonymous(text) for text in (finding.what, finding.seen, finding.do))
    return replace(finding, what=what, seen=seen, do=do)


def anonymous(text: str) -> str:
    """``text`` without home folder and user name."""
    homes = {str(Path.home()), os.path.realpath(Path.home())} - {"/"}
    for home in sorted(homes, key=len, reverse=True):
        text = re.sub(rf"{re.escape(home)}(?![\w.-])", "~", text)
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # nobody knows this user by name
        return text
    return re.sub(rf"(?<=/){re.escape(user)}(?![\w.-])", "USER", text)
