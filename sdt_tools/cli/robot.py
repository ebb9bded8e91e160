"""``sdt robot``: the robot's devices, and emulated ones in their place."""

import typer

from sdt_tools.cli import emulate_lms1xx, emulate_p3at, emulate_robot, robot_check

app = typer.Typer(no_args_is_help=True, help="The robot's devices, and emulated ones in their place.")
emulate = typer.Typer(no_args_is_help=True, help="Be the robot or one of its devices, with faults on demand.")
app.add_typer(emulate, name="emulate")
app.command("check")(robot_check.check)
emulate.command("lms1xx")(emulate_lms1xx.lms1xx)
emulate.command("p3at")(emulate_p3at.p3at)
emulate.command("robot", epilog=emulate_robot.KEYS_HELP)(emulate_robot.whole_robot)


@app.callback()
def robot() -> None:
    """The robot's devices, and emulated ones in their place."""


@emulate.callback()
def emulated() -> None:
    """Be the robot or one of its devices, with faults on demand."""
