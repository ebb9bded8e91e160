"""Where frames lie, so that some are neighbours: in the space of scans, in a network's feature space, or in time."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64

from sdt_tools.error_analysis.definitions import EPSILON_OPTIONS, Neighbourhood
from sdt_tools.error_analysis.distance import pair_distances_m
from sdt_tools.error_analysis.nearest import Near, nearest_frames
from sdt_tools.error_analysis.neighbours import NeighbourIndex, build_index, count_neighbours
from sdt_tools.runs.local import Progress

_MS_NS: Final = 1_000_000


@dataclass(frozen=True)
class Measure:
    """How far apart frames are, as people are told: by what, in what unit (empty for features, which have none)."""

    neighbourhood: Neighbourhood
    unit: str
    distance: str

    @property
    def option(self) -> str:
        """The option that sets ε."""
        return EPSILON_OPTIONS[self.neighbourhood]

    def text(self, distance: float) -> str:
        """A distance with its unit."""
        return f"{distance:.3g} {self.unit}".strip()


MEASURES: Final[Mapping[Neighbourhood, Measure]] = {
    "scan": Measure("scan", "m", "distance of scans, root mean square per ray (m)"),
    "feature": Measure("feature", "", "distance in feature space, root mean square per feature"),
    "time": Measure("time", "ms", "distance in time (ms)"),
}


@runtime_checkable
class Space(Protocol):
    """Frames by their rows, sorted by recording and stamp, and the distances between them."""

    @property
    def measure(self) -> Measure:
        """What the distances are."""
        ...

    def distances(
        self, left: Int64[np.ndarray, "pairs"], right: Int64[np.ndarray, "pairs"]
    ) -> Float64[np.ndarray, "pairs"]:
        """The distance of each pair of rows; infinite where frames are never neighbours."""
        ...

    def count(
        self,
        rows: Int64[np.ndarray, "queries"],
        epsilon: float,
        groups: Bool[np.ndarray, "groups frames"],
        progress: Progress | None = None,
    ) -> Int64[np.ndarray, "groups queries"]:
        """How many frames of each group lie within ``epsilon`` of the frames ``rows``; neither itself nor a copy."""
        ...

    def nearest(self, rows: Int64[np.ndarray, "wanted"], epsilon: float, count: int) -> list[list[Near]]:
        """For each of ``rows`` the ``count`` nearest other frames within ``epsilon``, nearest first."""
        ...


@dataclass(frozen=True, eq=False)
class VectorSpace:
    """Frames as vectors: scans, or places in feature space. Distances are root mean squares."""

    vectors: Float32[np.ndarray, "frames numbers"]
    measure: Measure

    @cached_property
    def index(self) -> NeighbourIndex:
        """Where similar frames are found; built when it is first needed."""
        return build_index(self.vectors)

    def distances(
        self, left: Int64[np.ndarray, "pairs"], right: Int64[np.ndarray, "pairs"]
    ) -> Float64[np.ndarray, "pairs"]:
        """The distance of each pair of rows."""
        return pair_distances_m(self.vectors, left, right)

    def count(
        self,
        rows: Int64[np.ndarray, "queries"],
        epsilon: float,
        groups: Bool[np.ndarray, "groups frames"],
        progress: Progress | None = None,
    ) -> Int64[np.ndarray, "groups queries"]:
        """Neighbours by group; exact copies are none."""
        return count_neighbours(self.index, rows, epsilon, groups, progress=progress)

    def nearest(self, rows: Int64[np.ndarray, "wanted"], epsilon: float, count: int) -> list[list[Near]]:
        """The nearest neighbours."""
        return nearest_frames(self.vectors, rows, epsilon, count)


@dataclass(frozen=True, eq=False)
class TimeSpace:
    """Frames by when they were taken: neighbours are of the same recording. Distances are in milliseconds."""

    recording: Int64[np.ndarray, "frames"]
    stamp_ns: Int64[np.ndarray, "frames"]
    measure: Measure = MEASURES["time"]

    def distances(
        self, left: Int64[np.ndarray, "pairs"], right: Int64[np.ndarray, "pairs"]
    ) -> Float64[np.ndarray, "pairs"]:
        """Milliseconds between each pair of rows; infinite between recordings."""
        apart_ms = np.abs(self.stamp_ns[left] - self.stamp_ns[right]) / _MS_NS
        return np.where(self.recording[left] == self.recording[right], apart_ms, np.inf)

    def count(
        self,
        rows: Int64[np.ndarray, "queries"],
        epsilon: float,
        groups: Bool[np.ndarray, "groups frames"],
        progress: Progress | None = None,
    ) -> Int64[np.ndarray, "groups queries"]:
        """Neighbours by group: those from ``epsilon`` before to ``epsilon`` after."""
        first, end = self._reach(rows, epsilon)
        before = np.concatenate([np.zeros((len(groups), 1), np.int64), np.cumsum(groups, axis=1)], axis=1)
        counts: Int64[np.ndarray, "groups queries"] = before[:, end] - before[:, first] - groups[:, rows]
        if progress:
            progress(len(rows), len(rows))
        return counts

    def nearest(self, rows: Int64[np.ndarray, "wanted"], epsilon: float, count: int) -> list[list[Near]]:
        """The frames just before and after."""
        found = []
        for row, first, end in zip(rows.tolist(), *(ends.tolist() for ends in self._reach(rows, epsilon)), strict=True):
            others = [other for other in range(max(first, row - count), min(end, row + count + 1)) if other != row]
            near = [Near(other, abs(int(self.stamp_ns[other] - self.stamp_ns[row])) / _MS_NS) for other in others]
            found.append(sorted(near, key=lambda one: (one.distance, one.row))[:count])
        return found

    def _reach(
        self, rows: Int64[np.ndarray, "queries"], epsilon: float
    ) -> tuple[Int64[np.ndarray, "queries"], Int64[np.ndarray, "queries"]]:
        """The first frame within reach of each row, and the first one beyond it."""
        reach_ns = int(epsilon * _MS_NS)
        first, end = np.empty_like(rows), np.empty_like(rows)
        starts = np.searchsorted(self.recording, np.arange(int(self.recording[-1]) + 2))
        for number in np.unique(self.recording[rows]).tolist():
            own = self.recording[rows] == number
            stamps_ns = self.stamp_ns[starts[number] : starts[number + 1]]
            at_ns = self.stamp_ns[rows[own]]
            first[own] = starts[number] + np.searchsorted(stamps_ns, at_ns - reach_ns, side="left")
            end[own] = starts[number] + np.searchsorted(stamps_ns, at_ns + reach_ns, side="right")
        return first, end


def scan_space(situations: Float32[np.ndarray, "frames rays"]) -> VectorSpace:
    """Frames by their scans, as ``distance.situations`` makes them."""
    return VectorSpace(situations, MEASURES["scan"])


def feature_space(features: Float32[np.ndarray, "frames features"]) -> VectorSpace:
    """Frames by what the network's last layer saw of them."""
    return VectorSpace(features, MEASURES["feature"])
