"""Pictures that commands are asked to draw."""

from pathlib import Path

from sdt_tools.errors import OutputExistsError, UsageError


def check_picture(path: Path, option: str) -> None:
    """Raises UsageError for a name that does not end in .png, OutputExistsError where it exists; names ``option``."""
    if path.suffix.lower() != ".png":
        raise UsageError(f"{option} {path}: pictures are PNG; end the name in .png")
    if path.exists():
        raise OutputExistsError(path, option)
