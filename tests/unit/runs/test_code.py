"""The hash of the code that a module depends on."""

from pathlib import Path

import pytest

import sdt_tools
from sdt_tools.runs import code

PACKAGE = Path(sdt_tools.__file__).parent


def closure(module: str) -> set[str]:
    return {str(path.relative_to(PACKAGE)) for path in code._closure(module)}


def test_what_is_imported_counts_directly_or_not() -> None:
    found = closure("sdt_tools.training.follow")
    assert {"training/follow.py", "training/loop.py", "frames.py", "robustness/intervals.py"} <= found


def test_what_is_imported_inside_a_function_counts() -> None:
    assert "training/follow.py" in closure("sdt_tools.cli.train")


def test_rooms_above_do_not_count() -> None:
    assert not {name.split("/")[0] for name in closure("sdt_tools.training.follow")} & {"cli", "view", "demo", "replay"}


def test_a_change_in_an_imported_module_changes_the_hash(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "sdt_tools"
    package.mkdir()
    (package / "low.py").write_text("X = 1\n")
    (package / "high.py").write_text("def f():\n    from sdt_tools import low\n    return low.X\n")
    (package / "other.py").write_text("Y = 1\n")
    monkeypatch.setattr(code, "_PACKAGE", package)

    def version() -> str:
        code.code_version.cache_clear()
        code._imported.cache_clear()
        return code.code_version("sdt_tools.high")

    first = version()
    (package / "other.py").write_text("Y = 2\n")
    assert version() == first
    (package / "low.py").write_text("X = 2\n")
    assert version() != first
    code.code_version.cache_clear()
    code._imported.cache_clear()


def test_a_module_from_elsewhere_depends_on_the_whole_package() -> None:
    assert code.code_version("tests.elsewhere") == code.code_version()
    assert code.code_version("sdt_tools.training.follow") != code.code_version()
