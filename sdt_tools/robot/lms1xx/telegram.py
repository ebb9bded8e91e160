"""A telegram's head: what kind it is, and what it is about."""

import re
from dataclasses import dataclass
from typing import Final

from sdt_tools.robot.lms1xx.framing import Dialect
from sdt_tools.robot.lms1xx.reading import FieldReader, TelegramError, reader_for

REFUSAL: Final = "sFA"
SCAN_DATA: Final = "LMDscandata"
_HEAD: Final = re.compile(rb"(s[A-Z]{2})(?: (\w+))?")


@dataclass(frozen=True)
class Telegram:
    """One telegram: its kind, as ``sRA``, the name of what it is about, and its values, not read yet."""

    kind: str
    name: str
    fields: FieldReader

    @property
    def is_scan(self) -> bool:
        """Whether it holds a scan: sent unasked, or as the answer to a question."""
        return self.name == SCAN_DATA and self.kind in ("sSN", "sRA")


def parse_telegram(dialect: Dialect, body: bytes) -> Telegram:
    """The telegram with this body. Raises TelegramError where it has no head of one."""
    if body[:3] == REFUSAL.encode():
        return Telegram(REFUSAL, "", reader_for(dialect, _after_blank(body[3:])))
    head = _HEAD.match(body)
    if head is None:
        raise TelegramError(f"{body[:20]!r} begins no telegram")
    kind, name = head[1].decode(), (head[2] or b"").decode()
    return Telegram(kind, name, reader_for(dialect, _after_blank(body[head.end() :])))


def refusal_code(telegram: Telegram) -> int:
    """The number of a refusal; 0 where it has none."""
    for bits in (16, 8):
        try:
            return telegram.fields.unsigned(bits)
        except TelegramError:
            continue
    return 0


def _after_blank(data: bytes) -> bytes:
    return data[1:] if data[:1] == b" " else data
