import shutil
from pathlib import Path

import polars as pl
import pytest
from labelled_recordings import make_labelled

from sdt_tools.dataset.build import build_dataset
from sdt_tools.dataset.config import DatasetConfig
from sdt_tools.dataset.load import load_dataset
from sdt_tools.errors import DatasetError


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("built")
    recordings = [make_labelled(folder, seed) for seed in range(3)]
    build_dataset(recordings, folder / "labels", DatasetConfig(val_share=0.34), folder / "set")
    return folder / "set"


@pytest.fixture
def dataset(built: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(built, tmp_path / "set"))


def rewrite(dataset: Path, change: pl.Expr) -> None:
    path = dataset / "frames.parquet"
    pl.read_parquet(path).with_columns(change).write_parquet(path)


def test_shapes_and_types(dataset: Path) -> None:
    loaded = load_dataset(dataset)
    assert loaded.train.ranges_m.shape == (len(loaded.train), 541)
    assert loaded.train.ranges_m.dtype.str == "<f8"
    assert loaded.train.labels.dtype.str == "<i8"
    assert len(loaded.train) == len(loaded.train.recordings) == len(loaded.train.stamps_ns) > len(loaded.val) > 0


def test_a_folder_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="nowhere: no such folder; name one that 'sdt dataset build' made"):
        load_dataset(tmp_path / "nowhere")
    with pytest.raises(DatasetError, match=r"no manifest\.toml in it"):
        load_dataset(tmp_path)


def test_a_manifest_that_is_none(dataset: Path) -> None:
    (dataset / "manifest.toml").write_text("hash = ")
    with pytest.raises(DatasetError, match=r"manifest\.toml: not valid TOML"):
        load_dataset(dataset)
    (dataset / "manifest.toml").write_text("hash = 'x'")
    with pytest.raises(DatasetError, match=r"manifest\.toml: not the manifest of a data set in format 1"):
        load_dataset(dataset)


def test_frames_that_are_missing_or_no_parquet(dataset: Path) -> None:
    (dataset / "frames.parquet").write_bytes(b"PAR1 not really PAR1")
    with pytest.raises(DatasetError, match=r"frames\.parquet: not readable as Parquet") as caught:
        load_dataset(dataset)
    assert "\n" not in str(caught.value)
    (dataset / "frames.parquet").unlink()
    with pytest.raises(DatasetError, match=r"frames\.parquet: no such file"):
        load_dataset(dataset)


def test_frames_of_another_sensor(dataset: Path) -> None:
    rewrite(dataset, pl.col("ranges_m").arr.head(361).list.to_array(361))
    with pytest.raises(DatasetError, match="ranges_m holds 361 rays, 541 rays expected"):
        load_dataset(dataset)


def test_frames_with_another_column(dataset: Path) -> None:
    rewrite(dataset, pl.lit(1).alias("extra"))
    with pytest.raises(DatasetError, match=r"the columns are split, .*, extra, not split, "):
        load_dataset(dataset)


@pytest.mark.parametrize(
    "change",
    [
        pl.col("label").replace({0: 1}),
        pl.col("stamp_ns") + 1,
        pl.when(pl.int_range(pl.len()) == 0)
        .then(pl.lit("val"))
        .otherwise(pl.col("split").cast(pl.String))
        .alias("split"),
        pl.col("ranges_m").reverse(),
        pl.col("recording_id").cast(pl.String).str.replace("^.", "x"),
    ],
)
def test_frames_that_the_manifest_was_not_written_for(dataset: Path, change: pl.Expr) -> None:
    rewrite(dataset, change)
    with pytest.raises(DatasetError, match=r"frames\.parquet is not what manifest\.toml describes"):
        load_dataset(dataset)


def test_a_split_without_frames(dataset: Path) -> None:
    import pyarrow.parquet as pq

    from sdt_tools.dataset.frames_file import SCHEMA, FramesHash

    with pq.ParquetWriter(dataset / "frames.parquet", SCHEMA):
        pass
    manifest = (dataset / "manifest.toml").read_text()
    old = load_hash(manifest)
    (dataset / "manifest.toml").write_text(manifest.replace(old, FramesHash().hexdigest()))
    with pytest.raises(DatasetError, match="no frames in 'train'; build the data set from more labelled recordings"):
        load_dataset(dataset)


def load_hash(manifest: str) -> str:
    return manifest.split('hash = "')[1].split('"')[0]
