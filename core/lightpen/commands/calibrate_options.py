"""What can be said to ``lightpen calibrate``, and what it means."""

import argparse
from dataclasses import replace
from pathlib import Path

from lightpen.commands.arguments import add_pen_options, finite, number_from
from lightpen.errors import UsageError
from lightpen.estimation.methods import METHODS
from lightpen.estimation.priors import Separation
from lightpen.model.assumptions import (
    COLDEST,
    USUAL,
    WARMEST,
    Assumptions,
    with_focal_length,
)
from lightpen.sentences import sentence

SMALLEST_SHARE, LARGEST_SHARE = 1e-9, 0.1


def add_calibrate_options(parser: argparse.ArgumentParser) -> None:
    """Add the images of a swing, and all that can be said of them."""
    parser.add_argument(
        "images",
        nargs="*",
        metavar="IMAGES",
        help="a folder, a pattern, a video, or the record of a swing",
    )
    parser.add_argument(
        "--centers",
        type=Path,
        nargs="+",
        action="extend",
        metavar="FILE.csv",
        help="LED centres (frame,led,x_px,y_px) in place of IMAGES",
    )
    parser.add_argument(
        "--from-record",
        type=Path,
        metavar="FILE.json",
        help="what --json wrote, or an accepted result, in place of IMAGES: the same "
        "tip from it alone",
    )
    parser.add_argument("--camera", type=Path, metavar="FILE")
    parser.add_argument(
        "--rig",
        type=Path,
        metavar="FILE",
        help="several cameras and where they stand, in place of --camera; IMAGES (or "
        "FILE.csv) is then one of each camera, in the order of this file",
    )
    parser.add_argument("--pen", type=Path, metavar="FILE")
    add_pen_options(parser)
    parser.add_argument(
        "--camera-sigma",
        type=_share,
        metavar="SHARE",
        help="standard uncertainty of the focal length, such as 0.5%%, where the "
        "camera file states none; that of the rest of the camera goes with it",
    )
    parser.add_argument(
        "--scale-sigma",
        type=_share,
        metavar="SHARE",
        help="standard uncertainty of the pen's scale, such as 20e-6, where the pen "
        "file states none",
    )
    parser.add_argument(
        "--temperature",
        type=number_from(COLDEST, WARMEST, "temperature", "degrees Celsius"),
        metavar="CELSIUS",
        help="of the pen during the swing, which makes it larger than its file says",
    )
    parser.add_argument(
        "--temperature-sigma",
        type=number_from(0.001, 50.0, "uncertainty", "K"),
        metavar="K",
        help="its standard uncertainty (0.5), or without --temperature how much warmer "
        "than at its measurement the pen may be (1.5)",
    )
    parser.add_argument(
        "--form-error",
        type=number_from(1e-7, 1.0, "uncertainty", "mm"),
        metavar="MM",
        help="standard uncertainty of where the ball sits, as ball and cone are not "
        "quite round (0.0002)",
    )
    parser.add_argument(
        "--center-bias",
        type=number_from(1e-6, 10.0, "uncertainty", "px"),
        metavar="PX",
        help="standard uncertainty of LED centres that does not average out (0.003)",
    )
    parser.add_argument(
        "--second-cone",
        metavar="IMAGES",
        help="images of a swing in a second cone, in the form of those of the first; "
        "the camera must not have moved",
    )
    parser.add_argument(
        "--distance",
        type=number_from(0.1, 10_000.0, "distance", "mm"),
        metavar="MM",
        help="of the two cones",
    )
    parser.add_argument(
        "--distance-sigma",
        type=number_from(1e-6, 100.0, "uncertainty", "mm"),
        metavar="MM",
        help="its standard uncertainty",
    )
    parser.add_argument("--method", choices=METHODS, default="joint")
    parser.add_argument(
        "--nominal-tip", type=finite, nargs=3, metavar=("X", "Y", "Z"), help="mm"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the record")


def _share(text: str) -> float:
    """Return a part of one, which may be given in per cent."""
    number = finite(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    if not SMALLEST_SHARE <= number <= LARGEST_SHARE:
        raise argparse.ArgumentTypeError(
            f"{text} is not a share from {SMALLEST_SHARE:g} to {LARGEST_SHARE:.0%}."
        )
    return number


def assumptions_of(options: argparse.Namespace) -> Assumptions:
    """Return what is assumed where files are silent."""
    assumed = USUAL
    if options.camera_sigma is not None:
        assumed = with_focal_length(assumed, options.camera_sigma)
    if options.scale_sigma is not None:
        assumed = replace(assumed, scale=options.scale_sigma)
    if options.temperature is not None:
        assumed = replace(assumed, temperature_c=options.temperature)
    if options.temperature_sigma is not None:
        which = "warmth" if options.temperature is None else "temperature"
        assumed = replace(assumed, **{which: options.temperature_sigma})
    if options.form_error is not None:
        assumed = replace(assumed, form_error=options.form_error)
    if options.center_bias is not None:
        assumed = replace(assumed, center_bias=options.center_bias)
    return assumed


def separation_of(options: argparse.Namespace) -> Separation | None:
    """Return the distance of two cones, if there are two."""
    given = (options.second_cone, options.distance, options.distance_sigma)
    if all(each is None for each in given):
        return None
    if any(each is None for each in given):
        raise UsageError(
            sentence(
                "cli.second-cone",
                "A second cone needs three options: --second-cone IMAGES, --distance "
                "MM and --distance-sigma MM. Give all or none.",
            )
        )
    return Separation(options.distance, options.distance_sigma)
