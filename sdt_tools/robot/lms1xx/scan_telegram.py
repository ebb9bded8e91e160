"""LMDscandata: the telegram that holds a scan, with every part that it may have.

(SICK, *Telegram Listing*, 8014631, "Output of measured values".)
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Int64

from sdt_tools.robot.lms1xx.reading import FieldReader, TelegramError
from sdt_tools.robot.lms1xx.writing import FieldWriter

_MOST_CHANNELS: Final = 16
_NAME_LENGTH: Final = 5
_EVENT_LENGTH: Final = 4


@dataclass(frozen=True)
class Encoder:
    """An encoder's position, in ticks, and its speed, in ticks a millimetre."""

    position: int
    speed: int


@dataclass(frozen=True, eq=False)
class Channel:
    """One kind of values: distances (``DIST1``, in mm before scale and offset) or strengths (``RSSI1``).

    Angles are in 1/10000 degree in the device's frame: 0 is to its right, 90 degrees ahead.
    """

    content: str
    scale: float
    offset: float
    start_angle: int
    step: int
    values: Int64[np.ndarray, "values"]


@dataclass(frozen=True)
class Position:
    """Where the device says it stands; ``rotation_type`` is 0 for none, 1 pitching, 2 rolling, 3 free."""

    xyz: tuple[float, float, float]
    rotation: tuple[float, float, float]
    rotation_type: int


@dataclass(frozen=True)
class DeviceTime:
    """What the device's calendar says; it starts in 1970 unless somebody sets it."""

    year: int
    month: int
    day: int
    hour: int
    minute: int
    second: int
    microsecond: int


@dataclass(frozen=True)
class Event:
    """An edge at a fast digital input: encoder, time since start-up and angle (1/10000 degree) then."""

    kind: str
    encoder_position: int
    time_us: int
    angle: int


@dataclass(frozen=True, eq=False)
class ScanTelegram:
    """All that one LMDscandata says. Counters have 16 bits, microseconds since start-up 32: they wrap."""

    telegram_counter: int
    scan_counter: int
    start_us: int
    """When the scan began."""
    transmission_us: int
    """When it was handed over for sending."""
    channels_16bit: tuple[Channel, ...]
    channels_8bit: tuple[Channel, ...] = ()
    scan_frequency: int = 5000
    """In 1/100 Hz."""
    measurement_frequency: int = 360
    """Rays a second, in 100 Hz."""
    version: int = 1
    device_number: int = 1
    serial_number: int = 0
    device_status: tuple[int, int] = (0, 0)
    inputs: tuple[int, int] = (0, 0)
    outputs: tuple[int, int] = (7, 0)
    reserved: int = 0
    encoders: tuple[Encoder, ...] = ()
    position: Position | None = None
    device_name: str | None = None
    comment: str | None = None
    time: DeviceTime | None = None
    event: Event | None = None

    def channel(self, content: str) -> Channel | None:
        """The channel that holds ``content``; None where there is none."""
        return next((one for one in (*self.channels_16bit, *self.channels_8bit) if one.content == content), None)


def read_scan(fields: FieldReader) -> ScanTelegram:
    """The values behind ``LMDscandata``. Raises TelegramError where they break off or make no sense.

    What follows the channels may be missing, as in old firmware.
    """
    version, device_number = fields.unsigned(16), fields.unsigned(16)
    serial_number = fields.unsigned(32)
    device_status = _pair(fields)
    telegram_counter, scan_counter = fields.unsigned(16), fields.unsigned(16)
    start_us, transmission_us = fields.unsigned(32), fields.unsigned(32)
    inputs, outputs = _pair(fields), _pair(fields)
    reserved = fields.unsigned(16)
    scan_frequency, measurement_frequency = fields.unsigned(32), fields.unsigned(32)
    encoders = tuple(Encoder(fields.unsigned(32), fields.unsigned(16)) for _ in range(_count(fields, "encoders")))
    channels_16bit = _read_channels(fields, 16)
    return ScanTelegram(
        telegram_counter,
        scan_counter,
        start_us,
        transmission_us,
        channels_16bit,
        () if fields.at_end else _read_channels(fields, 8),
        scan_frequency,
        measurement_frequency,
        version,
        device_number,
        serial_number,
        device_status,
        inputs,
        outputs,
        reserved,
        encoders,
        _read_position(fields) if _present(fields) else None,
        fields.short_string() if _present(fields) else None,
        fields.short_string() if _present(fields) else None,
        _read_time(fields) if _present(fields) else None,
        _read_event(fields) if _present(fields) else None,
    )


def write_scan(fields: FieldWriter, scan: ScanTelegram) -> None:
    """Write the values behind ``LMDscandata``."""
    fields.unsigned(scan.version, 16)
    fields.unsigned(scan.device_number, 16)
    fields.unsigned(scan.serial_number, 32)
    _write_pair(fields, scan.device_status)
    fields.unsigned(scan.telegram_counter, 16)
    fields.unsigned(scan.scan_counter, 16)
    fields.unsigned(scan.start_us, 32)
    fields.unsigned(scan.transmission_us, 32)
    _write_pair(fields, scan.inputs)
    _write_pair(fields, scan.outputs)
    fields.unsigned(scan.reserved, 16)
    fields.unsigned(scan.scan_frequency, 32)
    fields.unsigned(scan.measurement_frequency, 32)
    fields.unsigned(len(scan.encoders), 16)
    for encoder in scan.encoders:
        fields.unsigned(encoder.position, 32)
        fields.unsigned(encoder.speed, 16)
    _write_channels(fields, scan.channels_16bit, 16)
    _write_channels(fields, scan.channels_8bit, 8)
    _write_tail(fields, scan)


def _write_tail(fields: FieldWriter, scan: ScanTelegram) -> None:
    fields.unsigned(scan.position is not None, 16)
    if scan.position is not None:
        for value in (*scan.position.xyz, *scan.position.rotation):
            fields.real(value)
        fields.unsigned(scan.position.rotation_type, 8)
    for text in (scan.device_name, scan.comment):
        fields.unsigned(text is not None, 16)
        if text is not None:
            fields.string(text, 8)
    fields.unsigned(scan.time is not None, 16)
    if scan.time is not None:
        time = scan.time
        fields.unsigned(time.year, 16)
        for value in (time.month, time.day, time.hour, time.minute, time.second):
            fields.unsigned(value, 8)
        fields.unsigned(time.microsecond, 32)
    fields.unsigned(scan.event is not None, 16)
    if scan.event is not None:
        fields.word(scan.event.kind)
        fields.unsigned(scan.event.encoder_position, 32)
        fields.unsigned(scan.event.time_us, 32)
        fields.signed(scan.event.angle, 32)


def _read_channels(fields: FieldReader, bits: int) -> tuple[Channel, ...]:
    return tuple(_read_channel(fields, bits) for _ in range(_count(fields, f"{bits}-bit channels")))


def _read_channel(fields: FieldReader, bits: int) -> Channel:
    content = fields.word(_NAME_LENGTH)
    scale, offset = fields.real(), fields.real()
    start_angle, step, count = fields.signed(32), fields.unsigned(16), fields.unsigned(16)
    try:
        values = fields.array(bits, count)
    except TelegramError as error:
        raise TelegramError(f"{content}: {error}") from None
    return Channel(content, scale, offset, start_angle, step, values)


def _write_channels(fields: FieldWriter, channels: tuple[Channel, ...], bits: int) -> None:
    fields.unsigned(len(channels), 16)
    for channel in channels:
        fields.word(channel.content)
        fields.real(channel.scale)
        fields.real(channel.offset)
        fields.signed(channel.start_angle, 32)
        fields.unsigned(channel.step, 16)
        fields.unsigned(len(channel.values), 16)
        fields.array(channel.values, bits)


def _read_position(fields: FieldReader) -> Position:
    x, y, z, roll, pitch, yaw = (fields.real() for _ in range(6))
    return Position((x, y, z), (roll, pitch, yaw), fields.unsigned(8))


def _read_time(fields: FieldReader) -> DeviceTime:
    year = fields.unsigned(16)
    month, day, hour, minute, second = (fields.unsigned(8) for _ in range(5))
    return DeviceTime(year, month, day, hour, minute, second, fields.unsigned(32))


def _read_event(fields: FieldReader) -> Event:
    return Event(fields.word(_EVENT_LENGTH), fields.unsigned(32), fields.unsigned(32), fields.signed(32))


def _present(fields: FieldReader) -> bool:
    return not fields.at_end and fields.unsigned(16) != 0


def _count(fields: FieldReader, what: str) -> int:
    count = fields.unsigned(16)
    if count > _MOST_CHANNELS:
        raise TelegramError(f"{count} {what} are announced; no device has more than {_MOST_CHANNELS}")
    return count


def _pair(fields: FieldReader) -> tuple[int, int]:
    return fields.unsigned(8), fields.unsigned(8)


def _write_pair(fields: FieldWriter, values: tuple[int, int]) -> None:
    for value in values:
        fields.unsigned(value, 8)
