import tomllib
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.numpy import load_file
from safetensors.torch import load_file as load_torch
from safetensors.torch import save_file

from sdt_tools.errors import CheckpointError, OutputExistsError, RecordingError
from sdt_tools.models.card import ModelCard
from sdt_tools.models.checkpoint import load_checkpoint, save_checkpoint
from sdt_tools.models.checkpoint_folder import reserve
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.preprocess import PreprocessConfig, resolve_codes

SMALL = FollowNetConfig(kernels=(5, 3), widths=(4, 4), strides=(4, 4), hidden=8)


@pytest.fixture
def network() -> FollowNet:
    return new_follow_net(SMALL, PreprocessConfig(clip_m=3.0), seed=7).eval()


@pytest.fixture
def folder(tmp_path: Path, network: FollowNet) -> Path:
    folder = tmp_path / "follow-7"
    card = ModelCard(
        kind=FollowNet.kind,
        seed=7,
        dataset_hash="abc",
        architecture=network.architecture,
        preprocess=network.preprocess,
        training={"loop": {"epochs": 3}},
        metrics={"val_accuracy": 0.5, "val_confusion": [[1, 0], [0, 1]]},
    )
    save_checkpoint(folder, network, card, {"curve.csv": b"epoch\n1\n"})
    return folder


def rewrite_card(folder: Path, old: str, new: str) -> None:
    path = folder / "model.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def refusal(folder: Path) -> str:
    with pytest.raises(CheckpointError) as caught:
        load_checkpoint(folder)
    message = str(caught.value)
    assert "\n" not in message
    assert str(folder) in message
    return message


def test_a_checkpoint_answers_as_the_network_that_was_saved(folder: Path, network: FollowNet) -> None:
    scans = np.random.default_rng(0).uniform(0.0, 20.0, (300, 541))
    scans[:, ::7] = 0.0
    loaded = load_checkpoint(folder)
    with torch.inference_mode():
        expected = network(torch.from_numpy(resolve_codes(scans, network.preprocess).astype(np.float32)))
    np.testing.assert_allclose(loaded.predict_logits(scans), expected.numpy(), atol=1e-5)
    assert loaded.name == "follow-7"


def test_the_card_comes_back_whole(folder: Path) -> None:
    card = load_checkpoint(folder).card
    assert (card.seed, card.dataset_hash, card.architecture) == (7, "abc", SMALL)
    assert card.training == {"loop": {"epochs": 3}}
    assert card.metrics == {"val_accuracy": 0.5, "val_confusion": [[1, 0], [0, 1]]}


def test_other_readers_open_the_files(folder: Path, network: FollowNet) -> None:
    weights = load_file(folder / "weights.safetensors")
    np.testing.assert_array_equal(weights["layers.conv1.weight"], network.state_dict()["layers.conv1.weight"].numpy())
    card = tomllib.loads((folder / "model.toml").read_text())
    assert card["classes"] == [
        "stay", "forward", "left_forward", "right_forward", "backward", "left_backward", "right_backward",
    ]  # fmt: skip
    assert (folder / "curve.csv").read_bytes() == b"epoch\n1\n"


def test_nothing_is_written_over(folder: Path, network: FollowNet) -> None:
    before = (folder / "weights.safetensors").read_bytes()
    with pytest.raises(OutputExistsError, match="follow-7 exists already"):
        save_checkpoint(folder, network, load_checkpoint(folder).card)
    assert (folder / "weights.safetensors").read_bytes() == before


def test_a_failed_write_leaves_nothing(folder: Path, network: FollowNet, tmp_path: Path) -> None:
    card = load_checkpoint(folder).card
    with pytest.raises(CheckpointError, match="cannot be written"):
        save_checkpoint(tmp_path / "other", network, card, {"missing/curve.csv": b""})
    assert [path.name for path in tmp_path.iterdir()] == ["follow-7"]


def test_a_place_that_cannot_hold_a_checkpoint_is_refused_beforehand(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(CheckpointError, match=r"model: cannot be written: .*; choose another --out"):
        reserve(tmp_path / "file" / "model")


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    assert "no such checkpoint; train one" in refusal(tmp_path / "nowhere")


def test_a_file_is_no_checkpoint(tmp_path: Path) -> None:
    (tmp_path / "model.pt").write_bytes(b"\x80\x04.")
    assert "a checkpoint is a folder" in refusal(tmp_path / "model.pt")


@pytest.mark.parametrize("name", ["weights.safetensors", "model.toml"])
def test_a_missing_file_is_named(folder: Path, name: str) -> None:
    (folder / name).unlink()
    assert f"{name}: missing" in refusal(folder)


def test_a_broken_card_is_refused(folder: Path) -> None:
    (folder / "model.toml").write_text("kind = ")
    assert "model.toml: not valid TOML" in refusal(folder)


def test_another_kind_of_network_is_refused(folder: Path) -> None:
    rewrite_card(folder, '"follow_plain"', '"vision_resnet"')
    assert "of kind 'vision_resnet'; this version knows follow_gate, follow_plain" in refusal(folder)


def test_another_format_is_refused(folder: Path) -> None:
    rewrite_card(folder, "format = 1", "format = 2")
    assert "format 2, but this version reads 1" in refusal(folder)


def test_an_unknown_key_is_refused(folder: Path) -> None:
    rewrite_card(folder, "hidden = 8", "hiden = 8")
    assert "unknown key 'architecture.hiden'; did you mean 'hidden'?" in refusal(folder)


def test_other_classes_are_refused(folder: Path) -> None:
    rewrite_card(folder, '"stay"', '"halt"')
    assert "answers halt, forward" in refusal(folder)


def test_weights_of_another_shape_are_refused(folder: Path) -> None:
    rewrite_card(folder, "hidden = 8", "hidden = 9")
    said = "'layers.full1.weight' is float32 [8, 136], but the architecture in model.toml needs float32 [9, 136]"
    assert said in refusal(folder)


def test_weights_of_another_architecture_are_refused(folder: Path) -> None:
    weights = load_torch(folder / "weights.safetensors")
    weights["gate.weight"] = torch.zeros(3)
    save_file(weights, folder / "weights.safetensors")
    assert "holds 'gate.weight'" in refusal(folder)


def test_lacking_weights_are_refused(folder: Path) -> None:
    weights = load_torch(folder / "weights.safetensors")
    del weights["layers.full2.bias"]
    save_file(weights, folder / "weights.safetensors")
    assert "lacks 'layers.full2.bias'" in refusal(folder)


def test_weights_of_another_precision_are_refused(folder: Path) -> None:
    weights = load_torch(folder / "weights.safetensors")
    save_file({name: tensor.half() for name, tensor in weights.items()}, folder / "weights.safetensors")
    assert "is float16" in refusal(folder)


def test_weights_that_are_not_finite_are_refused(folder: Path) -> None:
    weights = load_torch(folder / "weights.safetensors")
    weights["layers.conv2.bias"][1] = float("nan")
    save_file(weights, folder / "weights.safetensors")
    assert "'layers.conv2.bias' has values that are not finite" in refusal(folder)


@pytest.mark.parametrize("content", [b"", b"\x80\x04}.", b"\xff" * 64])
def test_a_file_that_is_no_safetensors_is_refused(folder: Path, content: bytes) -> None:
    (folder / "weights.safetensors").write_bytes(content)
    assert "not a whole safetensors file" in refusal(folder)


def test_a_cut_file_is_refused(folder: Path) -> None:
    path = folder / "weights.safetensors"
    path.write_bytes(path.read_bytes()[:-4])
    assert "not a whole safetensors file" in refusal(folder)


def test_scans_of_another_geometry_are_refused(folder: Path) -> None:
    with pytest.raises(RecordingError, match="model follow-7 reads scans of 541 rays, not of 1081"):
        load_checkpoint(folder).predict_logits(np.ones((2, 1081)))


def test_no_scans_have_no_logits(folder: Path) -> None:
    assert load_checkpoint(folder).predict_logits(np.empty((0, 541))).shape == (0, 7)
