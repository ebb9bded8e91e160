"""A vision network as an ONNX graph, built layer by layer from its weights.

Input ``images``, float32 [batch, 3, height, width]: red, green, blue of 0 to 255. Output ``logits``, in the order of
``Gesture``, and ``features``, what the classifier sees. Normalisation is part of the graph.
"""

from typing import Any, Final

import numpy as np
import onnx
from onnx import TensorProto, checker, helper, numpy_helper
from torch import Tensor, nn

from sdt_tools.frames import Gesture
from sdt_tools.models.vision.layers import MeanOverImage, Normalise, Residual, SameConv2d
from sdt_tools.models.vision.net import VisionNet

INPUT: Final = "images"
LOGITS: Final = "logits"
FEATURES: Final = "features"
OPSET: Final = 17
IR_VERSION: Final = 8
"""The oldest file format that has opset 17, so that old readers open it."""


def vision_onnx(network: VisionNet) -> onnx.ModelProto:
    """The network as a checked ONNX model."""
    graph = _Graph()
    value = graph.layer("normalise", network.normalise, INPUT)
    for name, part in (("stem", network.stem), ("blocks", network.blocks), ("head", network.head)):
        value = graph.layer(name, part, value)
    graph.layer("mean", network.mean, value, FEATURES)
    graph.layer("classifier", network.classifier, FEATURES, LOGITS)
    preprocess = network.preprocess
    built = helper.make_model(
        helper.make_graph(
            graph.nodes,
            "vision_network",
            [
                helper.make_tensor_value_info(
                    INPUT, TensorProto.FLOAT, ["batch", 3, preprocess.height, preprocess.width]
                )
            ],
            [
                helper.make_tensor_value_info(LOGITS, TensorProto.FLOAT, ["batch", len(Gesture)]),
                helper.make_tensor_value_info(FEATURES, TensorProto.FLOAT, ["batch", network.architecture.features]),
            ],
            graph.initializers,
        ),
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        producer_name="sdt_tools",
    )
    helper.set_model_props(built, {"classes": ",".join(gesture.label for gesture in Gesture)})
    checker.check_model(built, full_check=True)
    return built


class _Graph:
    """Nodes and weights, gathered on the way; values are named after the layer that makes them."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.initializers: list[onnx.TensorProto] = []

    def layer(self, name: str, layer: nn.Module, value: str, out: str | None = None) -> str:
        """Add ``layer`` behind ``value``; the name of what comes out, which is ``out`` or ``name``."""
        match layer:
            case nn.Sequential():
                for own, inner in layer.named_children():
                    value = self.layer(f"{name}.{own}", inner, value)
                return value
            case Residual():
                branch = self.layer(f"{name}.branch", layer.branch, value)
                kept = value if layer.shortcut is None else self.layer(f"{name}.shortcut", layer.shortcut, value)
                return self._node("Add", name, [branch, kept])
            case Normalise():
                std, mean = (np.array(part, np.float32).reshape(1, 3, 1, 1) for part in (layer.std, layer.mean))
                scaled = self._node("Mul", f"{name}.mul", [value, self._constant(f"{name}.scale", 1 / std)])
                return self._node("Add", name, [scaled, self._constant(f"{name}.offset", -mean / std)])
            case nn.Conv2d():
                return self._convolution(name, layer, value)
            case nn.ReLU6():
                ends = [self._constant(f"{name}.{at}", np.float32(at)) for at in (0, 6)]
                return self._node("Clip", name, [value, *ends])
            case nn.ReLU():
                return self._node("Relu", name, [value])
            case nn.MaxPool2d():
                size, stride, around = (_both(part) for part in (layer.kernel_size, layer.stride, layer.padding))
                return self._node("MaxPool", name, [value], kernel_shape=size, strides=stride, pads=around * 2)
            case MeanOverImage():
                return self._node("ReduceMean", out or name, [value], axes=[2, 3], keepdims=0)
            case nn.Linear():
                return self._node("Gemm", out or name, [value, *self._weights(name, layer)], transB=1)
        raise AssertionError(f"no ONNX for {type(layer).__name__}")

    def _convolution(self, name: str, layer: nn.Conv2d, value: str) -> str:
        attributes: dict[str, Any] = {
            "kernel_shape": list(layer.kernel_size),
            "strides": list(layer.stride),
            "group": layer.groups,
        }
        if isinstance(layer, SameConv2d):
            attributes["auto_pad"] = "SAME_UPPER"
        else:
            assert not isinstance(layer.padding, str)
            attributes["pads"] = [*layer.padding, *layer.padding]
        return self._node("Conv", name, [value, *self._weights(name, layer)], **attributes)

    def _weights(self, name: str, layer: nn.Conv2d | nn.Linear) -> list[str]:
        assert layer.bias is not None
        given = {"weight": layer.weight, "bias": layer.bias}
        return [self._constant(f"{name}.{key}", _float32(tensor)) for key, tensor in given.items()]

    def _constant(self, name: str, value: np.ndarray | np.generic) -> str:
        self.initializers.append(numpy_helper.from_array(np.asarray(value), name))
        return name

    def _node(self, operator: str, name: str, inputs: list[str], **attributes: Any) -> str:
        self.nodes.append(helper.make_node(operator, inputs, [name], name=name, **attributes))
        return name


def _both(size: int | tuple[int, ...]) -> list[int]:
    return [size, size] if isinstance(size, int) else list(size)


def _float32(tensor: Tensor) -> np.ndarray:
    return tensor.detach().cpu().contiguous().float().numpy()
