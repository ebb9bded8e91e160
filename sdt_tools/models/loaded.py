"""A network as others use it: scans in, logits out."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

import numpy as np
import torch
from jaxtyping import Float32, Float64

from sdt_tools.errors import RecordingError
from sdt_tools.frames import RAYS, MotionClass
from sdt_tools.models.card import ModelCard
from sdt_tools.models.follow_net import FollowNet
from sdt_tools.models.preprocess import resolve_codes

BATCH: Final = 128
"""Scans answered at once: the activations of much larger batches leave the processor's cache."""


@dataclass(frozen=True, eq=False)
class LoadedModel:
    """A network ready to answer, with its card; ``name`` is the name of its folder."""

    name: str
    network: FollowNet
    card: ModelCard

    def predict_logits(self, ranges_m: Float64[np.ndarray, "scans rays"]) -> Float32[np.ndarray, "scans classes"]:
        """Logits for scans as the sensor gave them, codes and all, on one thread.

        Raises RecordingError for another number of rays.
        """
        if ranges_m.shape[1] != RAYS:
            raise RecordingError(f"model {self.name} reads scans of {RAYS} rays, not of {ranges_m.shape[1]}")
        return logits_of(self.network, ranges_m)


def logits_of(network: FollowNet, ranges_m: Float64[np.ndarray, "scans rays"]) -> Float32[np.ndarray, "scans classes"]:
    """What ``network``, in inference mode, answers to scans as the sensor gave them: in batches, on one thread."""
    logits = np.empty((len(ranges_m), len(MotionClass)), np.float32)
    with one_torch_thread(), torch.inference_mode():
        for start in range(0, len(ranges_m), BATCH):
            resolved = resolve_codes(ranges_m[start : start + BATCH], network.preprocess)
            answer: torch.Tensor = network(torch.from_numpy(resolved.astype(np.float32)))
            logits[start : start + BATCH] = answer.numpy()
    return logits


@contextmanager
def one_torch_thread() -> Iterator[None]:
    """Keep torch to one thread inside: a small network loses more by the second than it gains. Restored afterwards."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
