"""``sdt robot``: the robot's devices, and programs that play them."""

import typer

from sdt_tools.cli import robot_emulate_p3at

emulate = typer.Typer(
    help="Play a device of the robot, with its faults, for drivers to be tried on.", no_args_is_help=True
)
emulate.command("p3at")(robot_emulate_p3at.command)

app = typer.Typer(help="The robot's devices: play them.", no_args_is_help=True)
app.add_typer(emulate, name="emulate")
