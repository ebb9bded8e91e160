"""The few kinds of layer that the backbones are made of, batch norm folded into the convolutions.

Without batch norm nothing drifts with what is trained on, and training, attack and ONNX see the same weights.
"""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional


class Normalise(nn.Module):
    """Colours of 0 to 255 in the order red, green, blue, to (colour − mean) / std."""

    _scale: Tensor
    _offset: Tensor

    def __init__(self, mean: tuple[float, float, float], std: tuple[float, float, float]) -> None:
        super().__init__()
        self.mean, self.std = mean, std
        self.register_buffer("_scale", 1.0 / torch.tensor(std).view(1, 3, 1, 1), persistent=False)
        self.register_buffer("_offset", -(torch.tensor(mean) / torch.tensor(std)).view(1, 3, 1, 1), persistent=False)

    def forward(self, images: Float[Tensor, "batch 3 height width"]) -> Float[Tensor, "batch 3 height width"]:
        """The normalised images, laid out as convolutions like them best."""
        scaled: Tensor = torch.addcmul(self._offset, images, self._scale)
        return scaled.contiguous(memory_format=torch.channels_last)


class SameConv2d(nn.Conv2d):
    """A convolution padded as TensorFlow's ``same``: the output is the input over the stride, rounded up.

    What cannot be padded evenly gets the odd row below and the odd column on the right; the padding follows the
    size of what comes in.
    """

    def __init__(self, inputs: int, outputs: int, kernel: int, stride: int = 1, groups: int = 1) -> None:
        super().__init__(inputs, outputs, kernel, stride, groups=groups)

    def forward(
        self, images: Float[Tensor, "batch inputs height width"]
    ) -> Float[Tensor, "batch outputs rows columns"]:
        """The convolved images."""
        rows, columns = (self._missing(size) for size in images.shape[2:])
        if rows == columns and rows % 2 == 0:
            return functional.conv2d(images, self.weight, self.bias, self.stride, rows // 2, 1, self.groups)
        top, left = rows // 2, columns // 2
        padded = functional.pad(images, (left, columns - left, top, rows - top))
        return functional.conv2d(padded, self.weight, self.bias, self.stride, 0, 1, self.groups)

    def _missing(self, size: int) -> int:
        """Rows or columns that the padding adds in all."""
        kernel, stride = self.kernel_size[0], self.stride[0]
        return max((-(-size // stride) - 1) * stride + kernel - size, 0)


class Residual(nn.Module):
    """``branch`` of the input plus the input, or plus ``shortcut`` of it where there is one."""

    def __init__(self, branch: nn.Module, shortcut: nn.Module | None = None) -> None:
        super().__init__()
        self.branch = branch
        self.shortcut = shortcut

    def forward(
        self, images: Float[Tensor, "batch inputs height width"]
    ) -> Float[Tensor, "batch outputs rows columns"]:
        """The sum."""
        kept = images if self.shortcut is None else self.shortcut(images)
        total: Tensor = self.branch(images) + kept
        return total


class MeanOverImage(nn.Module):
    """The mean of each channel."""

    def forward(self, images: Float[Tensor, "batch channels height width"]) -> Float[Tensor, "batch channels"]:
        """The means."""
        return images.mean(dim=(2, 3))
