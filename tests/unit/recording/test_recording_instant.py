"""Whatever makes a recording writes its timing into it: nobody has to count again."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from edit_samples import recorded
from exchange_samples import full_recording
from recording_samples import CONFIG, INFO, T0, image, scan, write

from sdt_tools.clock import SECOND_NS
from sdt_tools.frames import Received
from sdt_tools.recording.editing.edit import edit_recordings
from sdt_tools.recording.editing.plan import (
    plan_drop_interval,
    plan_drop_topics,
    plan_merge,
    plan_split,
    plan_trim,
)
from sdt_tools.recording.exchange.lidar_csv import import_lidar_csv
from sdt_tools.recording.exchange.parquet.exporting import export_parquet
from sdt_tools.recording.exchange.parquet.importing import import_parquet
from sdt_tools.recording.exchange.ros2.exporting import export_ros2
from sdt_tools.recording.exchange.ros2.importing import import_ros2
from sdt_tools.recording.exchange.ros2.inward import Taking
from sdt_tools.recording.exchange.ros2.routes import Wanted
from sdt_tools.recording.inspect import InspectReport, inspect_recording
from sdt_tools.recording.repair import repair_recording
from sdt_tools.recording.writer import RecordingWriter

PAUSE_NS = (T0 + SECOND_NS, T0 + 2 * SECOND_NS)


def trimmed(folder: Path, out: Path) -> None:
    edit_recordings(plan_trim(recorded(folder), "0.55", "1.45", out))


def without_a_topic(folder: Path, out: Path) -> None:
    edit_recordings(plan_drop_topics(recorded(folder), ["/tf"], out))


def merged(folder: Path, out: Path) -> None:
    parts = edit_recordings(plan_split(recorded(folder), ["0.7", "1.1"], folder))
    edit_recordings(plan_merge([parts[2].out, parts[0].out], out))


def by_way_of_parquet(folder: Path, out: Path) -> None:
    export_parquet(full_recording(folder / "full.mcap"), folder / "table")
    import_parquet(folder / "table", out)


def by_way_of_ros2(folder: Path, out: Path) -> None:
    export_ros2(full_recording(folder / "full.mcap"), folder / "bag")
    import_ros2(folder / "bag", out, Wanted(), Taking())


def from_text(folder: Path, out: Path) -> None:
    row = ",".join(["1"] * 545)
    (folder / "drive.csv").write_text(f"{row}\n" * 10)
    import_lidar_csv(folder / "drive.csv", out, 50.0)


def repaired_after_a_cut(folder: Path, out: Path) -> None:
    path = recorded(folder)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 2 // 3])
    repair_recording(path, out)


@pytest.mark.parametrize(
    "make",
    [
        trimmed,
        without_a_topic,
        merged,
        by_way_of_parquet,
        by_way_of_ros2,
        from_text,
        repaired_after_a_cut,
    ],
)
def test_what_was_made_is_not_counted_again(tmp_path: Path, make: Callable[[Path, Path], None]) -> None:
    make(tmp_path, tmp_path / "new.mcap")
    noted, counted = (inspect_recording(tmp_path / "new.mcap", full) for full in (False, True))
    assert not noted.counted
    assert counted.disagreements == ()
    assert told(noted) == told(counted)
    assert noted.timing.topics["/lidar/scan"].count > 0


def told(report: InspectReport) -> InspectReport:
    """``report``, whether it was counted or not."""
    return replace(report, counted=True)


def paused(path: Path) -> Path:
    """Three seconds, the second of them a pause."""
    with RecordingWriter(path, INFO, CONFIG) as writer:
        for number in range(150):
            received = scan(number)
            if not PAUSE_NS[0] <= received.received_ns < PAUSE_NS[1]:
                writer.write(received)
        writer.note({"pauses_ns": f"{PAUSE_NS[0]}-{PAUSE_NS[1]}"})
    return path


@pytest.mark.parametrize(
    ("start", "end", "pauses"),
    [
        ("0.5", "2.5", (T0 + SECOND_NS, T0 + 2 * SECOND_NS)),
        (None, "0.5", None),
        ("0.5", "1.5", None),
    ],
)
def test_pauses_stay_pauses_in_a_part(tmp_path: Path, start: str | None, end: str, pauses: tuple[int, int]) -> None:
    edit_recordings(plan_trim(paused(tmp_path / "r.mcap"), start, end, tmp_path / "new.mcap"))
    report = inspect_recording(tmp_path / "new.mcap")
    assert report.stats.get("pauses_ns") == (f"{pauses[0]}-{pauses[1]}" if pauses else None)
    assert report.timing.topics["/lidar/scan"].gaps == 0


def test_what_was_dropped_is_no_gap_and_what_lay_within_it_neither(tmp_path: Path) -> None:
    edit_recordings(plan_drop_interval(paused(tmp_path / "r.mcap"), "0.5", "1.5", tmp_path / "new.mcap"))
    report = inspect_recording(tmp_path / "new.mcap")
    assert report.stats["pauses_ns"] == f"{T0 + SECOND_NS // 2}-{T0 + 2 * SECOND_NS}"
    assert report.timing.topics["/lidar/scan"].gaps == 0


def test_between_recordings_nothing_is_missing_and_in_parts_what_was(tmp_path: Path) -> None:
    messages = [scan(number) for number in range(100) if number not in (20, 50)]
    path = write(tmp_path / "drive.mcap", messages)
    parts = edit_recordings(plan_split(path, ["1"], tmp_path))  # a scan is missing at that very moment
    edit_recordings(plan_merge([part.out for part in parts], tmp_path / "whole.mcap"))
    assert inspect_recording(tmp_path / "whole.mcap").timing == inspect_recording(path).timing
    write(tmp_path / "later.mcap", [scan(number) for number in range(300, 400)], recording_id="later")
    edit_recordings(plan_merge([path, tmp_path / "later.mcap"], tmp_path / "both.mcap"))
    assert inspect_recording(tmp_path / "both.mcap").timing.topics["/lidar/scan"].gaps == 2


def test_a_pause_is_recorded_where_another_recording_goes_on(tmp_path: Path) -> None:
    pictures: list[Received] = [image(number) for number in range(45, 55)]
    write(tmp_path / "camera.mcap", pictures, recording_id="camera")
    edit_recordings(plan_merge([paused(tmp_path / "r.mcap"), tmp_path / "camera.mcap"], tmp_path / "new.mcap"))
    first_ns, last_ns = pictures[0].received_ns, pictures[-1].received_ns
    said = inspect_recording(tmp_path / "new.mcap").stats["pauses_ns"]
    assert said == f"{T0 + SECOND_NS}-{first_ns} {last_ns + 1}-{T0 + 2 * SECOND_NS}"
