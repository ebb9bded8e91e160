"""A line to type in that takes keys in their order."""

from collections.abc import Callable

from textual import events
from textual.widgets import Input


class Line(Input):
    """Calls ``given`` with what was typed, at Enter.

    Textual's own line does what keys like Enter and Backspace are for a moment later than it takes letters, which
    mixes up keys that come at once.
    """

    def __init__(self, given: Callable[[str], None], most: int = 200) -> None:
        super().__init__(max_length=most, select_on_focus=False)
        self._given = given
        self.cursor_blink = False

    async def on_key(self, event: events.Key) -> None:
        """Type a letter, or do what the key is for in a line."""
        if event.key == "enter":
            self._given(self.value)
        elif event.is_printable and event.character is not None:
            self.replace(event.character, *self.selection)
        else:
            bindings = self._bindings.key_to_bindings.get(event.key, [])
            if not bindings:
                return
            for binding in bindings:
                await self.run_action(binding.action)
        event.stop()
        event.prevent_default()
