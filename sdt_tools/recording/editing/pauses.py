"""Where a new recording holds nothing because nobody recorded, or because it was dropped: nothing is missing there."""

import json
from collections.abc import Iterable, Iterator, Sequence

from sdt_tools.recording.container.reader import McapReader
from sdt_tools.recording.editing.latched import EDIT
from sdt_tools.recording.editing.span import Span, whole_span
from sdt_tools.recording.timing.pauses import Pauses, pauses_in


def recorded(source: McapReader, spans: Iterable[Span]) -> Iterator[Span]:
    """What was recorded of ``spans`` of ``source``: they without its pauses."""
    pauses = sorted(pauses_in(source))
    for span in spans:
        start_ns = span.start_ns
        for pause_start_ns, pause_end_ns in pauses:
            if pause_start_ns < span.end_ns and pause_end_ns > start_ns:
                if start_ns < pause_start_ns:
                    yield Span(start_ns, pause_start_ns)
                start_ns = pause_end_ns
        if start_ns < span.end_ns:
            yield Span(start_ns, span.end_ns)


def pauses_between(spans: Iterable[Span]) -> Pauses:
    """The holes that ``spans``, in any order, leave together."""
    pauses: list[tuple[int, int]] = []
    reached_ns: int | None = None
    for span in sorted(spans, key=lambda span: span.start_ns):
        if reached_ns is not None and span.start_ns > reached_ns:
            pauses.append((reached_ns, span.start_ns))
        reached_ns = span.end_ns if reached_ns is None else max(reached_ns, span.end_ns)
    return tuple(pauses)


def spans_of(source: McapReader) -> Sequence[Span]:
    """The intervals that ``source`` is about: as its edit says, which may take in more than its messages do."""
    edits = [record.metadata for record in source.metadata if record.name == EDIT]
    try:
        said = json.loads(edits[-1]["spans_ns"]) if edits else []
        spans = [Span(int(start_ns), int(end_ns)) for start_ns, end_ns in said]
    except (KeyError, TypeError, ValueError):
        spans = []
    return spans or [whole_span(source)]
