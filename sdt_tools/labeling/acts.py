"""The text of a journal and the table it stands for: one line an act, checked line by line.

A line without its line end is one that a crash broke off: it was never shown as done, so it does not count. It stays in
the file. The next act closes it with ``#broken`` and begins on a line of its own.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import polars as pl

from sdt_tools.errors import LabelError
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource, journal_kind

COLUMNS: Final[Mapping[str, type[pl.Int64] | type[pl.String]]] = {
    "act_id": pl.Int64,
    "recording_id": pl.String,
    "stamp_ns": pl.Int64,
    "label": pl.String,
    "labeler": pl.String,
    "source": pl.String,
    "created_ns": pl.Int64,
}
HEADER: Final = (",".join(COLUMNS) + "\n").encode()
_UNREADABLE: Final = "the line is not UTF-8 text, or a number in it is too large"
_LARGEST: Final = (1 << 63) - 1
BROKEN: Final = b"#broken"
"""Closes a line that a crash broke off, so that it never turns into an act."""


@dataclass(frozen=True, eq=False)
class Acts:
    """Everything a journal holds: ``table`` has the columns of COLUMNS, in the order of the acts.

    ``broken_lines`` are the line numbers (the header is line 1) that crashes broke off; they stand for no act.
    """

    path: Path
    kind: LabelKind
    table: pl.DataFrame
    broken_lines: tuple[int, ...] = ()


def no_acts(path: Path) -> Acts:
    """What a journal at ``path`` would hold before the first act."""
    return Acts(path, journal_kind(path), pl.DataFrame(schema=COLUMNS))


def parse_journal(data: bytes, path: Path, recording_id: str | None) -> Acts:
    """A whole journal file. Raises LabelError naming ``path`` and the line; see ``parse_acts``."""
    if HEADER.startswith(data):  # also one that was broken off while its header was written
        return no_acts(path)
    if not data.startswith(HEADER):
        raise LabelError(f"{path}:1: the header is not '{HEADER.decode().strip()}'; this is no label journal")
    return parse_acts(data[len(HEADER) :], path, recording_id, first_line=2, after_act=0)


def parse_acts(data: bytes, path: Path, recording_id: str | None, first_line: int, after_act: int) -> Acts:
    """The acts in ``data``, lines of a journal from ``first_line`` on, which follow act ``after_act``.

    With ``recording_id`` None, all must belong to the recording of the first. Raises LabelError naming ``path`` and the
    line for: other than seven fields, a number that is none, an act out of order, another recording, a label that its
    kind does not have, an unknown source, a missing labeler.
    """
    kind = journal_kind(path)
    text = pl.Series("text", data.decode("utf-8", errors="replace").split("\n"))
    lines = pl.DataFrame({"line": pl.int_range(first_line, first_line + len(text), eager=True), "text": text})
    is_broken = pl.col("text").str.ends_with(BROKEN.decode())
    is_tail = pl.col("line") == first_line + len(text) - 1
    broken = lines.filter(is_broken | (is_tail & (pl.col("text") != "")))["line"].to_list()
    split = pl.col("text").str.split_exact(",", len(COLUMNS) - 1).struct.rename_fields(list(COLUMNS))
    fields = lines.filter(~is_broken & ~is_tail).with_columns(split.alias("fields")).unnest("fields")
    table = fields.with_columns(pl.col(name).cast(dtype, strict=False) for name, dtype in COLUMNS.items())
    owner = recording_id if recording_id is not None or table.is_empty() else str(table["recording_id"][0])
    wrong = table.filter(~_is_valid(kind, owner, after_act))
    if not wrong.is_empty():
        line = int(wrong["line"][0])
        row = int(fields["line"].search_sorted(line))
        before = after_act if row == 0 else int(table["act_id"][row - 1])
        fault = fault_in(str(fields["text"][row]), kind, owner, before)
        raise LabelError(f"{path}:{line}: {fault or _UNREADABLE}")
    return Acts(path, kind, table.select(list(COLUMNS)), tuple(broken))


def _is_valid(kind: LabelKind, recording_id: str | None, after_act: int) -> pl.Expr:
    checks = (
        pl.col("text").str.count_matches(",", literal=True) == len(COLUMNS) - 1,
        ~pl.col("text").str.contains("\ufffd", literal=True),
        pl.col("act_id") > pl.col("act_id").shift(1, fill_value=after_act),
        pl.col("recording_id") == pl.lit(recording_id, dtype=pl.String),
        pl.col("stamp_ns") >= 0,
        pl.col("label").is_in(["", *kind.classes]),
        pl.col("labeler").str.strip_chars() != "",
        pl.col("source").is_in([str(source) for source in LabelSource]),
        pl.col("created_ns") >= 0,
    )
    return pl.all_horizontal(check.fill_null(value=False) for check in checks)


def fault_in(text: str, kind: LabelKind, recording_id: str | None, before: int) -> str | None:
    """What is wrong with the line ``text``, which follows act ``before``, and what it should be; None for nothing.

    The rules of ``parse_acts`` for a line of its own, in microseconds.
    """
    fields = text.split(",")
    if len(fields) != len(COLUMNS):
        return f"{len(fields)} fields where {len(COLUMNS)} belong ({', '.join(COLUMNS)})"
    values = dict(zip(COLUMNS, fields, strict=True))
    for name, dtype in COLUMNS.items():
        if dtype is pl.Int64 and not (values[name].isascii() and values[name].isdecimal()):
            return f"{name} '{values[name]}' is not a whole number"
    if int(values["act_id"]) <= before:
        return f"act {values['act_id']} stands after act {before}; acts are numbered in order"
    if values["recording_id"] != recording_id:
        return f"the label belongs to recording '{values['recording_id']}', not '{recording_id}'"
    if values["label"] not in ("", *kind.classes):
        return f"unknown label '{values['label']}'; a {kind} is one of {', '.join(kind.classes)}"
    if values["source"] not in set(LabelSource):
        return f"unknown source '{values['source']}'; it is one of {', '.join(LabelSource)}"
    if not values["labeler"].strip():
        return "no labeler is named"
    if any(int(values[name]) > _LARGEST for name, dtype in COLUMNS.items() if dtype is pl.Int64):
        return _UNREADABLE
    return None
