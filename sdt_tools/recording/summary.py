"""What a recording holds of each topic: how much, and from when to when."""

from dataclasses import dataclass

from sdt_tools.clock import SECOND_NS


@dataclass(frozen=True)
class TopicSummary:
    """What a recording holds of one topic; times are those of receipt, None where it holds nothing."""

    topic: str
    schema: str
    count: int
    first_ns: int | None
    last_ns: int | None

    @property
    def hz(self) -> float | None:
        """Messages a second between the first and the last; None where those are no two moments."""
        if self.first_ns is None or self.last_ns is None or self.first_ns >= self.last_ns:
            return None
        return (self.count - 1) * SECOND_NS / (self.last_ns - self.first_ns)
