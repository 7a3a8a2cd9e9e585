"""What a calibration says of each camera: as a record, as text, and as warnings."""

from collections import Counter
from typing import Any

import numpy as np

from lightpen.detection.reasons import Reason
from lightpen.estimation.calibrate import Calibration, CameraImages
from lightpen.estimation.contradictions import COEFFICIENTS
from lightpen.messages import not_simultaneous
from lightpen.sentences import Sentence, sentence

MAX_NAMED = 5  # images
WIDTH = 10  # characters of a camera's name


def adjusted_intrinsics_record(calibration: Calibration, c: int) -> dict[str, Any]:
    """Return what the images made of the intrinsics of the c-th camera."""
    camera = calibration.bundle.state.rig.cameras[c]
    place = calibration.bundle.columns.cameras[c]
    deviations = np.sqrt(np.diag(calibration.bundle.covariance)[place])
    before = np.sqrt(np.diag(calibration.stated.cameras[c].covariance))
    names = ("fx", "fy", "cx", "cy", *COEFFICIENTS)
    return {
        name: {
            "value": value,
            "standard_uncertainty": deviation,
            "standard_uncertainty_before": known,
        }
        for name, value, deviation, known in zip(
            names, camera.intrinsics, deviations, before, strict=False
        )
    }


def rig_record(calibration: Calibration) -> dict[str, Any]:
    """Return what the images of several cameras say of each."""
    return {
        "cameras": [
            {
                "name": name,
                "images": {
                    "total": len(images.reasons) - images.reasons.count(Reason.ABSENT),
                    "used": int(images.used.sum()),
                    "dropped": dict(count_dropped(images.reasons)),
                },
                "moments_without_image": images.reasons.count(Reason.ABSENT),
                "rms_px": images.total_rms,
                "intrinsics": adjusted_intrinsics_record(calibration, c),
                "intrinsics_uncertainty_assumed": calibration.priors.cameras[c].assumed,
                "cam_from_rig": _place_record(calibration, c),
            }
            for c, (name, images) in enumerate(
                zip(
                    calibration.bundle.state.rig.names,
                    calibration.cameras,
                    strict=True,
                )
            )
        ]
    }


def _place_record(calibration: Calibration, c: int) -> dict[str, Any]:
    bundle, prior = calibration.bundle, calibration.stated.extrinsics
    rig = bundle.state.rig
    record: dict[str, Any] = {
        "rotation": rig.rotations[c],
        "translation_mm": rig.translations[c],
    }
    if c == 0 or prior is None:
        return record
    own = slice(6 * (c - 1), 6 * c)
    place = bundle.columns.extrinsics
    lag = calibration.lags[c - 1]
    return record | {
        "change_from_file": bundle.values[place][own],
        "standard_uncertainty": np.sqrt(np.diag(bundle.covariance)[place][own]),
        "standard_uncertainty_before": np.sqrt(np.diag(prior.covariance)[own]),
        "uncertainty_assumed": prior.assumed,
        "lag_images": None if lag is None else lag.value,
        "lag_standard_uncertainty": None if lag is None else lag.sigma,
    }


def count_dropped(reasons: tuple[Reason, ...]) -> Counter[str]:
    """Return how many images do not take part, by reason."""
    return Counter(str(why) for why in reasons if why and why is not Reason.ABSENT)


def rig_lines(calibration: Calibration) -> list[str]:
    """Return lines of text on the images of each camera, and where it stands."""
    lines = []
    rig = calibration.bundle.state.rig
    moves = calibration.bundle.values[calibration.bundle.columns.extrinsics]
    for c, (name, images) in enumerate(
        zip(rig.names, calibration.cameras, strict=True)
    ):
        n_images = len(images.reasons) - images.reasons.count(Reason.ABSENT)
        lines.append(
            f"  {name:<{WIDTH}} {images.used.sum()} of {n_images} images used, "
            f"{images.total_rms:.4f} px rms"
        )
        for reason, count in count_dropped(images.reasons).items():
            lines.append(
                f"    dropped  {count} {reason}: {named_images(images, reason)}"
            )
        if c > 0:
            turn, shift = moves[6 * c - 6 : 6 * c - 3], moves[6 * c - 3 : 6 * c]
            lines.append(
                f"    stands   {np.linalg.norm(shift):.3f} mm and "
                f"{np.degrees(np.linalg.norm(turn)):.4f} degrees off the rig file"
            )
    return lines


def named_images(images: CameraImages, reason: str) -> str:
    """Return the names of the images left out for a reason, the first few of them."""
    names = [
        name
        for name, why in zip(images.observations.names, images.reasons, strict=True)
        if why == reason
    ]
    return ", ".join(names[:MAX_NAMED]) + (", ..." if len(names) > MAX_NAMED else "")


def late_cameras(calibration: Calibration) -> list[Sentence]:
    """Return what is told of cameras that took their images later than the first."""
    names = calibration.bundle.state.rig.names[1:]
    return [
        not_simultaneous(name, lag.value)
        for name, lag in zip(names, calibration.lags, strict=True)
        if lag is not None and lag.is_noticeable
    ]


def rig_warnings(calibration: Calibration) -> list[Sentence]:
    """Return what the user of several cameras should look into."""
    rig = calibration.bundle.state.rig
    warnings = late_cameras(calibration)
    if rig.n_cameras == 1:
        return warnings
    n_moments = len(calibration.reasons)
    names = np.array([images.observations.names for images in calibration.cameras])
    for c, images in enumerate(calibration.cameras):
        absent = np.array([why is Reason.ABSENT for why in images.reasons])
        if absent.any():
            others = names[:, absent][:, 0]
            warnings.append(
                sentence(
                    "warning.no-partner",
                    "Camera {camera} has no image at {n_absent} of {n_moments} "
                    "moments, such as that of {example}. What the other cameras saw "
                    "there is used.",
                    camera=rig.names[c],
                    n_absent=int(absent.sum()),
                    n_moments=n_moments,
                    example=str(next(name for name in others if name)),
                )
            )
        n_apart = images.reasons.count(Reason.OTHER_MOMENT)
        if n_apart:
            first = images.reasons.index(Reason.OTHER_MOMENT)
            warnings.append(
                sentence(
                    "warning.other-moment",
                    "Camera {camera} shows the pen in another posture than the other "
                    "cameras at {n_apart} of {n_moments} moments, such as {example}; "
                    "its images of these are left out. Check that the images of one "
                    "moment have the same name, and the trigger.",
                    camera=rig.names[c],
                    n_apart=n_apart,
                    n_moments=n_moments,
                    example=images.observations.names[first],
                )
            )
    return warnings
