"""A network as it answers in ONNX Runtime: float32, on one thread, another implementation than torch's."""

from typing import Final

import numpy as np
import onnx
import onnxruntime
from jaxtyping import Float32, Float64

from sdt_tools.certify.onnx_export import INPUT, OUTPUT

_BATCH: Final = 128


class OnnxNetwork:
    """Holds an ONNX Runtime session."""

    def __init__(self, model: onnx.ModelProto | bytes) -> None:
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        content = model if isinstance(model, bytes) else model.SerializeToString()
        self._session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])

    def logits(self, ranges_m: Float64[np.ndarray, "scans rays"]) -> Float32[np.ndarray, "scans classes"]:
        """Logits for scans whose codes are resolved, rounded to float32 first."""
        parts = [
            self._session.run([OUTPUT], {INPUT: ranges_m[start : start + _BATCH].astype(np.float32)})[0]
            for start in range(0, len(ranges_m), _BATCH)
        ]
        return np.concatenate(parts)
