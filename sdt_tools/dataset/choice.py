"""Which of the labelled frames are taken: spaced, capped, and in equal numbers a class.

Classes are served rarest first. For each, every recording offers as many of its frames as fit between those already
taken, and the class's quota is drawn from all that is offered. A recording thus gives in proportion to how long the
class lasts in it: an equal share from each would favour moments in which a class only just came up.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int64


@dataclass(frozen=True, eq=False)
class Pool:
    """The labelled frames of a recording: stamps ascend."""

    stamps_ns: Int64[np.ndarray, "frames"]
    labels: Int64[np.ndarray, "frames"]

    def as_one_class(self) -> "Pool":
        """The same frames, all of class 0."""
        return Pool(self.stamps_ns, np.zeros_like(self.labels))


@dataclass(frozen=True)
class Rules:
    """What holds inside a recording: frames at least ``spacing_ns`` apart, at most ``cap`` of them."""

    spacing_ns: int
    cap: int | None


@dataclass(frozen=True, eq=False)
class Choice:
    """The frames taken: for each pool ascending indices into it, and for each class how many."""

    taken: tuple[Int64[np.ndarray, "_"], ...]
    filled: Mapping[int, int]


def available(pools: Sequence[Pool], classes: Sequence[int], rules: Rules) -> dict[int, int]:
    """How many frames of each class could be taken if it were the only one wanted."""
    return {
        wanted: sum(
            min(len(pack(pool.stamps_ns[pool.labels == wanted], rules.spacing_ns)), _room(rules, 0)) for pool in pools
        )
        for wanted in classes
    }


def fill_quotas(pools: Sequence[Pool], quotas: Mapping[int, int], rules: Rules, seed: Sequence[int]) -> Choice:
    """Take up to ``quotas[c]`` frames of each class c, by ``rules``; the same seed takes the same frames."""
    rng = np.random.default_rng(list(seed))
    supply = available(pools, list(quotas), rules)
    taken: list[Int64[np.ndarray, "_"]] = [np.empty(0, dtype=np.int64) for _ in pools]
    filled = dict.fromkeys(quotas, 0)
    for wanted in sorted(quotas, key=lambda label: (supply[label], label)):
        offers = [_offer(pool, wanted, mine, rules, rng) for pool, mine in zip(pools, taken, strict=True)]
        for place, frames in _draw(offers, quotas[wanted], rng):
            taken[place] = np.sort(np.append(taken[place], frames))
            filled[wanted] += len(frames)
    return Choice(tuple(taken), filled)


def largest_equal_quota(pools: Sequence[Pool], classes: Sequence[int], rules: Rules, seed: Sequence[int]) -> int:
    """A number of frames that ``fill_quotas`` reaches for every class at once, where it does not reach one more."""
    reached, missed = 0, min(available(pools, classes, rules).values()) + 1
    while missed - reached > 1:
        quota = (reached + missed) // 2
        filled = fill_quotas(pools, dict.fromkeys(classes, quota), rules, seed).filled
        if min(filled.values()) == quota:
            reached = quota
        else:
            missed = quota
    return reached


def equal_quotas(total: int, supply: Mapping[int, int]) -> dict[int, int]:
    """``total`` shared equally between the classes of ``supply``; what is left over goes to the commonest, one each."""
    share, rest = divmod(total, len(supply))
    commonest = sorted(supply, key=lambda label: (-supply[label], label))[:rest]
    return {label: share + (label in commonest) for label in supply}


def pack(stamps_ns: Int64[np.ndarray, "frames"], spacing_ns: int) -> Int64[np.ndarray, "_"]:
    """Indices of as many of the ascending stamps as can lie ``spacing_ns`` apart; no choice has more."""
    picked = []
    place = 0
    while place < len(stamps_ns):
        picked.append(place)
        place = max(place + 1, int(np.searchsorted(stamps_ns, stamps_ns[place] + spacing_ns, side="left")))
    return np.array(picked, dtype=np.int64)


def _offer(
    pool: Pool, wanted: int, taken: Int64[np.ndarray, "_"], rules: Rules, rng: np.random.Generator
) -> Int64[np.ndarray, "_"]:
    """Frames of a class that fit between the ``taken`` ones and each other, in random order, up to the cap."""
    frames = np.flatnonzero(pool.labels == wanted)
    frames = frames[_clearance_ns(pool.stamps_ns[frames], pool.stamps_ns[taken]) >= rules.spacing_ns]
    stamps_ns = pool.stamps_ns[frames]
    spread = _shift_into_slack(stamps_ns, pack(stamps_ns, rules.spacing_ns), rules.spacing_ns, rng)
    return rng.permutation(frames[spread])[: _room(rules, len(taken))]


def _clearance_ns(
    stamps_ns: Int64[np.ndarray, "frames"], taken_ns: Int64[np.ndarray, "taken"]
) -> Int64[np.ndarray, "frames"]:
    """Time from each stamp to the nearest of the ``taken_ns``, which ascend; as long as can be where there is none."""
    clearance_ns = np.full(len(stamps_ns), np.iinfo(np.int64).max)
    if len(taken_ns):
        after = np.searchsorted(taken_ns, stamps_ns, side="left")
        to_next_ns = np.abs(taken_ns[np.minimum(after, len(taken_ns) - 1)] - stamps_ns)
        to_last_ns = np.abs(stamps_ns - taken_ns[np.maximum(after - 1, 0)])
        clearance_ns = np.minimum(to_next_ns, to_last_ns)
    return clearance_ns


def _shift_into_slack(
    stamps_ns: Int64[np.ndarray, "frames"],
    picked: Int64[np.ndarray, "picked"],
    spacing_ns: int,
    rng: np.random.Generator,
) -> Int64[np.ndarray, "picked"]:
    """Move each picked frame to a random later one that keeps its distance from the next.

    Packing begins at the first frame of every run of a class; without this, changes of class would be overrepresented.
    """
    shifted = picked.copy()
    end = len(stamps_ns)
    for place in range(len(picked) - 1, -1, -1):
        shifted[place] = rng.integers(picked[place], end)
        limit_ns = stamps_ns[shifted[place]] - spacing_ns
        end = min(int(shifted[place]), int(np.searchsorted(stamps_ns, limit_ns, side="right")))
    return shifted


def _draw(
    offers: Sequence[Int64[np.ndarray, "_"]], quota: int, rng: np.random.Generator
) -> list[tuple[int, Int64[np.ndarray, "_"]]]:
    """``quota`` of all offered frames, each as likely as any other: (place of the offer, the frames taken of it)."""
    places = np.repeat(np.arange(len(offers)), [len(offer) for offer in offers])
    taken = np.bincount(rng.permutation(places)[:quota], minlength=len(offers))
    return [(place, offers[place][:count]) for place, count in enumerate(taken.tolist()) if count]


def _room(rules: Rules, taken: int) -> int:
    return np.iinfo(np.int64).max if rules.cap is None else rules.cap - taken
