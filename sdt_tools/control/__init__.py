"""Who drives: networks as drivers of the robot, the modes between them, the loop around them."""
