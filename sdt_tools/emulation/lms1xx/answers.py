"""What the emulated device answers to each command."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from sdt_tools.emulation.lms1xx.device import EmulatedDevice, Refusal, RefusedError, Session
from sdt_tools.emulation.lms1xx.making import SERIAL
from sdt_tools.robot.lms1xx.reading import FieldReader, TelegramError
from sdt_tools.robot.lms1xx.settings import (
    Identity,
    read_data_settings,
    read_output_range,
    read_scan_settings,
    write_data_settings,
    write_identity,
    write_output_range,
    write_scan_settings,
)
from sdt_tools.robot.lms1xx.telegram import REFUSAL, SCAN_DATA, Telegram
from sdt_tools.robot.lms1xx.writing import FieldWriter, writer_for

_CLIENT: Final = 3
_OTHER_PASSWORDS: Final = {2: 0xB21ACE26, 4: 0x81BE23AA}
_EVENTS: Final = (SCAN_DATA, "LFErec", "LIDoutputstate", "LIDinputstate")
_WITHOUT_EFFECT: Final = (
    *("LocationName", "FREchoFilter", "LFPmeanfilter", "LFPmedianfilter", "LFPnto1filter", "SetActiveApplications"),
    *("LICencset", "LICencres", "LICsrc", "EIHstCola"),
)
"""Settings that are taken, and change nothing here."""


@dataclass(frozen=True)
class Request:
    """A telegram that one client has sent at a host's time; its answer's values go to ``answer``."""

    device: EmulatedDevice
    session: Session
    telegram: Telegram
    answer: FieldWriter
    host_ns: int

    @property
    def values(self) -> FieldReader:
        """Those of the telegram."""
        return self.telegram.fields


Answer = Callable[[Request], None]
"""Does what a telegram says, and writes the values of its answer."""


def answer(device: EmulatedDevice, session: Session, telegram: Telegram, host_ns: int) -> bytes:
    """The body of the answer to ``telegram``."""
    fields = writer_for(device.dialect)
    try:
        kind = _perform(Request(device, session, telegram, fields, host_ns))
    except RefusedError as error:
        return _refused(device, error.refusal)
    except TelegramError:
        return _refused(device, Refusal.TOO_SHORT)
    return fields.body(f"{kind} {telegram.name}")


def _refused(device: EmulatedDevice, refusal: Refusal) -> bytes:
    fields = writer_for(device.dialect)
    fields.unsigned(refusal.value, 16)
    return fields.body(REFUSAL)


def _perform(request: Request) -> str:
    """Do what is asked; the kind of the answer."""
    name = request.telegram.name
    match request.telegram.kind:
        case "sRN" | "sRI":
            _find(_READ, "DeviceIdent" if name == "0" else name, Refusal.NO_SUCH_VARIABLE)(request)
            return "sRA"
        case "sWN":
            write = _find(_WRITE, name, Refusal.NO_SUCH_VARIABLE)
            if request.session.level < _CLIENT:
                raise RefusedError(Refusal.MAY_NOT_WRITE)
            write(request)
            return "sWA"
        case "sMN":
            _find(_METHODS, name, Refusal.NO_SUCH_METHOD)(request)
            return "sAN"
        case "sEN":
            _subscribe(request, name)
            return "sEA"
        case _:
            raise RefusedError(Refusal.NO_SUCH_KIND)


def _subscribe(request: Request, name: str) -> None:
    if name not in _EVENTS:
        raise RefusedError(Refusal.NO_SUCH_EVENT)
    wanted = request.values.unsigned(8)
    if name == SCAN_DATA:
        request.session.streams = bool(wanted)
    request.answer.unsigned(wanted, 8)


def _find(table: Mapping[str, Answer], name: str, otherwise: Refusal) -> Answer:
    if name not in table:
        raise RefusedError(otherwise)
    return table[name]


def _tell_identity(request: Request) -> None:
    write_identity(request.answer, Identity(request.device.config.kind, request.device.config.version))


def _tell_state(request: Request) -> None:
    seconds = int(request.device.time.us_at(request.host_ns) / 1e6)
    request.answer.unsigned(request.device.state(request.host_ns), 16)
    request.answer.unsigned(0, 8)
    request.answer.string(f"{seconds // 3600 % 24:02}:{seconds // 60 % 60:02}:{seconds % 60:02}")
    request.answer.string("01.01.1970")
    for _ in range(3):
        request.answer.unsigned(0, 16)


def _told(write: Callable[[EmulatedDevice, FieldWriter], None]) -> Answer:
    def tell(request: Request) -> None:
        write(request.device, request.answer)

    return tell


def _taken(request: Request) -> None:
    """Take a setting that changes nothing."""
    del request


def _taken_from_clients(request: Request) -> None:
    """Take a command that whoever serves the device carries out."""
    _check_login(request.session)


def _set_data(request: Request) -> None:
    request.device.set_data(read_data_settings(request.values))


def _set_output(request: Request) -> None:
    request.device.set_output(read_output_range(request.values))


def _log_in(request: Request) -> None:
    level, password = request.values.signed(8), request.values.unsigned(32)
    right = password == (_OTHER_PASSWORDS | {_CLIENT: int(request.device.config.password, 16)}).get(level)
    if right:
        request.session.level = level
    request.answer.unsigned(right, 8)


def _set_scan(request: Request) -> None:
    _check_login(request.session)
    request.answer.unsigned(request.device.set_scan(read_scan_settings(request.values)), 8)
    write_scan_settings(request.answer, request.device.settings.scan)


def _start(request: Request) -> None:
    _check_login(request.session)
    request.device.start(request.host_ns)
    request.answer.unsigned(0, 8)


def _stop(request: Request) -> None:
    _check_login(request.session)
    request.device.stop()
    request.answer.unsigned(0, 8)


def _run(request: Request) -> None:
    request.session.level = 0
    request.answer.unsigned(1, 8)


def _store(request: Request) -> None:
    _check_login(request.session)
    request.device.store()
    request.answer.unsigned(1, 8)


def _check_login(session: Session) -> None:
    if session.level < _CLIENT:
        raise RefusedError(Refusal.NOT_ALLOWED)


_READ: Final[Mapping[str, Answer]] = {
    "DeviceIdent": _tell_identity,
    "STlms": _tell_state,
    "LMPscancfg": _told(lambda device, fields: write_scan_settings(fields, device.settings.scan)),
    "LMDscandatacfg": _told(lambda device, fields: write_data_settings(fields, device.settings.data)),
    "LMPoutputRange": _told(lambda device, fields: write_output_range(fields, device.settings.output)),
    "SCdevicestate": _told(lambda _, fields: fields.unsigned(1, 8)),
    "FirmwareVersion": _told(lambda device, fields: fields.string(device.config.version)),
    "SerialNumber": _told(lambda _, fields: fields.string(f"{SERIAL:08}")),
    "LocationName": _told(lambda device, fields: fields.string(device.config.device_name or "not defined")),
    "ODoprh": _told(lambda _, fields: fields.unsigned(0, 32)),
    "ODpwrc": _told(lambda device, fields: fields.unsigned(device.power_ons, 32)),
}
_WRITE: Final[Mapping[str, Answer]] = {
    "LMDscandatacfg": _set_data,
    "LMPoutputRange": _set_output,
    **dict.fromkeys(_WITHOUT_EFFECT, _taken),
}
_METHODS: Final[Mapping[str, Answer]] = {
    "SetAccessMode": _log_in,
    "mLMPsetscancfg": _set_scan,
    "LMCstartmeas": _start,
    "LMCstopmeas": _stop,
    "LMCstandby": _stop,
    "Run": _run,
    "mEEwriteall": _store,
    "mSCreboot": _taken_from_clients,
}
