"""The calibration of one camera, or of two, as text and as a record."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.messages import Message
from lightpen.model.camera import Camera
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen.model.rigid import vector_from_rotation
from lightpen_extensions.boards.adjustment import N_SHAPE, BoardFit
from lightpen_extensions.boards.calibration import CameraCalibration
from lightpen_extensions.boards.distortion import choice_record, map_uncertainty
from lightpen_extensions.boards.observing import ObservedBoard, Views
from lightpen_extensions.boards.pair import PairCalibration

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
        *_left_out_lines(calibration.left_out, "they fit no other"),
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
        _board_line(fitted),
        *_remark_lines(calibration.remarks),
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
        **_camera_record(camera),
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
        "board_found": _board_record(fitted),
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


def pair_text(calibration: PairCalibration, observed: ObservedBoard) -> str:
    """Return the calibration of two cameras as text for the screen."""
    rig, fitted = calibration.rig, calibration.adjustment
    assert rig.covariance is not None
    u = COVERAGE_FACTOR * np.sqrt(np.diag(rig.covariance))
    turn = np.degrees(vector_from_rotation(rig.rotations[1]))
    one, other = rig.names
    lines = [
        f"{other} from {one}".ljust(30) + "".join(f"{axis:>13}" for axis in "xyz"),
        _row("Turn, degrees", turn),
        _row("  U (k = 2)", np.degrees(u[:3])),
        _row("Translation, mm", rig.translations[1]),
        _row("  U (k = 2)", u[3:]),
        "",
        f"{'Baseline':<{TITLE}}{calibration.baseline:.3f} mm, U = "
        f"{COVERAGE_FACTOR * calibration.baseline_sigma:.3f} mm",
        f"{'Views':<{TITLE}}{calibration.n_pairs} of both cameras used, of "
        f"{observed.views.n_views}",
        f"{'Residuals':<{TITLE}}{fitted.rms:.4f} px rms",
        *_left_out_lines(calibration.left_out, "of one camera, or the cameras differ"),
    ]
    for name, camera in zip(rig.names, rig.cameras, strict=True):
        four = zip(PINHOLE, camera.intrinsics.tolist(), strict=False)
        values = [f"{n} {value:.2f}" for n, value in four]
        if camera.covariance is not None:
            of = COVERAGE_FACTOR * np.sqrt(np.diag(camera.covariance))
            values = [f"{v} \u00b1 {b:.2f}" for v, b in zip(values, of, strict=False)]
        lines.append(f"{name[: TITLE - 1]:<{TITLE}}{', '.join(values)} px")
    lines += [_board_line(fitted), *_remark_lines(calibration.remarks)]
    return "\n".join(lines)


def pair_record(
    calibration: PairCalibration, observed: ObservedBoard
) -> dict[str, Any]:
    """Return the calibration of two cameras as a record."""
    rig, fitted = calibration.rig, calibration.adjustment
    return {
        "kind": "extrinsics",
        "board": calibration.views.board.name,
        "cameras": [
            {"name": name, **_camera_record(camera)}
            for name, camera in zip(rig.names, rig.cameras, strict=True)
        ],
        "cam_from_rig_rotation": rig.rotations[1],
        "cam_from_rig_translation_mm": rig.translations[1],
        "extrinsics_covariance": rig.covariance,
        "baseline_mm": calibration.baseline,
        "baseline_expanded_uncertainty_mm": (
            COVERAGE_FACTOR * calibration.baseline_sigma
        ),
        "rms_px": fitted.rms,
        "noise_px": fitted.sigma,
        "views_of_both": calibration.n_pairs,
        "board_found": _board_record(fitted),
        "views": [
            {"name": name, "rms_px": rms}
            for name, rms in zip(calibration.views.names, fitted.view_rms, strict=True)
        ],
        "views_left_out": calibration.left_out,
        "images_without_board": observed.unseen,
        "remarks": calibration.remarks,
    }


def _row(title: str, values: FloatArray) -> str:
    return f"  {title:<28}" + "".join(f"{value:13.4f}" for value in values)


def _left_out_lines(names: tuple[str, ...], why: str) -> list[str]:
    return [f"  left out   {', '.join(names)}: {why}"] if names else []


def _board_line(fitted: BoardFit) -> str:
    stretch, shear, *bends = fitted.state.shape.tolist()
    return (
        f"{'Board':<{TITLE}}stretched by {1e6 * stretch:+.0f} ppm, sheared by "
        f"{1e6 * shear:+.0f} ppm, bent by "
        + " ".join(f"{bend:+.3f}" for bend in bends)
        + " mm"
    )


def _remark_lines(remarks: tuple[Message, ...]) -> list[str]:
    return ["", *map(str, remarks)] if remarks else []


def _camera_record(camera: Camera) -> dict[str, Any]:
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


def _board_record(fitted: BoardFit) -> dict[str, dict[str, float]]:
    sigmas = np.sqrt(np.diag(fitted.covariance)[-N_SHAPE:])
    return {
        name: {"value": value, "standard_uncertainty": sigma}
        for name, value, sigma in zip(
            SHAPE_NAMES, fitted.state.shape.tolist(), sigmas.tolist(), strict=True
        )
    }
