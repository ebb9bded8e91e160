"""``sdt robot``: the robot's devices, and emulated ones in their place."""

import typer

from sdt_tools.cli import emulate_lms1xx, emulate_p3at, robot_check

app = typer.Typer(no_args_is_help=True, help="The robot's devices, and emulated ones in their place.")
emulate = typer.Typer(no_args_is_help=True, help="Be one of the robot's devices, with faults on demand.")
app.add_typer(emulate, name="emulate")
app.command("check")(robot_check.check)
emulate.command("lms1xx")(emulate_lms1xx.lms1xx)
emulate.command("p3at")(emulate_p3at.p3at)


@app.callback()
def robot() -> None:
    """The robot's devices, and emulated ones in their place."""


@emulate.callback()
def emulated() -> None:
    """Be one of the robot's devices, with faults on demand."""
