"""What can be set on an LMS1xx, as it stands in telegrams, and what the device says of its state.

Frequencies are in 1/100 Hz and angles in 1/10000 degree, in the device's frame: -45 to 225 degrees, 90 ahead.
"""

from dataclasses import dataclass
from typing import Final

from sdt_tools.robot.lms1xx.reading import FieldReader
from sdt_tools.robot.lms1xx.writing import FieldWriter

FIRST_ANGLE: Final = -450_000
LAST_ANGLE: Final = 2_250_000
HALF_DEGREE: Final = 5_000
MEASURING: Final = 7

_STATES: Final = {
    0: "undefined",
    1: "initialising",
    2: "being configured",
    3: "idle",
    4: "its mirror turns",
    5: "in preparation",
    6: "ready",
    MEASURING: "ready to measure",
}
_SETTING_FAILURES: Final = {
    1: "it does not take this frequency",
    2: "it does not take this resolution",
    3: "it takes neither this resolution nor this range of angles",
    4: "it does not take this range of angles",
}


@dataclass(frozen=True)
class ScanSettings:
    """LMPscancfg: how fast the mirror turns and how far rays are apart.

    An LMS1xx measures its full range whatever angles are asked for here.
    """

    frequency: int
    resolution: int
    first_angle: int = FIRST_ANGLE
    last_angle: int = LAST_ANGLE

    def same_rays(self, other: "ScanSettings") -> bool:
        """Whether the rays are the same; the angles change nothing, and firmware differs in what it says of them."""
        return (self.frequency, self.resolution) == (other.frequency, other.resolution)


@dataclass(frozen=True)
class OutputRange:
    """LMPoutputRange: which rays are sent."""

    resolution: int
    first_angle: int = FIRST_ANGLE
    last_angle: int = LAST_ANGLE


@dataclass(frozen=True)
class DataSettings:
    """LMDscandatacfg: what a scan's telegram holds. ``interval`` 1 sends every scan, 2 every second one."""

    echoes: int = 1
    remission: bool = False
    remission_16bit: bool = False
    unit: int = 0
    encoder: int = 0
    position: bool = False
    device_name: bool = False
    comment: bool = False
    time: bool = False
    interval: int = 1


@dataclass(frozen=True)
class Identity:
    """What the device says it is, as ``LMS10x_FieldEval`` and ``V1.36-21.10.2010``."""

    kind: str
    version: str

    def __str__(self) -> str:
        return f"{self.kind} {self.version}".strip()


def state_words(state: int) -> str:
    """What a number of STlms means."""
    return f"{_STATES.get(state, 'in a state that is in no list of ours')} (state {state})"


def setting_failure_words(code: int) -> str:
    """What a number of mLMPsetscancfg other than 0 means."""
    return f"{_SETTING_FAILURES.get(code, 'an error that it does not name')} (code {code})"


def read_scan_settings(fields: FieldReader) -> ScanSettings:
    """As in the answers to LMPscancfg and, behind their code, mLMPsetscancfg; of several sectors the first."""
    frequency = fields.unsigned(32)
    fields.unsigned(16)
    return ScanSettings(frequency, fields.unsigned(32), fields.signed(32), fields.signed(32))


def write_scan_settings(fields: FieldWriter, settings: ScanSettings) -> None:
    """One sector."""
    fields.unsigned(settings.frequency, 32)
    fields.unsigned(1, 16)
    fields.unsigned(settings.resolution, 32)
    fields.signed(settings.first_angle, 32)
    fields.signed(settings.last_angle, 32)


def read_output_range(fields: FieldReader) -> OutputRange:
    """Of several sectors the first."""
    fields.unsigned(16)
    return OutputRange(fields.unsigned(32), fields.signed(32), fields.signed(32))


def write_output_range(fields: FieldWriter, output: OutputRange) -> None:
    """One sector."""
    fields.unsigned(1, 16)
    fields.unsigned(output.resolution, 32)
    fields.signed(output.first_angle, 32)
    fields.signed(output.last_angle, 32)


def read_data_settings(fields: FieldReader) -> DataSettings:
    """As in the answer to LMDscandatacfg."""
    echoes, _ = fields.unsigned(8), fields.unsigned(8)
    remission, remission_16bit, unit = bool(fields.unsigned(8)), bool(fields.unsigned(8)), fields.unsigned(8)
    encoder, _ = fields.unsigned(8), fields.unsigned(8)
    position, device_name, comment, time = (bool(fields.unsigned(8)) for _ in range(4))
    return DataSettings(
        echoes, remission, remission_16bit, unit, encoder, position, device_name, comment, time, fields.unsigned(16)
    )


def write_data_settings(fields: FieldWriter, settings: DataSettings) -> None:
    """As LMDscandatacfg takes it."""
    for value in (settings.echoes, 0, settings.remission, settings.remission_16bit, settings.unit, settings.encoder, 0):
        fields.unsigned(value, 8)
    for value in (settings.position, settings.device_name, settings.comment, settings.time):
        fields.unsigned(value, 8)
    fields.unsigned(settings.interval, 16)


def read_identity(fields: FieldReader) -> Identity:
    """As in the answer to DeviceIdent."""
    return Identity(fields.string(), fields.string())


def write_identity(fields: FieldWriter, identity: Identity) -> None:
    """As DeviceIdent is answered."""
    fields.string(identity.kind)
    fields.string(identity.version)
