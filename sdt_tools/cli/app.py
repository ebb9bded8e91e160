"""The command ``sdt``: its verbs, and the one place where errors become a line and an exit code."""

import importlib
import importlib.util
import os
import sys
from types import ModuleType

import typer
from typer.core import TyperGroup

from sdt_tools.errors import SdtError
from sdt_tools.runs.threads import use_one_thread

VERBS = ("demo", "record", "inspect", "import", "label", "dataset", "train", "evaluate", "replay", "errors", "view")
"""In the order of the flow. Each is a module here (``import_`` for ``import``) with a ``command``, or an ``app``."""


class InOrderOfTheFlow(TyperGroup):
    """Lists the verbs as data flows through them."""

    def list_commands(self, ctx: object) -> list[str]:
        """The verbs."""
        del ctx
        return [verb for verb in VERBS if verb in self.commands]


app = typer.Typer(
    name="sdt",
    cls=InOrderOfTheFlow,
    help="Record, label, train, drive and replay learned robot controllers, and say why a frame is wrong.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _register(verb: str, module: ModuleType) -> None:
    if hasattr(module, "app"):
        app.add_typer(module.app, name=verb)
    else:
        app.command(verb)(module.command)


for _verb in VERBS:
    _name = f"sdt_tools.cli.{_verb}{'_' if _verb == 'import' else ''}"
    if importlib.util.find_spec(_name):
        _register(_verb, importlib.import_module(_name))


def main() -> None:
    """Run the command line; exit 2 for bad usage or input, 1 for a failure, 130 when interrupted."""
    use_one_thread()
    try:
        app()
    except SdtError as error:
        sys.stderr.write(f"sdt: {error}\n")
        sys.exit(error.exit_code)
    except BrokenPipeError:
        os._exit(141)
    except KeyboardInterrupt:
        sys.stderr.write("sdt: interrupted; what was finished is kept\n")
        sys.exit(130)
