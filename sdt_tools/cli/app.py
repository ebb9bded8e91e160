"""The command ``sdt``: its verbs, and the one place where errors become a line and an exit code."""

import importlib
import logging
import os
import sys
from types import ModuleType
from typing import Final, NoReturn

import typer
from typer.core import TyperGroup
from typer.exceptions import TyperException

from sdt_tools.errors import SdtError
from sdt_tools.runs.threads import use_one_thread

VERBS = (
    "demo",
    "record",
    "inspect",
    "repair",
    "edit",
    "import",
    "export",
    "label",
    "dataset",
    "domains",
    "train",
    "certify",
    "attack",
    "check",
    "evaluate",
    "drive",
    "replay",
    "errors",
    "view",
    "robot",
    "paper",
    "doctor",
)
"""In the order of the flow. Each is a module here (``import_`` for ``import``) with a ``command``, or an ``app``."""


_INTERRUPTED: Final = 130


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
    _register(_verb, importlib.import_module(f"sdt_tools.cli.{_verb}{'_' if _verb == 'import' else ''}"))


def main() -> None:
    """Run the command line; exit 2 for bad usage or input, 1 for a failure, 130 when interrupted."""
    use_one_thread()
    logging.getLogger("sdt_tools").addHandler(logging.NullHandler())  # commands say themselves what is damaged
    try:
        code = app(standalone_mode=False)
    except SdtError as error:
        _stop(str(error), error.exit_code)
    except TyperException as error:
        _stop(f"{error.format_message()} Try --help." if error.format_message() else "", error.exit_code)
    except BrokenPipeError:
        os._exit(141)
    except OSError as error:
        _stop(f"{error.filename or 'the system'}: {error.strerror}; check path, rights and disk", 2)
    if code == _INTERRUPTED:
        _stop("interrupted; what was finished is kept", _INTERRUPTED)
    sys.exit(code if isinstance(code, int) else 0)


def _stop(line: str, code: int) -> NoReturn:
    """Say why in one line, and exit."""
    if line:
        sys.stderr.write(f"sdt: {' '.join(line.split())}\n")
    sys.exit(code)
