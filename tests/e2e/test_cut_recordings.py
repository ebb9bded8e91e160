"""Recordings that were cut off or damaged, as a user meets them: every verb works on what is there, and says so."""

import json
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from sdt_tools.cli.app import main
from sdt_tools.models.card import ModelCard
from sdt_tools.models.checkpoint import save_checkpoint
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.preprocess import PreprocessConfig
from sdt_tools.recording.container.reader import McapReader

SAMPLES = Path(__file__).parents[2] / "recordings"
PLAIN, PRACTICE = SAMPLES / "sample_plain.mcap", SAMPLES / "sample_practice.mcap"


@dataclass(frozen=True)
class User:
    """Calls ``sdt`` in a folder, and reads what it says."""

    monkeypatch: pytest.MonkeyPatch
    capsys: pytest.CaptureFixture[str]

    def __call__(self, *arguments: object) -> str:
        """What ``sdt`` prints; it succeeds."""
        self.monkeypatch.setattr(sys, "argv", ["sdt", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        told = self.capsys.readouterr()
        assert ended.value.code in (0, None), told.err
        return told.out + told.err

    def document(self, *arguments: object) -> dict:
        """The one document that it prints with --json."""
        printed = self(*arguments, "--json")
        return json.loads(printed[printed.index("{") : printed.rindex("}") + 1])


@pytest.fixture
def sdt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> User:
    monkeypatch.chdir(tmp_path)
    return User(monkeypatch, capsys)


def cut(sample: Path, share: float) -> Path:
    """The first part of a sample, in the current folder, under the sample's name."""
    data = sample.read_bytes()
    path = Path(sample.name)
    path.write_bytes(data[: int(len(data) * share)])
    return path


def network() -> Path:
    net = new_follow_net(FollowNetConfig(), PreprocessConfig(), seed=0)
    card = ModelCard(kind=FollowNet.kind, seed=0, architecture=net.architecture, preprocess=net.preprocess)
    save_checkpoint(Path("model"), net, card)
    return Path("model")


def told_of(path: Path, sdt: User) -> str:
    """The line about ``path`` that every verb is to print."""
    report = sdt.document("inspect", path)
    assert report["truncated"]
    messages = sum(topic["count"] for topic in report["topics"].values())
    return (
        f"{path}: cut off at {report['end_ns']} ns, {report['duration_s']:.2f} s after its start; the {messages:,} "
        "messages up to there are read; `sdt repair` finishes it"
    )


def test_a_cut_recording_goes_all_the_way_and_is_always_named(sdt: User) -> None:
    paths = [cut(PLAIN, 0.7), cut(PRACTICE, 0.7)]
    lines = [told_of(path, sdt) for path in paths]
    model = network()
    said = {
        "inspect": sdt("inspect", paths[0]),
        "view": sdt("view", paths[0], "--out", "v.rrd"),
        "label auto": sdt("label", "auto", *paths, "--from", "truth", "--labels", "labels"),
    }
    build = ["dataset", "build", *paths, "--labels", "labels", "--as-recorded", "--allow-conflicts"]
    said["dataset build"] = sdt(*build, "--out", "d")
    said["replay"] = sdt("replay", model, *paths, "--labels", "labels", "--out", "p.parquet")
    said["errors"] = sdt("errors", "p.parquet", "--recordings", ".", "--out", "e")
    for verb, printed in said.items():
        expected = lines[:1] if verb in ("inspect", "view") else lines
        assert all(line in printed.splitlines() for line in expected), (verb, printed)


def test_machines_are_told_too(sdt: User) -> None:
    paths = [cut(PLAIN, 0.6), cut(PRACTICE, 0.6)]
    model = network()
    documents = {
        "view": sdt.document("view", paths[0], "--out", "v.rrd"),
        "label auto": sdt.document("label", "auto", *paths, "--from", "truth", "--labels", "labels"),
        "replay": sdt.document("replay", model, *paths, "--labels", "labels", "--out", "p.parquet"),
        "errors": sdt.document("errors", "p.parquet", "--recordings", ".", "--out", "e"),
    }
    build = ["dataset", "build", *paths, "--labels", "labels", "--as-recorded", "--allow-conflicts"]
    documents["dataset build"] = sdt.document(*build, "--out", "d")
    for verb, document in documents.items():
        assert document["truncated"] is True, verb
        named = document["incomplete"] if verb != "view" else [document["incomplete"]]
        assert {entry["path"] for entry in named} == {str(path) for path in (paths[:1] if verb == "view" else paths)}
    assert json.loads(Path("e/errors.json").read_text())["truncated"] is True


def test_what_a_damaged_chunk_has_lost_is_named_by_every_verb(sdt: User) -> None:
    path = Path(PRACTICE.name)
    data = bytearray(PRACTICE.read_bytes())
    with McapReader(PRACTICE) as source:
        (chunk, *_) = source.segments()
    data[chunk.offset + chunk.length // 2] ^= 0x10
    path.write_bytes(data)
    line = f"{path}: lost from {chunk.start_ns} to {chunk.end_ns} ns: "
    said = {
        "inspect": sdt("inspect", path, "--full"),
        "view": sdt("view", path, "--out", "v.rrd"),
        "label auto": sdt("label", "auto", path, "--from", "truth", "--labels", "labels"),
        "replay": sdt("replay", network(), path, "--labels", "labels", "--out", "p.parquet"),
        "errors": sdt("errors", "p.parquet", "--recordings", ".", "--out", "e"),
    }
    for verb, printed in said.items():
        assert any(told.startswith(line) for told in printed.splitlines()), (verb, printed)
        assert "cut off" not in printed


def test_what_is_whole_is_not_called_incomplete(sdt: User) -> None:
    path = cut(PRACTICE, 1.0)
    for printed in (sdt("inspect", path), sdt("view", path, "--out", "v.rrd")):
        assert "cut off" not in printed
    assert sdt.document("label", "auto", path, "--from", "truth", "--labels", "labels")["incomplete"] == []
