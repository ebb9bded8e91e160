"""How numbers are written in the cells of a report's tables."""

from collections.abc import Sequence

from sdt_tools.statistics import wilson


def table_line(cells: Sequence[str]) -> str:
    """One line of a Markdown table."""
    return f"| {' | '.join(cells)} |"


def ranged(values: Sequence[float]) -> str:
    """The median of least, median and largest, and the other two in brackets, in percent."""
    low, median, high = values
    return f"{median:.1%} ({low:.1%} to {high:.1%})"


def counted(successes: int, trials: int) -> str:
    """A count of so many, with its 95 % Wilson interval in percent."""
    if trials == 0:
        return "none"
    low, high = wilson(successes, trials)
    return f"{successes} of {trials} ({low:.0%} to {high:.0%})"
