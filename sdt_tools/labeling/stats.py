"""How far the labeling of a recording has come, who said what, and how far they agree."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sdt_tools.labeling.acts import no_acts
from sdt_tools.labeling.agreement import Agreement, agreement_of
from sdt_tools.labeling.frame_labels import UNSAID, labels_of
from sdt_tools.labeling.journal import read_journal
from sdt_tools.labeling.labelled_frames import labelled_frames
from sdt_tools.labeling.review import contradicting
from sdt_tools.labeling.vocabulary import LabelKind, journal_path
from sdt_tools.recording.reader import Recording


@dataclass(frozen=True)
class LabelStats:
    """One recording. People's labels and pre-labels are counted apart.

    ``human`` frames have been labelled by a person, ``resolved`` have a label by anybody; ``conflicts`` are frames on
    which people disagree and that nobody has settled, ``settled`` those that somebody has. ``strangers`` are acts about
    stamps that are no frame of the recording.
    """

    recording: Path
    journal: Path
    kind: LabelKind
    frames: int
    human: int
    resolved: int
    conflicts: int
    settled: int
    human_counts: dict[str, int]
    """Frames by class, as people say."""
    prelabel_counts: dict[str, int]
    """Frames by class, as commands, truth, models and imports say."""
    against_prelabels: int
    """Frames on which people say something else than the pre-labels, of those where both say something."""
    both: int
    words: dict[str, int]
    """Frames by labeler and source, as in ``anna (human)``."""
    agreement: Agreement
    strangers: int
    broken_lines: tuple[int, ...]


def label_stats(recording: Path, kind: LabelKind, labels_dir: Path) -> LabelStats:
    """The statistics of one recording; without a journal nothing is labelled. Raises LabelError where it is wrong."""
    with Recording.open(recording) as opened:
        path = journal_path(labels_dir, opened.stem, kind)
        acts = read_journal(path, opened.recording_id) if path.exists() else no_acts(path)
        labels = labels_of(kind, labelled_frames(opened, kind).stamps_ns, acts.table)
    named = labels.human != UNSAID
    return LabelStats(
        recording=recording,
        journal=path,
        kind=kind,
        frames=len(labels),
        human=int((named | labels.disputed).sum()),
        resolved=int((labels.resolved != UNSAID).sum()),
        conflicts=int(labels.disputed.sum()),
        settled=int((labels.settled != UNSAID).sum()),
        human_counts=dict(zip(kind.classes, labels.counts(labels.human), strict=True)),
        prelabel_counts=dict(zip(kind.classes, labels.counts(labels.prelabels), strict=True)),
        against_prelabels=int(contradicting(labels, labels.prelabels).sum()),
        both=int((named & (labels.prelabels != UNSAID)).sum()),
        words={
            f"{speaker.labeler} ({speaker.source})": int(np.count_nonzero(voice.classes != UNSAID))
            for speaker, voice in sorted(labels.voices.items(), key=lambda item: (item[0].source, item[0].labeler))
        },
        agreement=agreement_of(labels),
        strangers=labels.strangers,
        broken_lines=acts.broken_lines,
    )
