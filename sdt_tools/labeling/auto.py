"""Labels that a recording already holds: what was commanded, or what the scene knows to be true."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import polars as pl

from sdt_tools.clock import SECOND_NS
from sdt_tools.errors import LabelError
from sdt_tools.frames import CameraImage, Mode, MotionCommand, OperatorState
from sdt_tools.labeling.journal import Journal
from sdt_tools.labeling.resolve import standing
from sdt_tools.labeling.vocabulary import LabelKind, LabelSource, journal_path
from sdt_tools.recording.incomplete import Incomplete, incomplete
from sdt_tools.recording.live.decide import STOP
from sdt_tools.recording.live.perturb import PERTURBATION
from sdt_tools.recording.messages.topics import CAMERA_IMAGE, COMMAND, OPERATOR_STATE
from sdt_tools.recording.reader import Recording

AutoSource = Literal[LabelSource.COMMAND, LabelSource.TRUTH]
TRUTH_LABELER: Final = "scene"
STATE_HOLDS_NS: Final = SECOND_NS
"""An image is labelled with the operator's state before it, unless that is older than this."""

_COLUMNS = {"stamp_ns": pl.Int64, "label": pl.String, "labeler": pl.String}


@dataclass(frozen=True)
class AutoLabelSummary:
    """What labeling a recording did. ``labels`` were found, ``appended`` of them were new to the journal.

    ``skipped`` messages gave no label: commands in idle mode, forced, mere stops, or without the expert's word; images
    without a state.
    """

    recording: Path
    journal: Path
    labels: int
    appended: int
    skipped: int
    counts: dict[str, int]
    """Labels found, by class."""
    broken_lines: tuple[int, ...]
    """Lines of the journal that a crash had broken off."""
    incomplete: Incomplete | None
    """What is missing of the recording, where it was cut off or is damaged."""


@dataclass(frozen=True, eq=False)
class _Found:
    table: pl.DataFrame
    skipped: int


def label_automatically(recording: Path, kind: LabelKind, source: AutoSource, labels_dir: Path) -> AutoLabelSummary:
    """Append to the recording's journal what it says itself; what already stands there is not repeated.

    Motion: with ``command``, the motion that was commanded while the robot was active, by the driver who commanded it;
    with ``truth``, what the expert would have done. The label goes to the scan that the command was based on. Gesture:
    with ``truth``, the operator's state at each image. ``created_ns`` is the frame's own stamp, so that the same
    recording gives the same journal.

    Raises RecordingError where the recording cannot be read, LabelError where it holds no such labels or the journal is
    wrong.
    """
    with Recording.open(recording) as opened:
        recording_id = opened.recording_id
        found = _find(opened, kind, source)
        missing = incomplete(opened)
    path = journal_path(labels_dir, recording.stem, kind)
    with Journal(path, recording_id) as journal:
        fresh = found.table.with_columns(pl.lit(str(source)).alias("source"), pl.col("stamp_ns").alias("created_ns"))
        known = standing(journal.read())
        fresh = fresh.join(known, on=["stamp_ns", "label", "labeler", "source"], how="anti", maintain_order="left")
        appended = journal.append_table(fresh)
    counts = dict(found.table["label"].value_counts(sort=True).iter_rows())
    return AutoLabelSummary(
        recording=recording,
        journal=path,
        labels=len(found.table),
        appended=appended,
        skipped=found.skipped,
        counts={name: int(counts.get(name, 0)) for name in kind.classes},
        broken_lines=journal.broken_lines,
        incomplete=missing,
    )


def _find(opened: Recording, kind: LabelKind, source: LabelSource) -> _Found:
    path = opened.path
    if kind is LabelKind.GESTURE and source is LabelSource.COMMAND:
        raise LabelError(f"{path}: commands carry no gestures; label them from the truth")
    needed = [COMMAND] if kind is LabelKind.MOTION else [OPERATOR_STATE, CAMERA_IMAGE]
    for topic in needed:
        if topic not in opened.topics:
            raise LabelError(f"{path}: no {topic} in it, so there is nothing to label from; {_ADVICE[topic]}")
    messages = (received.message for received in opened.messages(topics=needed))
    if kind is LabelKind.GESTURE:
        found = _gestures(messages)
    else:
        found = _expert_words(messages) if source is LabelSource.TRUTH else _commands(messages)
    if found.table.is_empty():
        raise LabelError(f"{path}: {_NOTHING[kind, source]}")
    return found


_ADVICE = {
    COMMAND: "record with a driver, or label by hand",
    OPERATOR_STATE: "only the scene knows the operator's state; label by hand",
    CAMERA_IMAGE: "record with a camera",
}
_NOTHING = {
    (LabelKind.MOTION, LabelSource.COMMAND): f"no command in {COMMAND} was given in active mode; nothing to label from",
    (LabelKind.MOTION, LabelSource.TRUTH): f"{COMMAND} does not say what the expert would do; label from the commands",
    (LabelKind.GESTURE, LabelSource.TRUTH): f"no image has an {OPERATOR_STATE} just before it; nothing to label from",
}


def _commands(messages: Iterable[object]) -> _Found:
    labels: dict[int, tuple[str, str]] = {}
    skipped = 0
    for message in messages:
        if isinstance(message, MotionCommand):
            if message.mode is Mode.ACTIVE and message.driver not in (PERTURBATION, STOP):
                labels[message.stamp_ns] = (message.motion.label, message.driver or "unknown")
            else:
                skipped += 1
    return _found(labels, skipped)


def _expert_words(messages: Iterable[object]) -> _Found:
    labels: dict[int, tuple[str, str]] = {}
    skipped = 0
    for message in messages:
        if isinstance(message, MotionCommand):
            if message.expert is not None:
                labels[message.stamp_ns] = (message.expert.label, TRUTH_LABELER)
            else:
                skipped += 1
    return _found(labels, skipped)


def _gestures(messages: Iterable[object]) -> _Found:
    image_stamps_ns: list[int] = []
    states: list[tuple[int, str]] = []
    for message in messages:
        if isinstance(message, OperatorState):
            states.append((message.stamp_ns, message.gesture.label))
        elif isinstance(message, CameraImage):
            image_stamps_ns.append(message.stamp_ns)
    images = pl.DataFrame({"stamp_ns": image_stamps_ns}, schema={"stamp_ns": pl.Int64}).unique().sort("stamp_ns")
    state = pl.DataFrame(states, schema={"stamp_ns": pl.Int64, "label": pl.String}, orient="row").sort("stamp_ns")
    labels = images.join_asof(state, on="stamp_ns", strategy="backward", tolerance=STATE_HOLDS_NS).drop_nulls()
    table = labels.with_columns(pl.lit(TRUTH_LABELER).alias("labeler")).select(list(_COLUMNS))
    return _Found(table, len(image_stamps_ns) - len(table))


def _found(labels: dict[int, tuple[str, str]], skipped: int) -> _Found:
    rows = [(stamp_ns, *labels[stamp_ns]) for stamp_ns in sorted(labels)]
    return _Found(pl.DataFrame(rows, schema=_COLUMNS, orient="row"), skipped)
