"""The options of ``lightpen calibrate``."""

import argparse
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path

from lightpen.commands.arguments import (
    add_bits,
    add_cameras_and_pen,
    add_json,
    add_pen_options,
    finite,
    number_from,
)
from lightpen.model.limits import USUAL, Assumptions, with_focal_length
from lightpen.model.names import METHODS

SHARE = "SHARE"  # unit of a relative number
# What `Assumptions` describes as options.
STATED = tuple(each for each in fields(Assumptions) if each.metadata)


def add_calibrate_options(parser: argparse.ArgumentParser) -> None:
    """Add the images of a swing and their options."""
    parser.add_argument(
        "images",
        nargs="*",
        metavar="IMAGES",
        help="image folder, file name pattern, video, or record of a swing",
    )
    parser.add_argument(
        "--centers",
        type=Path,
        nargs="+",
        action="extend",
        metavar="FILE.csv",
        help="LED centres (frame,led,x_px,y_px) instead of IMAGES",
    )
    parser.add_argument(
        "--from-record",
        type=Path,
        metavar="FILE.json",
        help="calibration record (from --json) or accepted result instead of IMAGES; "
        "recomputes the tip from it",
    )
    add_cameras_and_pen(
        parser, "give IMAGES (or FILE.csv) once per camera, in the order of this file"
    )
    add_pen_options(parser)
    add_bits(parser)
    parser.add_argument(
        "--fps",
        type=number_from(0.01, 10_000.0, "image rate", "images a second"),
        help="image rate; with it times are stated in ms",
    )
    parser.add_argument(
        "--camera-sigma",
        type=_number(SHARE, 1e-9, 0.1),
        metavar=SHARE,
        help="standard uncertainty of the focal length, for example 0.5%%, if the "
        "intrinsics file states none; other intrinsics are scaled with it",
    )
    for each in STATED:
        described = each.metadata
        parser.add_argument(
            f"--{described['option']}",
            type=_number(described["unit"], *described["range"]),
            metavar=described["unit"],
            help=described["help"],
        )
    parser.add_argument(
        "--temperature-sigma",
        type=number_from(0.001, 50.0, "uncertainty", "K"),
        metavar="K",
        help="standard uncertainty of the temperature (0.5), or without "
        "--temperature the temperature difference from the LED measurement (1.5)",
    )
    parser.add_argument(
        "--method",
        choices=METHODS,
        help="estimator of the reported tip (joint; of a record, its own)",
    )
    number = number_from(1, 10**6, "number", "")
    for name, which in (("from", "first"), ("until", "last")):
        parser.add_argument(
            f"--{name}",
            type=number,
            metavar="N",
            help=f"number of the {which} image to be used, from 1",
        )
    parser.add_argument(
        "--nominal-tip",
        type=finite,
        nargs=3,
        metavar=("X", "Y", "Z"),
        help="nominal tip centre, pen frame, mm",
    )
    add_json(parser)


def _number(unit: str, least: float, most: float) -> Callable[[str], float]:
    """Return a parser of numbers within limits; a share may be given in per cent."""
    inside = number_from(least, most, "value", "" if unit == SHARE else unit)

    def number_of(text: str) -> float:
        if unit == SHARE and text.endswith("%"):
            return inside(f"{finite(text[:-1]) / 100}")
        return inside(text)

    return number_of


def assumptions_of(options: argparse.Namespace) -> Assumptions:
    """Return the default uncertainties."""
    assumed = USUAL
    if options.camera_sigma is not None:
        assumed = with_focal_length(assumed, options.camera_sigma)
    given = {
        each.name: getattr(options, each.metadata["option"].replace("-", "_"))
        for each in STATED
    }
    temperature = "warmth" if options.temperature is None else "temperature"
    given[temperature] = options.temperature_sigma
    return replace(assumed, **{n: x for n, x in given.items() if x is not None})
