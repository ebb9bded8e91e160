"""Where everything lies in an MCAP file: from its summary where that is whole, else by walking its records."""

from sdt_tools.recording.container.records import FileIndex
from sdt_tools.recording.container.summary import DamagedSummaryError, read_summary
from sdt_tools.recording.container.walk import walk


def read_index(view: memoryview) -> FileIndex:
    """The index of the MCAP file whose bytes are ``view`` (which starts with the magic)."""
    try:
        summary = read_summary(view)
    except DamagedSummaryError as error:
        index = walk(view)
        index.harmless.append(str(error))
        return index
    return summary if summary is not None else walk(view)
