"""A discovery as its record and as text."""

from typing import Any

import numpy as np

from lightpen.formats.own_json import plain, record_heading
from lightpen.local_time import local_now
from lightpen.messages import Message, message
from lightpen.model.coverage import COVERAGE_FACTOR
from lightpen.model.limits import USUAL
from lightpen_extensions.boards.distortion import choice_record
from lightpen_extensions.boards.report import PINHOLE
from lightpen_extensions.discover.found import Discovery

TO_MICROMETRES = 1000.0
OTHER_CAMERA = 3.0  # standard deviations, of the focal length from the file's


def discovery_record(discovery: Discovery) -> dict[str, Any]:
    """Return the record of a discovery.

    Without a known length the unit of all lengths is a hundredth of the largest
    distance between two LEDs, and ``scale`` is "relative".
    """
    calibration, at = discovery.calibration, discovery.parameters
    values = discovery.camera.intrinsics
    names = (*PINHOLE, *discovery.camera.distortion_names)
    n_leds = discovery.pen.n_leds
    record = {
        **record_heading(local_now()),
        "kind": "discovery",
        "scale": "relative" if discovery.is_relative else "measured",
        "lengths": [
            {
                "leds": [each.first + 1, each.second + 1],
                "length_mm": each.length,
                "standard_uncertainty_mm": each.sigma,
            }
            for each in discovery.lengths
            if not discovery.is_relative
        ],
        "n_leds": n_leds,
        "leds_mm": discovery.pen.leds,
        "leds_expanded_uncertainty_mm": discovery.led_uncertainty,
        "normals": discovery.pen.normals,
        "tip_pen_mm": discovery.tip_pen,
        "expanded_uncertainty_mm": discovery.expanded_uncertainty,
        "cone_cam_mm": calibration.joint.cone_cam,
        "coverage_factor": COVERAGE_FACTOR,
        "disc_diameter_mm": discovery.pen.diameter,
        "image_size": discovery.camera.image_size,
        "intrinsics": {
            name: {"value": value, "standard_uncertainty": sigma}
            for name, value, sigma in zip(
                names, values, discovery.intrinsics_sigma, strict=True
            )
        },
        "distortion_choice": (
            None
            if discovery.lens_choice is None
            else choice_record(discovery.lens_choice)
        ),
        "covariance": {
            "parameters": [
                *(f"tip_{axis}" for axis in "xyz"),
                *names,
                "disc_diameter",
                *(f"led_{j + 1}_{axis}" for j in range(n_leds) for axis in "xyz"),
            ],
            "matrix": discovery.covariance,
        },
        "hypotheses": [
            {
                "mirrored": each.mirrored,
                "started_at_focal_length_px": each.started_at,
                "focal_length_px": each.focal_length,
                "misfit_px": each.misfit,
                "is_best": each.is_best,
            }
            for each in discovery.hypotheses
        ],
        "images": {"total": len(calibration.used), "used": int(calibration.used.sum())},
        "sigma_px": calibration.bundle.sigma,
        "fixed_lamps": discovery.n_lamps,
        "largest_contribution": {
            "name": str(calibration.budget.largest_share.name),
            "expanded_uncertainty_mm": calibration.budget.weakest_share(
                calibration.budget.largest_share
            ),
        },
    }
    assert at.number == len(discovery.covariance)
    found: dict[str, Any] = plain(record)
    return found


def discovery_text(discovery: Discovery) -> str:
    """Return the result of a discovery as text, in English."""
    tip, U = discovery.tip_pen, discovery.expanded_uncertainty
    unit, fine, factor = "mm", "µm", TO_MICROMETRES
    if discovery.is_relative:
        unit, fine, factor = "% of the largest LED distance", "%", 1.0
    lines = [
        f"{'':12}{'value':>14}{'U (k = 2)':>12}",
        *(
            f"  tip {axis:<6}{value:14.4f}{u:12.4f} {unit}"
            for axis, value, u in zip("xyz", tip, U, strict=True)
        ),
    ]
    values, sigmas = discovery.camera.intrinsics, discovery.intrinsics_sigma
    names = (*PINHOLE, *discovery.camera.distortion_names)
    lines += [
        f"  {name:<10}{value:14.6g}{COVERAGE_FACTOR * sigma:12.2g}"
        for name, value, sigma in zip(names, values, sigmas, strict=True)
    ]
    lines += [
        f"  LED {j:<6}{x:10.4f}{y:11.4f}{z:11.4f}   U {u.max() * factor:#.3g} {fine}"
        for j, ((x, y, z), u) in enumerate(
            zip(discovery.pen.leds, discovery.led_uncertainty, strict=True), 1
        )
    ]
    calibration = discovery.calibration
    lines.append(
        f"{int(calibration.used.sum())} of {len(calibration.used)} images, noise "
        f"{calibration.bundle.sigma:.3f} px."
    )
    lines += [str(remark) for remark in remarks_of(discovery)]
    return "\n".join(lines)


def remarks_of(discovery: Discovery) -> tuple[Message, ...]:
    """Return the limits of the uncertainty, and notes on the result."""
    remarks = _remarks_on_camera(discovery)
    if discovery.is_relative:
        return (*remarks, message("discover.relative"))
    at = discovery.parameters
    tip = discovery.tip_pen - discovery.pen.leds.mean(axis=0)
    far = int(np.argmax(np.abs(tip)))
    U = float(discovery.expanded_uncertainty[far])
    known = min(discovery.lengths, key=lambda each: each.sigma / each.length)
    by_length = COVERAGE_FACTOR * known.sigma / known.length * abs(float(tip[far]))
    if by_length > 0.5 * U and at.number:
        better = known.sigma / 4
        rest = max(U**2 - by_length**2 * (1 - 1 / 16), 0.0) ** 0.5
        remarks.append(
            message(
                "discover.length-limits", sigma=better, now=U * 1e3, then=rest * 1e3
            )
        )
    return tuple(remarks)


def _remarks_on_camera(discovery: Discovery) -> list[Message]:
    """Return the statement on the lens found, or on the file of the camera."""
    choice = discovery.lens_choice
    if choice is not None:
        share = 100 * discovery.camera.folded_share
        return [message("camera-validity.fold", share=share)] if share else []
    stated = discovery.calibration.bundle.unknowns.start.rig.cameras[0]
    sigma = USUAL.focal_length * stated.fx
    if stated.covariance is not None:
        sigma = float(np.sqrt(stated.covariance[0, 0]))
    found = discovery.camera.fx
    if abs(found - stated.fx) <= OTHER_CAMERA * np.hypot(
        sigma, float(discovery.intrinsics_sigma[0])
    ):
        return []
    off = 100 * (stated.fx / found - 1)
    return [message("discover.camera-off", stated=stated.fx, found=found, off=off)]
