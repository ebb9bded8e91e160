from pathlib import Path

import pytest

from sdt_tools.errors import RunError, UsageError
from sdt_tools.runs.local import run_units
from sdt_tools.runs.unit import Unit, execute, finished


def write_text(out: Path, text: str, log: str) -> None:
    with Path(log).open("a") as stream:
        stream.write("ran\n")
    (out / "result.txt").write_text(text)


def copy_file(out: Path, source: Path) -> None:
    (out / "copy").write_bytes(source.read_bytes())


def break_off(out: Path) -> None:
    (out / "half.txt").write_text("half")
    raise ZeroDivisionError("no")


def refuse(out: Path) -> None:
    raise UsageError("bad input; give another")


def times_run(log: Path) -> int:
    return log.read_text().count("ran") if log.exists() else 0


def text_unit(name: str, text: str, log: Path) -> Unit:
    return Unit(name, write_text, {"text": text, "log": str(log)})


def test_a_finished_unit_is_not_done_again(tmp_path: Path) -> None:
    unit = text_unit("a", "one", tmp_path / "log")
    execute(unit, tmp_path)
    assert (execute(unit, tmp_path) / "result.txt").read_text() == "one"
    assert times_run(tmp_path / "log") == 1


def test_other_inputs_replace_the_old_result(tmp_path: Path) -> None:
    execute(text_unit("a", "one", tmp_path / "log"), tmp_path)
    folder = execute(text_unit("a", "two", tmp_path / "log"), tmp_path)
    assert (folder / "result.txt").read_text() == "two"


def test_a_path_stands_for_its_content(tmp_path: Path) -> None:
    source = tmp_path / "in.txt"
    source.write_text("1")
    unit = Unit("c", copy_file, {"source": source})
    execute(unit, tmp_path)
    assert finished(unit, tmp_path)
    source.write_text("2")
    assert not finished(unit, tmp_path)


def test_a_unit_that_breaks_leaves_nothing_and_keeps_the_old_result(tmp_path: Path) -> None:
    execute(text_unit("a", "one", tmp_path / "log"), tmp_path)
    with pytest.raises(RunError, match="unit 'a' failed: ZeroDivisionError: no"):
        execute(Unit("a", break_off, {}), tmp_path)
    assert (tmp_path / "a" / "result.txt").read_text() == "one"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "log"]


def test_what_a_killed_process_left_half_done_is_swept_away(tmp_path: Path) -> None:
    gone, alive = tmp_path / ".a.999999999.part", tmp_path / ".a.1.part"
    for scratch in (gone, alive):
        scratch.mkdir()
    execute(text_unit("a", "one", tmp_path / "log"), tmp_path)
    assert (gone.exists(), alive.exists()) == (False, True)


def test_an_error_meant_for_the_user_passes_unchanged(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="bad input; give another"):
        execute(Unit("a", refuse, {}), tmp_path)


def test_units_over_processes_give_what_one_process_gives(tmp_path: Path) -> None:
    units = [text_unit(f"u{i}", str(i), tmp_path / "log") for i in range(4)]
    seen: list[tuple[int, int]] = []
    folders = run_units(units, tmp_path / "two", workers=2, progress=lambda done, total: seen.append((done, total)))
    assert [(f / "result.txt").read_text() for f in folders] == ["0", "1", "2", "3"]
    assert (seen[0], seen[-1]) == ((0, 4), (4, 4))


def test_a_failure_keeps_what_was_finished_and_a_rerun_does_the_rest(tmp_path: Path) -> None:
    log = tmp_path / "log"
    good = text_unit("good", "x", log)
    with pytest.raises(RunError):
        run_units([good, Unit("bad", break_off, {})], tmp_path / "out")
    run_units([good, text_unit("bad", "mended", log)], tmp_path / "out")
    assert times_run(log) == 2


def test_an_argument_without_a_stable_hash_is_refused() -> None:
    with pytest.raises(TypeError, match="cannot be hashed"):
        Unit("a", write_text, {"text": object()}).fingerprint()
