"""The calibration record: one definition for files, reports and the schema.

The program writes and reads these types and no others; `docs/schema.py` makes the
published JSON schema of them. A number that could not be found is None; tip, cone,
their covariance and the instrument always are found. What only a rig of several cameras
has is left out of the JSON of a single camera.
"""

from collections.abc import Mapping
from typing import Annotated, TypeAlias

from msgspec import UNSET, Meta, Struct, UnsetType

from lightpen.detection.reasons import Reason
from lightpen.estimation.reports.verdict import Grade, NextStep
from lightpen.estimation.uncertainty.budget import ContributionName
from lightpen.formats.own_json import (
    FileRecord,
    Length,
    ProgramName,
    StoredMessage,
    StoredValue,
    Vector,
    ZonedTime,
)
from lightpen.model.limits import Assumptions
from lightpen.model.names import Method, Origin

Count: TypeAlias = Annotated[int, Meta(ge=0, le=10**9)]
Place: TypeAlias = Annotated[int, Meta(ge=1, le=10**9)]  # from 1
Counts: TypeAlias = tuple[Count, Count, Count, Count, Count, Count, Count, Count]
Number: TypeAlias = float | None
Pair: TypeAlias = tuple[Number, Number]
Triple: TypeAlias = tuple[Number, Number, Number]
Matrix3: TypeAlias = tuple[Vector, Vector, Vector]
Row: TypeAlias = tuple[float, float, float, float, float, float]
Covariance: TypeAlias = Annotated[
    tuple[Row, Row, Row, Row, Row, Row], Meta(description="Of tip and cone, mm^2.")
]
Expanded: TypeAlias = Annotated[Vector, Meta(description="U (k = 2) along each axis.")]
NotNegative: TypeAlias = Annotated[float, Meta(ge=0)]
Diameter: TypeAlias = Annotated[float, Meta(gt=0, le=1000)]
Lamp: TypeAlias = tuple[Length | None, Length | None]


class ImageCounts(Struct, frozen=True):
    """Number of images, and reasons for unused ones."""

    total: Count
    used: Count
    dropped: dict[Reason, Count]


class Convergence(Struct, frozen=True):
    """The iterations of the two-stage method."""

    x_mm: tuple[tuple[Number, ...], ...]
    objective_mm2: tuple[Number, ...]
    alpha: tuple[Number, ...]
    increment_mm: tuple[Number, ...]


class MethodRecord(Struct, frozen=True, omit_defaults=True):
    """Tip and cone by one of the estimators.

    Attributes
    ----------
    off_joint_mm
        Tip of the two-stage method less that of the joint fit, a part of its U.
    projection_bias_mm
        The part of it by projected discs that are taken for points.
    """

    tip_pen_mm: Triple
    cone_cam_mm: Triple
    covariance: tuple[tuple[Number, ...], ...]
    expanded_uncertainty_mm: Triple
    rms_mm: Number
    convergence: Convergence | None = None
    off_joint_mm: Triple | None = None
    projection_bias_mm: Triple | None = None


class VerdictLimits(Struct, frozen=True, omit_defaults=True):
    """The limits of the verdict."""

    max_uncertainty_mm: float
    min_images: Count
    min_per_field: Count
    requires_temperature: bool = False


class VerdictRecord(StoredMessage, frozen=True):
    """The verdict on the calibration alone: its main reason, the grade, what to do."""

    grade: Grade
    next_step: NextStep
    limits: VerdictLimits


class ContributionRecord(Struct, frozen=True):
    """A contribution to U: k = 1 along each axis, U (k = 2) along the weakest."""

    name: ContributionName
    standard_uncertainty_mm: Vector
    weakest_expanded_uncertainty_mm: float
    assumed: bool


class UncertaintyRecord(Struct, frozen=True):
    """The uncertainty budget.

    Attributes
    ----------
    shares
        The contributions; the sum of their squares is that of the combined standard
        uncertainty. A contribution that is not listed is zero.
    independent_noise_mm
        Contribution of noise if no two images were correlated, k = 1.
    correlation_factor
        Ratio of the noise variance to that of independent images.
    led_sigma_mm
        Standard deviation of the errors of the LED file, estimated from the images.
    halves_difference_mm
        Difference of the tips from the odd and from the even images.
    """

    shares: tuple[ContributionRecord, ...]
    independent_noise_mm: Triple | None
    correlation_factor: float
    led_sigma_mm: Number
    halves_difference_mm: Triple
    halves_expanded_uncertainty_mm: Triple


class AdjustedParameter(Struct, frozen=True):
    """A camera parameter after the adjustment, k = 1."""

    value: float
    standard_uncertainty: Number
    standard_uncertainty_before: Number


class Estimate(Struct, frozen=True):
    """A value, k = 1."""

    value: Number
    standard_uncertainty: Number


class ContradictionRecord(Struct, frozen=True, omit_defaults=True):
    """A value of a file that the images contradict, with U (k = 2) of both."""

    what: str
    unit: str
    stated: Number
    stated_expanded_uncertainty: Number
    wanted: Number
    wanted_expanded_uncertainty: Number
    standard_deviations: Number
    camera: str = ""


class AdjustmentRecord(Struct, frozen=True):
    """The values of the files after the adjustment."""

    intrinsics: dict[str, AdjustedParameter]
    intrinsics_uncertainty_assumed: bool
    pen_growth: Number
    disc_diameter_mm: Number
    disc_diameter_by_areas_mm: Estimate | None
    contradictions: tuple[ContradictionRecord, ...]


class SelfCheckRecord(Struct, frozen=True):
    """Errors with which half of the LEDs predict the others.

    Attributes
    ----------
    value
        Ratio (rms) of the errors that depend on the posture to the rest: about 1 if
        pen, LEDs and lens agree with the model.
    limit
        Exceeded by chance in one of a hundred swings.
    """

    value: float
    limit: float


class OtherCameraRecord(Struct, frozen=True):
    """A camera of a rig but the first, as fitted."""

    intrinsics: tuple[float, ...]
    cam_from_rig_rotation: Matrix3
    cam_from_rig_translation_mm: Vector


class PenScaleRecord(Struct, frozen=True):
    """Scale s of the pen during the swing: that of the LED file and temperature."""

    growth: Annotated[
        float, Meta(description="Of pen and tip against the LED file, relative.")
    ]
    file_sigma: NotNegative
    thermal_sigma: NotNegative
    deviation: Annotated[float, Meta(description="Estimate of s by the swing.")]
    variance: NotNegative
    covariance: Annotated[
        tuple[float, ...], Meta(description="Of all parameters of `covariance` with s.")
    ]


class InstrumentRecord(Struct, frozen=True, omit_defaults=True):
    """Cameras and pen as fitted, and the covariance of all with the tip."""

    intrinsics: Annotated[tuple[float, ...], Meta(min_length=4)]
    disc_diameter_mm: Diameter
    leds_mm: tuple[Vector, ...]
    covariance: Annotated[
        tuple[tuple[float, ...], ...],
        Meta(
            description="Of tip, intrinsics of each camera, cam_from_rig of all but "
            "the first (rad, mm), disc diameter and LEDs, in this order."
        ),
    ]
    scale: PenScaleRecord
    other_cameras: tuple[OtherCameraRecord, ...] = ()

    def __post_init__(self) -> None:
        size = 4 + len(self.intrinsics) + 3 * len(self.leds_mm)
        size += sum(6 + len(other.intrinsics) for other in self.other_cameras)
        rows = (*self.covariance, self.scale.covariance)
        if {size} != {len(self.covariance), *map(len, rows)}:
            raise ValueError("The covariance is of another instrument.")


class DirectionRecord(Struct, frozen=True):
    """The direction in the pen frame along which U of the tip is largest."""

    vector_pen: Vector
    expanded_uncertainty_mm: float


class CoverageRecord(Struct, frozen=True):
    """The postures of the swing: images in each direction of the dial."""

    directions: tuple[str, ...]
    leaning: Counts
    leaning_far: Counts
    upright: Count
    missing: tuple[str, ...]
    tilt_deg: Pair
    turn_deg: Pair


class LedRecord(Struct, frozen=True):
    """Residuals of an LED, and its distance from the file position."""

    led: Place
    seen: Count
    used: Count
    rms_px: Number
    mean_px: Pair
    displacement_mm: Triple
    displaced: bool


class CameraPlace(Struct, frozen=True, omit_defaults=True):
    """Pose of a camera in its rig; for the first camera, the reference, no more."""

    rotation: Matrix3
    translation_mm: Vector
    change_from_file: tuple[Number, ...] | None = None
    standard_uncertainty: tuple[Number, ...] | None = None
    standard_uncertainty_before: tuple[Number, ...] | None = None
    uncertainty_assumed: bool | None = None
    lag_images: Number | UnsetType = UNSET
    lag_standard_uncertainty: Number | UnsetType = UNSET


class CameraRecord(Struct, frozen=True):
    """Results of one camera of a rig."""

    name: str
    images: ImageCounts
    rms_px: Number
    intrinsics: dict[str, AdjustedParameter]
    intrinsics_uncertainty_assumed: bool
    cam_from_rig: CameraPlace


class RigRecord(Struct, frozen=True):
    """Results of the cameras of a rig."""

    cameras: tuple[CameraRecord, ...]


class InputsRecord(Struct, frozen=True, omit_defaults=True):
    """The files that were read; cameras, rig and pen with content."""

    camera: FileRecord
    pen: FileRecord
    observations: tuple[FileRecord, ...]
    units: str | None
    led_diameter_mm: Number
    image_interval_ms: float | None = None
    rig: FileRecord | None = None
    cameras: tuple[FileRecord, ...] = ()


class SpotRecord(Struct, frozen=True, omit_defaults=True):
    """The image of an LED: its centre, and whether it was usable and used.

    Attributes
    ----------
    sigma_px
        Standard deviation of a coordinate by detection, of an LED too small to have an
        edge; it weights the LED.
    """

    led: Place
    x_px: Length
    y_px: Length
    area_px2: Length | None
    fit: bool
    used: bool
    sigma_px: Length | None = None


class FrameRecord(Struct, frozen=True, omit_defaults=True, kw_only=True):
    """An image, and why it is not used.

    Attributes
    ----------
    tip_cam_mm
        The tip from this image alone.
    edge_width_px
        Width of the edges of the LEDs, from dark to bright.
    """

    camera: str = ""
    moment: Count = 0
    file: str
    used: bool
    reason: Reason
    detail: str
    detail_code: str
    detail_values: Mapping[str, StoredValue] = {}
    rms_px: Number
    tip_cam_mm: Triple
    edge_width_px: Length | None
    lamps_px: tuple[Lamp, ...]
    leds: tuple[SpotRecord, ...]


class CalibrationRecord(Struct, frozen=True, omit_defaults=True, kw_only=True):
    """Calibration of the probe tip of a light pen.

    The tip is the effective one: the point x of the LED frame, in the scale of the LED
    file, that stays most nearly at one place c over the swing, ``min over x, c of sum
    |R_i x + T_i - c|^2`` with the poses of the LED frame. Scale and temperature of the
    pen, and bending under another force, act when it measures.

    Lengths are in mm, image points in px. Verdict and weakest direction are those of
    the reported tip; residuals, budget and LEDs those of the joint estimator.
    The file ends with one entry more, its checksum.

    Attributes
    ----------
    origin
        Of the images: live camera, recorded or simulated.
    method
        Estimator of the reported tip.
    nominal_tip_mm
        Tip by design.
    change_from_nominal_mm
        Measured minus nominal.
    rms_px
        Residual of the LED centres, rms.
    rms_mm
        Distance of the tips from single images to the cone, rms.
    warnings
        Findings to check; their codes stay when the wording changes.
    assumptions
        Default values for what the files do not state.
    self_check
        Comparison of one half of the LEDs with the other.
    instrument
        Input of verification and measuring.
    inputs
        Enough to compute the tip again from this record alone.
    """

    program: ProgramName
    created: ZonedTime
    origin: Origin | None
    method: Method
    tip_pen_mm: Annotated[Vector, Meta(description="The tip in the pen frame.")]
    cone_cam_mm: Annotated[
        Vector, Meta(description="The same point in the frame of the first camera.")
    ]
    covariance: Covariance
    expanded_uncertainty_mm: Expanded
    cone_expanded_uncertainty_mm: Expanded
    coverage_factor: float
    nominal_tip_mm: Vector | None
    change_from_nominal_mm: Vector | None
    rms_px: float
    rms_mm: Number
    sigma_px: Annotated[float, Meta(ge=0, description="Noise of an LED centre.")]
    images: ImageCounts
    methods: dict[str, MethodRecord]
    verdict: VerdictRecord
    warnings: tuple[StoredMessage, ...]
    uncertainty: UncertaintyRecord
    adjusted: AdjustmentRecord
    assumptions: Assumptions
    instrument: InstrumentRecord
    weakest_direction: DirectionRecord
    coverage: CoverageRecord
    leds: tuple[LedRecord, ...]
    self_check: SelfCheckRecord | None = None
    rig: RigRecord | None = None
    inputs: InputsRecord
    frames: tuple[FrameRecord, ...]

    def __post_init__(self) -> None:
        n_leds = len(self.leds)
        if max((spot.led for f in self.frames for spot in f.leds), default=0) > n_leds:
            raise ValueError("An LED is seen that the pen does not have.")
        if len(self.instrument.leds_mm) != n_leds:
            raise ValueError("The instrument is of another pen.")
        n_lamps = {len(frame.lamps_px) for frame in self.frames}
        if self.rig is None and len(n_lamps) > 1:
            raise ValueError("Images show different numbers of fixed lamps.")
