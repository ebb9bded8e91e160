"""A small problem with a known answer: where is the nearest object, and how near?

Scans of a bare room with one object. Its side gives left, right or ahead, its range forward (beyond 1 m) or backward;
no object means stay. Mirroring a scan mirrors the answer. Some rays are codes.
"""

from pathlib import Path

import numpy as np
import tomli_w

from sdt_tools.dataset.frames_file import FRAMES_FILE, FrameBlock, FramesWriter
from sdt_tools.dataset.manifest import FORMAT, MANIFEST_FILE
from sdt_tools.frames import MotionClass

MOTIONS = {
    (-1, 0): MotionClass.RIGHT_FORWARD,
    (0, 0): MotionClass.FORWARD,
    (1, 0): MotionClass.LEFT_FORWARD,
    (-1, 1): MotionClass.RIGHT_BACKWARD,
    (0, 1): MotionClass.BACKWARD,
    (1, 1): MotionClass.LEFT_BACKWARD,
}


def draw_frames(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Scans [count, 541] in metres with codes in them, and their classes."""
    rng = np.random.default_rng(seed)
    scans = rng.uniform(3.0, 6.0, (count, 1)) + rng.normal(0.0, 0.02, (count, 541))
    labels = np.zeros(count, np.int64)
    for place, kind in enumerate(rng.integers(0, 7, count)):
        if kind == MotionClass.STAY:
            continue
        side, near = int(kind - 1) % 3 - 1, int(kind > 3)
        centre = 270 + side * 90 + rng.integers(-25, 26)
        width = rng.integers(8, 16)
        scans[place, centre - width : centre + width] = rng.uniform(0.3, 0.6) if near else rng.uniform(1.4, 2.0)
        labels[place] = MOTIONS[side, near]
    scans[rng.random(scans.shape) < 0.02] = 0.0
    return scans, labels


def write_dataset(folder: Path, train: int, val: int, classes: tuple[str, ...] | None = None) -> Path:
    """A data set of the problem, as the data set builder would have written it."""
    folder.mkdir()
    names = classes or tuple(motion.label for motion in MotionClass)
    with FramesWriter(folder / FRAMES_FILE, names) as writer:
        for seed, (split, count) in enumerate({"train": train, "val": val}.items()):
            scans, labels = draw_frames(seed, count)
            stamps_ns = np.arange(count) * 1_000_000_000
            writer.write(FrameBlock(split, f"id-{split}", f"drawn-{split}", stamps_ns, labels, scans))
        frames_hash = writer.close()
    manifest = {"format": FORMAT, "hash": frames_hash, "rays": 541, "classes": list(names)}
    (folder / MANIFEST_FILE).write_text(tomli_w.dumps(manifest))
    return folder
