"""Rules for a LiDAR's scans: how many rays, where they point, in which unit, and what a ray without echo is."""

import math
from itertools import pairwise
from typing import Final

import numpy as np

from sdt_tools.frames import FIRST_RAY_RAD, FRAME_LIDAR, RAYS, LidarScan
from sdt_tools.robot.contract.trial import Trial
from sdt_tools.robot.contract.verdict import Verdict, broken, judged, not_judged

_CODES_BELOW_M: Final = 0.016
"""Below this a range is a code of the sensor, in thousandths."""
_FARTHEST_M: Final = 100.0
_AT_THE_END: Final = 5
_SAME_SHARE: Final = 0.95


def lidar_rules(trial: Trial) -> list[Verdict]:
    """The verdicts on its scans."""
    scans = trial.scans
    if not scans:
        return []
    strange = {type(scan.ranges_m).__name__ for scan in scans if not _is_row(scan.ranges_m)}
    if strange:
        return [broken("ranges are a row of numbers", f"they are {', '.join(sorted(strange))}; give a numpy array")]
    return [_rays(scans), _angles(scans), _numbers(scans), _codes(scans), _own(trial), _nearest(scans[-1])]


def _is_row(ranges: object) -> bool:
    return isinstance(ranges, np.ndarray) and ranges.ndim == 1 and ranges.dtype.kind in "fiu"


def _rays(scans: list[LidarScan]) -> Verdict:
    counts = sorted({len(scan.ranges_m) for scan in scans})
    faults = [f"scans have {', '.join(map(str, counts))} rays"] if counts != [RAYS] else []
    types = {scan.ranges_m.dtype.name for scan in scans}
    if types != {"float64"}:
        faults.append(f"ranges are {', '.join(sorted(types))}; give float64")
    frames = {scan.frame_id for scan in scans} - {FRAME_LIDAR}
    faults += [f"the frame is {', '.join(sorted(frames))}, not {FRAME_LIDAR}"] if frames else []
    return judged(f"a scan has {RAYS} rays", faults, f"{len(scans)} scans")


def _angles(scans: list[LidarScan]) -> Verdict:
    ends = sorted({(scan.start_angle_rad, scan.end_angle_rad) for scan in scans})
    wrong = [end for end in ends if not np.allclose(end, (FIRST_RAY_RAD, -FIRST_RAY_RAD), atol=1e-4)]
    faults = []
    if wrong:
        first, last = wrong[0]
        is_degrees = " (are these degrees?)" if max(abs(first), abs(last)) > 2 * math.pi else ""
        faults.append(f"from {first:.4g} to {last:.4g} rad{is_degrees}, not from {FIRST_RAY_RAD:.4f}, on the right")
    return judged("rays run from -135° (right) to 135° (left)", faults, "as each scan says")


def _numbers(scans: list[LidarScan]) -> Verdict:
    ranges_m = np.concatenate([scan.ranges_m for scan in scans])
    faults = []
    if not np.isfinite(ranges_m).all():
        share = 1.0 - np.isfinite(ranges_m).mean()
        faults.append(f"{share:.2%} are nan or infinite; keep the sensor's code (0.000, 0.002, 0.003)")
        ranges_m = ranges_m[np.isfinite(ranges_m)]
    if ranges_m.size and ranges_m.min() < 0:
        faults.append(f"the least is {ranges_m.min():g}; keep the sensor's code (0.000, 0.002, 0.003)")
    if ranges_m.size and ranges_m.max() > _FARTHEST_M:
        faults.append(f"the greatest is {ranges_m.max():g}; are these millimetres?")
    seen = f"{np.median(ranges_m):.2f} m in the middle, {ranges_m.max():.2f} m at most" if ranges_m.size else ""
    return judged("ranges are finite metres", faults, seen)


def _codes(scans: list[LidarScan]) -> Verdict:
    rule = "rays without echo keep the sensor's code"
    ranges_m = np.concatenate([scan.ranges_m for scan in scans])
    small = ranges_m[(ranges_m >= 0) & (ranges_m < _CODES_BELOW_M)]
    faults = []
    if np.abs(small * 1000 - np.rint(small * 1000)).max(initial=0.0) > 1e-6:
        faults.append("some below 16 mm are no whole thousandths; a code is a number, no distance: do not scale it")
    farthest = [float(scan.ranges_m.max()) for scan in scans]
    usual = max(set(farthest), key=farthest.count)
    filled = [int((scan.ranges_m == usual).sum()) >= _AT_THE_END for scan in scans]
    if len(scans) > _AT_THE_END and np.mean(filled) >= _SAME_SHARE and not small.size:
        faults.append(f"in every scan several rays are just {usual:g}, and none has a code; do not fill them in")
    if not faults and not small.size:
        return not_judged(rule, "every ray had an echo; let it look at the sky, or out of a window")
    values, counts = np.unique(np.rint(small * 1000).astype(np.int64), return_counts=True)
    seen = ", ".join(
        f"{value / 1000:.3f}: {count / ranges_m.size:.2%}" for value, count in zip(values, counts, strict=True)
    )
    return judged(rule, faults, seen)


def _own(trial: Trial) -> Verdict:
    scans = trial.scans
    faults = []
    pairs = zip(trial.first_ranges_m, scans, strict=False)
    if any(not np.array_equal(kept_m, scan.ranges_m, equal_nan=True) for kept_m, scan in pairs):
        faults.append("a scan changed after it was read; give each an array of its own")
    elif any(np.shares_memory(one.ranges_m, other.ranges_m) for one, other in pairwise(scans)):
        faults.append("two scans share an array; give each one of its own")
    return judged("each scan's array is its own", faults, f"{len(trial.first_ranges_m)} scans stayed as they were")


def _nearest(scan: LidarScan) -> Verdict:
    """Which way rays run cannot be seen from scans alone: a person is told what to compare."""
    rule = "the right is on the right"
    ranges_m = np.where(np.isfinite(scan.ranges_m) & (scan.ranges_m >= _CODES_BELOW_M), scan.ranges_m, np.inf)
    if len(ranges_m) != RAYS or not np.isfinite(ranges_m).any():
        return not_judged(rule, "no ray hit anything")
    ray = int(ranges_m.argmin())
    bearing_deg = (ray - RAYS // 2) / 2
    side = "ahead" if bearing_deg == 0 else f"{abs(bearing_deg):g}° to the {'left' if bearing_deg > 0 else 'right'}"
    return not_judged(rule, f"compare: the nearest thing is at {ranges_m[ray]:.2f} m, {side}")
