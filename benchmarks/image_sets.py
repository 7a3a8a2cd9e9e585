"""The image sets that LIGHTPEN_DATA names, with their truth."""

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.formats.camera_files import read_camera
from lightpen.formats.images import ImageSource, find_images
from lightpen.formats.pen_files import read_pen
from lightpen.model.camera import Camera
from lightpen.model.pen import Pen


def data_folder() -> Path | None:
    """Return the folder of the image sets, or None where LIGHTPEN_DATA is not set."""
    folder = os.environ.get("LIGHTPEN_DATA")
    return Path(folder).resolve() if folder else None


@dataclass(frozen=True, eq=False)
class ImageSet:
    """A folder with images or centres of a swing.

    Attributes
    ----------
    pen : Pen
        As measured.
    truth : dict
        The content of ``truth.json``.
    """

    folder: Path
    camera: Camera
    pen: Pen
    truth: dict[str, Any]

    @property
    def images(self) -> ImageSource:
        """The images of the set."""
        return find_images(str(self.folder / "images"))

    @property
    def true_tip(self) -> FloatArray:
        """Tip in the frame of the measured pen, (3,), mm."""
        return np.array(self.truth["pen"]["tip_in_leds_csv_frame_bestfit"])

    @property
    def true_centers(self) -> FloatArray:
        """Ellipse centres of the LEDs of all images, (N, L, 2), px."""
        return np.array(
            [
                [led["ellipse_center"] for led in frame["leds"]]
                for frame in self.truth["frames"]
            ]
        )


def read_image_set(folder: Path) -> ImageSet:
    """Read what a set has beside its images."""
    return ImageSet(
        folder,
        read_camera(folder / "camera.yaml"),
        read_pen(folder / "leds.csv", None, None, None),
        json.loads((folder / "truth.json").read_text(encoding="utf-8")),
    )
