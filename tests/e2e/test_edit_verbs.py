"""``sdt edit`` as a user calls it."""

import json
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from sdt_tools.cli.app import main

SAMPLES = Path(__file__).parents[2]
Sdt = Callable[..., tuple[int, str, str]]


@pytest.fixture
def sdt(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Sdt:
    """Runs a command where a labelled sample lies in ``recordings``: exit code, stdout, stderr."""
    for name in ("recordings/sample_practice.mcap", "labels/sample_practice.motion.csv"):
        path = tmp_path / name.replace("sample_practice", "drive")
        path.parent.mkdir()
        path.write_bytes((SAMPLES / name).read_bytes())
    (tmp_path / "recordings/text.mcap").write_text("no recording")
    monkeypatch.chdir(tmp_path)

    def call(*words: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["sdt", *map(str, words)])
        with pytest.raises(SystemExit) as stop:
            main()
        return int(stop.value.code or 0), *capsys.readouterr()

    return call


def test_split_then_merge_brings_back_recording_and_labels(sdt: Sdt, tmp_path: Path) -> None:
    code, out, _ = sdt(
        "edit", "split", "recordings/drive.mcap", "--at", 4, "--at", 8, "--out-dir", "recordings", "--json"
    )
    assert code == 0
    parts = [part["out"] for part in json.loads(out)["recordings"]]
    assert parts == [f"recordings/drive_0{n}.mcap" for n in (1, 2, 3)]
    code, out, _ = sdt("edit", "merge", *reversed(parts), "--out", "recordings/again.mcap", "--json")
    assert code == 0
    document = json.loads(out)
    (again,) = document["recordings"]
    acts = len((tmp_path / "labels/drive.motion.csv").read_text().splitlines()) - 1
    assert document["journals"] == [{"path": "labels/again.motion.csv", "acts": acts, "of": acts}]
    assert [original["path"] for original in again["originals"]] == parts
    whole, merged = (
        json.loads(sdt("inspect", f"recordings/{name}.mcap", "--json")[1])["topics"] for name in ("drive", "again")
    )
    assert merged == whole


def test_people_are_told_what_was_carried_and_what_could_not_be_read(sdt: Sdt, tmp_path: Path) -> None:
    drive = tmp_path / "recordings/drive.mcap"
    drive.write_bytes(drive.read_bytes()[: drive.stat().st_size // 2])
    code, _, said = sdt("edit", "trim", drive, "--from", 1, "--out", "new.mcap")
    assert code == 0
    assert "carried to the beginning" in said
    assert "is cut off; it was read up to where it stops" in said
    assert "labels/new.motion.csv: " in said


def test_put_list_restore(sdt: Sdt, tmp_path: Path) -> None:
    code, out, _ = sdt("edit", "trash", "put", "recordings/drive.mcap", "--reason", "blurred", "--json")
    assert code == 0
    assert [Path(folder).parent.name for folder in json.loads(out)["trashed"]] == [".trash"]
    assert list((tmp_path / "labels").iterdir()) == []
    (entry,) = json.loads(sdt("edit", "trash", "list", "--json")[1])["trash"]
    assert entry["reason"] == "blurred"
    assert "blurred" in sdt("edit", "trash", "list")[2]
    code, out, _ = sdt("edit", "trash", "restore", entry["name"], "--json")
    assert code == 0
    drive, labels = tmp_path / "recordings/drive.mcap", tmp_path / "labels/drive.motion.csv"
    assert [Path(path).resolve() for path in json.loads(out)["restored"]] == [drive, labels]
    assert drive.is_file()
    assert labels.is_file()
    assert "its trash is empty" in sdt("edit", "trash", "list")[2]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["trim", "drive", "--from", "90", "--out", "new.mcap"], "lies outside the recording"),
        (["trim", "drive", "--from", "3", "--to", "2", "--out", "new.mcap"], "--from 3 is not before --to 2"),
        (["trim", "drive", "--from", "soon", "--out", "new.mcap"], "'soon' is no moment"),
        (["trim", "drive", "--out", "new.mcap"], "say --from, --to or both"),
        (["trim", "drive", "--from", "1", "--out", "recordings/text.mcap"], "text.mcap exists already"),
        (["trim", "text", "--from", "1", "--out", "new.mcap"], "text.mcap: not an MCAP file"),
        (["trim", "none", "--from", "1", "--out", "new.mcap"], "none.mcap: no such recording"),
        (["split", "drive", "--at", "2", "--at", "1", "--out-dir", "parts"], "give the points in order"),
        (["split", "drive", "--at", "99", "--out-dir", "parts"], "does not lie within the recording"),
        (["split", "drive", "--out-dir", "parts"], "say where to split"),
        (["split", "drive", "--at", "1", "--every", "1", "--out-dir", "parts"], "one of them"),
        (["drop", "drive", "--topic", "/odom", "--out", "new.mcap"], "has no topic /odom; it has"),
        (["drop", "drive", "--out", "new.mcap"], "say what to drop"),
        (["drop", "drive", "--from", "0", "--out", "new.mcap"], "no message would be left"),
        (["merge", "drive", "--out", "new.mcap"], "give two recordings or more"),
        (["merge", "drive", "drive", "--out", "new.mcap"], "give it once"),
        (["trim", "drive", "--from", "1", "--out", "drive.mcap"], "drive.motion.csv exists already"),
        (["trash", "put", "none"], "none.mcap: no such recording; nothing was discarded"),
        (["trash", "put", "drive", "drive"], "is given twice"),
        (["trash", "restore", "nothing"], "nothing: not in the trash of recordings"),
        (["trash", "list", "--dir", "nowhere"], "nowhere: no such folder"),
    ],
)
def test_bad_input_is_one_line_and_exit_2(sdt: Sdt, tmp_path: Path, words: list[str], message: str) -> None:
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    names = ("drive", "text", "none")
    code, out, said = sdt("edit", *[f"recordings/{word}.mcap" if word in names else word for word in words])
    assert code == 2
    assert out == ""
    assert message in said
    assert said.count("\n") == 1
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before
