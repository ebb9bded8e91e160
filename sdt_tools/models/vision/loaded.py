"""A vision network as others use it: pictures in, logits out, by ONNX Runtime on one thread."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import onnxruntime
import torch
from jaxtyping import Float32, UInt8

from sdt_tools.errors import RunError
from sdt_tools.frames import Gesture
from sdt_tools.models.card import VisionCard
from sdt_tools.models.loaded import one_torch_thread
from sdt_tools.models.vision.net import VisionNet
from sdt_tools.models.vision.onnx_graph import FEATURES, INPUT, LOGITS, vision_onnx
from sdt_tools.models.vision.pictures import decode_picture, resize_picture

_BATCH: Final = 4
"""Images answered at once: the activations of many large ones leave the processor's cache."""
_TOLERANCE: Final = 1e-3
"""How far the two runtimes may differ, as a share of the largest logit (at least 1): float32 over a hundred layers."""


@dataclass(frozen=True, eq=False)
class LoadedVisionModel:
    """A vision network ready to answer, with its card; ``name`` is the name of its folder.

    ``network`` is the same in torch, for attacks and training.
    """

    name: str
    network: VisionNet
    card: VisionCard
    session: onnxruntime.InferenceSession

    def predict_logits(self, images_u8: UInt8[np.ndarray, "images height width 3"]) -> Float32[np.ndarray, "images 3"]:
        """Logits for images as ``pixels`` makes them, in the order of ``Gesture``."""
        logits, _ = self.answer(images_u8)
        return logits

    def predict_features(
        self, images_u8: UInt8[np.ndarray, "images height width 3"]
    ) -> Float32[np.ndarray, "images features"]:
        """What the classifier sees of images as ``pixels`` makes them: places in feature space."""
        _, features = self.answer(images_u8)
        return features

    def answer(
        self, images_u8: UInt8[np.ndarray, "images height width 3"]
    ) -> tuple[Float32[np.ndarray, "images 3"], Float32[np.ndarray, "images features"]]:
        """Logits and features at once: one is on the way to the other."""
        logits = np.empty((len(images_u8), len(Gesture)), np.float32)
        features = np.empty((len(images_u8), self.card.architecture.features), np.float32)
        for start in range(0, len(images_u8), _BATCH):
            part = slice(start, start + _BATCH)
            asked = np.ascontiguousarray(images_u8[part].transpose(0, 3, 1, 2), np.float32)
            logits[part], features[part] = self.session.run([LOGITS, FEATURES], {INPUT: asked})
        return logits, features

    def pixels(self, picture_bgr_u8: UInt8[np.ndarray, "rows columns *colours"]) -> UInt8[np.ndarray, "height width 3"]:
        """A picture in blue, green, red (or grey), of any size, as the network sees it: red, green, blue."""
        return resize_picture(picture_bgr_u8, self.card.preprocess)

    def read(self, data: bytes) -> Float32[np.ndarray, "3"]:
        """Logits for one compressed picture. Raises RecordingError for one that cannot be decoded."""
        logits: Float32[np.ndarray, "3"] = self.predict_logits(self.pixels(decode_picture(data))[None])[0]
        return logits

    def decide(self, data: bytes) -> Gesture:
        """The gesture in one compressed picture. Raises RecordingError for one that cannot be decoded."""
        return Gesture(int(self.read(data).argmax()))


def ready_to_answer(name: str, network: VisionNet, card: VisionCard) -> LoadedVisionModel:
    """``network``, in inference mode, with an ONNX Runtime session that was seen to answer as torch does.

    Raises RunError where it does not.
    """
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    session = onnxruntime.InferenceSession(
        vision_onnx(network).SerializeToString(), options, providers=["CPUExecutionProvider"]
    )
    model = LoadedVisionModel(name, network, card, session)
    shape = (2, card.preprocess.height, card.preprocess.width, 3)
    probe = np.random.default_rng(0).integers(0, 256, shape).astype(np.uint8)
    expected = torch_logits(network, probe)
    difference = float(np.abs(model.predict_logits(probe) - expected).max())
    if not difference <= _TOLERANCE * max(1.0, float(np.abs(expected).max())):
        raise RunError(f"{name}: ONNX Runtime and torch differ by {difference:.2g} in a logit; report their versions")
    return model


def torch_logits(
    network: VisionNet, images_u8: Sequence[UInt8[np.ndarray, "height width 3"]] | UInt8[np.ndarray, "n height width 3"]
) -> Float32[np.ndarray, "n 3"]:
    """What torch answers to images as the network sees them, on one thread."""
    parts = []
    with one_torch_thread(), torch.inference_mode():
        for start in range(0, len(images_u8), _BATCH):
            batch = torch.from_numpy(np.asarray(images_u8[start : start + _BATCH]))
            parts.append(network(batch.permute(0, 3, 1, 2).float()).numpy())
    return np.concatenate(parts) if parts else np.empty((0, len(Gesture)), np.float32)
