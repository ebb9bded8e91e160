"""Which frames go where: recordings split, and the frames of each split chosen by the configuration."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Int64

from sdt_tools.clock import SECOND_NS
from sdt_tools.dataset.candidates import LabelledRecording
from sdt_tools.dataset.choice import Choice, Rules, available, equal_quotas, fill_quotas, largest_equal_quota
from sdt_tools.dataset.config import DatasetConfig
from sdt_tools.dataset.split import SplitEntry, validation_ids
from sdt_tools.errors import DatasetError
from sdt_tools.labeling.vocabulary import LabelKind

TRAIN: Final = "train"
VAL: Final = "val"


@dataclass(frozen=True, eq=False)
class Selection:
    """The frames that one recording gives to a split: ascending indices into its pool."""

    recording: LabelledRecording
    split: str
    frames: Int64[np.ndarray, "frames"]


def select_frames(
    labelled: Sequence[LabelledRecording], config: DatasetConfig, named: frozenset[str] = frozenset()
) -> list[Selection]:
    """One selection for each recording: training first, then validation, each in order of the recordings' ids.

    The recordings ``named`` by their ids validate; where none is, the configuration's share of all.

    Raises DatasetError where there are too few recordings, or a class cannot fill its quota (naming class, have, need).
    """
    in_order = sorted(labelled, key=lambda recording: recording.recording_id)
    entries = [SplitEntry(recording.recording_id, recording.scenario) for recording in in_order]
    validation = named or validation_ids(entries, config.val_share, config.seed)
    selections = []
    for number, (split, total) in enumerate([(TRAIN, config.train_frames), (VAL, config.val_frames)]):
        members = [recording for recording in in_order if (recording.recording_id in validation) == (split == VAL)]
        choice = _choose(members, split, total, config, (config.seed, number))
        selections += [
            Selection(recording, split, frames) for recording, frames in zip(members, choice.taken, strict=True)
        ]
    return selections


def _choose(
    members: Sequence[LabelledRecording], split: str, total: int | None, config: DatasetConfig, seed: Sequence[int]
) -> Choice:
    names = LabelKind(config.kind).classes if config.balanced else ("all classes together",)
    pools = [recording.pool if config.balanced else recording.pool.as_one_class() for recording in members]
    rules = Rules(round(config.spacing_s * SECOND_NS), config.per_recording_cap)
    if total is None:
        quota = max(1, largest_equal_quota(pools, range(len(names)), rules, seed))
        need = dict.fromkeys(range(len(names)), quota)
    else:
        need = equal_quotas(total, available(pools, range(len(names)), rules))
    choice = fill_quotas(pools, need, rules, seed)
    short = {names[label]: (choice.filled[label], need[label]) for label in need if choice.filled[label] < need[label]}
    if short:
        raise DatasetError(_shortage(split, len(members), short, config))
    return choice


def _shortage(split: str, recordings: int, short: Mapping[str, tuple[int, int]], config: DatasetConfig) -> str:
    classes = "; ".join(f"{name}: have {have}, need {need}" for name, (have, need) in short.items())
    cap = "" if config.per_recording_cap is None else f", at most {config.per_recording_cap} a recording"
    return (
        f"too few frames for '{split}' (recordings: {recordings}; {config.spacing_s:g} s apart{cap}): {classes}; "
        "record or label more of them, ask for fewer, or change balance, spacing or validation share"
    )
