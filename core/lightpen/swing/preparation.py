"""The choices for a calibration, and which of them are missing."""

from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Self

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.cameras.protocol import CameraInUse
from lightpen.cameras.replay import RECORDED
from lightpen.cameras.source import Source, SourceNeeds
from lightpen.cameras.sources import SIMULATED, UNCHOSEN, source_named
from lightpen.detection.pixel_box import RegionOfInterest
from lightpen.formats.opened_files import CameraFile, PenFile
from lightpen.formats.rig_files import RigFile
from lightpen.local_time import local_now
from lightpen.model.camera import Camera
from lightpen.model.limits import USUAL, Assumptions, SwingLimits
from lightpen.model.names import Method, Origin
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig
from lightpen.record.library.tip_library import ListedTip
from lightpen.record.results.results import Result
from lightpen.record.swings.header import Names
from lightpen.swing.capture.state import SwingSetup

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


class MissingInput(StrEnum):
    """Missing inputs, in the order of the steps."""

    STATION = "station"
    OPERATOR = "operator"
    PEN = "pen"
    TIP = "tip"
    CONE = "cone"
    SOURCE = "source"
    SOURCE_PLACE = "source place"
    DEVICE = "device"
    IMAGES = "images"
    CAMERA_FILE = "camera file"
    IMAGE_SIZE = "image size"
    SECOND_DEVICE = "second device"
    SECOND_IMAGES = "second images"
    RIG_FILE = "rig file"
    RIG_OF_TWO = "rig of two"
    SECOND_IMAGE_SIZE = "second image size"
    PEN_FILE = "pen file"


@dataclass(frozen=True, eq=False)
class StationChoices:
    """What is chosen at a station and kept as it is."""

    names: Names = field(default_factory=Names)
    limits: SwingLimits = field(default_factory=SwingLimits)
    assumptions: Assumptions = USUAL
    method: Method = "joint"  # of the reported tip
    heading: float | None = None  # operator's right in the image, rad, once learnt
    temperature_day: str = ""  # ISO date of the temperature in the assumptions


@dataclass(frozen=True, eq=False)
class Preparation(StationChoices):
    """The choices for a calibration."""

    nominal_tip: FloatArray | None = None  # (3,), mm; None: the LED file's
    source: SourceChoice = field(default_factory=SourceChoice)
    image_size: tuple[int, int] | None = None  # px; None while there are no images
    camera_in_use: CameraInUse | None = None  # None until one is open
    camera_file: CameraFile | None = None
    pen_file: PenFile | None = None
    # (M, 3), circles of stray light: centre x, y and radius, px
    mask: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    second: SecondCamera | None = None  # None for a single camera

    @property
    def asks_temperature(self) -> bool:
        """Whether the temperature of the pen has not been entered today."""
        return self.origin is Origin.LIVE and self.temperature_day != _today()

    @property
    def assumptions_today(self) -> Assumptions:
        """The assumptions, without a temperature of another day."""
        if self.asks_temperature:
            return replace(self.assumptions, temperature_c=None)
        return self.assumptions

    @property
    def lacks_temperature(self) -> bool:
        """Whether a limit requires a temperature that is not stated."""
        temperature = self.assumptions_today.temperature_c
        return self.limits.requires_temperature and temperature is None

    def with_temperature(self, temperature_c: float | None) -> Self:
        """Return a copy with the pen temperature of today; None if not measured."""
        assumptions = replace(self.assumptions, temperature_c=temperature_c)
        return replace(self, assumptions=assumptions, temperature_day=_today())

    def with_assumptions(self, assumptions: Assumptions) -> Self:
        """Return a copy with other assumptions; a new temperature is dated today."""
        before, temperature = self.assumptions_today, assumptions.temperature_c
        changed = replace(self, assumptions=assumptions)
        if temperature == before.temperature_c:
            return changed
        return changed.with_temperature(temperature)

    @property
    def camera(self) -> Camera | None:
        """The intrinsics, of the first camera of a rig."""
        if self.second is not None:
            return None if self.second.rig is None else self.second.rig.cameras[0]
        return None if self.camera_file is None else self.camera_file.camera

    @property
    def sources(self) -> tuple[SourceChoice, ...]:
        """Source of the images of each camera."""
        if self.second is None:
            return (self.source,)
        return (self.source, self.second.source)

    @property
    def pen(self) -> Pen | None:
        """The pen, with the nominal tip in use."""
        if self.pen_file is None:
            return None
        if self.nominal_tip is None:
            return self.pen_file.pen
        return replace(self.pen_file.pen, nominal_tip=self.nominal_tip)

    @property
    def origin(self) -> Origin:
        """Origin of the images: simulated if any file is."""
        seen_by = self.camera_file if self.second is None else self.second.rig_file
        files = seen_by, self.pen_file
        if any(file is not None and file.is_simulated for file in files):
            return Origin.SIMULATED
        return _ORIGINS.get(self.source.kind, Origin.LIVE)

    def with_source(self, source: SourceChoice) -> Self:
        """Return a copy with another image source.

        Files of a simulated pen are only kept with the simulated source. Stray light
        and the operator's heading belong to one camera and are dropped.
        """
        if source == self.source:
            return self
        simulates = source.kind == SourceKind.SIMULATED
        camera_file, pen_file = self.camera_file, self.pen_file
        if camera_file is not None and camera_file.is_simulated is not simulates:
            camera_file = None
        if pen_file is not None and pen_file.is_simulated is not simulates:
            pen_file = None
        return replace(
            self,
            source=source,
            camera_file=camera_file,
            pen_file=pen_file,
            mask=np.zeros((0, 3)),
            heading=None,
        )

    @property
    def rig_file(self) -> RigFile | None:
        """The file of both cameras, where there are two."""
        return None if self.second is None else self.second.rig_file

    def with_rig(self, rig_file: RigFile | None) -> Self:
        """Return a copy with another rig file; it needs two cameras."""
        if self.second is None:
            return self
        return replace(self, second=replace(self.second, rig_file=rig_file))

    def with_second(self, source: SourceChoice | None) -> Self:
        """Return a copy with another second camera, or without one.

        The rig file is kept if it is simulated exactly as the source is; the stray
        light mask of the camera before is dropped.
        """
        if source is None:
            return replace(self, second=None)
        before = self.second or SecondCamera()
        if self.second is not None and source == before.source:
            return self
        rig_file, simulates = before.rig_file, source.kind == SourceKind.SIMULATED
        if rig_file is not None and rig_file.is_simulated is not simulates:
            rig_file = None
        return replace(self, second=SecondCamera(source, rig_file))

    def without_images(self) -> Self:
        """Return a copy for cameras that have not sent an image yet."""
        second = self.second
        if second is not None:
            second = replace(second, image_size=None, in_use=None)
        return replace(self, image_size=None, camera_in_use=None, second=second)

    def mask_of(self, camera: int) -> FloatArray:
        """Return the stray light in the images of a camera, from 0, (M, 3), px."""
        if camera == 0 or self.second is None:
            return self.mask
        return self.second.mask

    def in_use(self, camera: int) -> CameraInUse | None:
        """Return the open camera by its place, from 0."""
        if camera == 0 or self.second is None:
            return self.camera_in_use
        return self.second.in_use

    def with_mask(self, camera: int, mask: FloatArray) -> Self:
        """Return a copy with another stray light mask of a camera, counted from 0."""
        if camera == 0 or self.second is None:
            return replace(self, mask=mask)
        return replace(self, second=replace(self.second, mask=mask))

    def renamed(self, names: Names) -> Self:
        """Return a copy with other names.

        Ball diameter and nominal centre of the tip before are dropped, unless a
        diameter comes with the new name, or they were given before any name.
        """
        now = self.names
        if now.tip in ("", names.tip):
            return replace(self, names=names)
        if names.ball_diameter == now.ball_diameter:
            names = replace(names, ball_diameter=None)
        return replace(self, names=names, nominal_tip=None)

    def completed(self, last: Result) -> Self:
        """Return a copy with ball and nominal centre of the last result, if unknown."""
        names, nominal_tip = self.names, self.nominal_tip
        if names.ball_diameter is None:
            names = replace(names, ball_diameter=last.names.ball_diameter)
        of_file = None if self.pen_file is None else self.pen_file.pen.nominal_tip
        if nominal_tip is None and not _same(last.nominal_tip, of_file):
            nominal_tip = last.nominal_tip  # it is the tip's own
        return replace(self, names=names, nominal_tip=nominal_tip)

    def with_listed(self, tip: ListedTip) -> Self:
        """Return a copy for a tip of the library, with its ball and nominal centre.

        What the library does not tell stays if it is the tip that is in use.
        """
        now = self.renamed(replace(self.names, tip=tip.id))
        ball = tip.ball_diameter_mm or now.names.ball_diameter
        nominal_tip = now.nominal_tip if tip.nominal_tip is None else tip.nominal_tip
        names = replace(now.names, ball_diameter=ball)
        return replace(now, names=names, nominal_tip=nominal_tip)

    @property
    def region(self) -> RegionOfInterest:
        """Camera, pen and mask for the detection."""
        others: tuple[RegionOfInterest, ...] = ()
        if self.second is not None:
            rig = self.second.rig
            camera = None if rig is None else rig.cameras[1]
            others = (RegionOfInterest(camera, self.pen, self.second.mask),)
        return RegionOfInterest(self.camera, self.pen, self.mask, others)

    def start_missing_inputs(self) -> tuple[MissingInput, ...]:
        """Return the missing inputs of the step Start."""
        names = self.names
        given = {
            MissingInput.STATION: names.station,
            MissingInput.OPERATOR: names.operator,
            MissingInput.PEN: names.pen,
            MissingInput.TIP: names.tip,
            MissingInput.CONE: names.cone,
        }
        return tuple(lack for lack, name in given.items() if not name.strip())

    def camera_missing_inputs(self) -> tuple[MissingInput, ...]:
        """Return the missing inputs of the step Camera."""
        missing_inputs = []
        if self.source.lacks_place:
            lacks = {
                SourceNeeds.CHOICE: MissingInput.SOURCE,
                SourceNeeds.FILES: MissingInput.SOURCE_PLACE,
            }
            needs = self.source.source.needs
            missing_inputs.append(lacks.get(needs, MissingInput.DEVICE))
        elif self.image_size is None:
            missing_inputs.append(MissingInput.IMAGES)
        camera = self.camera
        if camera is None and self.second is None:
            missing_inputs.append(MissingInput.CAMERA_FILE)
        if camera is not None and self.image_size not in (None, camera.image_size):
            missing_inputs.append(MissingInput.IMAGE_SIZE)
        return (*missing_inputs, *self._second_missing_inputs())

    def _second_missing_inputs(self) -> tuple[MissingInput, ...]:
        """Return the missing inputs of the second camera."""
        second = self.second
        if second is None:
            return ()
        missing_inputs = []
        if second.source.lacks_place:
            missing_inputs.append(MissingInput.SECOND_DEVICE)
        elif second.image_size is None:
            missing_inputs.append(MissingInput.SECOND_IMAGES)
        if second.rig is None:
            missing_inputs.append(MissingInput.RIG_FILE)
        elif second.rig.n_cameras != N_CAMERAS:
            missing_inputs.append(MissingInput.RIG_OF_TWO)
        elif second.image_size not in (None, second.rig.cameras[1].image_size):
            missing_inputs.append(MissingInput.SECOND_IMAGE_SIZE)
        return tuple(missing_inputs)

    def leds_missing_inputs(self) -> tuple[MissingInput, ...]:
        """Return the missing inputs of the step LEDs."""
        return (MissingInput.PEN_FILE,) if self.pen_file is None else ()

    def missing_inputs(self) -> tuple[MissingInput, ...]:
        """Return all missing inputs."""
        return (
            self.start_missing_inputs()
            + self.camera_missing_inputs()
            + self.leds_missing_inputs()
        )

    def swing_setup(self) -> SwingSetup:
        """Return the setup of the swing; the preparation must be complete."""
        camera, pen = self.camera, self.pen
        if camera is None or pen is None:
            raise ValueError("`camera_file` and `pen_file` must be chosen.")
        is_recording = self.source.kind == SourceKind.RECORDED
        second = self.second
        return SwingSetup(
            camera,
            pen,
            self.limits,
            self.mask,
            assumptions=self.assumptions_today,
            is_recording=is_recording,
            beside=None if second is None else second.rig,
            other_masks=() if second is None else (second.mask,),
        )

    def swings_like(self, other: "Preparation") -> bool:
        """Return whether a swing begun with the other would be the same."""
        return (
            self.sources == other.sources
            and self.camera_file is other.camera_file
            and self.pen_file is other.pen_file
            and self.names == other.names
            and self.limits == other.limits
            and self.assumptions_today == other.assumptions_today
            and _same(self.nominal_tip, other.nominal_tip)
            and np.array_equal(self.mask, other.mask)
            and self._has_second_of(other)
        )

    def _has_second_of(self, other: "Preparation") -> bool:
        one, two = self.second, other.second
        if one is None or two is None:
            return one is two
        return one.rig_file is two.rig_file and np.array_equal(one.mask, two.mask)


def _today() -> str:
    return local_now().date().isoformat()


_ORIGINS: dict[str, Origin] = {
    SourceKind.SIMULATED: Origin.SIMULATED,
    SourceKind.RECORDED: Origin.RECORDED,
}


def _same(one: FloatArray | None, other: FloatArray | None) -> bool:
    if one is None or other is None:
        return one is other
    return np.array_equal(one, other)
