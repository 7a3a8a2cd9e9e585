"""Types of command-line arguments, and options that several commands share."""

import argparse
import getpass
import math
import os
from collections.abc import Callable
from pathlib import Path

from lightpen.commands.console import note
from lightpen.errors import UsageError
from lightpen.formats.pen_tables import UNITS
from lightpen.formats.rig_files import write_window
from lightpen.messages import message
from lightpen.record.library.supervision import Signature

# Of any number, whatever it counts: beyond, its square may be none.
SMALLEST, LARGEST = 1e-9, 1e6


def whole_number(text: str) -> int:
    """Return a whole number of 0 or more."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text} is not a whole number of 0 or more.")
    return int(text)


def finite(text: str) -> float:
    """Return a number."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise argparse.ArgumentTypeError(f"{text} is not a number.")
    if abs(number) > LARGEST:
        raise argparse.ArgumentTypeError(f"{text} is too large a number.")
    return number


def above_zero(text: str) -> float:
    """Return a number above 0."""
    number = finite(text)
    if number <= 0:
        raise argparse.ArgumentTypeError(f"{text} is not a number above 0.")
    if number < SMALLEST:
        raise argparse.ArgumentTypeError(f"{text} is too small a number.")
    return number


def not_negative(text: str) -> float:
    """Return a number of 0 or more."""
    number = finite(text)
    if number < 0:
        raise argparse.ArgumentTypeError(f"{text} is not a number of 0 or more.")
    return number


def number_from(
    lowest: float, highest: float, what: str, unit: str
) -> Callable[[str], float]:
    """Return a parser of numbers within limits, both included."""

    def number_of(text: str) -> float:
        number = finite(text)
        if not lowest <= number <= highest:
            raise argparse.ArgumentTypeError(
                f"{text} {unit} is no {what} from {lowest:g} to {highest:g} {unit}."
            )
        return number

    return number_of


def add_file(
    parser: argparse.ArgumentParser, name: str, metavar: str, meaning: str
) -> None:
    """Add an option or argument that is a path."""
    parser.add_argument(name, type=Path, metavar=metavar, help=meaning)


def add_bits(parser: argparse.ArgumentParser) -> None:
    """Add ``--bits``; see `ImageSource.of_bits`."""
    parser.add_argument(
        "--bits",
        type=int,
        choices=range(8, 17),
        metavar="BITS",
        help="bits of a pixel, 8 to 16, which tell clipped light (default: stated by "
        "the image file, or the highest level where pixels pile up)",
    )


def add_data(parser: argparse.ArgumentParser) -> None:
    """Add ``--data``, a data folder; `data_of` reads it."""
    add_file(parser, "--data", "FOLDER", "data folder (default: that of the program)")


def data_of(options: argparse.Namespace) -> Path:
    """Return the chosen data folder, by default that of the program."""
    folder: Path = options.data_folder() if options.data is None else options.data
    return folder


def add_camera(parser: argparse.ArgumentParser, meaning: str) -> None:
    """Add ``--camera``, and how the images differ from those that it is for."""
    parser.add_argument("--camera", type=Path, metavar="FILE", help=meaning)
    parser.add_argument(
        "--binning",
        type=int,
        choices=range(1, 9),
        default=1,
        metavar="N",
        help="N x N pixels of the camera file are one of the images",
    )
    parser.add_argument(
        "--roi",
        type=whole_number,
        nargs=4,
        metavar=("X", "Y", "WIDTH", "HEIGHT"),
        help="the images show this region of the camera file's, px before binning",
    )


def use_window(options: argparse.Namespace) -> None:
    """Use the camera of binned or cut images, written beside the file of the whole."""
    if not hasattr(options, "roi") or (options.roi is None and options.binning == 1):
        return
    if options.camera is None:
        raise UsageError("cli.window-needs-camera")
    roi = None if options.roi is None else tuple(options.roi)
    options.camera = write_window(options.camera, options.binning, roi)
    note(message("cli.window-written", file=options.camera))


def add_cameras_and_pen(parser: argparse.ArgumentParser, rig_images: str) -> None:
    """Add ``--camera`` or ``--rig``, and ``--pen``."""
    add_camera(parser, "intrinsics file of the camera")
    parser.add_argument(
        "--rig",
        type=Path,
        metavar="FILE",
        help="rig file with the extrinsics of several cameras, instead of --camera; "
        f"{rig_images}",
    )
    parser.add_argument("--pen", type=Path, metavar="FILE", help="LED file of the pen")


def add_pen_options(parser: argparse.ArgumentParser) -> None:
    """Add options for what a pen file may omit."""
    parser.add_argument(
        "--units",
        choices=sorted(UNITS),
        help="unit of an LED file that does not state one",
    )
    parser.add_argument(
        "--led-diameter",
        type=finite,
        metavar="MM",
        help="diameter of the LED discs if the LED file does not state it (10)",
    )


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add the option for the file of the record."""
    add_file(parser, "--json", "FILE", "write the record as JSON")


PASSWORD = "LIGHTPEN_PASSWORD"  # names the variable with the password of a supervisor


def supervisor_signature(name: str | None) -> Signature | None:
    """Return the signature of a supervisor whose password is requested, or variable."""
    if name is None:
        return None
    password = os.environ.get(PASSWORD)
    if password is None:
        password = getpass.getpass("Supervisor's password: ")
    return Signature(name, password)
