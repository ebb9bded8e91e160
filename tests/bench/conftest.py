"""After the table of times: what each benchmark says beside them, the ratios to its peers above all."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1] / "unit" / "recording"))  # recorders that are killed


@pytest.hookimpl(trylast=True)
def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Print every benchmark's ``extra_info``."""
    session = getattr(config, "_benchmarksession", None)
    notes = {bench.name: bench.extra_info for bench in getattr(session, "benchmarks", ()) if bench.extra_info}
    if not notes:
        return
    terminalreporter.section("ratios and rates")
    for name, extra in notes.items():
        terminalreporter.write_line(f"{name}: " + ", ".join(f"{key} {_short(value)}" for key, value in extra.items()))


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
