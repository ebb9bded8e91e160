"""How things stand in a world, as a judge sees it."""

import math

from sdt_tools.evaluation.outcome import Situation
from sdt_tools.scene.world import World


def situation_in(world: World) -> Situation:
    """This moment of ``world``; the operator has ended when he is done with his path."""
    lidar, operator = world.lidar_pose, world.operator
    dx_m, dy_m = operator.x_m - lidar.x_m, operator.y_m - lidar.y_m
    return Situation(
        time_s=world.time_s,
        robot=world.robot,
        operator_range_m=math.hypot(dx_m, dy_m),
        operator_bearing_rad=math.remainder(math.atan2(dy_m, dx_m) - lidar.yaw_rad, math.tau),
        operator_visible=world.operator_visible(),
        operator_standing=world.operator_standing,
        operator_ended=world.operator_done,
        contact=world.contact,
    )
