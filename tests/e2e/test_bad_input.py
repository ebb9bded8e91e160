"""Every wrong input: one line that says what, where and what to do; exit 2; nothing harmed."""

from pathlib import Path

import pytest
from refusals import Sdt, assert_refused

from sdt_tools.models.card import ModelCard
from sdt_tools.models.checkpoint import save_checkpoint
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.preprocess import PreprocessConfig

SAMPLES = Path(__file__).parents[2] / "recordings"
PLAIN = SAMPLES / "sample_plain.mcap"


@pytest.fixture
def model(tmp_path: Path) -> Path:
    network = new_follow_net(FollowNetConfig(), PreprocessConfig(), 0)
    save_checkpoint(
        tmp_path / "model",
        network,
        ModelCard(kind=FollowNet.kind, seed=0, architecture=network.architecture, preprocess=network.preprocess),
    )
    return tmp_path / "model"


@pytest.mark.parametrize(
    "command",
    [
        ["inspect", "none.mcap"],
        ["label", "auto", "none.mcap", "--from", "truth"],
        ["dataset", "build", "none.mcap", "--out", "data"],
        ["view", "none.mcap"],
    ],
)
def test_a_missing_recording_is_named(sdt: Sdt, command: list[str]) -> None:
    assert_refused(sdt(*command), "none.mcap", "no such")


def test_a_file_that_is_not_an_mcap_is_named(sdt: Sdt, tmp_path: Path) -> None:
    (tmp_path / "notes.mcap").write_text("This is no recording, however long it may go on. " * 9)
    assert_refused(sdt("inspect", "notes.mcap"), "notes.mcap", "not an MCAP")


def test_an_unknown_scenario_lists_the_known_ones(sdt: Sdt, tmp_path: Path) -> None:
    assert_refused(sdt("record", "scene", "--scenario", "plane", "--out", "x.mcap"), "plane", "plain", "around_boxes")
    assert not (tmp_path / "x.mcap").exists()


def test_an_unknown_key_names_the_nearest(sdt: Sdt, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text("[rates]\nscan_hertz = 25.0\n")
    result = sdt("record", "scene", "--config", "c.toml", "--out", "x.mcap")
    assert_refused(result, "c.toml", "unknown key", "rates.scan_hertz", "did you mean 'scan_hz'")


def test_a_key_like_none_there_is_lists_them(sdt: Sdt, tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text("[rates]\nwheels = 4\n")
    code, said = sdt("record", "scene", "--config", "c.toml", "--out", "x.mcap")
    assert_refused((code, said), "rates.wheels", "follow_hz, image_hz, scan_hz, vision_hz")
    assert "did you mean" not in said


@pytest.mark.parametrize("name", ["x.jpg", "x.weird", "x"])
@pytest.mark.parametrize("verb", [["domains", "--level", "1", "--out"], ["inspect", PLAIN, "--plot"]])
def test_pictures_are_png_and_nothing_else(sdt: Sdt, tmp_path: Path, verb: list[object], name: str) -> None:
    assert_refused(sdt(*verb, name), f"{verb[-1]} {name}", ".png")
    assert list(tmp_path.iterdir()) == []


def test_an_output_that_exists_is_left_alone(sdt: Sdt, tmp_path: Path) -> None:
    (tmp_path / "x.mcap").write_text("mine")
    assert_refused(sdt("record", "scene", "--no-camera", "--seconds", 1, "--out", "x.mcap"), "x.mcap exists already")
    assert (tmp_path / "x.mcap").read_text() == "mine"


def test_another_number_of_rays_is_said(sdt: Sdt, tmp_path: Path) -> None:
    (tmp_path / "short.csv").write_text("\n".join(",".join(["1.0"] * 364) for _ in range(3)))
    assert_refused(sdt("import", "lidar-csv", "short.csv", "--hz", 25, "--out", "x.mcap"), "short.csv", "541")


def test_a_checkpoint_of_another_architecture_is_refused(sdt: Sdt, model: Path) -> None:
    card = model / "model.toml"
    card.write_text(card.read_text().replace("hidden = 48", "hidden = 64"))
    result = sdt("replay", model, SAMPLES / "sample_practice.mcap", "--out", "p.parquet")
    assert_refused(result, "model")


def test_a_folder_without_a_model_is_refused(sdt: Sdt, tmp_path: Path) -> None:
    assert_refused(sdt("evaluate", "follow", tmp_path, "--scenario", "plain", "--seeds", "0"), str(tmp_path))


def test_an_empty_data_set_is_refused(sdt: Sdt, tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    assert_refused(sdt("train", "follow", "data", "--out", "m"), "data")


def test_recordings_without_labels_make_no_data_set(sdt: Sdt, tmp_path: Path) -> None:
    result = sdt("dataset", "build", SAMPLES / "sample_practice.mcap", "--labels", tmp_path, "--out", "data")
    assert_refused(result, "sample_practice", "label")
    assert not (tmp_path / "data").exists()


def test_errors_without_labels_say_what_to_do(sdt: Sdt, model: Path, tmp_path: Path) -> None:
    recording = SAMPLES / "sample_practice.mcap"
    assert sdt("replay", model, recording, "--out", "p.parquet")[0] == 0
    result = sdt("errors", "p.parquet", "--recordings", recording, "--out", "e")
    assert_refused(result, "label")
    assert not (tmp_path / "e").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["fly"], "No such command 'fly'"),
        (["record", "scene"], "name either --out, for one recording, or --session, for takes"),
        (["repair", "r.mcap"], "Missing option '--out'"),
        (["record", "scene", "--seed", "-1", "--out", "x"], "'--seed'"),
        (["record", "scene", "--seconds", "inf", "--out", "x"], "seconds"),
        (["import", "lidar-csv", "x.csv", "--hz", "inf", "--out", "x"], "--hz inf"),
    ],
)
def test_a_wrong_call_is_one_line_too(sdt: Sdt, words: list[str], said: str) -> None:
    assert_refused(sdt(*words), said)


def test_a_folder_that_cannot_be_made_is_named(sdt: Sdt, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    result = sdt("evaluate", "follow", "expert", "--scenario", "plain", "--seeds", 0, "--out", "file/x")
    assert_refused(result, "file/x", "Not a directory")


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('name = "../evil"', "'name'"),
        ('name = "x"\ntimeout_s = inf', "'timeout_s'"),
        ('name = "x"\npost = [{ x = 1, y = 1, radius = -0.1 }]', "greater than 0, not -0.1"),
        ('name = "x"\nbox = [{ x = 0, y = 0, length = 2, width = 2 }]', "robot starts inside box 0"),
    ],
)
def test_a_scenario_that_cannot_be_is_refused(sdt: Sdt, tmp_path: Path, line: str, said: str) -> None:
    (tmp_path / "own.toml").write_text(line + "\noperator = { path = [[1.5, 0.0], [4.0, 0.0]] }\n")
    assert_refused(sdt("record", "scene", "--scenario", "own.toml", "--no-camera", "--out", "x.mcap"), said)
    assert not (tmp_path / "x.mcap").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--level", "3", "--domains", "own.toml"], ["level", "domains", "contradict"]),
        (["--level", "2", "--epsilon-m", "0.1"], ["level", "epsilon_m", "contradict"]),
        (["--arch", "transformer"], ["transformer", "plain or gate"]),
        (["--inner", "guess"], ["--inner", "ibp", "pgd"]),
        (["--level", "1", "--delta", "0"], ["--delta", "greater than 0"]),
        (["--level", "1", "--lambda", "-1"], ["--lambda", "greater than 0"]),
        (["--epochs", "0"], ["--epochs", "greater than or equal to 1"]),
    ],
)
def test_training_options_that_make_no_sense_are_named(sdt: Sdt, options: list[str], words: list[str]) -> None:
    assert_refused(sdt("train", "follow", "data", "--out", "out", *options), *words)


def test_a_malformed_domain_file_is_named(sdt: Sdt, model: Path, tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text('[[domain]]\nname = "x"\nallowed = []\n')
    for verb in (["certify", model], ["attack", "follow", model], ["domains"]):
        assert_refused(sdt(*verb, "--domains", "own.toml"), "own.toml", "allowed names no class")


def test_level_0_has_nothing_to_certify(sdt: Sdt, model: Path) -> None:
    assert_refused(sdt("certify", model, "--level", "0"), "level 0 asks for nothing")


def test_a_missing_model_is_named_by_every_verb_that_takes_one(sdt: Sdt) -> None:
    for verb in (["certify", "none", "--level", "1"], ["attack", "follow", "none", "--level", "1"]):
        assert_refused(sdt(*verb), "none", "no such checkpoint")
