"""The sources of images that are chosen for a calibration."""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.cameras.protocol import CameraSettings
from lightpen.cameras.replay import RECORDED
from lightpen.cameras.source import Source, SourceNeeds
from lightpen.cameras.sources import SIMULATED, UNCHOSEN, source_named
from lightpen.formats.rig_files import RigFile
from lightpen.model.rig import Rig

N_CAMERAS = 2  # that are live at once


class SourceKind(StrEnum):
    """The sources that are no cameras; all are in `lightpen.cameras.sources`."""

    SIMULATED = SIMULATED.key
    RECORDED = RECORDED.key


@dataclass(frozen=True)
class SourceChoice:
    """The source of images."""

    kind: str = SourceKind.SIMULATED  # key of a source
    # Folder, pattern or video of a recording; serial number or address of a camera.
    place: str = ""
    producer: str = ""  # file of GenTL; empty for those that the system names

    @property
    def source(self) -> Source:
        """The source; none chosen for an unknown kind."""
        return source_named(self.kind) or UNCHOSEN

    @property
    def lacks_place(self) -> bool:
        """Whether the place of the images is missing."""
        return self.source.needs is not SourceNeeds.NOTHING and not self.place


NO_SOURCE = SourceChoice("")


@dataclass(frozen=True)
class CameraInUse:
    """The camera that images come from."""

    serial: str
    settings: CameraSettings


@dataclass(frozen=True, eq=False)
class SecondCamera:
    """A second camera, which sees the pen from elsewhere at the same moments."""

    source: SourceChoice = field(default_factory=SourceChoice)
    rig_file: RigFile | None = None  # extrinsics and intrinsics of both cameras
    image_size: tuple[int, int] | None = None  # px; None while there are no images
    in_use: CameraInUse | None = None  # None until it is open
    # (M, 3), circles of stray light: centre x, y and radius, px
    mask: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))

    @property
    def rig(self) -> Rig | None:
        """Both cameras."""
        return None if self.rig_file is None else self.rig_file.rig
