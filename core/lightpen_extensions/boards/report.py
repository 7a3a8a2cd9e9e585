"""The calibration of a camera as text and as a record, and parts of those of two."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.messages import Message
from lightpen.model.camera import Camera
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen_extensions.boards.adjustment import N_SHAPE, BoardFit
from lightpen_extensions.boards.calibration import CameraCalibration
from lightpen_extensions.boards.distortion import choice_record, map_uncertainty
from lightpen_extensions.boards.observing import ObservedBoard, Views

COLUMNS, ROWS = 4, 3
PINHOLE = ("fx", "fy", "cx", "cy")
SHAPE_NAMES = (
    "stretch",
    "shear",
    "bend_along_rows_mm",
    "bend_across_mm",
    "bend_along_columns_mm",
)
TITLE = 13  # characters


def residuals_by_region(views: Views, residuals: FloatArray) -> dict[str, Any]:
    """Return points, rms and mean residuals of one camera in 3 rows and 4 columns, px.

    NaN without points. A lens that the model does not fit pulls its regions to some
    side. ``residuals`` (V, 1, N, 2) are NaN where a point was not seen.
    """
    seen = views.seen
    (x, y), left = views.pixels[seen].T, residuals[seen]
    width, height = views.image_sizes[0]

    def total(weights: FloatArray) -> FloatArray:
        inside = [[-0.5, height - 0.5], [-0.5, width - 0.5]]
        sums, *_ = np.histogram2d(y, x, (ROWS, COLUMNS), inside, weights=weights)
        return np.asarray(sums)

    count = total(np.ones(len(x)))
    with np.errstate(invalid="ignore"):
        rms = np.sqrt(total(np.square(left).sum(axis=-1)) / count)
        mean = np.stack([total(each) / count for each in left.T], axis=-1)
    return {"points": count.astype(np.int64), "rms_px": rms, "mean_px": mean}


def intrinsics_text(calibration: CameraCalibration, observed: ObservedBoard) -> str:
    """Return the calibration of a camera as text for the screen."""
    camera, fitted = calibration.camera, calibration.adjustment
    assert camera.covariance is not None
    u = COVERAGE_FACTOR * np.sqrt(np.diag(camera.covariance))
    uncertain = map_uncertainty(camera, camera.covariance)
    n_found = observed.views.n_views
    lines = [f"{'Intrinsics':<{TITLE}}{'':>18}{'U (k = 2)':>14}"]
    names = (*PINHOLE, *camera.distortion_names)
    lines += [
        f"  {name:<{TITLE - 2}}{value:>18.6g}{of:>14.2g}"
        for name, value, of in zip(names, camera.intrinsics, u, strict=False)
    ]
    lines += [
        "",
        f"{'Views':<{TITLE}}{calibration.views.n_views} used, the board found in "
        f"{n_found} of {n_found + len(observed.unseen)} images",
        *left_out_lines(calibration.left_out, "they fit no other"),
    ]
    if calibration.n_points_left_out:
        lines.append(f"  points     {calibration.n_points_left_out} left out")
    lines += [
        f"{'Residuals':<{TITLE}}{fitted.rms:.4f} px rms; in views left out "
        f"{calibration.held_out_rms:.4f} px",
        f"{'Distortion':<{TITLE}}{calibration.choice.message}",
        f"{'Projection':<{TITLE}}standard uncertainty {uncertain.center:.4f} px in the "
        f"middle, {uncertain.typical:.4f} px over the image, {uncertain.worst:.4f} px "
        "at worst",
        board_line(fitted),
        *remark_lines(calibration.remarks),
    ]
    return "\n".join(lines)


def intrinsics_record(
    calibration: CameraCalibration, unseen: Sequence[str]
) -> dict[str, Any]:
    """Return the calibration as a record; ``unseen`` names images without the board."""
    camera, fitted = calibration.camera, calibration.adjustment
    views, found = calibration.views, calibration.effects.components
    assert camera.covariance is not None
    uncertain = map_uncertainty(camera, camera.covariance)
    field = calibration.effects.field
    return {
        "kind": "intrinsics",
        "board": views.board.name,
        **camera_record(camera),
        "rms_px": fitted.rms,
        "noise_px": fitted.sigma,
        "held_out_rms_px": calibration.held_out_rms,
        "distortion_choice": choice_record(calibration.choice),
        "board_points_in_plane_mm": found.in_plane,
        "board_points_out_of_plane_mm": found.out_of_plane,
        "lens_field": field
        and {"amplitude_px": field.amplitude, "length_px": field.length},
        "projection_uncertainty": {
            "middle_px": uncertain.center,
            "rms_px": uncertain.typical,
            "worst_px": uncertain.worst,
            "pixels": uncertain.pixels,
            "standard_uncertainty_px": uncertain.sigmas,
        },
        "residuals_by_region": residuals_by_region(views, fitted.residuals),
        "board_found": board_record(fitted),
        "views": [
            {
                "name": name,
                "rms_px": fitted.view_rms[v, 0],
                "held_out_rms_px": calibration.effects.held_out[v],
                "points": np.flatnonzero(views.seen[v, 0]),
                "pixels": views.pixels[v, 0][views.seen[v, 0]],
            }
            for v, name in enumerate(views.names)
        ],
        "views_left_out": calibration.left_out,
        "duplicates": calibration.duplicates,
        "points_left_out": calibration.n_points_left_out,
        "images_without_board": unseen,
        "remarks": calibration.remarks,
    }


def left_out_lines(names: tuple[str, ...], why: str) -> list[str]:
    """Return the line on views that were excluded, if there are any."""
    return [f"  left out   {', '.join(names)}: {why}"] if names else []


def board_line(fitted: BoardFit) -> str:
    """Return the line on the shape of the board."""
    stretch, shear, *bends = fitted.state.shape.tolist()
    return (
        f"{'Board':<{TITLE}}stretched by {1e6 * stretch:+.0f} ppm, sheared by "
        f"{1e6 * shear:+.0f} ppm, bent by "
        + " ".join(f"{bend:+.3f}" for bend in bends)
        + " mm"
    )


def remark_lines(remarks: tuple[Message, ...]) -> list[str]:
    """Return the lines of remarks below the rest."""
    return ["", *map(str, remarks)] if remarks else []


def camera_record(camera: Camera) -> dict[str, Any]:
    """Return the record of the intrinsics."""
    names = (*PINHOLE, *camera.distortion_names)
    record = {
        "image_size": camera.image_size,
        "lens_model": camera.lens.value,
        "intrinsics": dict(zip(names, camera.intrinsics.tolist(), strict=True)),
        "covariance": camera.covariance,
    }
    if camera.covariance is not None:
        u = COVERAGE_FACTOR * np.sqrt(np.diag(camera.covariance))
        record["expanded_uncertainty"] = dict(zip(names, u.tolist(), strict=False))
    return record


def board_record(fitted: BoardFit) -> dict[str, dict[str, float]]:
    """Return the record of the shape of the board."""
    sigmas = np.sqrt(np.diag(fitted.covariance)[-N_SHAPE:])
    return {
        name: {"value": value, "standard_uncertainty": sigma}
        for name, value, sigma in zip(
            SHAPE_NAMES, fitted.state.shape.tolist(), sigmas.tolist(), strict=True
        )
    }
