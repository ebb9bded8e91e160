import math
from pathlib import Path

import numpy as np
import polars as pl
import pyarrow.parquet as pq
import pytest
from replay_samples import (
    OPERATOR,
    PERIOD_NS,
    SPEED_MPS,
    YAW_RAD,
    NearestAhead,
    expert,
    label,
    messages,
    nearest_m,
    write,
    write_drive,
)

from sdt_tools.clock import FAST_EPOCH_NS
from sdt_tools.config import read_toml
from sdt_tools.errors import LabelError, OutputExistsError, RecordingError, UsageError
from sdt_tools.frames import LidarScan, MotionClass
from sdt_tools.replay.predictions import SCHEMA, scan_predictions
from sdt_tools.replay.replay import ReplayConfig, replay
from sdt_tools.runs.unit import content_hash


@pytest.fixture
def drives(tmp_path: Path) -> list[Path]:
    paths = [write_drive(tmp_path / "recordings", f"drive_{seed}", seed=seed) for seed in (0, 1)]
    for path in paths:
        label(path, tmp_path / "labels")
    return paths


def replayed(drives: list[Path], tmp_path: Path, model: NearestAhead | None = None, **options: object) -> pl.DataFrame:
    out = tmp_path / "predictions.parquet"
    replay(model or NearestAhead(), drives, tmp_path / "labels", out, ReplayConfig(**options))
    return scan_predictions([out]).collect()


def test_every_scan_is_answered_and_labelled_ones_have_a_loss(drives: list[Path], tmp_path: Path) -> None:
    rows = replayed(drives, tmp_path, NearestAhead(stops_at_m=1.2))
    assert rows.schema == pl.Schema(SCHEMA)
    assert rows["recording"].to_list() == ["drive_0"] * 100 + ["drive_1"] * 100
    labelled = rows.filter(pl.col("label").is_not_null())
    assert labelled["stamp_ns"].to_list() == [FAST_EPOCH_NS + n * PERIOD_NS for n in range(0, 100, 5)] * 2
    assert labelled["loss_01"].to_list() == [float(1.0 <= nearest_m(n) < 1.2) for n in range(0, 100, 5)] * 2
    assert rows.filter(pl.col("label").is_null())["loss_01"].null_count() == 160


def test_cross_entropy_is_that_of_the_softmax(drives: list[Path], tmp_path: Path) -> None:
    rows = replayed(drives, tmp_path, NearestAhead(stops_at_m=1.2)).filter(pl.col("label").is_not_null())
    right, wrong = math.log(math.exp(2) + 6) - 2, math.log(math.exp(2) + 6)
    expected = [wrong if loss else right for loss in rows["loss_01"]]
    np.testing.assert_allclose(rows["loss_ce"].to_numpy(), expected, rtol=1e-6)


def test_the_scan_tells_ranges_codes_and_domains(drives: list[Path], tmp_path: Path) -> None:
    rows = replayed(drives[:1], tmp_path)
    np.testing.assert_allclose(rows["front_range_m"].to_numpy(), [nearest_m(n) for n in range(100)], atol=1e-6)
    np.testing.assert_allclose(rows["invalid_share"].to_numpy(), 3 / 541, rtol=1e-6)
    to_level_4 = [(nearest_m(n) - 0.2) / math.sqrt(541) for n in range(100)]
    np.testing.assert_allclose(rows["domain_distance_m"].to_numpy(), to_level_4, rtol=1e-5)
    assert not rows["in_level_4"].any()


def test_a_scan_inside_a_domain_is_a_member_of_its_level_and_those_above(tmp_path: Path) -> None:
    ranges_m = np.full((1, 541), 3.5)
    ranges_m[0, 200] = 0.15
    path = write(tmp_path / "near.mcap", [LidarScan(FAST_EPOCH_NS, ranges_m[0])])
    out = tmp_path / "p.parquet"
    replay(NearestAhead(), [path], None, out)
    row = scan_predictions([out]).collect().row(0, named=True)
    assert [row[f"in_level_{level}"] for level in (1, 2, 3, 4)] == [False, False, True, True]
    assert row["distance_level_2_m"] == pytest.approx(0.5 * math.sqrt(540 / 541), rel=1e-6)
    assert row["distance_level_3_m"] == 0.0


def test_the_recording_tells_where_the_operator_was_and_what_was_driven(drives: list[Path], tmp_path: Path) -> None:
    rows = replayed(drives[:1], tmp_path)
    way_m = SPEED_MPS * np.arange(100) * PERIOD_NS * 1e-9 + 0.197
    ahead_m, aside_m = OPERATOR.x_m - way_m * math.cos(YAW_RAD), OPERATOR.y_m - way_m * math.sin(YAW_RAD)
    np.testing.assert_allclose(rows["operator_range_m"].to_numpy(), np.hypot(ahead_m, aside_m), rtol=1e-6)
    bearing_rad = np.arctan2(aside_m, ahead_m) - YAW_RAD
    np.testing.assert_allclose(rows["operator_bearing_rad"].to_numpy(), bearing_rad, atol=1e-6)
    np.testing.assert_allclose(rows["speed_mps"].to_numpy(), SPEED_MPS, atol=1e-5)
    held = [expert(n - n % 5).label for n in range(100)]
    assert rows["command"].to_list() == rows["motion"].to_list() == held
    assert set(rows["mode"]) == {"active"}
    assert set(rows["scenario"]) == {"plain"}


def test_what_a_recording_does_not_know_is_null(tmp_path: Path) -> None:
    scans = [message for message in messages(20, 0) if isinstance(message, LidarScan)]
    path = write(tmp_path / "bare.mcap", scans)
    out = tmp_path / "p.parquet"
    replay(NearestAhead(), [path], None, out)
    rows = scan_predictions([out]).collect()
    unknown = {"label", "loss_01", "loss_ce", "operator_range_m", "operator_bearing_rad", "motion", "command", "mode"}
    unknown |= {"speed_mps", "light"}
    assert {name for name in rows.columns if rows[name].null_count() == 20} == unknown
    assert {name for name in rows.columns if rows[name].null_count() == 0} == set(SCHEMA) - unknown


def test_the_light_is_that_of_the_session(tmp_path: Path) -> None:
    path = write_drive(tmp_path, "sunny", scans=10, light="sun")
    out = tmp_path / "p.parquet"
    replay(NearestAhead(), [path], None, out)
    assert set(scan_predictions([out]).collect()["light"]) == {"sun"}


def test_only_labelled_scans_when_asked(drives: list[Path], tmp_path: Path) -> None:
    rows = replayed(drives, tmp_path, frames="labelled")
    assert len(rows) == 40
    assert rows["label"].null_count() == 0


def test_the_batch_size_does_not_change_the_answers(drives: list[Path], tmp_path: Path) -> None:
    small, large = tmp_path / "small.parquet", tmp_path / "large.parquet"
    for out, batch in ((small, 7), (large, 256)):
        replay(NearestAhead(1.2), drives, tmp_path / "labels", out, ReplayConfig(batch=batch))
    one, other = (scan_predictions([out]).drop("latency_us").collect() for out in (small, large))
    assert one.equals(other)


def test_each_recording_is_a_row_group_that_other_readers_open(drives: list[Path], tmp_path: Path) -> None:
    replayed(drives, tmp_path)
    file = pq.ParquetFile(tmp_path / "predictions.parquet")
    assert [file.metadata.row_group(n).num_rows for n in range(file.num_row_groups)] == [100, 100]
    assert file.schema_arrow.metadata[b"sdt.classes"].decode().split(",") == [motion.label for motion in MotionClass]
    assert len(file.read().column("logits")[0]) == 7


def test_beside_the_predictions_stands_what_they_were_made_from(drives: list[Path], tmp_path: Path) -> None:
    replayed(drives, tmp_path)
    note = read_toml(tmp_path / "predictions.toml")
    assert note["model"]["name"] == "nearest"
    assert note["recordings"] == {path.stem: content_hash(path) for path in drives}
    assert set(note["labels"]) == {"drive_0", "drive_1"}
    assert note["config"] == {"frames": "all", "batch": 128}


def test_the_summary_counts_what_was_done(drives: list[Path], tmp_path: Path) -> None:
    summary = replay(NearestAhead(1.2), drives, tmp_path / "labels", tmp_path / "p.parquet")
    wrong = sum(1.0 <= nearest_m(n) < 1.2 for n in range(0, 100, 5)) * 2
    assert (summary.frames, summary.labelled, summary.wrong) == (200, 40, wrong)
    assert summary.accuracy == pytest.approx(1 - wrong / 40)


def test_labels_without_a_scan_and_recordings_without_a_journal_are_counted(tmp_path: Path) -> None:
    longer = write_drive(tmp_path / "longer", "drive", scans=100)
    label(longer, tmp_path / "labels")
    shorter = write_drive(tmp_path, "drive", scans=50)
    other = write_drive(tmp_path, "other", scans=10, seed=5)
    summary = replay(NearestAhead(), [shorter, other], tmp_path / "labels", tmp_path / "p.parquet")
    assert summary.labels_without_frame == 10
    assert summary.without_journal == ("other",)


def test_a_recording_that_was_cut_off_is_read_as_far_as_it_goes(drives: list[Path], tmp_path: Path) -> None:
    whole = write_drive(tmp_path, "long", scans=1500, seed=3)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size * 2 // 3])
    summary = replay(NearestAhead(), [cut], None, tmp_path / "p.parquet")
    assert summary.truncated
    (missing,) = summary.incomplete
    assert missing.path == cut
    assert 0 < summary.frames < 1500


def test_progress_tells_recordings(drives: list[Path], tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    out = tmp_path / "p.parquet"
    replay(NearestAhead(), drives, None, out, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(0, 2), (1, 2), (2, 2)]


def test_what_exists_is_not_written_over(drives: list[Path], tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text("mine")
    with pytest.raises(OutputExistsError, match=r"p\.toml exists already"):
        replay(NearestAhead(), drives, None, tmp_path / "p.parquet")


def test_a_failure_leaves_nothing_behind(drives: list[Path], tmp_path: Path) -> None:
    broken = tmp_path / "broken.mcap"
    broken.write_bytes(b"not an MCAP")
    with pytest.raises(RecordingError, match=r"broken\.mcap"):
        replay(NearestAhead(), [*drives, broken], None, tmp_path / "out" / "p.parquet")
    assert list((tmp_path / "out").iterdir()) == []


def test_bad_calls_say_what_to_do(drives: list[Path], tmp_path: Path) -> None:
    out = tmp_path / "p.parquet"
    with pytest.raises(UsageError, match="no recordings given"):
        replay(NearestAhead(), [], None, out)
    with pytest.raises(UsageError, match="2 recordings are called 'drive_0'"):
        replay(NearestAhead(), [drives[0], drives[0]], None, out)
    with pytest.raises(UsageError, match="add --labels"):
        replay(NearestAhead(), drives, None, out, ReplayConfig(frames="labelled"))
    with pytest.raises(LabelError, match="no such folder of labels"):
        replay(NearestAhead(), drives, tmp_path / "nowhere", out)
    with pytest.raises(LabelError, match=r"labels none of the 2 recordings \(as in drive_0\.motion\.csv\)"):
        replay(NearestAhead(), drives, tmp_path, out)
    no_scans = write(tmp_path / "silent.mcap", [m for m in messages(5, 0) if not isinstance(m, LidarScan)])
    with pytest.raises(RecordingError, match=r"silent\.mcap: has no scans"):
        replay(NearestAhead(), [no_scans], None, out)


def test_files_that_are_no_predictions_are_named(tmp_path: Path) -> None:
    text, table, other = tmp_path / "a.parquet", tmp_path / "b.parquet", tmp_path / "c.parquet"
    text.write_text("hello")
    pl.DataFrame({"recording": ["x"]}).write_parquet(table)
    pl.DataFrame(schema={**SCHEMA, "loss_ce": pl.String()}).write_parquet(other)
    for path, reason in (
        (tmp_path / "none.parquet", "no such file"),
        (tmp_path, "is a folder"),
        (text, "not a predictions file"),
        (table, "it lacks the column 'recording_id'"),
        (other, "the column 'loss_ce' is String, not Float32"),
    ):
        with pytest.raises(UsageError, match=reason) as raised:
            scan_predictions([path])
        assert str(path) in str(raised.value)


def test_predictions_of_several_files_are_read_as_one(drives: list[Path], tmp_path: Path) -> None:
    for name in ("one", "two"):
        replay(NearestAhead(name=name), drives, None, tmp_path / f"{name}.parquet")
    rows = scan_predictions([tmp_path / "one.parquet", tmp_path / "two.parquet"])
    assert rows.group_by("model").len().sort("model").collect().rows() == [("one", 200), ("two", 200)]
