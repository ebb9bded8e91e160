"""Rules for a camera's pictures."""

from itertools import pairwise

import numpy as np

from sdt_tools.frames import FRAME_CAMERA, RawPicture
from sdt_tools.robot.contract.trial import Trial
from sdt_tools.robot.contract.verdict import Verdict, broken, judged


def camera_rules(trial: Trial) -> list[Verdict]:
    """The verdicts on its pictures."""
    pictures = [one for one in trial.given if isinstance(one, RawPicture)]
    if not pictures:
        return []
    strange = {type(one.image_bgr_u8).__name__ for one in pictures if not isinstance(one.image_bgr_u8, np.ndarray)}
    if strange:
        return [broken("pictures are numpy arrays", f"they are {', '.join(sorted(strange))}")]
    return [_pixels(pictures), _own(pictures)]


def _pixels(pictures: list[RawPicture]) -> Verdict:
    faults = []
    forms = sorted({f"{one.image_bgr_u8.dtype} {one.image_bgr_u8.shape}" for one in pictures})
    image = pictures[0].image_bgr_u8
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3:
        faults.append(f"they are {forms[0]}; give uint8 of height, width and 3 (blue, green, red)")
    elif len(forms) > 1:
        faults.append(f"their form changes: {', '.join(forms)}")
    if {one.frame_id for one in pictures} != {FRAME_CAMERA}:
        faults.append(f"the frame is not {FRAME_CAMERA}")
    return judged("pictures are blue, green, red in 8 bits, of one size", faults, forms[0])


def _own(pictures: list[RawPicture]) -> Verdict:
    shared = any(np.shares_memory(one.image_bgr_u8, other.image_bgr_u8) for one, other in pairwise(pictures))
    faults = ["two pictures share an array; give each one of its own"] if shared else []
    return judged("each picture's array is its own", faults, f"{len(pictures)} pictures")
