import gzip
import hashlib
import os
from pathlib import Path

import numpy as np
import pytest
from recording_samples import T0, read_by_mcap

from sdt_tools.errors import OutputExistsError, RecordingError, UsageError
from sdt_tools.frames import LogEntry
from sdt_tools.recording.exchange.lidar_csv import import_lidar_csv
from sdt_tools.recording.reader import Recording


def drive(scans: int = 5) -> np.ndarray:
    """Rows as in the files: step, two states, 541 ranges, steering."""
    rng = np.random.default_rng(0)
    ranges = np.round(rng.uniform(0.2, 19.0, (scans, 541)), 3)
    ranges[:, 3] = 0.0
    ranges[0, 4] = 0.002
    return np.column_stack([np.arange(scans), np.zeros((scans, 2)), ranges, np.linspace(-1, 1, scans)])


def as_text(rows: np.ndarray) -> str:
    return "".join(",".join(f"{value:g}" for value in row) + "\n" for row in rows)


def test_scans_come_in_as_they_stand(tmp_path: Path) -> None:
    rows, path = drive(), tmp_path / "drive.csv"
    path.write_text(as_text(rows))
    summary = import_lidar_csv(path, tmp_path / "out" / "d.mcap", hz=25.0)
    with Recording.open(tmp_path / "out" / "d.mcap") as recording:
        series = recording.scans()
        assert recording.recording_id == summary.recording_id
    assert series.ranges_m.tobytes() == np.ascontiguousarray(rows[:, 3:544]).tobytes()
    assert list(series.stamps_ns) == [T0 + n * 40_000_000 for n in range(5)]
    assert (summary.scans, summary.seconds) == (5, 0.16)
    assert summary.invalid_share == pytest.approx(6 / (5 * 541))


def test_compressed_and_plain_give_the_same_scans(tmp_path: Path) -> None:
    text = as_text(drive())
    (tmp_path / "a.csv").write_text(text)
    with gzip.open(tmp_path / "a.csv.gz", "wt") as file:
        file.write(text)
    for name in ("a.csv", "a.csv.gz"):
        import_lidar_csv(tmp_path / name, tmp_path / f"{name}.mcap", hz=50.0)
    data = [[m.data for _, _, m in read_by_mcap(tmp_path / f"{name}.mcap")] for name in ("a.csv", "a.csv.gz")]
    assert data[0] == data[1]
    assert len(data[0]) == 6


def test_the_recording_says_what_it_was_made_from(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text(as_text(drive()))
    import_lidar_csv(path, tmp_path / "d.mcap", hz=12.5)
    with Recording.open(tmp_path / "d.mcap") as recording:
        session = recording.session
        (log,) = [m.message for m in recording.messages(["/session/log"])]
    assert session["source"] == "import"
    assert session["import_file"] == "drive.csv"
    assert session["import_sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
    assert session["import_hz"] == "12.5"
    assert isinstance(log, LogEntry)
    assert "steering" in log.text


def test_importing_again_gives_the_same_bytes(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text(as_text(drive()))
    for name in ("one", "two"):
        import_lidar_csv(path, tmp_path / name, hz=25.0)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


def short_row(text: str) -> str:
    lines = text.splitlines()
    return "\n".join([lines[0], ",".join(lines[1].split(",")[:30]), *lines[2:]])


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (short_row, r"line 2 has 30 columns, 545 expected: step, two states, 541 ranges, steering"),
        (lambda text: text + "1,2,3\n", r"line 6 has 3 columns, 545 expected"),
        (lambda text: text.replace(",0.002,", ",near,"), r"line 1: could not convert string to float: 'near'"),
        (lambda text: text.replace(",0.002,", ",-1,"), r"line 1: has a range that is negative or not finite"),
        (lambda text: text.replace(",0.002,", ",nan,"), r"line 1: has a range that is negative or not finite"),
        (lambda _: "", r"holds no scans; nothing was imported"),
    ],
)
def test_a_file_that_is_no_drive_is_refused_in_one_line_and_nothing_is_left(
    tmp_path: Path, spoil, message: str
) -> None:
    path = tmp_path / "drive.csv"
    path.write_text(spoil(as_text(drive())))
    with pytest.raises(RecordingError, match=rf"drive\.csv: {message}") as error:
        import_lidar_csv(path, tmp_path / "d.mcap", hz=25.0)
    assert "\n" not in str(error.value)
    assert [entry.name for entry in tmp_path.iterdir()] == ["drive.csv"]


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    (tmp_path / "text.csv.gz").write_text("0,1,2\n")
    (tmp_path / "binary.csv").write_bytes(b"\x89\xff\xfe\0\x01")
    with gzip.open(tmp_path / "whole.gz", "wt") as file:
        file.write(as_text(drive()))
    (tmp_path / "cut.csv.gz").write_bytes((tmp_path / "whole.gz").read_bytes()[:-200])
    (tmp_path / "folder.csv").mkdir()
    for name, message in {
        "missing.csv": "no such file; check the path",
        "text.csv.gz": "not a text file, nor one compressed with gzip",
        "binary.csv": "not a text file, nor one compressed with gzip",
        "cut.csv.gz": "the compressed file is cut off",
        "folder.csv": "is a folder",
    }.items():
        with pytest.raises(RecordingError, match=f"{name}: {message}"):
            import_lidar_csv(tmp_path / name, tmp_path / "d.mcap", hz=25.0)


@pytest.mark.parametrize("hz", [0.0, -5.0, float("nan")])
def test_a_rate_is_positive(tmp_path: Path, hz: float) -> None:
    with pytest.raises(UsageError, match="give the scans a second"):
        import_lidar_csv(tmp_path / "any.csv", tmp_path / "d.mcap", hz)


def test_an_existing_output_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "drive.csv").write_text(as_text(drive()))
    (tmp_path / "d.mcap").write_text("mine")
    with pytest.raises(OutputExistsError):
        import_lidar_csv(tmp_path / "drive.csv", tmp_path / "d.mcap", hz=25.0)
    assert (tmp_path / "d.mcap").read_text() == "mine"


def test_all_real_drives_import(tmp_path: Path) -> None:
    data = os.environ.get("SDT_DATA")
    if not data:
        pytest.skip("SDT_DATA is not set: the real drives are elsewhere")
    paths = sorted((Path(data) / "p3at_lms1xx").glob("*.csv.gz"))
    assert len(paths) == 20
    for path in paths:
        out = tmp_path / f"{path.stem}.mcap"
        import_lidar_csv(path, out, hz=25.0)
        with gzip.open(path, "rt") as file:
            expected = np.loadtxt(file, delimiter=",", ndmin=2)[:, 3:544]
        with Recording.open(out) as recording:
            assert np.array_equal(recording.scans().ranges_m, expected)
