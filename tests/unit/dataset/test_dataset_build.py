import hashlib
import tomllib
from collections import Counter
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from labelled_recordings import (
    CLASSES,
    MS,
    SCAN_PERIOD_NS,
    START_NS,
    make_labelled,
    make_labels,
    make_recording,
    ranges_m,
    recording_id,
)

from sdt_tools.dataset import build
from sdt_tools.dataset.build import DatasetSummary, build_dataset
from sdt_tools.dataset.config import DatasetConfig
from sdt_tools.dataset.load import FrameSet, load_dataset
from sdt_tools.errors import DatasetError, LabelError, OutputExistsError


def build_in(folder: Path, recordings: list[Path], out: str = "set", **options: object) -> DatasetSummary:
    return build_dataset(recordings, folder / "labels", DatasetConfig.model_validate(options), folder / out)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("recorded")
    return [make_labelled(folder, seed) for seed in range(10)]


@pytest.fixture
def recordings(recorded: list[Path], tmp_path: Path) -> list[Path]:
    """The recordings and labels linked into a folder of the test's own."""
    (tmp_path / "labels").mkdir()
    for path in recorded:
        (tmp_path / path.name).hardlink_to(path)
        journal = path.parent / "labels" / f"{path.stem}.motion.csv"
        (tmp_path / "labels" / journal.name).write_bytes(journal.read_bytes())
    return [tmp_path / path.name for path in recorded]


def frames_of(frames: FrameSet, name: str) -> list[int]:
    return [
        int(stamp) for stamp, recording in zip(frames.stamps_ns, frames.recordings, strict=True) if recording == name
    ]


def test_a_data_set_has_the_scans_as_the_sensor_gave_them_and_their_labels(
    recordings: list[Path], tmp_path: Path
) -> None:
    build_in(tmp_path, recordings)
    dataset = load_dataset(tmp_path / "set")
    assert dataset.classes == CLASSES
    for frames in (dataset.train, dataset.val):
        for place, (stamp_ns, name) in enumerate(zip(frames.stamps_ns.tolist(), frames.recordings, strict=True)):
            seed, scan = int(name[1:]), (stamp_ns - START_NS) // SCAN_PERIOD_NS
            np.testing.assert_array_equal(frames.ranges_m[place], ranges_m(seed, scan))
            assert frames.labels[place] == (seed + scan // 30) % 7


def test_the_parquet_says_the_same_to_another_reader(recordings: list[Path], tmp_path: Path) -> None:
    build_in(tmp_path, recordings)
    dataset = load_dataset(tmp_path / "set")
    rows = pq.read_table(tmp_path / "set" / "frames.parquet").to_pylist()
    assert [row["split"] for row in rows] == ["train"] * len(dataset.train) + ["val"] * len(dataset.val)
    for row, label, stamp in zip(rows, dataset.train.labels.tolist(), dataset.train.stamps_ns.tolist(), strict=False):
        assert (row["label"], row["label_name"], row["stamp_ns"]) == (label, CLASSES[label], stamp)
        assert row["recording_id"] == recording_id(tmp_path / f"{row['recording']}.mcap")
        assert row["ranges_m"] == ranges_m(int(row["recording"][1:]), (stamp - START_NS) // SCAN_PERIOD_NS).tolist()


def test_frames_keep_their_distance_and_no_recording_gives_more_than_its_share(
    recordings: list[Path], tmp_path: Path
) -> None:
    build_in(tmp_path, recordings, per_recording_cap=9, spacing_s=0.5)
    dataset = load_dataset(tmp_path / "set")
    for frames in (dataset.train, dataset.val):
        for name in set(frames.recordings):
            stamps_ns = frames_of(frames, name)
            assert stamps_ns == sorted(stamps_ns)
            assert np.all(np.diff(stamps_ns) >= 500 * MS)
            assert len(stamps_ns) <= 9


def test_no_recording_is_in_both_splits(recordings: list[Path], tmp_path: Path) -> None:
    summary = build_in(tmp_path, recordings, val_share=0.3)
    dataset = load_dataset(tmp_path / "set")
    assert not set(dataset.train.recordings) & set(dataset.val.recordings)
    assert len(set(dataset.val.recordings)) == 3
    assert summary.recordings == 10


def test_recordings_named_for_validation_validate_alone(recordings: list[Path], tmp_path: Path) -> None:
    folder = recordings[0].parent
    built = build_dataset(recordings[:7], folder / "labels", DatasetConfig(), tmp_path / "d", validation=recordings[7:])
    dataset = load_dataset(built.folder)
    assert {path.stem for path in recordings[7:]} == set(dataset.val.recordings)
    assert {path.stem for path in recordings[:7]} == set(dataset.train.recordings)


def test_totals_are_met_exactly_and_balanced(recordings: list[Path], tmp_path: Path) -> None:
    summary = build_in(tmp_path, recordings, train_frames=45, val_frames=14)
    assert (summary.train_frames, summary.val_frames) == (45, 14)
    assert sorted(summary.counts["train"].values()) == [6, 6, 6, 6, 7, 7, 7]
    assert set(summary.counts["val"].values()) == {2}
    dataset = load_dataset(tmp_path / "set")
    assert Counter(CLASSES[label] for label in dataset.train.labels.tolist()) == summary.counts["train"]


def test_without_totals_classes_are_equal_and_none_could_have_one_more(recordings: list[Path], tmp_path: Path) -> None:
    counts = build_in(tmp_path, recordings).counts["train"]
    (each,) = set(counts.values())
    with pytest.raises(DatasetError, match="need"):
        build_in(tmp_path, recordings, "more", train_frames=7 * (each + 1))


def test_as_recorded_everything_that_fits_is_taken(recordings: list[Path], tmp_path: Path) -> None:
    summary = build_in(tmp_path, recordings, balanced=False, val_share=0.2)
    assert (summary.train_frames, summary.val_frames) == (8 * 15, 2 * 15)  # six seconds at 0.4 s
    fewer = build_in(tmp_path, recordings, "fewer", balanced=False, train_frames=50)
    assert fewer.train_frames == 50


def test_the_same_inputs_give_the_same_content_in_any_order(recordings: list[Path], tmp_path: Path) -> None:
    one = build_in(tmp_path, recordings, "one")
    other = build_in(tmp_path, recordings[::-1], "other")
    assert one.hash == other.hash
    for name in ("frames.parquet", "manifest.toml"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "other" / name).read_bytes()


def test_another_seed_takes_other_frames(recordings: list[Path], tmp_path: Path) -> None:
    assert build_in(tmp_path, recordings, "one").hash != build_in(tmp_path, recordings, "other", seed=1).hash


def test_the_manifest_names_what_the_set_was_made_from(recordings: list[Path], tmp_path: Path) -> None:
    summary = build_in(tmp_path, recordings, val_share=0.4)
    manifest = tomllib.loads((tmp_path / "set" / "manifest.toml").read_text())
    assert manifest["hash"] == summary.hash == load_dataset(tmp_path / "set").hash
    assert manifest["config"]["val_share"] == 0.4
    assert manifest["counts"] == summary.counts
    assert manifest["frames"] == {"train": summary.train_frames, "val": summary.val_frames}
    assert manifest["conflicts"] == {"checked": False, "frames": []}
    by_name = {entry["recording"]: entry for entry in manifest["recordings"]}
    assert len(by_name) == 10
    for path in recordings:
        entry = by_name[path.stem]
        journal = tmp_path / "labels" / entry["journal"]
        assert entry["recording_id"] == recording_id(path)
        assert entry["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
        assert entry["journal_sha256"] == hashlib.sha256(journal.read_bytes()).hexdigest()
        assert (entry["scans"], entry["labels"], entry["unmatched_labels"]) == (300, 60, 0)
    assert sum(entry["frames"] for entry in by_name.values()) == summary.train_frames + summary.val_frames


def test_labels_go_to_the_nearest_scan_within_the_tolerance(tmp_path: Path) -> None:
    for seed in (0, 1):
        path = make_recording(tmp_path / f"r{seed}.mcap", seed, 100)
        near, far = START_NS + 9 * MS, START_NS + 100 * SCAN_PERIOD_NS
        make_labels(path, recording_id(path), [(near, "stay"), (far, "stay")])
    summary = build_in(tmp_path, [tmp_path / "r0.mcap", tmp_path / "r1.mcap"], balanced=False, tolerance_ms=9)
    assert load_dataset(tmp_path / "set").train.stamps_ns.tolist() == [START_NS]
    assert summary.unmatched_labels == 2
    with pytest.raises(DatasetError, match="too few frames"):
        build_in(tmp_path, [tmp_path / "r0.mcap", tmp_path / "r1.mcap"], "none", balanced=False, tolerance_ms=8.9)


def test_disputes_and_broken_lines_are_counted(recordings: list[Path], tmp_path: Path) -> None:
    journal = tmp_path / "labels" / "r0.motion.csv"
    with journal.open("a") as stream:
        for act_id, (labeler, label) in enumerate([("anna", "stay"), ("ben", "forward")], start=61):
            stream.write(f"{act_id},{recording_id(recordings[0])},{START_NS},{label},{labeler},human,0\n")
        stream.write("63,br")
    summary = build_in(tmp_path, recordings)
    assert (summary.disputed_stamps, summary.broken_lines) == (1, 1)
    dataset = load_dataset(tmp_path / "set")
    assert START_NS not in frames_of(dataset.train, "r0") + frames_of(dataset.val, "r0")


def test_a_class_that_is_missing_is_named_with_what_it_has_and_needs(tmp_path: Path) -> None:
    for seed in range(4):
        path = make_recording(tmp_path / f"r{seed}.mcap", seed, 150)
        stamps = [START_NS + scan * SCAN_PERIOD_NS for scan in range(0, 150, 25)]
        make_labels(path, recording_id(path), list(zip(stamps, CLASSES[:6], strict=True)))
    paths = [tmp_path / f"r{seed}.mcap" for seed in range(4)]
    with pytest.raises(
        DatasetError, match=r"'train' \(recordings: 3; .*: right_backward: have 0, need 1; record or label"
    ):
        build_in(tmp_path, paths)
    with pytest.raises(DatasetError, match=r"stay: have 3, need 4; .*right_backward: have 0, need 4") as caught:
        build_in(tmp_path, paths, train_frames=28)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "set").exists()


def test_conflicts_are_refused_and_named(recordings: list[Path], tmp_path: Path) -> None:
    def forward_is_forbidden(ranges: np.ndarray, labels: np.ndarray) -> np.ndarray:
        assert ranges.shape == (len(labels), 541)
        return labels == 1

    config = DatasetConfig()
    with pytest.raises(
        DatasetError,
        match=r"in a safety domain of level 3 that forbids their label: \d+ \(r\d at \d+ ns \(forward\).* more\)",
    ):
        build_dataset(recordings, tmp_path / "labels", config, tmp_path / "set", forward_is_forbidden)
    assert sorted(path.name for path in tmp_path.iterdir() if "set" in path.name) == []

    allowed = config.model_copy(update={"allow_conflicts": True})
    summary = build_dataset(recordings, tmp_path / "labels", allowed, tmp_path / "set", forward_is_forbidden)
    listed = load_dataset(tmp_path / "set").manifest["conflicts"]
    forward = summary.counts["train"]["forward"] + summary.counts["val"]["forward"]
    assert summary.conflicts == forward == len(listed["frames"])
    assert {entry["label"] for entry in listed["frames"]} == {"forward"}
    assert listed["checked"]


def test_progress_counts_each_recording_twice_and_ends_at_the_total(recordings: list[Path], tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    build_dataset(
        recordings,
        tmp_path / "labels",
        DatasetConfig(),
        tmp_path / "set",
        progress=lambda done, total: seen.append((done, total)),
    )
    assert seen == [(done, 20) for done in range(21)]


def test_what_exists_is_not_written_over(recordings: list[Path], tmp_path: Path) -> None:
    (tmp_path / "set").mkdir()
    with pytest.raises(OutputExistsError, match="set exists already"):
        build_in(tmp_path, recordings)


def test_an_interrupted_build_leaves_nothing(
    recordings: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_: object) -> str:
        raise KeyboardInterrupt

    before = sorted(tmp_path.iterdir())
    monkeypatch.setattr(build, "manifest_toml", interrupt)
    with pytest.raises(KeyboardInterrupt):
        build_in(tmp_path, recordings)
    assert sorted(tmp_path.iterdir()) == before


def test_bad_inputs_are_named(recordings: list[Path], tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="no recordings given"):
        build_in(tmp_path, [])
    with pytest.raises(DatasetError, match="one recording given; training and validation need at least one each"):
        build_in(tmp_path, recordings[:1])
    with pytest.raises(DatasetError, match=r"r0\.mcap and .*r0\.mcap are the same recording"):
        build_in(tmp_path, [*recordings, recordings[0]])
    (tmp_path / "labels" / "r3.motion.csv").unlink()
    with pytest.raises(LabelError, match=r"r3\.motion\.csv: no such journal"):
        build_in(tmp_path, recordings)


def test_memory_holds_no_whole_recording(
    recordings: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Small batches and row groups give the same data set as large ones."""
    whole = build_in(tmp_path, recordings, "whole")
    monkeypatch.setattr("sdt_tools.dataset.build.SCANS_A_BATCH", 7)
    monkeypatch.setattr("sdt_tools.dataset.candidates.SCANS_A_BATCH", 7)
    monkeypatch.setattr("sdt_tools.dataset.frames_file.ROWS_A_GROUP", 10)
    pieces = build_in(tmp_path, recordings, "pieces")
    assert pieces.hash == whole.hash == load_dataset(tmp_path / "pieces").hash
    assert pq.ParquetFile(tmp_path / "pieces" / "frames.parquet").num_row_groups > 3
