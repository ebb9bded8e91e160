"""From many acts to one label a stamp."""

from pathlib import Path
from typing import Final

import polars as pl

from sdt_tools.labeling.acts import Acts
from sdt_tools.labeling.journal import read_journal
from sdt_tools.labeling.vocabulary import SETTLED_BY, LabelKind, LabelSource, journal_path

IS_SETTLEMENT: Final = (pl.col("source") == str(LabelSource.HUMAN)) & pl.col("labeler").str.starts_with(SETTLED_BY)
"""Whether an act settles what people disagree about."""

_RANK = {str(source): rank for rank, source in enumerate(LabelSource)}


def standing(acts: Acts) -> pl.DataFrame:
    """The acts that stand: the last of each stamp, labeler and source, unless it withdrew the label. Order of acts."""
    last = acts.table.unique(subset=["stamp_ns", "labeler", "source"], keep="last", maintain_order=True)
    return last.filter(pl.col("label") != "")


def resolve(acts: Acts) -> pl.DataFrame:
    """One label a stamp: columns stamp_ns (Int64, ascending), label, source, labeler (String).

    The most trusted source that has spoken decides: a settlement, human, import, truth, command, model; within it the
    latest act. Stamps where humans disagree are left out, whatever other sources say, until they agree, withdraw or
    someone settles them; see ``disagreements``.
    """
    rank = pl.col("source").replace_strict(_RANK, return_dtype=pl.Int8)
    ranked = standing(acts).with_columns(pl.when(IS_SETTLEMENT).then(-1).otherwise(rank).alias("rank"))
    deciding = ranked.filter(pl.col("rank") == pl.col("rank").min().over("stamp_ns"))
    settled = deciding.join(disagreements(acts), on="stamp_ns", how="anti")
    return (
        settled.sort("act_id")
        .unique(subset="stamp_ns", keep="last", maintain_order=True)
        .sort("stamp_ns")
        .select("stamp_ns", "label", "source", "labeler")
    )


def disagreements(acts: Acts) -> pl.DataFrame:
    """What stands of the humans who disagree: columns stamp_ns, labeler, label, in order of stamp and labeler.

    Without the stamps that someone has settled.
    """
    stands = standing(acts)
    human = stands.filter((pl.col("source") == str(LabelSource.HUMAN)) & ~IS_SETTLEMENT)
    unsettled = human.join(stands.filter(IS_SETTLEMENT), on="stamp_ns", how="anti")
    disputed = unsettled.filter(pl.col("label").n_unique().over("stamp_ns") > 1)
    return disputed.sort("stamp_ns", "labeler").select("stamp_ns", "labeler", "label")


def read_labels(labels_dir: Path, stem: str, kind: LabelKind, recording_id: str | None = None) -> pl.DataFrame:
    """The resolved labels of the recording ``stem`` (see ``resolve``). Raises LabelError as ``read_journal`` does."""
    return resolve(read_journal(journal_path(labels_dir, stem, kind), recording_id))
