"""A camera's picture in a terminal, in its right proportions."""

import io

import numpy as np
from jaxtyping import UInt8
from PIL import Image, UnidentifiedImageError
from textual.strip import Strip
from textual.widget import Widget

from sdt_tools.frames import CameraImage
from sdt_tools.terminal.raster import BLANK, draw_pixels, style
from sdt_tools.terminal.scan_view import said_in_the_middle


def thumbnail(image: CameraImage, columns: int, rows: int) -> UInt8[np.ndarray, "rows columns 3"] | None:
    """The picture, as large as it fits into ``columns`` by ``rows`` square pixels; None where it cannot be decoded."""
    try:
        with Image.open(io.BytesIO(image.data)) as opened:
            scale = min(columns / opened.width, rows / opened.height)
            size = max(1, round(opened.width * scale)), max(2, round(opened.height * scale) // 2 * 2)
            opened.draft("RGB", size)  # a JPEG decodes at an eighth of its size in a tenth of the time
            small = opened.convert("RGB").resize(size, Image.Resampling.BOX)
    except (UnidentifiedImageError, OSError, ValueError, Image.DecompressionBombError):
        return None
    return np.asarray(small)


class PictureView(Widget):
    """Shows one picture."""

    DEFAULT_CSS = "PictureView { width: 1fr; height: 1fr; }"

    def __init__(self, *, id: str | None = None) -> None:  # noqa: A002
        super().__init__(id=id)
        self._image: CameraImage | None = None
        self._words = "no picture"
        self._strips: list[Strip] = []
        self._left = 0

    def show(self, image: CameraImage | None, words: str = "no picture") -> None:
        """Show ``image``; without one say ``words``."""
        if image is not None and image is self._image:
            return
        self._image, self._words = image, words
        self._draw()

    def on_resize(self) -> None:
        """Draw anew."""
        self._draw()

    def render_line(self, y: int) -> Strip:
        """One line of the picture."""
        width = self.size.width
        if y >= len(self._strips):
            return Strip.blank(width, style(BLANK))
        strip = self._strips[y]
        left = (width - strip.cell_length) // 2
        blank = Strip.blank(left, style(BLANK))
        return Strip.join([blank, strip]).extend_cell_length(width, style(BLANK))

    def _draw(self) -> None:
        width, height = self.size
        if width and height:
            pixels = None if self._image is None else thumbnail(self._image, width, height * 2)
            words = self._words if self._image is None else "the picture cannot be decoded"
            self._strips = said_in_the_middle(words, width, height) if pixels is None else draw_pixels(pixels)
        self.refresh()
