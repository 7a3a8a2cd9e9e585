"""Webcams by OpenCV, for evaluation only: they lose images unnoticed."""

import sys
from pathlib import Path

import cv2
import numpy as np

from lightpen.cameras.pairing import Clock
from lightpen.cameras.protocol import Range, lost, not_found
from lightpen.cameras.source import FoundDevice, Source, SourceNeeds, SourcePlace
from lightpen.messages import message
from lightpen_extensions.drivers.device_camera import (
    DeliveredFrame,
    DeviceCamera,
    setting_refused,
)

LISTED = Path("/sys/class/video4linux")
N_TRIED = 4  # where the system lists no cameras


class WebcamFeatures:
    """Image size and format of a webcam; nothing can be set."""

    def __init__(self, first: cv2.typing.MatLike, place: str) -> None:
        self._numbers = {"Width": first.shape[1], "Height": first.shape[0]}
        self._format = "Mono8" if first.ndim == 2 else "BGR8"
        self._place = place

    def has(self, name: str) -> bool:
        """Return False."""
        return False

    def number(self, name: str) -> float:
        """Return the size of the images."""
        return float(self._numbers[name])

    def limits(self, name: str) -> Range:
        """Return the size of the images."""
        return Range(self.number(name), self.number(name))

    def choice(self, name: str) -> str:
        """Return the pixel format."""
        return self._format

    def choices(self, name: str) -> tuple[str, ...]:
        """Return the pixel format."""
        return (self._format,)

    def set(self, name: str, value: float | str | bool) -> None:
        """Raise `ConfigError`, unless it is the pixel format."""
        if name != "PixelFormat":
            raise setting_refused(self._place, name)

    def execute(self, name: str) -> None:
        """Raise `ConfigError`."""
        raise setting_refused(self._place, name)


class WebcamDevice:
    """A webcam by its number, or another name that OpenCV opens."""

    def __init__(self, place: str) -> None:
        self.serial = place  # number by its connection
        self._capture: cv2.VideoCapture | None = None
        self._features: WebcamFeatures | None = None
        self._n_read = 0

    @property
    def features(self) -> WebcamFeatures:
        """Features of the open camera."""
        assert self._features is not None
        return self._features

    def open(self) -> None:
        """Open the camera."""
        place = self.serial
        self._capture = capture = (
            cv2.VideoCapture(int(place))
            if place.isdecimal()
            else cv2.VideoCapture(place)
        )
        is_read, first = capture.read()
        if not is_read:
            self.close()
            raise not_found(place)
        self._features = WebcamFeatures(first, place)

    def close(self) -> None:
        """Close the camera."""
        capture, self._capture = self._capture, None
        if capture is not None:
            capture.release()

    def start(self) -> None:
        """No-op: it streams once it is open."""

    def stop(self) -> None:
        """No-op."""

    def fetch(self, timeout_s: float) -> DeliveredFrame | None:
        """Return the next image, however long it takes."""
        assert self._capture is not None
        is_read, image = self._capture.read()
        if not is_read:
            raise lost(self.serial, "it sends no image")
        self._n_read += 1
        height, width = image.shape[:2]
        data = np.asarray(image, np.uint8).reshape(-1)
        return DeliveredFrame(data, width, height, self._n_read)

    def probe(self) -> None:
        """No-op: `fetch` reports failures."""


def _find(producer: str) -> tuple[FoundDevice, ...]:
    if sys.platform == "linux":
        folders = sorted(LISTED.glob("video*")) if LISTED.is_dir() else []
        return tuple(
            FoundDevice(
                folder.name.removeprefix("video"),
                f"{(folder / 'name').read_text().strip()} ({folder.name})",
            )
            for folder in folders
            if (folder / "index").read_text().strip() == "0"  # others hold no images
        )
    found = []
    for number in range(N_TRIED):
        capture = cv2.VideoCapture(number)
        if capture.isOpened():
            found.append(FoundDevice(str(number), str(number)))
        capture.release()
    return tuple(found)


def _camera(place: SourcePlace, clock: Clock) -> DeviceCamera:
    return DeviceCamera(WebcamDevice(place.name), clock)


WEBCAM = Source("webcam", message("source.webcam"), SourceNeeds.DEVICE, _camera, _find)
