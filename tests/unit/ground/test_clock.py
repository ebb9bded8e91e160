from sdt_tools.clock import HostClock, Pacer


class FakeTime:
    """Monotonic and wall time that a test moves by hand."""

    def __init__(self) -> None:
        self.monotonic = 1_000
        self.wall = 5_000_000

    def clock(self) -> HostClock:
        return HostClock(wall_ns=lambda: self.wall, monotonic_ns=lambda: self.monotonic)

    def sleep_s(self, seconds: float) -> None:
        self.monotonic += max(1, round(seconds * 1e9))


def test_host_time_does_not_follow_a_corrected_wall_clock() -> None:
    time = FakeTime()
    clock = time.clock()
    assert clock.now_ns() == 5_000_000
    time.wall -= 3_000_000
    time.monotonic += 10
    assert clock.now_ns() == 5_000_010


def test_a_pacer_in_time_releases_once_a_period_and_misses_nothing() -> None:
    time = FakeTime()
    pacer = Pacer(100, time.clock(), time.sleep_s)
    assert [pacer.wait() - 5_000_000 for _ in range(3)] == [100, 200, 300]
    assert pacer.missed == 0


def test_a_late_caller_is_released_at_once_and_the_deadlines_it_slept_through_are_counted() -> None:
    time = FakeTime()
    pacer = Pacer(100, time.clock(), time.sleep_s)
    time.monotonic += 360
    assert pacer.wait() - 5_000_000 == 300
    assert pacer.missed == 3
    assert pacer.wait() - 5_000_000 == 400
    assert pacer.missed == 3


def test_half_a_period_is_not_late_and_more_is_whoever_slept_it() -> None:
    time = FakeTime()
    oversleeping = [0, 50, 51, 100]

    def sleep_s(seconds: float) -> None:
        time.sleep_s(seconds)
        time.monotonic += oversleeping.pop(0)

    pacer = Pacer(100, time.clock(), sleep_s)
    assert [(pacer.wait() - 5_000_000, pacer.missed) for _ in range(4)] == [(100, 0), (200, 0), (300, 1), (500, 2)]
    time.monotonic += 150
    assert (pacer.wait() - 5_000_000, pacer.missed) == (600, 2)
