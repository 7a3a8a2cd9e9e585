"""Rings for the spots of a live image."""

from collections import deque
from collections.abc import Iterator

import numpy as np
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QButtonGroup, QWidget

from lightpen.arrays import BoolArray, FloatArray
from lightpen.cameras.protocol import Frame
from lightpen.live.pipeline import LiveImage
from lightpen_app.look.layouts import horizontal_layout
from lightpen_app.look.theme import Tone
from lightpen_app.widgets.controls import PushButton
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.image_view import Marker

RING = 1.4  # times the radius of its spot
CLEARANCE = 2.0  # image px between spot and ring, at least


def live_markers(seen: LiveImage) -> tuple[Marker, ...]:
    """Return a ring for each spot, numbered for LEDs.

    Spots that are no LED are dashed; without intrinsics and pen file this is unknown,
    and all rings are solid.
    """
    spots = seen.spots
    numbers = led_numbers(seen)
    radii = RING * np.sqrt(spots.areas / np.pi) + CLEARANCE
    angles = _free_angles(spots.centers)
    other = Tone.ACTIVE if seen.detection is None else Tone.WARN
    return tuple(
        Marker(
            x, y, radius, numbers.get(i, ""), tone=Tone.GOOD if i in numbers else other
        )
        for i, ((x, y), radius, angle) in enumerate(
            zip(spots.centers.tolist(), radii.tolist(), angles.tolist(), strict=True)
        )
    )


def mask_markers(mask: FloatArray) -> Iterator[Marker]:
    """Yield a crossed circle for each row x, y, radius of an (M, 3) mask, px."""
    for x, y, radius in mask.tolist():
        yield Marker(x, y, radius, tone=Tone.QUIET, crossed=True)


def stray_markers(circles: FloatArray, label: str) -> Iterator[Marker]:
    """Yield a ring for each row x, y, radius of (M, 3) stray lights, px."""
    for x, y, radius in circles.tolist():
        yield Marker(x, y, RING * radius, label, Tone.BAD, label_angle=0.0)


def _free_angles(places: FloatArray) -> FloatArray:
    """Return the direction with most room at each of (N, 2) places, rad."""
    offsets = places[:, None] - places[None]
    distances = np.linalg.norm(offsets, axis=-1)
    np.fill_diagonal(distances, np.inf)
    push = (offsets / np.maximum(distances, 1.0)[..., None] ** 3).sum(axis=1)
    angles: FloatArray = np.arctan2(push[:, 1], push[:, 0])
    return angles


def led_numbers(seen: LiveImage) -> dict[int, str]:
    """Return the number of the LED of each spot that is one."""
    if seen.detection is None or seen.detection.labels is None:
        return {}
    spot_of_led = seen.detection.labels.spot
    labelled: BoolArray = spot_of_led >= 0
    return {
        int(spot_of_led[led]): str(led + 1) for led in np.flatnonzero(labelled).tolist()
    }


RATE_S = 2.0  # over which the images are counted


class FrameRate:
    """Measures how many images come."""

    def __init__(self) -> None:
        self._arrivals: deque[tuple[float, int]] = deque()  # time, number of the image

    def add(self, frame: Frame) -> None:
        """Count one more image; one of another stream begins anew."""
        time = frame.host_ts_ns * 1e-9
        if self._arrivals:
            before, number = self._arrivals[-1]
            if not 0 < time - before < RATE_S or frame.seq <= number:
                self._arrivals.clear()
        self._arrivals.append((time, frame.seq))
        while time - self._arrivals[0][0] > RATE_S:
            self._arrivals.popleft()

    def value(self) -> float:
        """Return the images a second; 0 before the second image."""
        if len(self._arrivals) < 2:
            return 0.0
        (start, first), (end, last) = self._arrivals[0], self._arrivals[-1]
        return (last - first) / (end - start)


N_CAMERAS = 2


class CameraSwitch(Translated, QWidget):
    """A button for each camera; one is pressed."""

    value_changed = Signal(int)  # index of the camera to show

    def __init__(self) -> None:
        super().__init__()

        # Widgets
        self._buttons = [PushButton() for _ in range(N_CAMERAS)]
        self._group = QButtonGroup(self)
        for c, button in enumerate(self._buttons):
            button.setCheckable(True)
            self._group.addButton(button, c)
        self._buttons[0].setChecked(True)

        # Layout
        horizontal_layout(self, *self._buttons)

        # Connections
        self._group.idClicked.connect(self.value_changed)

        self._refresh()

    def value(self) -> int:
        """Return the number of the camera that is shown, from 0."""
        return self._group.checkedId()

    def set_value(self, camera: int) -> None:
        """Show another camera as chosen."""
        self._buttons[camera].setChecked(True)

    def _refresh(self) -> None:
        for number, button in enumerate(self._buttons, start=1):
            button.setText(self.tr("Camera {0}").format(number))
