"""The calibration of one camera, or of two, as text and as a record."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.intrinsics.board_fit import BoardFit
from lightpen.intrinsics.calibration import CameraCalibration
from lightpen.intrinsics.coverage import cover
from lightpen.intrinsics.distortion import choice_record
from lightpen.intrinsics.next_view import choose_next_view
from lightpen.intrinsics.observing import ObservedBoard
from lightpen.intrinsics.pair import PairCalibration
from lightpen.intrinsics.uncertainty_map import map_uncertainty
from lightpen.intrinsics.variance_components import MixedFit
from lightpen.intrinsics.views import BoardTolerances
from lightpen.model.camera import Camera
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.rigid import vector_from_rotation

COLUMNS, ROWS = 4, 3


@dataclass(frozen=True, eq=False)
class Regions:
    """Residuals of one camera in 3 rows and 4 columns."""

    n_points: IntArray  # (3, 4)
    rms: FloatArray  # (3, 4), px; NaN without points
    # (3, 4, 2), px; a lens that the model does not fit pulls its regions to some side.
    means: FloatArray


def measure_regions(fitted: BoardFit, camera: Camera) -> Regions:
    """Return the residuals of a single camera by region."""
    residuals = fitted.residuals[:, 0]
    seen = np.isfinite(residuals[..., 0])
    poses = fitted.state.poses
    board = fitted.board_points
    points = board @ np.swapaxes(poses.rotations, 1, 2) + poses.translations[:, None]
    at = camera.project(points[seen]) / np.array(camera.image_size)
    at = np.floor(at * np.array([COLUMNS, ROWS])).astype(np.int64)
    column = np.clip(at[:, 0], 0, COLUMNS - 1)
    row = np.clip(at[:, 1], 0, ROWS - 1)
    n_points = np.zeros((ROWS, COLUMNS), dtype=np.int64)
    sums = np.zeros((ROWS, COLUMNS, 2))
    squares = np.zeros((ROWS, COLUMNS))
    np.add.at(n_points, (row, column), 1)
    np.add.at(sums, (row, column), residuals[seen])
    np.add.at(squares, (row, column), np.square(residuals[seen]).sum(axis=-1))
    counts = np.where(n_points > 0, n_points, np.nan)
    return Regions(n_points, np.sqrt(squares / counts), sums / counts[..., None])


PINHOLE = ("fx", "fy", "cx", "cy")
SHAPE_NAMES = (
    "stretch",
    "shear",
    "bend_along_rows_mm",
    "bend_across_mm",
    "bend_along_columns_mm",
)
N_WORST = 5
TITLE = 13  # characters


def intrinsics_text(calibration: CameraCalibration, observed: ObservedBoard) -> str:
    """Return the calibration of a camera as text for the screen."""
    camera, fitted = calibration.camera, calibration.adjustment
    assert camera.covariance is not None
    u = COVERAGE_FACTOR * np.sqrt(np.diag(camera.covariance))
    uncertain = map_uncertainty(camera, camera.covariance)
    coverage = cover(calibration.views, fitted.state.poses)
    lines = [f"{'Intrinsics':<{TITLE}}{'':>18}{'U (k = 2)':>14}"]
    lines += [
        f"  {name:<{TITLE - 2}}{value:>18.6g}{of:>14.2g}"
        for name, value, of in zip(
            (*PINHOLE, *camera.distortion_names),
            camera.intrinsics.tolist(),
            u.tolist(),
            strict=False,
        )
    ]
    lines += [
        "",
        f"{'Views':<{TITLE}}{calibration.views.n_views} used, the board found in "
        f"{observed.views.n_views} of "
        f"{observed.views.n_views + len(observed.unseen)} images",
    ]
    if calibration.left_out:
        lines.append(
            f"  left out   {', '.join(calibration.left_out)}: they fit no other"
        )
    if calibration.n_points_left_out:
        lines.append(f"  points     {calibration.n_points_left_out} left out")
    lines += [
        f"{'Residuals':<{TITLE}}{fitted.rms:.4f} px rms; in views left out "
        f"{calibration.held_out_rms:.4f} px",
        f"{'Distortion':<{TITLE}}{calibration.choice.message}",
        f"{'Projection':<{TITLE}}standard uncertainty {uncertain.center:.4f} px in the "
        f"middle, {uncertain.typical:.4f} px over the image, {uncertain.worst:.4f} px "
        "at worst",
        f"{'Coverage':<{TITLE}}{coverage.share:.0%} of the image, tilts "
        f"{np.degrees(coverage.tilts.min()):.0f} to "
        f"{np.degrees(coverage.tilts.max()):.0f} degrees",
        *(f"  missing    {each}" for each in coverage.missing),
        *_halves_lines(calibration),
        *_board_lines(fitted),
    ]
    lines += _effects_lines(calibration.effects)
    lines += ["", _region_lines(fitted, camera), "", *_worst_lines(calibration)]
    if calibration.remarks:
        lines += ["", *map(str, calibration.remarks)]
    return "\n".join(lines)


def intrinsics_record(
    calibration: CameraCalibration, unseen: Sequence[str], tolerances: BoardTolerances
) -> dict[str, Any]:
    """Return the calibration as a record; ``unseen`` names images without the board."""
    camera, fitted, views = (
        calibration.camera,
        calibration.adjustment,
        calibration.views,
    )
    assert camera.covariance is not None
    uncertain = map_uncertainty(camera, camera.covariance)
    regions, halves = measure_regions(fitted, camera), calibration.halves
    coverage = cover(views, fitted.state.poses)
    next_view = choose_next_view(fitted, views.board)
    return {
        "kind": "intrinsics",
        "board": views.board.name,
        "board_assumed": _tolerances_record(tolerances),
        **_camera_record(camera),
        "rms_px": fitted.rms,
        "noise_px": fitted.sigma,
        "held_out_rms_px": calibration.held_out_rms,
        "distortion_choice": choice_record(calibration.choice),
        "effects": _effects_record(calibration.effects),
        "projection_uncertainty": {
            "middle_px": uncertain.center,
            "rms_px": uncertain.typical,
            "worst_px": uncertain.worst,
            "pixels": uncertain.pixels,
            "standard_uncertainty_px": uncertain.sigmas,
        },
        "residuals_by_region": {
            "points": regions.n_points,
            "rms_px": regions.rms,
            "mean_px": regions.means,
        },
        "halves": halves
        and {
            "difference_px": halves.difference,
            "expanded_uncertainty_px": halves.expanded_uncertainty,
            "in_image_px": halves.in_image,
            "detectable_zoom": halves.detectable_zoom,
        },
        "board_found": _board_record(fitted),
        "coverage": {
            "points": coverage.cells,
            "share": coverage.share,
            "tilted_right_down_left_up": coverage.tilted,
            "missing": coverage.missing,
        },
        "next_view": {"outline_px": next_view.outline, "gain": next_view.gain},
        "views": [
            {
                "name": name,
                "rms_px": fitted.view_rms[v, 0],
                "held_out_rms_px": calibration.held_out[v],
                "tilt_deg": float(np.degrees(coverage.tilts[v])),
                "size_px": coverage.sizes[v],
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
        f"{'Views':<{TITLE}}{calibration.n_pairs} of both cameras, "
        f"{calibration.views.n_views} used of {observed.views.n_views}",
        f"{'Residuals':<{TITLE}}{fitted.rms:.4f} px rms",
    ]
    if calibration.left_out:
        lines.append(
            f"  left out   {', '.join(calibration.left_out)}: the cameras do not agree"
        )
    lines += _effects_lines(calibration.effects)
    for name, camera in zip(rig.names, rig.cameras, strict=True):
        assert camera.covariance is not None
        of = COVERAGE_FACTOR * np.sqrt(np.diag(camera.covariance))
        lines.append(
            f"{name[: TITLE - 1]:<{TITLE}}fx {camera.fx:.2f} \u00b1 {of[0]:.2f}, fy "
            f"{camera.fy:.2f} \u00b1 {of[1]:.2f}, cx {camera.cx:.2f} \u00b1 "
            f"{of[2]:.2f}, cy {camera.cy:.2f} \u00b1 {of[3]:.2f} px"
        )
    lines += _board_lines(fitted)
    if calibration.remarks:
        lines += ["", *map(str, calibration.remarks)]
    return "\n".join(lines)


def pair_record(
    calibration: PairCalibration, observed: ObservedBoard, tolerances: BoardTolerances
) -> dict[str, Any]:
    """Return the calibration of two cameras as a record."""
    rig, fitted, lag = calibration.rig, calibration.adjustment, calibration.lag
    return {
        "kind": "extrinsics",
        "board": calibration.views.board.name,
        "board_assumed": _tolerances_record(tolerances),
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
        "effects": _effects_record(calibration.effects),
        "views_of_both": calibration.n_pairs,
        "board_found": _board_record(fitted),
        "lag": (
            None
            if lag is None
            else {
                "in_views": lag.views,
                "standard_uncertainty": lag.sigma,
                "ms": lag.lag_ms,
                "px_per_ms_at_100_mm_per_s": lag.px_per_ms,
                "significant": lag.is_significant,
            }
        ),
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


def _halves_lines(calibration: CameraCalibration) -> list[str]:
    halves = calibration.halves
    if halves is None:
        return []
    differences = ", ".join(
        f"{name} {value:+.2f} \u00b1 {u:.2f}"
        for name, value, u in zip(
            PINHOLE,
            halves.difference.tolist(),
            halves.expanded_uncertainty.tolist(),
            strict=False,
        )
    )
    return [
        f"{'Halves':<{TITLE}}{differences} px; {halves.in_image:.3f} px in the image",
        f"{'Zoom':<{TITLE}}a change of {halves.detectable_zoom:.2%} after half of the "
        "views would be found",
    ]


def _board_lines(fitted: BoardFit) -> list[str]:
    stretch, shear, *bends = fitted.state.shape.tolist()
    return [
        f"{'Board':<{TITLE}}stretched by {1e6 * stretch:+.0f} ppm, sheared by "
        f"{1e6 * shear:+.0f} ppm, bent by "
        + " ".join(f"{bend:+.3f}" for bend in bends)
        + " mm"
    ]


def _region_lines(fitted: BoardFit, camera: Camera) -> str:
    regions = measure_regions(fitted, camera)
    lines = ["Residuals by region of the image: px rms (mean u, mean v)"]
    for rms, mean, n_points in zip(
        regions.rms, regions.means, regions.n_points, strict=True
    ):
        lines.append(
            "".join(
                f"  {r:.3f} ({u:+.3f} {v:+.3f})" if n else f"  {'-':^22}"
                for r, (u, v), n in zip(rms, mean, n_points, strict=True)
            )
        )
    return "\n".join(lines)


def _worst_lines(calibration: CameraCalibration) -> list[str]:
    rms = calibration.adjustment.view_rms[:, 0]
    return [
        "Worst views, px rms (by the others)",
        *(
            f"  {calibration.views.names[v]:<28}{rms[v]:8.4f} "
            f"({calibration.held_out[v]:.4f})"
            for v in calibration.worst_first[:N_WORST]
        ),
    ]


def _effects_lines(effects: MixedFit) -> list[str]:
    found, is_pair = effects.components, len(effects.fields) > 1
    lines = [
        f"{'Effects':<{TITLE}}noise {found.noise:.4f} px, smooth error of a view "
        f"{found.view:.4f} px, points of the board {found.in_plane:.4f} mm in plane "
        f"and {found.out_of_plane:.4f} mm out of plane, its rows and columns "
        f"{found.lines:.4f} mm"
        + (f", motion between the exposures {found.between:.4f} px" if is_pair else "")
    ]
    lines += [
        f"{'Lens field':<{TITLE}}amplitude {field.amplitude:.4f} px, correlation "
        f"length {field.length:.0f} px"
        for field in effects.fields
        if field is not None
    ]
    return lines


def _effects_record(effects: MixedFit) -> dict[str, Any]:
    found = effects.components
    return {
        "noise_px": found.noise,
        "view_px": found.view,
        "between_exposures_px": found.between if len(effects.fields) > 1 else None,
        "board_in_plane_mm": found.in_plane,
        "board_out_of_plane_mm": found.out_of_plane,
        "board_lines_mm": found.lines,
        "lens_fields": [
            field and {"amplitude_px": field.amplitude, "length_px": field.length}
            for field in effects.fields
        ],
        "lens_field_log_likelihood_gain": 0.5 * effects.field_gain,
        "clustering_by_view": effects.clustering,
    }


def _camera_record(camera: Camera) -> dict[str, Any]:
    assert camera.covariance is not None
    names = (*PINHOLE, *camera.distortion_names)
    return {
        "image_size": camera.image_size,
        "lens_model": camera.lens.value,
        "intrinsics": dict(zip(names, camera.intrinsics.tolist(), strict=True)),
        "expanded_uncertainty": dict(
            zip(
                names,
                (COVERAGE_FACTOR * np.sqrt(np.diag(camera.covariance))).tolist(),
                strict=False,
            )
        ),
        "covariance": camera.covariance,
    }


def _tolerances_record(tolerances: BoardTolerances) -> dict[str, float]:
    return {
        "flatness_mm": tolerances.flatness,
        "squareness": tolerances.squareness,
        "scale": tolerances.scale,
    }


def _board_record(fitted: BoardFit) -> dict[str, dict[str, float]]:
    sigmas = np.sqrt(np.diag(fitted.covariance)[fitted.of_shape])
    return {
        name: {"value": value, "standard_uncertainty": sigma}
        for name, value, sigma in zip(
            SHAPE_NAMES, fitted.state.shape.tolist(), sigmas.tolist(), strict=True
        )
    }
