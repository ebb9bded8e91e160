"""Faults that were planned happen to the emulated LiDAR when their time has come."""

from threading import Event, Thread
from time import monotonic
from typing import Final

from sdt_tools.emulation.faults import Fault, Faults
from sdt_tools.emulation.lms1xx.emulator import EmulatedLms1xx
from sdt_tools.emulation.lms1xx.fault_kinds import LidarFault
from sdt_tools.emulation.lms1xx.faults import faults_at

_LOOK_S: Final = 0.01


class FaultPlan:
    """Sees to the ``planned`` faults of ``emulator`` from now on until ``close``; ``faults`` may be switched too."""

    def __init__(self, emulator: EmulatedLms1xx, planned: tuple[Fault, ...], seed: int = 0) -> None:
        self.faults = Faults(planned)
        self._emulator = emulator
        self._seed = seed
        self._began_s = monotonic()
        self._is_off = self._is_unplugged = self._has_hung_up = False
        self._ended = Event()
        self._see_to_it(0.0)
        self._thread = Thread(target=self._run, name="lms1xx-faults", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Nothing more goes wrong. May be called twice."""
        self._ended.set()
        self._thread.join()

    def __enter__(self) -> "FaultPlan":
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def _run(self) -> None:
        while not self._ended.wait(_LOOK_S):
            self._see_to_it(monotonic() - self._began_s)

    def _see_to_it(self, at_s: float) -> None:
        emulator = self._emulator
        now = faults_at(self.faults, at_s, self._seed)
        if now != emulator.faults:
            emulator.faults = now
        emulator.silent = self._holds(LidarFault.SILENCE, at_s)
        if (is_unplugged := self._holds(LidarFault.CABLE, at_s)) is not self._is_unplugged:
            self._is_unplugged = is_unplugged
            emulator.unplug(is_unplugged)
        if (hangs_up := self._holds(LidarFault.HANG_UP, at_s)) is not self._has_hung_up:
            self._has_hung_up = hangs_up
            if hangs_up:
                emulator.hang_up()
        if (is_off := self._holds(LidarFault.POWER, at_s)) is not self._is_off:
            self._is_off = is_off
            (emulator.switch_off if is_off else emulator.switch_on)()

    def _holds(self, kind: LidarFault, at_s: float) -> bool:
        return self.faults.value(kind, at_s) is not None
