"""A verb that does one thing when no sub-command is named, as ``sdt errors PREDICTIONS`` does."""

from typing import Any, Final

from typer.core import TyperGroup

DEFAULT: Final = "analyse"
"""The sub-command meant when none is named."""


class WithDefault(TyperGroup):
    """Takes words that do not begin with a sub-command (or ask for help) as those of ``analyse``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """The words, led by a sub-command."""
        named = args and (args[0] in self.commands or args[0] in ctx.help_option_names)
        words: list[str] = super().parse_args(ctx, args if named or not args else [DEFAULT, *args])
        return words
