"""What every refusal has in common."""

from collections.abc import Callable

Sdt = Callable[..., tuple[int, str]]
"""Runs a command: its exit code, and what it said on stderr."""


def assert_refused(result: tuple[int, str], *words: str) -> None:
    """One line, exit code 2, and in it all ``words``."""
    code, said = result
    assert code == 2, said
    assert said.startswith("sdt: ")
    assert said.count("\n") == 1
    for word in words:
        assert word in said
