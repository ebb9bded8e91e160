"""The backbones, built from their shapes: a stem, blocks in a row, and a head before the classifier."""

from collections import OrderedDict
from dataclasses import dataclass

from torch import nn

from sdt_tools.models.vision.config import LiteConfig, ResNetConfig
from sdt_tools.models.vision.layers import Residual, SameConv2d


@dataclass(frozen=True, eq=False)
class BackboneParts:
    """What stands between pixels and the mean over the image."""

    stem: nn.Sequential
    blocks: nn.Sequential
    head: nn.Sequential


def build_backbone(architecture: LiteConfig | ResNetConfig) -> BackboneParts:
    """A backbone with the random weights that torch draws."""
    return _lite(architecture) if isinstance(architecture, LiteConfig) else _resnet(architecture)


def _lite(config: LiteConfig) -> BackboneParts:
    blocks: list[nn.Module] = []
    width = config.stem
    for stage in config.stages:
        for place in range(stage.blocks):
            stride = stage.stride if place == 0 else 1
            branch = _inverted_bottleneck(width, stage.width, stage.expand, stage.kernel, stride)
            blocks.append(Residual(branch) if stride == 1 and width == stage.width else branch)
            width = stage.width
    return BackboneParts(
        stem=_named(conv=SameConv2d(3, config.stem, 3, 2), relu=nn.ReLU6()),
        blocks=nn.Sequential(*blocks),
        head=_named(conv=SameConv2d(width, config.head, 1), relu=nn.ReLU6()),
    )


def _inverted_bottleneck(inputs: int, outputs: int, expand: int, kernel: int, stride: int) -> nn.Sequential:
    inner = inputs * expand
    layers: dict[str, nn.Module] = {}
    if expand != 1:
        layers |= {"expand": SameConv2d(inputs, inner, 1), "expand_relu": nn.ReLU6()}
    return _named(
        **layers,
        depthwise=SameConv2d(inner, inner, kernel, stride, groups=inner),
        depthwise_relu=nn.ReLU6(),
        project=SameConv2d(inner, outputs, 1),
    )


def _resnet(config: ResNetConfig) -> BackboneParts:
    blocks: list[nn.Module] = []
    inputs = config.stem
    for stage, (depth, width) in enumerate(zip(config.depths, config.widths, strict=True)):
        for place in range(depth):
            stride = 2 if place == 0 and stage > 0 else 1
            blocks.append(_bottleneck(inputs, width, stride))
            inputs = width
    return BackboneParts(
        stem=_named(conv=nn.Conv2d(3, config.stem, 7, 2, 3), relu=nn.ReLU(), pool=nn.MaxPool2d(3, 2, 1)),
        blocks=nn.Sequential(*blocks),
        head=nn.Sequential(),
    )


def _bottleneck(inputs: int, outputs: int, stride: int) -> nn.Sequential:
    inner = outputs // 4
    branch = _named(
        reduce=nn.Conv2d(inputs, inner, 1),
        reduce_relu=nn.ReLU(),
        conv=nn.Conv2d(inner, inner, 3, stride, 1),
        conv_relu=nn.ReLU(),
        restore=nn.Conv2d(inner, outputs, 1),
    )
    changes = inputs != outputs or stride != 1
    return _named(residual=Residual(branch, nn.Conv2d(inputs, outputs, 1, stride) if changes else None), relu=nn.ReLU())


def _named(**layers: nn.Module) -> nn.Sequential:
    return nn.Sequential(OrderedDict(layers))
