"""A line to type in, and keys that come faster than the screen follows, as over a slow connection: all in their order.

What opens over a screen takes a moment, and a terminal that was late sends many keys at once. None of those that were
meant for a line may reach the screen below, where they mean something else, and none is lost.
"""

import asyncio
from collections.abc import Callable
from typing import Any, Final

from textual import events
from textual.screen import Screen
from textual.widgets import Input

_OPENS_S: Final = 0.002


class Line(Input):
    """Calls ``given`` with what was typed, at Enter.

    Textual's line does what keys like Enter and Backspace are for a moment later than it takes letters.
    """

    def __init__(self, given: Callable[[str], None], most: int = 200) -> None:
        super().__init__(max_length=most, select_on_focus=False)
        self._given = given
        self.cursor_blink = False

    async def on_key(self, event: events.Key) -> None:
        """Take a key at once; one that comes when the line is closed belongs to what is shown then."""
        if not await belongs_elsewhere(self.screen, event):
            await self.take(event)

    async def take(self, event: events.Key) -> None:
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


async def belongs_elsewhere(screen: Screen[Any], event: events.Key) -> bool:
    """Whether ``screen``, which was to take the key, is not the one that is shown any more; then that one gets it."""
    app = screen.app
    if app.screen is screen:
        return False
    event.stop()
    event.prevent_default()
    while not app.screen.is_mounted:
        await asyncio.sleep(_OPENS_S)
    app.post_message(events.Key(event.key, event.character))
    return True
