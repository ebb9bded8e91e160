"""What a network is asked to keep: the domains of a safety level, or those of a file."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

from sdt_tools.errors import UsageError
from sdt_tools.robustness.boxes import DomainSet
from sdt_tools.robustness.domains import SafetyLevel, domains


@dataclass(frozen=True, eq=False)
class Specification:
    """Sets of domains, and where they are from: ``level`` is None for those of a file, ``file`` for those of a level.

    ``slug`` is a name that can be part of a file's.
    """

    sets: tuple[DomainSet, ...]
    name: str
    slug: str
    level: int | None = None
    file: Path | None = None

    @property
    def domains(self) -> int:
        """How many domains there are in all sets."""
        return sum(len(boxes) for boxes in self.sets)

    def fingerprint(self) -> str:
        """SHA-256 over the bounds, rays and allowed classes of all sets, in order."""
        digest = hashlib.sha256()
        for boxes in self.sets:
            allowed = ",".join(motion.label for motion in sorted(boxes.allowed))
            digest.update(f"{boxes.name}\0{boxes.lower_m.shape}\0{allowed}\0".encode())
            for array in (boxes.lower_m, boxes.upper_m, boxes.rays):
                digest.update(array.tobytes())
        return digest.hexdigest()


def specification_of(level: int | None, file: Path | None) -> Specification:
    """The domains of ``level`` or of ``file``; one of the two has to be given.

    Raises UsageError where both or none are, for a level that does not exist, and for level 0, which has no domains;
    ConfigError for a file that is wrong.
    """
    if (level is None) == (file is None):
        what = "not both" if file is not None else "one of them is needed"
        raise UsageError(f"--level and --domains: choose the domains of a level or those of a file, {what}")
    if file is not None:
        from sdt_tools.robustness.domain_file import load_domains

        return Specification(load_domains(file), str(file), file.stem, file=file)
    if level == SafetyLevel.NONE:
        raise UsageError("level 0 asks for nothing: there are no domains to certify; choose 1, 2, 3 or 4")
    if level not in list(SafetyLevel):
        raise UsageError(f"--level {level}: no such level; choose 1, 2, 3 or 4")
    return Specification((domains(SafetyLevel(level)),), f"level {level}", f"level-{level}", level=level)
