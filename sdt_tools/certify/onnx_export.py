"""A network as an ONNX graph, built layer by layer from its weights, for other verifiers and runtimes.

Input ``ranges_m``, float32 [batch, 541]: metres, codes resolved. Output ``logits``, [batch, 7], in the order of
``MotionClass``. Clipping and scaling are part of the graph, as they are part of the network.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import onnx
from onnx import TensorProto, checker, helper, numpy_helper
from torch import Tensor, nn

from sdt_tools.errors import CheckpointError
from sdt_tools.frames import RAYS, MotionClass
from sdt_tools.models.layers import MaxOverRays, Rays, SoftClip, SumOfBranches
from sdt_tools.models.loaded import LoadedModel
from sdt_tools.models.preprocess import ClipScale

INPUT: Final = "ranges_m"
OUTPUT: Final = "logits"
OPSET: Final = 17
IR_VERSION: Final = 8
"""The oldest file format that has opset 17, so that old readers open it."""


def onnx_model(model: LoadedModel) -> onnx.ModelProto:
    """The network of ``model`` as a checked ONNX model. Raises CheckpointError, naming it, for a layer it cannot say.

    Its metadata hold the model's name and kind, the classes, and what was done with codes before the input.
    """
    graph = _Graph()
    end = graph.through(model.network.layers, INPUT, (RAYS,))
    if not graph.nodes:
        raise CheckpointError(f"{model.name}: the network has no layers, so there is nothing to export")
    _rename_result(graph.nodes, end)
    built = helper.make_model(
        helper.make_graph(
            graph.nodes,
            "follow_network",
            [helper.make_tensor_value_info(INPUT, TensorProto.FLOAT, ["batch", RAYS])],
            [helper.make_tensor_value_info(OUTPUT, TensorProto.FLOAT, ["batch", len(MotionClass)])],
            graph.initializers,
        ),
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        producer_name="sdt_tools",
    )
    preprocess = model.network.preprocess
    helper.set_model_props(
        built,
        {
            "model": model.name,
            "kind": model.network.kind,
            "classes": ",".join(motion.label for motion in MotionClass),
            "clip_m": repr(preprocess.clip_m),
            "scale_m": repr(preprocess.scale_m or preprocess.clip_m),
            "code_policy": preprocess.code_policy,
            "code_below_m": repr(preprocess.code_below_m),
        },
    )
    checker.check_model(built, full_check=True)
    return built


def write_onnx(model: onnx.ModelProto, path: Path) -> None:
    """Write the model as one file, weights included."""
    path.write_bytes(model.SerializeToString())


def _rename_result(nodes: Sequence[onnx.NodeProto], end: str) -> None:
    for node in nodes:
        for names in (node.input, node.output):
            for place, name in enumerate(names):
                if name == end:
                    names[place] = OUTPUT


class _Graph:
    """Nodes and weights, gathered on the way through the layers.

    Values are named after the layer that makes them, as in ``sum.trunk.conv1``.
    """

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.initializers: list[onnx.TensorProto] = []
        self._shape: tuple[int, ...] = ()

    def through(self, layers: nn.Sequential, value: str, shape: tuple[int, ...], place: str = "") -> str:
        """Add ``layers`` behind ``value``, of ``shape`` without the batch; the name of what comes out."""
        self._shape = shape
        for name, layer in layers.named_children():
            value = self._layer(f"{place}{name}", layer, value)
        return value

    def _layer(self, name: str, layer: nn.Module, value: str) -> str:
        match layer:
            case nn.Dropout() | nn.Identity():
                return value
            case ClipScale():
                return self._clip_scale(name, layer, value)
            case nn.ReLU():
                return self._node("Relu", name, [value])
            case nn.Conv1d():
                return self._convolution(name, layer, value)
            case nn.Linear() if len(self._shape) == 1:
                return self._full(name, layer, value)
            case nn.Unflatten() if layer.dim == 1:
                return self._unflatten(name, layer, value)
            case nn.Flatten() if (layer.start_dim, layer.end_dim) == (1, -1):
                self._shape = (int(np.prod(self._shape)),)
                return self._node("Flatten", name, [value], axis=1)
            case SoftClip():
                limit = self._constant(f"{name}.limit", np.float32(layer.limit))
                share = self._node("Tanh", f"{name}.tanh", [self._node("Div", f"{name}.div", [value, limit])])
                return self._node("Mul", name, [share, limit])
            case Rays():
                return self._rays(name, layer, value)
            case MaxOverRays() if len(self._shape) == 2:
                self._shape = self._shape[:1]
                return self._node("ReduceMax", name, [value], axes=[2], keepdims=0)
            case SumOfBranches():
                return self._sum(name, layer, value)
        raise CheckpointError(
            f"layer '{name}' is a {type(layer).__name__}, which cannot be exported where it stands; "
            "use Conv1d, Linear, ReLU, Dropout, Flatten, Unflatten and the layers of sdt_tools.models"
        )

    def _clip_scale(self, name: str, layer: ClipScale, value: str) -> str:
        low, high = (self._constant(f"{name}.{end}", np.float32(at)) for end, at in (("0", 0.0), ("m", layer.clip_m)))
        scale = self._constant(f"{name}.scale", np.float32(2.0 / layer.scale_m))
        one = self._constant(f"{name}.one", np.float32(1.0))
        clipped = self._node("Clip", f"{name}.clip", [value, low, high])
        return self._node("Sub", name, [self._node("Mul", f"{name}.mul", [clipped, scale]), one])

    def _convolution(self, name: str, layer: nn.Conv1d, value: str) -> str:
        if layer.padding_mode != "zeros":
            raise CheckpointError(f"layer '{name}' pads with '{layer.padding_mode}', but only zeros can be exported")
        kernel, stride, dilation = layer.kernel_size[0], layer.stride[0], layer.dilation[0]
        padding = layer.padding
        all_round = dilation * (kernel - 1) if padding == "same" else 0 if isinstance(padding, str) else 2 * padding[0]
        before = all_round // 2
        length = (self._shape[1] + all_round - dilation * (kernel - 1) - 1) // stride + 1
        self._shape = (layer.out_channels, length)
        return self._node(
            "Conv",
            name,
            [value, *self._weights(name, layer)],
            kernel_shape=[kernel],
            strides=[stride],
            dilations=[dilation],
            group=layer.groups,
            pads=[before, all_round - before],
        )

    def _full(self, name: str, layer: nn.Linear, value: str) -> str:
        self._shape = (layer.out_features,)
        return self._node("Gemm", name, [value, *self._weights(name, layer)], transB=1)

    def _unflatten(self, name: str, layer: nn.Unflatten, value: str) -> str:
        sizes = np.empty(self._shape[0]).reshape([int(size) for size in layer.unflattened_size]).shape
        self._shape = (*sizes, *self._shape[1:])
        return self._node("Reshape", name, [value, self._constant(f"{name}.shape", np.array([0, *self._shape]))])

    def _rays(self, name: str, layer: Rays, value: str) -> str:
        self._shape = (layer.last - layer.first + 1,)
        parts = {"starts": layer.first, "ends": layer.last + 1, "axes": 1}
        return self._node(
            "Slice", name, [value, *(self._constant(f"{name}.{key}", np.array([at])) for key, at in parts.items())]
        )

    def _sum(self, name: str, layer: SumOfBranches, value: str) -> str:
        before = self._shape
        ends = []
        for branch, layers in layer.branches.named_children():
            assert isinstance(layers, nn.Sequential)
            ends.append(self.through(layers, value, before, f"{name}.{branch}."))
        return self._node("Sum", name, ends)

    def _weights(self, name: str, layer: nn.Conv1d | nn.Linear) -> list[str]:
        given = {"weight": layer.weight, "bias": layer.bias}
        return [
            self._constant(f"{name}.{key}", _float32(tensor)) for key, tensor in given.items() if tensor is not None
        ]

    def _constant(self, name: str, value: np.ndarray | np.generic) -> str:
        self.initializers.append(numpy_helper.from_array(np.asarray(value), name))
        return name

    def _node(self, operator: str, name: str, inputs: list[str], **attributes: Any) -> str:
        self.nodes.append(helper.make_node(operator, inputs, [name], name=name, **attributes))
        return name


def _float32(tensor: Tensor) -> np.ndarray:
    return tensor.detach().cpu().float().numpy()
