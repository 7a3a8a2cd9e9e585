"""``lightpen discover``: tip, pen and camera from one swing and one length."""

import argparse
import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from lightpen.commands.arguments import (
    above_zero,
    add_bits,
    add_camera,
    add_file,
    add_json,
)
from lightpen.commands.console import (
    are_same,
    images_at,
    printing,
    progress,
    shown,
    write_record,
)
from lightpen.errors import UsageError
from lightpen.formats.camera_files import read_camera
from lightpen.formats.files import require_folder_of
from lightpen.formats.observation_files import read_unlabelled_centers
from lightpen.formats.pen_files import write_pen
from lightpen.formats.rig_files import write_camera
from lightpen.model.camera import Camera
from lightpen.model.pen import DISC_DIAMETER, check_leds
from lightpen_extensions.discover.discover import discover
from lightpen_extensions.discover.found import require_lens
from lightpen_extensions.discover.report import discovery_record, discovery_text
from lightpen_extensions.discover.scale import MeasuredLength, Request
from lightpen_extensions.discover.tracks import (
    Report,
    Sightings,
    find_spots,
    sightings_of_centers,
)

LONGEST = "longest"
CALIPER = 0.02  # mm, standard uncertainty of a length unless given
LEAST_SIDE, MOST_SIDE = 32, 65_536  # px, of an image
SEARCHING = 0.6  # of the progress with images


def add_discover(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen discover``."""
    parser.set_defaults(run=_discover)
    parser.add_argument(
        "images",
        nargs="*",
        metavar="IMAGES",
        help="image folder, file name pattern, video or record of a swing, in the "
        "order of time, 10 images a second or more",
    )
    parser.add_argument(
        "--centers",
        type=Path,
        metavar="FILE.csv",
        help="spot centres without LED numbers (frame,x_px,y_px) instead of IMAGES; "
        "needs --image-size",
    )
    parser.add_argument(
        "--image-size", type=_size, metavar="WxH", help="size of the images, 2448x2048"
    )
    add_bits(parser)
    parser.add_argument(
        "--length",
        nargs="+",
        action="append",
        default=[],
        metavar="LENGTH",
        help="known length: 'longest MM' between the two LEDs farthest apart, or "
        "'A B MM' between two LEDs by number (repeatable)",
    )
    parser.add_argument(
        "--length-sigma",
        type=above_zero,
        default=CALIPER,
        metavar="MM",
        help=f"standard uncertainty of each length ({CALIPER})",
    )
    parser.add_argument(
        "--led-diameter",
        type=above_zero,
        default=DISC_DIAMETER,
        metavar="MM",
        help=f"diameter of the LED discs ({DISC_DIAMETER:g})",
    )
    add_camera(parser, "intrinsics file, if there is one")
    for name, what in (("pen", "LED file"), ("camera", "intrinsics file")):
        suffix = "json" if name == "pen" else "yaml"
        add_file(parser, f"--out-{name}", f"FILE.{suffix}", f"write the {what}")
    add_json(parser)


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{1,6})[xX](\d{1,6})", text)
    if not found:
        raise argparse.ArgumentTypeError(f"{text} is no size such as 2448x2048.")
    width, height = int(found[1]), int(found[2])
    if not all(LEAST_SIDE <= side <= MOST_SIDE for side in (width, height)):
        raise argparse.ArgumentTypeError(
            f"{text} is no size from {LEAST_SIDE} to {MOST_SIDE} px."
        )
    return width, height


@printing
def _discover(options: argparse.Namespace) -> None:
    lengths = tuple(_length(words, options.length_sigma) for words in options.length)
    if not lengths and options.out_pen is not None:
        raise UsageError("discover.no-length")
    camera = None if options.camera is None else read_camera(options.camera)
    _check_outputs(options)
    if bool(options.images) == bool(options.centers):
        raise UsageError("cli.discover-images-or-centers")
    request = Request(lengths, options.led_diameter, camera)
    with progress("Finding pen and camera") as report:
        share = 0.0 if options.centers else SEARCHING
        sightings = _sightings(options, camera, partial(_report_part, report, 0, share))
        rest = partial(_report_part, report, share, 1 - share)
        found = discover(sightings, request, rest)
    if options.out_camera is not None:
        require_lens(found.camera)
    if options.out_pen is not None:
        check_leds(found.pen.leds, found.pen.diameter)
        write_pen(found.pen, options.out_pen)
    if options.out_camera is not None:
        write_camera(found.camera, options.out_camera)
    if options.json is not None:
        write_record(options.json, discovery_record(found))
    print(shown(discovery_text(found)))


def _report_part(report: Report, start: float, share: float, fraction: float) -> None:
    report(start + share * fraction)


def _length(words: Sequence[str], sigma: float) -> MeasuredLength:
    try:
        if len(words) == 2 and words[0].strip().casefold() == LONGEST:
            return MeasuredLength(None, above_zero(words[1]), sigma)
        if len(words) == 3:
            first, second = (int(word) for word in words[:2])
            return MeasuredLength((first, second), above_zero(words[2]), sigma)
    except (ValueError, argparse.ArgumentTypeError):
        pass
    raise UsageError("cli.discover-length-words", words=" ".join(words))


def _check_outputs(options: argparse.Namespace) -> None:
    """Refuse outputs in no folder, over an input or each other, or of other suffix."""
    inputs = (options.centers, options.camera)
    seen: list[Path] = []
    outputs = (options.out_pen, options.out_camera, options.json)
    for path in outputs:
        if path is None:
            continue
        require_folder_of(path)
        if any(are_same(path, other) for other in (*inputs, *seen) if other):
            raise UsageError("cli.discover-output-twice", file=path)
        seen.append(path)
    for path, suffixes in (
        (options.out_pen, (".json",)),
        (options.out_camera, (".yaml", ".yml")),
    ):
        if path is not None and path.suffix.lower() not in suffixes:
            raise UsageError(
                "cli.discover-suffix", file=path, suffix=" or ".join(suffixes)
            )


def _sightings(
    options: argparse.Namespace, camera: Camera | None, report: Report
) -> Sightings:
    """Read a swing, which must be of the images of the camera file."""
    if not options.centers:
        sightings = find_spots(images_at(*options.images).of_bits(options.bits), report)
    else:
        size = options.image_size or (None if camera is None else camera.image_size)
        if size is None:
            raise UsageError("cli.discover-no-size")
        given = read_unlabelled_centers(options.centers)
        names = tuple(f"frame {frame}" for frame in given.frames)
        sightings = sightings_of_centers(names, given.centers, size)
    if camera is not None and camera.image_size != sightings.size:
        raise UsageError(
            "cli.camera-of-other-size",
            file=options.camera,
            width=camera.width,
            height=camera.height,
            seen_width=sightings.size[0],
            seen_height=sightings.size[1],
        )
    return sightings
