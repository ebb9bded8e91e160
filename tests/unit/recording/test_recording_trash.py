import errno
import os
import tomllib
from contextlib import suppress
from pathlib import Path

import pytest

from sdt_tools.clock import FAST_EPOCH_NS, SECOND_NS
from sdt_tools.errors import OutputExistsError, RecordingError, UsageError
from sdt_tools.recording.trash import discard, restore, trashed

NOW_NS = FAST_EPOCH_NS + 90 * SECOND_NS


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A folder with recordings and labels beside each other."""
    for folder in ("recordings", "labels"):
        (tmp_path / folder).mkdir()
    (tmp_path / "recordings/take.mcap").write_text("a take")
    (tmp_path / "labels/take.motion.csv").write_text("labels")
    return tmp_path


def files_below(folder: Path) -> dict[str, str]:
    """Path and text of each, but for the trash's records."""
    files = [path for path in folder.rglob("*") if path.is_file() and "trash.toml" not in path.name]
    return {str(path.relative_to(folder)): path.read_text() for path in files}


def discard_all(home: Path) -> Path:
    return discard(home / "recordings/take.mcap", "blurred", NOW_NS, [home / "labels/take.motion.csv"])


def test_what_is_discarded_lies_in_the_trash_with_a_record(home: Path) -> None:
    folder = discard_all(home)
    assert folder == home / "recordings/.trash/20250101T000130Z-take.mcap"
    assert files_below(home) == {
        "recordings/.trash/20250101T000130Z-take.mcap/take.mcap": "a take",
        "recordings/.trash/20250101T000130Z-take.mcap/take.motion.csv": "labels",
    }
    assert tomllib.loads((folder / "trash.toml").read_text()) == {
        "discarded_ns": NOW_NS,
        "reason": "blurred",
        "file": [
            {"name": "take.mcap", "from": "take.mcap"},
            {"name": "take.motion.csv", "from": "../labels/take.motion.csv"},
        ],
    }


def test_the_trash_is_listed_oldest_first(home: Path) -> None:
    discard_all(home)
    (home / "recordings/older.mcap").write_text("older")
    discard(home / "recordings/older.mcap", "", NOW_NS - 60 * SECOND_NS)
    older, take = trashed(home / "recordings")
    assert (older.name, older.reason) == ("20250101T000030Z-older.mcap", "")
    assert (take.discarded_ns, take.reason, take.size_bytes) == (NOW_NS, "blurred", 12)
    assert [file.origin for file in take.files] == [
        home / "recordings/take.mcap",
        home / "labels/take.motion.csv",
    ]


@pytest.mark.parametrize("name", ["take", "take.mcap", "20250101T000130Z-take.mcap"])
def test_all_comes_back_to_where_it_was(home: Path, name: str) -> None:
    before = files_below(home)
    discard_all(home)
    files = restore(home / "recordings", name)
    assert files_below(home) == before
    assert files == (home / "recordings/take.mcap", home / "labels/take.motion.csv")
    assert list((home / "recordings/.trash").iterdir()) == []


def test_it_comes_back_also_where_everything_was_moved_to(home: Path) -> None:
    discard_all(home)
    elsewhere = home.parent / f"{home.name}_elsewhere"
    home.rename(elsewhere)
    restore(elsewhere / "recordings", "take")
    assert files_below(elsewhere) == {"recordings/take.mcap": "a take", "labels/take.motion.csv": "labels"}


@pytest.mark.parametrize("taken", ["recordings/take.mcap", "labels/take.motion.csv"])
def test_nothing_is_written_over_and_nothing_moves_then(home: Path, taken: str) -> None:
    discard_all(home)
    (home / taken).write_text("another")
    before = files_below(home)
    with pytest.raises(OutputExistsError, match=Path(taken).name):
        restore(home / "recordings", "take")
    assert files_below(home) == before


def test_what_comes_to_the_place_at_the_last_moment_stays(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    discard_all(home)
    link = os.link

    def linked_late(source: Path, target: Path, follow_symlinks: bool) -> None:
        target.write_text("another")
        link(source, target, follow_symlinks=follow_symlinks)

    monkeypatch.setattr(os, "link", linked_late)
    with pytest.raises(RecordingError, match=r"cannot be restored: File exists; it stays there"):
        restore(home / "recordings", "take")
    contents = files_below(home)
    assert contents["labels/take.motion.csv"] == "another"
    assert sorted(contents.values()) == ["a take", "another", "labels"]


def test_two_of_one_name_are_told_apart(home: Path) -> None:
    discard_all(home)
    (home / "recordings/take.mcap").write_text("again")
    second = discard(home / "recordings/take.mcap", "", NOW_NS)
    assert second.name == "20250101T000130Z-take.mcap-2"
    with pytest.raises(UsageError, match=r"more than one in the trash; name one: .*take\.mcap, .*take\.mcap-2"):
        restore(home / "recordings", "take")
    restore(home / "recordings", second.name)
    assert (home / "recordings/take.mcap").read_text() == "again"


class ProcessDiedError(BaseException):
    pass


@pytest.mark.parametrize("steps", range(12))
@pytest.mark.parametrize("action", ["discard", "restore"])
def test_whenever_the_process_dies_nothing_is_lost(
    home: Path, monkeypatch: pytest.MonkeyPatch, steps: int, action: str
) -> None:
    """Dies before one system call after another that moves, writes or removes something; then tries again."""
    whole = files_below(home)
    if action == "restore":
        discard_all(home)
    left = [steps]

    def dying(call):
        def counted(*words, **options):
            if left[0] == 0:
                raise ProcessDiedError
            left[0] -= 1
            return call(*words, **options)

        return counted

    with monkeypatch.context() as patch:
        for owner, name in ((os, "link"), (os, "fsync"), (Path, "rename"), (Path, "unlink"), (Path, "rmdir")):
            patch.setattr(owner, name, dying(getattr(owner, name)))
        with suppress(ProcessDiedError):
            discard_all(home) if action == "discard" else restore(home / "recordings", "take")
    assert set(files_below(home).values()) == {"a take", "labels"}
    for entry in trashed(home / "recordings"):
        restore(home / "recordings", entry.name)
    assert files_below(home) == whole
    assert trashed(home / "recordings") == ()


def refuse_links(source: Path, target: Path, follow_symlinks: bool) -> None:
    raise PermissionError(errno.EPERM, os.strerror(errno.EPERM), str(source))


def test_file_systems_without_links_will_do(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = files_below(home)
    discard_all(home)
    monkeypatch.setattr(os, "link", refuse_links)
    restore(home / "recordings", "take")
    assert files_below(home) == before


def test_labels_may_lie_on_another_disk(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rename = Path.rename

    def renamed(source: Path, target: Path) -> Path:
        if source.parent == home / "labels" and target.parent != home / "labels":
            raise OSError(errno.EXDEV, os.strerror(errno.EXDEV), str(source))
        return rename(source, target)

    monkeypatch.setattr(Path, "rename", renamed)
    folder = discard_all(home)
    assert files_below(folder) == {"take.mcap": "a take", "take.motion.csv": "labels"}
    assert files_below(home / "labels") == {}


def test_a_record_that_is_gone_hides_nothing(home: Path) -> None:
    folder = discard_all(home)
    (folder / "trash.toml").write_text("reason = [")
    (entry,) = trashed(home / "recordings")
    assert entry.discarded_ns is None
    assert {file.path.name for file in entry.files} == {"take.mcap", "take.motion.csv"}
    with pytest.raises(UsageError, match=r"trash\.toml: cannot be read; nobody knows where its files came from"):
        restore(home / "recordings", entry.name)


def test_what_cannot_be_discarded_is_said(home: Path) -> None:
    with pytest.raises(UsageError, match=r"none\.mcap: no such file"):
        discard(home / "recordings/none.mcap", "", NOW_NS)
    folder = discard_all(home)
    with pytest.raises(UsageError, match="is in the trash already"):
        discard(folder / "take.mcap", "", NOW_NS)
    with pytest.raises(UsageError, match=r"other: not in the trash of .*; `sdt edit trash list` shows what is"):
        restore(home / "recordings", "other")
    with pytest.raises(UsageError, match="nowhere: no such folder"):
        trashed(home / "nowhere")
    assert trashed(home / "labels") == ()
