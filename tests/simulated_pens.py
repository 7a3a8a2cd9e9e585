"""Pens of other layouts than the paper's."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lightpen.model.pen import Pen
from lightpen.model.rigid import rotation_from_vector
from lightpen_extensions.simulator.swings import flat_pen, paper_pen

FAN_ANGLE = np.radians(20)  # of a fanned column's discs from +z
NEARLY = 2.0  # mm, largest misfit of the near-symmetric pen to its mirror image


def six_led_pen() -> Pen:
    """Return a pen with four LEDs in front of two."""
    front = [(-25, 20, 0), (25, 45, 0), (-25, 115, 0), (25, 160, 0)]
    back = [(0, 75, -30), (0, 180, -30)]
    return flat_pen("six", front + back)


def eight_led_pen() -> Pen:
    """Return a pen with LEDs at three depths."""
    front = [(-28, 10, 0), (24, 40, 0), (-22, 95, 0), (30, 130, 0), (-26, 175, 0)]
    middle = [(3, 70, -15), (0, 150, -18)]
    back = [(0, 0, -35)]
    return flat_pen("eight", front + middle + back)


def near_symmetric_pen() -> Pen:
    """Return a ten-LED pen that its mirror image fits to `NEARLY`."""
    back = [(0.0, y, -30.0) for y in (0.0, 60.0, 120.0, 180.0)]
    left = [(-25.0, y, 0.0) for y in (25.0, 90.0, 155.0)]
    right = [(25.0, y + NEARLY, 0.0) for _, y, _ in left]
    return flat_pen("near-symmetric", back + left + right)


def fanned_pen() -> Pen:
    """Return the paper's pen with the discs of its two columns turned outwards."""
    pen = paper_pen()
    turns = FAN_ANGLE * np.sign(pen.leds[:, 0])
    zero = np.zeros_like(turns)
    rotations = rotation_from_vector(np.stack([zero, turns, zero], axis=-1))
    return replace(pen, normals=rotations[:, :, 2], name="fanned")


SAMPLE_PENS: dict[str, Callable[[], Pen]] = {
    "paper": paper_pen,
    "six": six_led_pen,
    "eight": eight_led_pen,
    "near-symmetric": near_symmetric_pen,
    "fanned": fanned_pen,
}
