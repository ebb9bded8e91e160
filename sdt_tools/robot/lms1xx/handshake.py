"""From an open connection to a stream of scans: who is there, how it is set, what must change, until it is ready.

Nothing is written that stands already, nobody logs in where nothing is written, and nothing is stored permanently
unless asked.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from threading import Event
from time import monotonic
from typing import Final, TypeVar

from sdt_tools.errors import DeviceError
from sdt_tools.robot.lms1xx.config import Lms1xxConfig
from sdt_tools.robot.lms1xx.framing import Dialect
from sdt_tools.robot.lms1xx.link import ANSWER_S, Link, LinkLostError, NoAnswerError, RefusedError
from sdt_tools.robot.lms1xx.reading import FieldReader, TelegramError
from sdt_tools.robot.lms1xx.settings import (
    MEASURING,
    DataSettings,
    Identity,
    OutputRange,
    ScanSettings,
    read_data_settings,
    read_identity,
    read_output_range,
    read_scan_settings,
    setting_failure_words,
    state_words,
    write_data_settings,
    write_output_range,
    write_scan_settings,
)
from sdt_tools.robot.lms1xx.telegram import Telegram

Say = Callable[[str], None]
"""Takes a line about what is being done."""
ValueT = TypeVar("ValueT")
_LMS1XX: Final = re.compile(r"LMS1[0-9x]{2}(?![0-9x])", re.IGNORECASE)
UNNAMED: Final = Identity("a device that does not name itself", "")
_POLL_S: Final = 0.1
_AGAIN_S: Final = 10.0
"""A device that is not ready after so long, though told to measure, is logged out of and told again."""
_STORE_S: Final = 10.0
"""Writing the flash memory takes seconds."""
_RUN_S: Final = 5.0


@dataclass(frozen=True)
class Changes:
    """Settings to be written; None where what stands will do."""

    scan: ScanSettings | None = None
    data: DataSettings | None = None
    output: OutputRange | None = None

    def __bool__(self) -> bool:
        return any(change is not None for change in (self.scan, self.data, self.output))


def open_link(
    config: Lms1xxConfig, connect_s: float = 3.0, wait_s: float = ANSWER_S, first: Dialect | None = None
) -> tuple[Link, Identity]:
    """A connection to an LMS1xx in the first dialect that it answers in, and what it says it is.

    ``first`` is the dialect to try before others.

    Raises DeviceError where nothing can be reached, where something else answers, or nothing does.
    """
    heard = b""
    for dialect in sorted(config.dialects, key=lambda dialect: dialect is not first):
        link = Link(config.host, config.port, dialect, config.place, connect_s)
        try:
            return link, _lms1xx(link, wait_s)
        except (NoAnswerError, LinkLostError):
            heard = heard or link.heard
            link.close()
        except BaseException:
            link.close()
            raise
    raise DeviceError(f"{config.place}: {_stranger(config.dialects, heard)}")


def start_stream(link: Link, config: Lms1xxConfig, closing: Event, say: Say, mute: set[str]) -> None:
    """Have the device measure as ``config`` says, and send its scans.

    ``mute`` holds settings that this device does not tell, and learns more of them: nobody waits for them twice.

    Raises DeviceError where it refuses, where its password is another, or where it does not get ready in time.
    """
    changes = needed_changes(link, config, mute)
    state = _state(link)
    if changes or state != MEASURING:
        if state != MEASURING:
            say(f"{config.place} is {state_words(state)}: waiting for it")
        _log_in(link, config)
        _write(link, config, changes, say)
        _get_ready(link, config, closing, say)
        _accepted(link.ask("sMN Run", wait_s=_RUN_S), 1)
    fields = link.writer()
    fields.unsigned(1, 8)
    link.ask("sEN LMDscandata", fields)


def needed_changes(link: Link, config: Lms1xxConfig, mute: set[str]) -> Changes:
    """What must be written. A setting that the device does not tell is written, if it matters."""
    wanted = config.scan_settings
    scan = _read(link, "LMPscancfg", read_scan_settings, mute)
    data = _read(link, "LMDscandatacfg", read_data_settings, mute)
    output = _read(link, "LMPoutputRange", read_output_range, mute)
    wanted_output = OutputRange(wanted.resolution)
    return Changes(
        None if scan is not None and scan.same_rays(wanted) else wanted,
        None if data is not None and data.echoes & 1 and data.interval == 1 else _all_scans(data),
        None if output is None or output == wanted_output else wanted_output,
    )


def _all_scans(data: DataSettings | None) -> DataSettings:
    """Every scan, with its first echo; what else was set, by whomever, stays."""
    return DataSettings() if data is None else replace(data, echoes=data.echoes | 1, interval=1)


def _lms1xx(link: Link, wait_s: float) -> Identity:
    identity = _identity(link, wait_s)
    if identity == UNNAMED:
        return identity
    if _LMS1XX.match(identity.kind) is None:
        raise DeviceError(
            f"{link.place} is no LMS1xx: it says it is '{identity}'; give the LiDAR's address, or use another driver"
        )
    return identity


def _identity(link: Link, wait_s: float) -> Identity:
    """What the device says it is; UNNAMED where it does not say, but tells its state as an LMS1xx does."""
    for head in ("sRN DeviceIdent", "sRI 0"):  # the second as old firmware calls it
        try:
            return _parsed(link, link.ask(head, wait_s=wait_s), read_identity)
        except RefusedError:
            continue
        except NoAnswerError:
            break
    link.ask("sRN STlms", wait_s=wait_s)
    return UNNAMED


def _stranger(dialects: tuple[Dialect, ...], heard: bytes) -> str:
    tried = " or ".join(dialect.label for dialect in dialects)
    if heard:
        return (
            f"what answers there is no SICK device (it says {heard[:30].decode('latin-1')!r}); "
            "check address and port: an LMS1xx listens at 2111 and 2112"
        )
    other = "" if len(dialects) > 1 else ", or set the protocol to auto"
    return (
        f"something listens there, but does not answer in {tried}; is it the LiDAR, and has it started? "
        f"check address and port (2111 or 2112){other}"
    )


def _read(link: Link, name: str, read: Callable[[FieldReader], ValueT], mute: set[str]) -> ValueT | None:
    """What is set; None where the device refuses to tell, is silent about it, or tells it in another way."""
    if name in mute:
        return None
    try:
        return read(link.ask(f"sRN {name}").fields)
    except (RefusedError, NoAnswerError, TelegramError):
        mute.add(name)
        return None


def _state(link: Link) -> int:
    return _parsed(link, link.ask("sRN STlms"), lambda fields: fields.unsigned(16))


def _log_in(link: Link, config: Lms1xxConfig) -> None:
    level, password = config.login
    fields = link.writer()
    fields.signed(level, 8)
    fields.unsigned(int(password, 16), 32)
    if not _accepted(link.ask("sMN SetAccessMode", fields), 1):
        raise DeviceError(
            f"{config.place} does not take the password '{config.password}'; "
            "give the one that is set in it, or reset it with SICK's software"
        )


def _write(link: Link, config: Lms1xxConfig, changes: Changes, say: Say) -> None:
    if changes.scan is not None:
        say(f"{config.place}: setting {config.scan_hz} Hz and {config.resolution_deg:g}°")
        fields = link.writer()
        write_scan_settings(fields, changes.scan)
        code = _parsed(link, link.ask("sMN mLMPsetscancfg", fields, wait_s=_RUN_S), lambda answer: _first(answer, 0))
        if code:
            raise DeviceError(
                f"{config.place} refused {config.scan_hz} Hz and {config.resolution_deg:g}°: "
                f"{setting_failure_words(code)}; choose another rate"
            )
    if changes.data is not None:
        say(f"{config.place}: setting what a scan holds")
        fields = link.writer()
        write_data_settings(fields, changes.data)
        link.ask("sWN LMDscandatacfg", fields)
    if changes.output is not None:
        say(f"{config.place}: having it send all rays")
        fields = link.writer()
        write_output_range(fields, changes.output)
        link.ask("sWN LMPoutputRange", fields)
    if changes and config.permanent:
        say(f"{config.place}: storing its settings for good")
        _accepted(link.ask("sMN mEEwriteall", wait_s=_STORE_S), 1)


def _get_ready(link: Link, config: Lms1xxConfig, closing: Event, say: Say) -> None:
    """Have it measure, and wait until it does."""
    link.ask("sMN LMCstartmeas", wait_s=_RUN_S)
    began_s = told_s = monotonic()
    state = _state(link)
    while state != MEASURING:
        if closing.wait(_POLL_S):
            raise DeviceError(f"{config.place}: closed while it was not ready yet")
        waited_s = monotonic() - began_s
        if waited_s > config.ready_s:
            raise DeviceError(
                f"{config.place} is not ready after {waited_s:.0f} s: {state_words(state)}; power it off and on, "
                "and look for a message in its display"
            )
        if monotonic() - told_s > _AGAIN_S:
            say(f"{config.place} is still {state_words(state)}: starting it again")
            _accepted(link.ask("sMN Run", wait_s=_RUN_S), 1)
            _log_in(link, config)
            link.ask("sMN LMCstartmeas", wait_s=_RUN_S)
            told_s = monotonic()
        state = _state(link)


def _accepted(answer: Telegram, yes: int) -> bool:
    """Whether the number of ``answer`` is ``yes``; some firmware gives none."""
    return _first(answer.fields, yes) == yes


def _first(fields: FieldReader, otherwise: int) -> int:
    """The first value; ``otherwise`` where there is none."""
    return otherwise if fields.at_end else fields.unsigned(8)


def _parsed(link: Link, answer: Telegram, read: Callable[[FieldReader], ValueT]) -> ValueT:
    try:
        return read(answer.fields)
    except TelegramError as error:
        raise DeviceError(f"{link.place}: its answer about {answer.name} makes no sense: {error}") from None
