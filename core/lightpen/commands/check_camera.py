"""``lightpen check-camera``: test of a camera file with one swing."""

import argparse

import numpy as np

from lightpen.commands.arguments import (
    add_bits,
    add_camera_and_pen,
    add_json,
    number_from,
)
from lightpen.commands.console import (
    images_at,
    printing,
    progress,
    require_other_file,
    shown,
    write_record,
)
from lightpen.detection.observations import observe_images
from lightpen.errors import CalibrationError
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.estimation.reports.report import adjusted_intrinsics
from lightpen.formats.camera_files import COLDEST, WARMEST, read_camera
from lightpen.formats.own_json import plain
from lightpen.formats.pen_files import read_pen
from lightpen.local_time import local_now
from lightpen.model.camera import unmodelled_effects_of
from lightpen.model.coverage import COVERAGE_FACTOR


def add_check_camera(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen check-camera``."""
    parser.set_defaults(run=_check_camera)
    parser.add_argument(
        "images", nargs="+", metavar="IMAGES", help="images of one swing of the pen"
    )
    add_camera_and_pen(parser)
    add_bits(parser)
    parser.add_argument(
        "--temperature",
        type=number_from(COLDEST, WARMEST, "temperature", "degrees Celsius"),
        metavar="CELSIUS",
        help="temperature at the station",
    )
    add_json(parser)


@printing
def _check_camera(options: argparse.Namespace) -> None:
    source = images_at(*options.images).of_bits(options.bits)
    require_other_file(options.json, options.camera, options.pen, *source.files)
    camera = read_camera(options.camera)
    pen = read_pen(options.pen, options.units, options.led_diameter, None)
    with progress("Finding LEDs") as report:
        observations = observe_images(source, camera, pen, report)
    calibration = calibrate(camera, pen, observations)
    doubts = unmodelled_effects_of(camera, local_now().date(), options.temperature)
    denied = [each for each in calibration.contradictions if not each.of_pen]
    print(shown(_text(calibration, camera.intrinsics.tolist())))
    for doubt in doubts:
        print(shown(str(doubt)))
    if options.json is not None:
        record = {
            "kind": "camera check",
            "agrees": not denied,
            "intrinsics": adjusted_intrinsics(calibration, 0),
            "contradictions": [each.message for each in denied],
            "doubts": doubts,
        }
        write_record(options.json, plain(record))
    if denied:
        for each in denied[1:]:
            print(shown(str(each.message)))
        raise CalibrationError(denied[0].message)
    print("\nFile and camera agree.")


def _text(calibration: Calibration, stated: list[float]) -> str:
    fitted = calibration.bundle
    place = fitted.layout.cameras[0]
    camera = fitted.state.rig.cameras[0]
    u = COVERAGE_FACTOR * np.sqrt(np.diag(fitted.covariance)[place])
    before = COVERAGE_FACTOR * np.sqrt(
        np.diag(calibration.stated.cameras[0].covariance)
    )
    lines = [
        f"{'':8}{'file':>14}{'U (k = 2)':>12}{'with the swing':>16}{'U (k = 2)':>12}"
    ]
    lines += [
        f"  {name:<6}{of_file:14.6g}{known:12.2g}{value:16.6g}{now:12.2g}"
        for name, of_file, known, value, now in zip(
            ("fx", "fy", "cx", "cy", *camera.distortion_names),
            stated,
            before.tolist(),
            camera.intrinsics.tolist(),
            u.tolist(),
            strict=False,
        )
    ]
    return "\n".join(lines)
