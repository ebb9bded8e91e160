"""Attachments: files within the file, each with its own checksum."""

from isal.isal_zlib import crc32
from mcap.records import Attachment

from sdt_tools.recording.container.records import UNREADABLE, body_of

_CHECKSUM_BYTES = 4


def read_attachment(body: memoryview) -> Attachment | None:
    """The attachment in the body of its record; None where that is damaged. A checksum of zero is none."""
    stream = body_of(body, 0, len(body))
    try:
        attachment = Attachment.read(stream)
    except UNREADABLE:
        return None
    covered = stream.count - _CHECKSUM_BYTES
    crc = int.from_bytes(body[covered : stream.count], "little")
    return attachment if not crc or crc32(body[:covered]) == crc else None
