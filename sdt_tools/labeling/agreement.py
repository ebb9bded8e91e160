"""How far people who label the same frames agree, beyond chance.

Cohen's κ for each two (scikit-learn) and Krippendorff's α for all (krippendorff), nominal classes, over what each has
said himself: what was settled afterwards changes neither.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Int8

from sdt_tools.labeling.frame_labels import UNSAID, FrameLabels, Speaker
from sdt_tools.labeling.vocabulary import LabelSource


@dataclass(frozen=True)
class PairAgreement:
    """Two people: ``frames`` were labelled by both, ``agreed`` of them alike.

    ``kappa`` is None where it is not defined: no such frame, or one and the same class throughout.
    """

    first: str
    second: str
    frames: int
    agreed: int
    kappa: float | None


@dataclass(frozen=True)
class Agreement:
    """All who labelled: ``frames`` were labelled by at least two. ``alpha`` is None where it is not defined."""

    labelers: tuple[str, ...]
    frames: int
    alpha: float | None
    pairs: tuple[PairAgreement, ...]


def agreement_of(labels: FrameLabels) -> Agreement:
    """The agreement of the people in ``labels``."""
    said = {name: labels.voice(Speaker(LabelSource.HUMAN, name)).classes for name in labels.labelers}
    pairs = tuple(_pair(one, said[one], other, said[other]) for one, other in combinations(said, 2))
    if len(said) < 2:
        return Agreement(labels.labelers, 0, None, pairs)
    words = np.stack(list(said.values()))
    shared = words[:, (words != UNSAID).sum(axis=0) > 1]
    return Agreement(labels.labelers, shared.shape[1], _alpha(shared), pairs)


def _pair(first: str, one: Int8[np.ndarray, "frames"], second: str, other: Int8[np.ndarray, "frames"]) -> PairAgreement:
    both = (one != UNSAID) & (other != UNSAID)
    one, other = one[both], other[both]
    return PairAgreement(first, second, len(one), int((one == other).sum()), _kappa(one, other))


def _kappa(one: Int8[np.ndarray, "shared"], other: Int8[np.ndarray, "shared"]) -> float | None:
    if len(np.unique(np.concatenate([one, other]))) < 2:
        return None
    # scikit-learn takes a second to import, and only those who ask for agreement need it
    from sklearn.metrics import cohen_kappa_score

    return float(cohen_kappa_score(one, other))


def _alpha(words: Int8[np.ndarray, "labelers shared"]) -> float | None:
    values = np.unique(words[words != UNSAID])
    if len(values) < 2:
        return None
    import krippendorff

    counts = np.stack([(words == value).sum(axis=0) for value in values], axis=1)
    return float(krippendorff.alpha(value_counts=counts, level_of_measurement="nominal"))
