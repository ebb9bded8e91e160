"""Every failure that a user can cause or meet, as one tree.

SdtError                     exit 1: something failed
├── UsageError               exit 2: the call or its input is wrong
│   ├── ConfigError          a configuration or scenario file
│   ├── RecordingError       a file that is not, or not yet, one of our recordings
│   │   └── DiskRefusedError a recording that its disk has no room for
│   ├── LabelError           a label journal
│   ├── DatasetError         a data set that cannot be built or used
│   ├── CheckpointError      a model folder
│   └── OutputExistsError    an output that would be written over
├── RunError                 a unit of work failed; what was finished before is kept
└── DeviceError              a device of the robot cannot be reached, refuses, or is another one

A message says what happened, where, and what the user can do.
"""

from pathlib import Path


class SdtError(Exception):
    """A failure with a foreseeable cause. Its text is one line, meant for the user."""

    exit_code = 1


class UsageError(SdtError):
    """The call, or a file given to it, is wrong."""

    exit_code = 2


class ConfigError(UsageError):
    """A configuration, scenario or domain file is wrong."""


class RecordingError(UsageError):
    """A recording is missing, damaged, or lacks what is asked of it."""


class DiskRefusedError(RecordingError):
    """The disk refuses what is to be recorded."""


class LabelError(UsageError):
    """A label journal is missing or malformed."""


class DatasetError(UsageError):
    """A data set is empty, conflicting, or of another geometry."""


class CheckpointError(UsageError):
    """A model folder is missing, incomplete, or of another architecture."""


class OutputExistsError(UsageError):
    """The output exists; nothing is ever written over unasked. ``option`` names it in the call, if one does."""

    def __init__(self, path: Path, option: str | None = "--out") -> None:
        advice = "move it away" if option is None else f"choose another {option}, or move it away"
        super().__init__(f"{path} exists already; {advice}")


class RunError(SdtError):
    """A unit of work failed."""


class DeviceError(SdtError):
    """A device of the robot cannot be reached, refuses, or is another one."""
