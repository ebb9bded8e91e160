"""Label statistics as people read them."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from sdt_tools.labeling.stats import LabelStats


def print_stats(console: Console, stats: Sequence[LabelStats]) -> None:
    """How far each recording is, what people said, and how far they agree."""
    table = Table("recording", "frames", "people", "any", "conflicts", "settled", "≠ pre-labels")
    for one in stats:
        people = f"{one.human:,} ({one.human / one.frames:.0%})"
        against = f"{one.against_prelabels:,} of {one.both:,}"
        numbers = [f"{number:,}" for number in (one.resolved, one.conflicts, one.settled)]
        table.add_row(one.recording.stem, f"{one.frames:,}", people, *numbers, against)
    console.print(table)
    counts = Table("class", "people", "pre-labels")
    for name in stats[0].kind.classes:
        said = (sum(of[name] for of in found) for found in _counts(stats))
        counts.add_row(name, *(f"{number:,}" for number in said))
    console.print(counts)
    for one in stats:
        _print_agreement(console, one)


def _counts(stats: Sequence[LabelStats]) -> tuple[list[dict[str, int]], list[dict[str, int]]]:
    return [one.human_counts for one in stats], [one.prelabel_counts for one in stats]


def _print_agreement(console: Console, one: LabelStats) -> None:
    words = ", ".join(f"{who} {count:,}" for who, count in one.words.items()) or "nobody has said anything"
    console.print(f"{one.recording.stem}: {words}", soft_wrap=True)
    for pair in one.agreement.pairs:
        kappa = "not defined" if pair.kappa is None else f"{pair.kappa:.3f}"
        shared = f"{pair.agreed:,} of {pair.frames:,} frames alike"
        console.print(f"  {pair.first} and {pair.second}: {shared}, Cohen's κ {kappa}", soft_wrap=True)
    if one.agreement.alpha is not None:
        console.print(f"  all, on {one.agreement.frames:,} frames: Krippendorff's α {one.agreement.alpha:.3f}")
    if one.strangers:
        console.print(f"  {one.strangers:,} acts are about no frame of the recording; they count for nothing")
    for line in one.broken_lines:
        console.print(
            f"  {one.journal}:{line}: the line is broken off; it is kept, and counts for nothing", soft_wrap=True
        )
