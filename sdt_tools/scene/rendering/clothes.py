"""What the parts of a person are painted with: shirt, sleeves, trousers, shoes, skin and hair."""

from dataclasses import dataclass

import cv2
import numpy as np

from sdt_tools.scene.rendering.face import paint_face
from sdt_tools.scene.rendering.paint import SIDE, Picture, fabric, finish, noise, sheet
from sdt_tools.scene.rendering.person import Person
from sdt_tools.scene.rendering.texture import TextureBank


@dataclass(frozen=True)
class Wardrobe:
    """The textures of one person."""

    shirt: int
    sleeve: int
    trousers: int
    skin: int
    face: int
    hair: int
    shoe: int
    accent: int


def paint_person(person: Person, bank: TextureBank, rng: np.random.Generator) -> Wardrobe:
    """All pictures of ``person``."""
    sleeve = _patterned(person, rng)
    skin = sheet(person.skin) * (1 + 0.02 * noise(rng, (8, 8)))[..., None]
    return Wardrobe(
        shirt=bank.add(_shirt(person, sleeve, fabric(rng, person.shirt_accent))),
        sleeve=bank.add(sleeve),
        trousers=bank.add(_trousers(person, rng)),
        skin=bank.add(finish(skin.astype(np.float32))),
        face=bank.add(paint_face(person, rng)),
        hair=bank.add(_strands(person, rng)),
        shoe=bank.add(_shoe(person, rng)),
        accent=bank.add(fabric(rng, person.shirt_accent)),
    )


def _patterned(person: Person, rng: np.random.Generator) -> Picture:
    cloth = fabric(rng, person.shirt).astype(np.float32)
    shading = cloth / np.maximum(person.shirt, 1.0)
    if person.pattern == "stripes":
        step = int(rng.choice([16, 32, 64]))
        rows = (np.arange(SIDE) // (step // 2)) % 2 == 1
        cloth[rows] = (person.shirt_accent * shading)[rows]
    elif person.pattern == "checks":
        step = int(rng.choice([16, 32]))
        bars = (np.arange(SIDE) // (step // 2)) % 2 == 1
        share = 0.5 * (bars[:, None].astype(np.float32) + bars[None, :])[..., None]
        cloth = (1 - share) * cloth + share * person.shirt_accent * shading
    return finish(cloth)


def _shirt(person: Person, cloth: Picture, inner: Picture) -> Picture:
    """Wrapped around the trunk: the middle of the picture is the chest, its sides the back; neck above, hem below."""
    canvas = cloth.astype(np.float32)
    middle = SIDE // 2
    if person.open_jacket:
        for row in range(SIDE):
            half = int(10 + 16 * (1 - row / SIDE) + 6 * row / SIDE)
            canvas[row, middle - half : middle + half] = inner[row, middle - half : middle + half]
            canvas[row, middle - half - 2 : middle - half] *= 0.5
            canvas[row, middle + half : middle + half + 2] *= 0.5
    elif person.pattern == "print":
        color = person.shirt_accent.tolist()
        cv2.circle(canvas, (middle, 96), 20, color, -1, cv2.LINE_AA)
        cv2.rectangle(canvas, (middle - 24, 124), (middle + 24, 132), color, -1)
    elif person.long_sleeves:
        canvas[:, middle - 1 : middle + 1] *= 0.6
        for row in range(30, SIDE, 36):
            cv2.circle(canvas, (middle, row), 2, (225.0, 228.0, 228.0), -1, cv2.LINE_AA)
        cv2.rectangle(canvas, (middle + 18, 78), (middle + 40, 112), (person.shirt * 0.75).tolist(), 1, cv2.LINE_AA)
    canvas[-5:] *= 0.7
    return finish(canvas)


def _trousers(person: Person, rng: np.random.Generator) -> Picture:
    canvas = fabric(rng, person.trousers, folds=0.1).astype(np.float32)
    for seam in (SIDE // 4, 3 * SIDE // 4):
        canvas[:, seam : seam + 2] *= 0.75
    return finish(canvas)


def _strands(person: Person, rng: np.random.Generator) -> Picture:
    strands = sheet(person.hair_color) * (1 + 0.25 * noise(rng, (3, 40)))[..., None]
    return finish(strands.astype(np.float32))


def _shoe(person: Person, rng: np.random.Generator) -> Picture:
    """Along the shoe; the middle of the picture is above, its upper and lower edges are the sole."""
    canvas = sheet(person.shoes)
    canvas = canvas * (1 + 0.05 * noise(rng, (6, 6)))[..., None]
    sole = np.array([210.0, 214.0, 216.0]) if rng.random() < 0.5 else person.shoes * 0.4
    canvas[:, :58] = sole
    canvas[:, -58:] = sole
    for row in range(90, 150, 12):
        canvas[row : row + 4, 112:144] = 200.0
    return finish(canvas)
