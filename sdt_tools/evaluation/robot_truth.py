"""How an emulated robot has fared, by the truth of its world: the same verdict as a run in the scene gets."""

from typing import Final

from sdt_tools.evaluation.outcome import Judge, SuccessConfig, Verdict
from sdt_tools.evaluation.situation import situation_in
from sdt_tools.frames import LidarScan, Received
from sdt_tools.scene.world import World

_SCANS_A_LOOK: Final = 5
"""At 50 Hz it is looked at ten times a second, as often as a motion is decided."""


class RobotTruth:
    """Judges how ``world``'s robot follows its operator, scan by scan. Implements Observer.

    ``verdict`` is None while it is open.
    """

    def __init__(self, world: World, timeout_s: float, config: SuccessConfig | None = None) -> None:
        self.verdict: Verdict | None = None
        self._world = world
        self._judge = Judge(timeout_s, config or SuccessConfig())
        self._scans = 0
        situation_in(world)  # what it needs is compiled now: the world does not wait for it

    def observe(self, received: Received) -> None:
        """Look at every fifth scan's moment."""
        if isinstance(received.message, LidarScan):
            self._scans += 1
            if self._scans % _SCANS_A_LOOK == 0 and self.verdict is None:
                self.verdict = self._judge.see(situation_in(self._world))

    def close(self) -> None:
        """Nothing is open."""

    @property
    def text(self) -> str:
        """For people."""
        if self.verdict is None:
            return f"no verdict after {self._world.time_s:.1f} s: the operator is still under way"
        return f"{self.verdict.outcome}: {self.verdict.reason}"

    def document(self) -> dict[str, object]:
        """For machines."""
        verdict = self.verdict
        return {
            "time_s": round(self._world.time_s, 3),
            "contact": self._world.contact,
            "outcome": None if verdict is None else verdict.outcome.value,
            "reason": None if verdict is None else verdict.reason,
        }
