"""Files made from other files: every record taken over as it is, into a file that is whole or not there."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mcap.reader import make_reader
from mcap.records import Channel

from sdt_tools.errors import OutputExistsError, RecordingError
from sdt_tools.recording.container.file import McapFile
from sdt_tools.recording.container.reader import McapReader, RawEntry
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, is_ours
from sdt_tools.recording.scratch import give_name, scratch_folder
from sdt_tools.recording.session import SOFTWARE
from sdt_tools.recording.timing.pauses import PAUSES, Pauses, pauses_text
from sdt_tools.recording.timing.stamps import StampLog
from sdt_tools.recording.timing.summary import timing_entries, timing_of


class RecordCopy:
    """Takes messages of one file after another over into ``file``, their data untouched.

    Channels are announced when their first message comes, or by ``announce``; the same topic, schema, encoding and
    metadata from several files make one channel.
    """

    def __init__(self, file: McapFile) -> None:
        self._file = file
        self._numbers: dict[tuple[object, ...], int] = {}
        self._ours: dict[int, str] = {}
        self._stamps = StampLog()

    @property
    def has_ours(self) -> bool:
        """Whether topics of ours are among those that were announced."""
        return bool(self._ours)

    def announce(self, source: McapReader, channel: Channel) -> int:
        """The number of ``channel`` of ``source`` in the new file."""
        schema = source.schema(channel)
        name, encoding, data = ("", "", b"") if schema is None else (schema.name, schema.encoding, schema.data)
        key = (
            channel.topic,
            channel.message_encoding,
            name,
            encoding,
            data,
            tuple(sorted(channel.metadata.items())),
        )
        number = self._numbers.get(key)
        if number is None:
            number = self._numbers[key] = self._file.add_channel(
                channel.topic,
                name,
                data,
                schema_encoding=encoding,
                encoding=channel.message_encoding,
                metadata=channel.metadata,
            )
            if is_ours(channel.topic, name, channel.message_encoding):
                self._ours[number] = channel.topic
        return number

    def take(self, source: McapReader, entry: RawEntry) -> None:
        """One message of ``source``."""
        channel = source.channels[entry.channel_id]
        number = self.announce(source, channel)
        compress = channel.topic != CAMERA_IMAGE  # JPEG does not compress
        self._file.add_message(number, entry.log_ns, entry.publish_ns, entry.data, compress)
        if number in self._ours:
            self._stamps.see(self._ours[number], entry.log_ns, entry.publish_ns)

    def stats(self, pauses: Pauses) -> dict[str, str]:
        """Entries of ``sdt.stats``: counts, timing and ``pauses`` of what is in the file by now."""
        counts = {f"count.{topic}": str(count) for topic, count in self._file.counts.items()}
        told = {PAUSES: pauses_text(pauses)} if pauses else {}
        return counts | told | timing_entries(timing_of(self._stamps, pauses))


@contextmanager
def new_file(out: Path, library: str = SOFTWARE, profile: str = "") -> Iterator[McapFile]:
    """A file to be written at ``out``, which appears there only when it is finished and another reader has read it.

    Raises OutputExistsError where ``out`` exists, RecordingError where the disk refuses or what was written does not
    read back; then nothing is left at ``out``.
    """
    if out.exists():
        raise OutputExistsError(out)
    with scratch_folder(out) as scratch:
        part = scratch / out.name
        file = McapFile(part, library, profile=profile)
        try:
            yield file
            file.finish()
        finally:
            file.close()
        check_readable(part, sum(file.counts.values()))
        give_name(part, out)


def check_readable(path: Path, messages: int) -> None:
    """Read ``path`` with the mcap package, checksums too; raises RecordingError unless it finds so many messages."""
    try:
        with path.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            found = sum(1 for _ in reader.iter_messages())  # in order of time: else it holds them all in memory
    except Exception as error:
        raise RecordingError(f"{path}: what was written does not read back ({error}); check the disk") from None
    if found != messages:
        raise RecordingError(f"{path}: {found} of {messages} messages read back; check the disk")
