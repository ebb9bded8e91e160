"""Pauses of a recording that was killed: only its log tells of them."""

from pathlib import Path

import pytest
from recording_samples import CONFIG, INFO, PERIOD_NS, T0, scan

from sdt_tools.frames import LogEntry, LogLevel, Received
from sdt_tools.recording.exchange.parquet.exporting import export_parquet
from sdt_tools.recording.exchange.parquet.importing import import_parquet
from sdt_tools.recording.inspect import inspect_recording
from sdt_tools.recording.reader import Recording
from sdt_tools.recording.repair import repair_recording
from sdt_tools.recording.timing.pauses import paused_entry, resumed_entry
from sdt_tools.recording.writer import RecordingWriter

FIRST, SECOND = (50, 100), (120, 130)
"""Scans that are left out, by number."""


def moment(number: int) -> int:
    return T0 + number * PERIOD_NS


PAUSES = ((moment(50), moment(100)), (moment(120), moment(130)))


def killed(path: Path, last: int = 150) -> Path:
    """As a recorder that was paused twice leaves it when it is killed before its scan ``last``."""
    with RecordingWriter(path, INFO, CONFIG, chunk_bytes=20_000) as writer:
        for number in range(last):
            for start, end in (FIRST, SECOND):
                if number == start:
                    writer.write(Received(moment(number), paused_entry(moment(number))))
                if number == end:
                    seconds = (end - start) * PERIOD_NS / 1e9
                    writer.write(Received(moment(number), resumed_entry(moment(number), seconds)))
            if not any(start <= number < end for start, end in (FIRST, SECOND)):
                writer.write(scan(number))
        size = writer.size
    path.write_bytes(path.read_bytes()[:size])
    return path


def test_the_pauses_of_a_cut_recording_are_read_from_its_log(tmp_path: Path) -> None:
    path = killed(tmp_path / "cut.mcap")
    with Recording.open(path) as recording:
        assert recording.truncated
        assert recording.pauses == PAUSES
    report = inspect_recording(path)
    assert report.topic_document("/lidar/scan")["gaps"] == 0
    assert report.topic_document("/lidar/scan")["max_gap_ms"] == 20.0


def test_a_repaired_recording_keeps_them(tmp_path: Path) -> None:
    repair_recording(killed(tmp_path / "cut.mcap"), tmp_path / "new.mcap")
    report = inspect_recording(tmp_path / "new.mcap")
    assert report.stats["pauses_ns"] == " ".join(f"{start}-{end}" for start, end in PAUSES)
    assert report.topic_document("/lidar/scan")["gaps"] == 0
    assert not report.counted


def test_what_is_exported_from_a_cut_recording_keeps_them(tmp_path: Path) -> None:
    export_parquet(killed(tmp_path / "cut.mcap"), tmp_path / "table")
    import_parquet(tmp_path / "table", tmp_path / "new.mcap")
    with Recording.open(tmp_path / "new.mcap") as recording:
        assert recording.pauses == PAUSES


@pytest.mark.parametrize("last", [52, 125])
def test_a_pause_that_never_ended_is_none(tmp_path: Path, last: int) -> None:
    with Recording.open(killed(tmp_path / "cut.mcap", last)) as recording:
        assert recording.pauses == PAUSES[: last > 100]


def test_other_words_in_the_log_are_no_pauses(tmp_path: Path) -> None:
    path = tmp_path / "r.mcap"
    with RecordingWriter(path, INFO, CONFIG) as writer:
        for number, (text, name) in enumerate(
            [("resumed", "pause"), (paused_entry(0).text, "mark"), ("resumed", "mark"), ("resumed", "pause")]
        ):
            writer.write(Received(moment(number), LogEntry(moment(number), LogLevel.INFO, text, name)))
        writer.write(scan(9))
    path.write_bytes(path.read_bytes()[:-40])
    with Recording.open(path) as recording:
        assert recording.truncated
        assert recording.pauses == ()
