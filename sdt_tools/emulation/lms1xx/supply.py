"""Where the scans of an emulated LiDAR come from."""

from pathlib import Path
from typing import Final, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float64

from sdt_tools.clock import FAST_EPOCH_NS, SECOND_NS
from sdt_tools.errors import RecordingError
from sdt_tools.frames import LidarScan, Received
from sdt_tools.recording.reader import Recording
from sdt_tools.scene.config import SceneConfig
from sdt_tools.scene.scenario import layout_for
from sdt_tools.scene.source import SceneSource

_DECISION_NS: Final = SECOND_NS // 10


@runtime_checkable
class ScanSupply(Protocol):
    """What a LiDAR sees, whenever it is asked."""

    def ranges_at(self, host_ns: int) -> Float64[np.ndarray, "rays"]:
        """The 541 ranges in metres at ``host_ns``, which never goes back. Codes are below 16 mm."""
        ...


class RecordedScans:
    """The scans of a recording at the pace at which they were taken, again and again."""

    def __init__(self, path: Path) -> None:
        with Recording.open(path) as recording:
            self._scans = recording.scans()
        if len(self._scans) == 0:
            raise RecordingError(f"{path}: has no scans to serve; name another recording")
        self._offsets_ns = self._scans.stamps_ns - self._scans.stamps_ns[0]
        between_ns = self._offsets_ns[-1] // max(len(self._scans) - 1, 1)
        self._turn_ns = int(self._offsets_ns[-1] + max(between_ns, 1))
        self._began_ns: int | None = None

    def ranges_at(self, host_ns: int) -> Float64[np.ndarray, "rays"]:
        """The newest scan at that time since the first call."""
        if self._began_ns is None:
            self._began_ns = host_ns
        at_ns = (host_ns - self._began_ns) % self._turn_ns
        row = int(np.searchsorted(self._offsets_ns, at_ns, side="right")) - 1
        ranges_m: Float64[np.ndarray, "rays"] = self._scans.ranges_m[row]
        return ranges_m


class SceneScans:
    """A scenario that the scene's expert drives through, live; where it ends, the next seed's begins."""

    def __init__(self, scenario: str, seed: int, config: SceneConfig | None = None) -> None:
        self._scenario = scenario
        self._seed = seed
        self._config = config or SceneConfig()
        self._scene = self._play()
        self._scene.expert.advise()  # the first time takes a second, and no scan may wait for it
        list(self._play().read(FAST_EPOCH_NS))
        self._began_ns: int | None = None
        self._decided_ns = 0
        self._ranges_m: Float64[np.ndarray, "rays"] | None = None

    def ranges_at(self, host_ns: int) -> Float64[np.ndarray, "rays"]:
        """The newest scan when the scene has gone on to that time."""
        if self._scene.finished:
            self._seed += 1
            self._scene = self._play()
            self._began_ns = None
        if self._began_ns is None:
            self._began_ns, self._decided_ns = host_ns, host_ns - _DECISION_NS
        if host_ns - self._decided_ns >= _DECISION_NS:
            self._decided_ns = host_ns
            self._scene.command(self._config.motions.twist(self._scene.expert.advise()))
        for sensed in self._scene.read(FAST_EPOCH_NS + host_ns - self._began_ns):
            if isinstance(sensed, Received) and isinstance(sensed.message, LidarScan):
                self._ranges_m = sensed.message.ranges_m
        assert self._ranges_m is not None
        return self._ranges_m

    def _play(self) -> SceneSource:
        return SceneSource(layout_for(self._scenario, self._seed), self._config, start_ns=FAST_EPOCH_NS)
