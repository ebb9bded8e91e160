from collections import OrderedDict
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import pytest
import torch
from torch import nn

from sdt_tools.certify.onnx_answers import OnnxNetwork
from sdt_tools.certify.onnx_export import onnx_model, write_onnx
from sdt_tools.errors import CheckpointError
from sdt_tools.models.card import ModelCard
from sdt_tools.models.follow_net import FollowNet, FollowNetConfig, new_follow_net
from sdt_tools.models.gated_net import GateConfig, GatedNetConfig, new_gated_net
from sdt_tools.models.layers import SoftClip, SumOfBranches
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.models.preprocess import PreprocessConfig


def loaded(network: FollowNet) -> LoadedModel:
    card = ModelCard(kind=network.kind, seed=0, architecture=network.architecture, preprocess=network.preprocess)
    return LoadedModel("small", network, card)


PREPROCESS = PreprocessConfig(clip_m=3.5, scale_m=5.0, code_policy="near")
NETWORKS = {
    "plain": lambda: new_follow_net(FollowNetConfig(), PREPROCESS, 1),
    "gated": lambda: new_gated_net(GatedNetConfig(gate=GateConfig(limit=0.05)), PREPROCESS, 1),
}


@pytest.fixture(params=NETWORKS)
def model(request: pytest.FixtureRequest) -> LoadedModel:
    """Weights are made large, for fresh ones answer nearly the same to all scans."""
    network = NETWORKS[request.param]().eval()
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.mul_(2.0)
    return loaded(network)


@pytest.fixture
def scans_m() -> np.ndarray:
    generator = np.random.default_rng(0)
    return 20.0 * generator.random((50, 541)) * generator.random((50, 1))


def test_onnx_runtime_answers_as_torch_does(model: LoadedModel, scans_m: np.ndarray, tmp_path: Path) -> None:
    write_onnx(onnx_model(model), tmp_path / "small.onnx")
    session = onnxruntime.InferenceSession(tmp_path / "small.onnx", providers=["CPUExecutionProvider"])
    (logits,) = session.run(["logits"], {"ranges_m": scans_m.astype(np.float32)})
    with torch.inference_mode():
        expected = model.network(torch.tensor(scans_m).float()).numpy()
    assert logits.shape == (50, 7)
    assert np.ptp(expected, axis=0).min() > 0.005  # the answers depend on the scans
    np.testing.assert_allclose(logits, expected, atol=1e-5)


def test_the_file_is_valid_and_says_what_it_is(model: LoadedModel, tmp_path: Path) -> None:
    write_onnx(onnx_model(model), tmp_path / "small.onnx")
    found = onnx.load(tmp_path / "small.onnx")
    onnx.checker.check_model(found, full_check=True)
    props = {prop.key: prop.value for prop in found.metadata_props}
    assert props["kind"] == model.network.kind
    assert props["classes"] == "stay,forward,left_forward,right_forward,backward,left_backward,right_backward"
    assert (props["model"], props["clip_m"], props["scale_m"]) == ("small", "3.5", "5.0")
    assert (props["code_policy"], props["code_below_m"]) == ("near", "0.005")
    assert found.opset_import[0].version >= 17
    (scan,) = found.graph.input
    assert (scan.name, scan.type.tensor_type.shape.dim[1].dim_value) == ("ranges_m", 541)
    assert [output.name for output in found.graph.output] == ["logits"]


def test_batches_are_answered_as_scans_by_themselves(model: LoadedModel, scans_m: np.ndarray) -> None:
    network = OnnxNetwork(onnx_model(model))
    many = np.tile(scans_m, (3, 1))
    np.testing.assert_allclose(network.logits(many)[120], network.logits(many[120:121])[0], atol=1e-5)


def test_dropout_is_the_identity_even_of_a_network_in_training(scans_m: np.ndarray) -> None:
    network = new_follow_net(FollowNetConfig(dropout=0.9), PREPROCESS, 1)
    in_training = OnnxNetwork(onnx_model(loaded(network.train()))).logits(scans_m)
    assert np.array_equal(in_training, OnnxNetwork(onnx_model(loaded(network.eval()))).logits(scans_m))


@pytest.mark.parametrize(
    "convolution",
    [
        nn.Conv1d(1, 4, 4, padding="same"),
        nn.Conv1d(1, 4, 3, padding="valid", dilation=2),
        nn.Conv1d(1, 4, 5, stride=3, padding=1, bias=False),
    ],
    ids=["same", "valid", "strided"],
)
@pytest.mark.filterwarnings("ignore:Using padding='same' with even kernel")
def test_convolutions_of_other_shapes_are_exported_too(convolution: nn.Conv1d, scans_m: np.ndarray) -> None:
    network = new_follow_net(FollowNetConfig(), PREPROCESS, 1).eval()
    features = convolution(torch.zeros(1, 1, 541)).numel()
    network.layers = nn.Sequential(nn.Unflatten(1, (1, -1)), convolution, nn.Flatten(), nn.Linear(features, 7))
    with torch.inference_mode():
        expected = network.layers(torch.tensor(scans_m).float()).numpy()
    np.testing.assert_allclose(OnnxNetwork(onnx_model(loaded(network))).logits(scans_m), expected, atol=1e-4)


def test_sums_of_sums_are_exported(scans_m: np.ndarray) -> None:
    network = new_follow_net(FollowNetConfig(), PREPROCESS, 1).eval()
    inner = SumOfBranches({"a": nn.Sequential(nn.Linear(541, 7), SoftClip(2.0)), "b": nn.Sequential(nn.Linear(541, 7))})
    network.layers = nn.Sequential(SumOfBranches({"c": nn.Sequential(inner), "d": nn.Sequential(nn.Linear(541, 7))}))
    with torch.inference_mode():
        expected = network.layers(torch.tensor(scans_m).float()).numpy()
    np.testing.assert_allclose(OnnxNetwork(onnx_model(loaded(network))).logits(scans_m), expected, atol=1e-4)


@pytest.mark.parametrize(
    ("layers", "said"),
    [
        (OrderedDict(odd=nn.GELU(), full=nn.Linear(541, 7)), "layer 'odd' is a GELU"),
        (OrderedDict(channel=nn.Unflatten(1, (1, 541)), full=nn.Linear(541, 7)), "layer 'full' is a Linear"),
        (
            OrderedDict(channel=nn.Unflatten(1, (1, 541)), ring=nn.Conv1d(1, 1, 3, padding=1, padding_mode="circular")),
            "layer 'ring' pads with 'circular'",
        ),
        (OrderedDict(sum=SumOfBranches({"a": nn.Sequential(nn.Softmax(dim=1))})), "layer 'sum.a.0' is a Softmax"),
        (OrderedDict(), "no layers"),
    ],
)
def test_what_cannot_be_exported_is_named(layers: "OrderedDict[str, nn.Module]", said: str) -> None:
    network = new_follow_net(FollowNetConfig(), PREPROCESS, 1)
    network.layers = nn.Sequential(layers)
    with pytest.raises(CheckpointError, match=said):
        onnx_model(loaded(network))
