"""What evaluations of models × scenarios × seeds have in common: their arguments, and the tables of their units."""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import polars as pl

from sdt_tools.errors import UsageError
from sdt_tools.runs.unit import content_hash


def parse_seeds(text: str) -> list[int]:
    """Seeds from ``7``, ``1000-1019`` or a list of such with commas. Raises UsageError."""
    seeds: list[int] = []
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        if not first.isdecimal() or (dash and not last.isdecimal()) or (dash and int(last) < int(first)):
            raise UsageError(f"--seeds {text}: give seeds as 7, 1000-1019 or 3,5,1000-1009")
        seeds += range(int(first), int(last or first) + 1)
    return seeds


def check_given(given_by_name: Mapping[str, Sequence[object]]) -> None:
    """Raise UsageError where of something none is given, or one twice."""
    for what, given in given_by_name.items():
        if not given:
            raise UsageError(f"no {what} given; name at least one")
        refuse_repeated(what, given)


def refuse_repeated(what: str, names: Sequence[object]) -> None:
    """Raise UsageError where one of ``names`` comes twice."""
    for name in names:
        if names.count(name) > 1:
            raise UsageError(f"{what} {name} is given twice; name each once")


def identity(model: str) -> str:
    """Eight letters for a checkpoint folder, by its content, or for a model that is a name."""
    path = Path(model)
    return (content_hash(path) if path.is_dir() else hashlib.sha256(model.encode()).hexdigest())[:8]


def gather(by_model: Mapping[str, Sequence[Path]], file: str, out: Path) -> pl.DataFrame:
    """The tables ``file`` of all units as one, the model as it was named before each row; written to ``out`` too."""
    table = pl.concat(
        [
            pl.read_parquet(folder / file).select(pl.lit(model).alias("model"), pl.all())
            for model, folders in by_model.items()
            for folder in folders
        ]
    )
    table.write_parquet(out / file)
    return table
