"""Who can see whom."""

from typing import no_type_check

import numpy as np
from numba import njit


@njit(cache=True)
@no_type_check
def any_visible(x_m, y_m, targets, segments, circles):
    """Whether the straight line from (x, y) to one of ``targets`` (n, 3) crosses none of segments and circles."""
    for i in range(targets.shape[0]):  # noqa: SIM110 - numba knows no generators
        if not _blocked(x_m, y_m, targets[i, 0], targets[i, 1], segments, circles):
            return True
    return False


@njit(cache=True)
@no_type_check
def _blocked(x0, y0, x1, y1, segments, circles):
    dx = x1 - x0
    dy = y1 - y0
    for j in range(segments.shape[0]):
        ax = segments[j, 0] - x0
        ay = segments[j, 1] - y0
        bx = segments[j, 2] - x0
        by = segments[j, 3] - y0
        side_a = dx * ay - dy * ax
        side_b = dx * by - dy * bx
        if side_a * side_b <= 0.0 and side_a != side_b:
            ex = bx - ax
            ey = by - ay
            along = (ax * ey - ay * ex) / (dx * ey - dy * ex)
            if 0.0 <= along <= 1.0:
                return True
    square = dx * dx + dy * dy
    for j in range(circles.shape[0]):
        cx = circles[j, 0] - x0
        cy = circles[j, 1] - y0
        along = 0.0
        if square > 0.0:
            along = min(1.0, max(0.0, (cx * dx + cy * dy) / square))
        if np.hypot(cx - along * dx, cy - along * dy) < circles[j, 2]:
            return True
    return False
