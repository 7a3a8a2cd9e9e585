"""The window, or a command: ``lightpen calibrate | simulate | pivot | pen | ...``.

Exit status: 0 done, 1 the data cannot give a tip, 2 wrong usage or unreadable input.
"""

import argparse
import os
import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import version
from io import TextIOWrapper
from pathlib import Path
from typing import NoReturn, Protocol

import cv2
import numpy as np

from lightpen.arrays import FloatArray
from lightpen.commands.arguments import add_pen_options, finite, whole_number
from lightpen.commands.console import (
    BAD_INPUT,
    NO_TIP,
    Command,
    are_same,
    lacking,
    printing,
    progress,
    require_other_file,
    shown,
    write_record,
)
from lightpen.commands.pen_health import add_improve_pen
from lightpen.commands.recalculate import add_recalculate
from lightpen.commands.repeatability import add_repeatability
from lightpen.commands.verify import add_verify
from lightpen.detection.moments import observe_rig_centers, observe_rig_images
from lightpen.detection.observations import (
    Observations,
    observe_centers,
    observe_images,
)
from lightpen.errors import CalibrationError, LightpenError, UsageError
from lightpen.estimation.calibrate import Calibration, calibrate, calibrate_rig
from lightpen.estimation.pivot_calibration import calibrate_pivot
from lightpen.estimation.priors import Separation
from lightpen.estimation.report import (
    METHODS,
    calibration_record,
    pivot_record,
)
from lightpen.estimation.second_cone import SecondSwing
from lightpen.estimation.summary import calibration_text, pivot_text
from lightpen.estimation.verdict import judge
from lightpen.formats.camera_files import read_camera
from lightpen.formats.hashes import Inputs, RigInputs, all_hashed, hashed
from lightpen.formats.images import find_images
from lightpen.formats.observation_files import read_centers, read_poses
from lightpen.formats.pairing import pair_images
from lightpen.formats.pen_files import read_pen, read_raw_pen, write_pen
from lightpen.formats.rig_files import read_rig
from lightpen.formats.simulated_files import is_simulated
from lightpen.model.assumptions import USUAL, Assumptions, with_focal_length
from lightpen.model.camera import Camera
from lightpen.model.limits import SwingLimits
from lightpen.model.origin import Origin
from lightpen.model.pen import DISC_DIAMETER, Pen
from lightpen.record.reading import (
    is_record,
    missing_parts,
    open_record,
    record_files,
    recorded_limits,
    unacknowledged_images,
)
from lightpen.record.solving import record_inputs, solve_record
from lightpen.sentences import Sentence, sentence

# A word that is none of these may be a file to open.
COMMANDS = (
    *("open", "calibrate", "simulate", "pivot", "pen", "verify", "repeatability"),
    *("recalculate", "improve-pen"),
)
LARGEST_SHARE = 0.1
COLDEST, WARMEST = -50.0, 100.0  # degrees C, of a pen
MIN_LED_DIAMETER, MAX_LED_DIAMETER = 2.0, 12.0  # mm, of simulated LEDs
MAX_RIG = 4  # simulated cameras
MIN_BASELINE, MAX_BASELINE = 50.0, 1500.0  # mm, between simulated cameras
MIN_BLUR, MAX_BLUR = 0.3, 8.0  # px, of simulated optics
MAX_NAMED = 3  # images; of more the first is named
MAX_RENDERED = 30_000  # images
NEGATIVE_NUMBER = re.compile(r"-\.?[0-9]")
RIG_NEEDED = sentence(
    "cli.rig-needed", "Those of several cameras need --rig FILE in place of --camera."
)
# What to type about what the core says, by its codes.
ADVICE = {
    "pen-file.no-units": "Name them so: --units mm.",
    "pen-file.contradicting-units": "It is given by --units.",
    "pen.too-large": "Name them so: --units um.",
    "pen.too-small": "Name them so: --units m.",
    "pen.not-in-frame": "That is done by: lightpen pen RAW.csv OUT.csv.",
    "pen.neither-framed-nor-handed": "That is done by: lightpen pen RAW.csv OUT.csv.",
    "images.ambiguous": "They are given by --centers FILE.csv.",
}


class Desktop(Protocol):
    """What the command line starts beside its commands; each returns an exit status."""

    def show_window(self, swing: Path | None) -> int:
        """Open the window; with what leads to a recorded swing, show that."""

    def play_demo(self) -> int:
        """Play a calibration with a simulated operator."""

    def test_itself(self, report: Path) -> int:
        """Try what the program needs, and write a report."""

    def install_entry(self) -> int:
        """Put the program into the menu of the desktop."""

    def remove_entry(self) -> int:
        """Take it out of the menu again."""


def main(arguments: Sequence[str] | None = None, desktop: Desktop | None = None) -> int:
    """Run the command line and return the exit status.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the process unless given.
    desktop : Desktop, optional
        Without it a command must be given.
    """
    given = sys.argv[1:] if arguments is None else arguments
    parser = _parser(desktop)
    if desktop is not None and _is_file_to_open(given):
        given = ["open", *given]
    # argparse takes "-90." and "-9e1" for options, but not with a blank before them.
    options = parser.parse_args(
        [f" {text}" if NEGATIVE_NUMBER.match(text) else text for text in given]
    )
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # a console may lack letters of a name
            stream.reconfigure(errors="backslashreplace")
    cv2.setNumThreads(1)  # images are spread over threads, one each
    run: Command = options.run
    try:
        status = run(options)
    except CalibrationError as error:
        _complain(error.sentence)
        return NO_TIP
    except LightpenError as error:
        _complain(error.sentence)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("lightpen: stopped.", file=sys.stderr)
        return BAD_INPUT
    return status


def _complain(trouble: Sentence) -> None:
    """Print what is wrong, and what to type about it."""
    advice = [ADVICE[each.code] for each in trouble.parts() if each.code in ADVICE]
    print(shown(" ".join(map(str, ["lightpen:", trouble, *advice]))), file=sys.stderr)


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        super().error(shown(message))


def _parser(desktop: Desktop | None) -> argparse.ArgumentParser:
    has_window = desktop is not None
    parser = _Parser(
        prog="lightpen",
        description="Calibrate the probe tip of a light pen."
        + (" Without a command, a window opens and leads through it." * has_window),
        epilog="Exit status: 0 done, 1 the data cannot give a tip, 2 wrong usage or "
        "unreadable input.",
    )
    parser.add_argument("--version", action="version", version=version("lightpen"))
    commands = parser.add_subparsers(required=desktop is None, metavar="COMMAND")
    if desktop is not None:
        _add_desktop(parser, desktop)
        _add_open(commands.add_parser("open", help="show a recorded swing"), desktop)
    _add_calibrate(commands.add_parser("calibrate", help="find the tip from a swing"))
    _add_simulate(commands.add_parser("simulate", help="write a simulated swing"))
    _add_pivot(commands.add_parser("pivot", help="find the tip from given poses"))
    _add_pen(commands.add_parser("pen", help="put measured LEDs into the pen frame"))
    add_verify(commands.add_parser("verify", help="prove a tip by touching"))
    add_repeatability(
        commands.add_parser("repeatability", help="compare calibrations of one tip")
    )
    add_recalculate(
        commands.add_parser(
            "recalculate", help="solve calibrations again, and check U by Monte Carlo"
        )
    )
    add_improve_pen(
        commands.add_parser("improve-pen", help="a better LED file by several swings")
    )
    return parser


def _is_file_to_open(given: Sequence[str]) -> bool:
    """Return whether there is nothing but a file, as icons hand it over."""
    return len(given) == 1 and given[0] not in COMMANDS and Path(given[0]).exists()


def _add_desktop(parser: argparse.ArgumentParser, desktop: Desktop) -> None:
    parser.set_defaults(run=partial(_start_desktop, desktop))
    starts = parser.add_mutually_exclusive_group()
    starts.add_argument(
        "--demo",
        action="store_true",
        help="play a whole calibration with a simulated operator",
    )
    starts.add_argument(
        "--self-test",
        type=Path,
        metavar="REPORT.json",
        help="try all that the program needs on this computer, and write a report",
    )
    starts.add_argument(
        "--install-desktop-entry",
        action="store_true",
        help="put the program into the menu of a Linux desktop",
    )
    starts.add_argument(
        "--remove-desktop-entry", action="store_true", help="take it out again"
    )


def _start_desktop(desktop: Desktop, options: argparse.Namespace) -> int:
    if options.demo:
        return desktop.play_demo()
    if options.self_test is not None:
        return desktop.test_itself(options.self_test)
    if options.install_desktop_entry:
        return desktop.install_entry()
    if options.remove_desktop_entry:
        return desktop.remove_entry()
    return desktop.show_window(None)


def _add_open(parser: argparse.ArgumentParser, desktop: Desktop) -> None:
    parser.set_defaults(run=lambda options: desktop.show_window(options.swing))
    parser.add_argument(
        "swing",
        type=Path,
        metavar="SWING",
        help="the record of a swing, the file swing.lightpen in it, or a result",
    )


def _add_calibrate(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_calibrate)
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
        type=_temperature,
        metavar="CELSIUS",
        help="of the pen during the swing, which makes it larger than its file says",
    )
    parser.add_argument(
        "--temperature-sigma",
        type=_positive,
        metavar="K",
        help="its standard uncertainty (0.5), or without --temperature how much warmer "
        "than at its measurement the pen may be (1.5)",
    )
    parser.add_argument(
        "--form-error",
        type=_positive,
        metavar="MM",
        help="standard uncertainty of where the ball sits, as ball and cone are not "
        "quite round (0.0002)",
    )
    parser.add_argument(
        "--center-bias",
        type=_positive,
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
        "--distance", type=_positive, metavar="MM", help="of the two cones"
    )
    parser.add_argument(
        "--distance-sigma",
        type=_positive,
        metavar="MM",
        help="its standard uncertainty",
    )
    parser.add_argument("--method", choices=METHODS, default="joint")
    parser.add_argument(
        "--nominal-tip", type=finite, nargs=3, metavar=("X", "Y", "Z"), help="mm"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the record")


def _add_simulate(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_simulate)
    parser.add_argument("out", type=Path, metavar="OUT", help="folder to write")
    parser.add_argument("--images", type=_n_images, default=60, metavar="N")
    parser.add_argument("--seed", type=whole_number, default=0, metavar="S")
    parser.add_argument(
        "--scene", choices=("clean", "hard"), default="clean", help="what goes wrong"
    )
    parser.add_argument(
        "--swing",
        choices=("field", "cone", "operator", "one-axis", "upright"),
        default="field",
        help="how the pen moves",
    )
    parser.add_argument(
        "--leds",
        choices=("even", "hot-spot", "dome", "ring", "halo", "ghost"),
        default="even",
        help="how the LEDs look inside and round their rims",
    )
    parser.add_argument(
        "--led-diameter", type=_led_diameter, default=DISC_DIAMETER, metavar="MM"
    )
    parser.add_argument(
        "--blur",
        type=_blur,
        default=0.8,
        metavar="PX",
        help="standard deviation of the optics' blur",
    )
    parser.add_argument("--bits", type=int, choices=(8, 12, 16), default=8)
    parser.add_argument(
        "--cameras",
        type=int,
        choices=range(1, MAX_RIG + 1),
        default=1,
        help="in a row, each turned to the pen; of several OUT gets a folder each, and "
        "rig.json",
    )
    parser.add_argument(
        "--baseline",
        type=_baseline,
        default=1000.0,
        metavar="MM",
        help="from the first of several cameras to the last",
    )
    parser.add_argument(
        "--pen",
        choices=("paper", "six", "eight", "near-symmetric", "fanned"),
        default="paper",
        help="layout of the LEDs",
    )


def _led_diameter(text: str) -> float:
    diameter = finite(text)
    if not MIN_LED_DIAMETER <= diameter <= MAX_LED_DIAMETER:
        raise argparse.ArgumentTypeError(
            f"{text} mm is no diameter from {MIN_LED_DIAMETER:g} to "
            f"{MAX_LED_DIAMETER:g} mm."
        )
    return diameter


def _blur(text: str) -> float:
    sigma = finite(text)
    if not MIN_BLUR <= sigma <= MAX_BLUR:
        raise argparse.ArgumentTypeError(
            f"{text} px is no blur from {MIN_BLUR:g} to {MAX_BLUR:g} px."
        )
    return sigma


def _baseline(text: str) -> float:
    baseline = finite(text)
    if not MIN_BASELINE <= baseline <= MAX_BASELINE:
        raise argparse.ArgumentTypeError(
            f"{text} mm is no baseline from {MIN_BASELINE:g} to {MAX_BASELINE:g} mm."
        )
    return baseline


def _n_images(text: str) -> int:
    number = whole_number(text)
    if number == 0:
        raise argparse.ArgumentTypeError("at least one image is needed.")
    if number > MAX_RENDERED:
        raise argparse.ArgumentTypeError(f"at most {MAX_RENDERED} images are rendered.")
    return number


def _positive(text: str) -> float:
    number = finite(text)
    if not number > 0:
        raise argparse.ArgumentTypeError(f"{text} is not above 0.")
    return number


def _temperature(text: str) -> float:
    number = finite(text)
    if not COLDEST <= number <= WARMEST:
        raise argparse.ArgumentTypeError(
            f"{text} is no temperature from {COLDEST:g} to {WARMEST:g} degrees Celsius."
        )
    return number


def _share(text: str) -> float:
    """Return a part of one, which may be given in per cent."""
    number = finite(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    if not 0 < number <= LARGEST_SHARE:
        raise argparse.ArgumentTypeError(
            f"{text} is not a share above 0 and up to {LARGEST_SHARE:.0%}."
        )
    return number


def _assumptions(options: argparse.Namespace) -> Assumptions:
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


def _separation(options: argparse.Namespace) -> Separation | None:
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


def _add_pivot(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_pivot)
    parser.add_argument("poses", type=Path, metavar="POSES.csv")
    parser.add_argument(
        "--least-squares", action="store_true", help="take all poses alike"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the record")


def _add_pen(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_pen)
    parser.add_argument("raw", type=Path, metavar="RAW.csv")
    parser.add_argument("out", type=Path, metavar="OUT.csv")
    add_pen_options(parser)


@dataclass(frozen=True, eq=False)
class _Calibrated:
    """A calibration and what it was made from; hashes are read when asked for."""

    calibration: Calibration
    nominal_tip: FloatArray | None
    limits: SwingLimits
    origin: Origin | None
    inputs: Callable[[], Inputs]


@printing
def _calibrate(options: argparse.Namespace) -> None:
    if bool(options.images) == (options.centers is not None):
        raise UsageError(
            sentence(
                "cli.images-or-centers",
                "Give either IMAGES or --centers FILE.csv.",
            )
        )
    inputs = (options.camera, options.rig, options.pen, *(options.centers or ()))
    require_other_file(options.json, *inputs)
    if len(options.images) == 1 and is_record(Path(options.images[0])):
        calibrated = _from_record(options)
    elif options.rig is not None:
        calibrated = _from_rig(options)
    else:
        calibrated = _from_observations(options)
    calibration = calibrated.calibration
    verdict = judge(calibration, calibrated.limits)
    text = calibration_text(
        *(calibration, options.method, calibrated.nominal_tip, verdict),
        calibrated.origin,
    )
    print(shown(text))
    if options.json is not None:
        record = calibration_record(
            calibration, calibrated.inputs(), options.method, calibrated.limits
        )
        write_record(options.json, record)


def _from_record(options: argparse.Namespace) -> _Calibrated:
    folder = Path(options.images[0])
    own = {
        "--camera": options.camera,
        "--rig": options.rig,
        "--pen": options.pen,
        "--units": options.units,
        "--led-diameter": options.led_diameter,
        "--nominal-tip": options.nominal_tip,
        "--camera-sigma": options.camera_sigma,
        "--scale-sigma": options.scale_sigma,
        "--temperature": options.temperature,
        "--temperature-sigma": options.temperature_sigma,
        "--form-error": options.form_error,
        "--center-bias": options.center_bias,
        "--second-cone": options.second_cone,
        "--distance": options.distance,
        "--distance-sigma": options.distance_sigma,
    }
    given = [name for name, value in own.items() if value is not None]
    if given:
        raise UsageError(
            sentence(
                "cli.record-brings-its-own",
                "{folder} is the record of a swing, which brings its own. Leave out "
                "{options}.",
                folder=str(folder),
                options=", ".join(given),
            )
        )
    record = open_record(folder)
    require_other_file(options.json, *record_files(record))
    _note_unacknowledged(unacknowledged_images(record))
    with progress("Finding LEDs") as report:
        solution = solve_record(record, report)
    return _Calibrated(
        solution.calibration,
        solution.source.pen.nominal_tip,
        recorded_limits(record),
        solution.source.origin,
        lambda: record_inputs(solution.source),
    )


def _note_unacknowledged(names: Sequence[str]) -> None:
    """Tell of images that take no part because no journal names them."""
    if not names:
        return
    if len(names) == 1:
        note = sentence(
            "record.image-unacknowledged",
            "{image} is in the folder but not in the journal; it was not acknowledged "
            "and takes no part.",
            image=names[0],
        )
    elif len(names) <= MAX_NAMED:
        note = sentence(
            "record.images-unacknowledged",
            "{images} are in the folder but not in the journal; they were not "
            "acknowledged and take no part.",
            images=", ".join(names),
        )
    else:
        note = sentence(
            "record.many-images-unacknowledged",
            "{n_images} images, the first {first}, are in the folder but not in the "
            "journal; they were not acknowledged and take no part.",
            n_images=len(names),
            first=names[0],
        )
    _note(note)


def _note(note: Sentence) -> None:
    print(shown(f"lightpen: {note}"), file=sys.stderr)


def _lacking(option: str, images: Sequence[str]) -> UsageError:
    """Return that an option is missing, and why the images are not a record."""
    missing = missing_parts(Path(images[0])) if len(images) == 1 else ()
    if not missing:
        return lacking(option)
    return UsageError(
        sentence(
            "cli.part-of-record-missing",
            "{option} FILE is missing. Only a record needs none, and {folder} is "
            "not a whole one: it lacks {missing}. Restore what it lacks from a "
            "copy, or give --camera FILE and --pen FILE.",
            option=option,
            folder=images[0],
            missing=", ".join(missing),
        )
    )


def _from_observations(options: argparse.Namespace) -> _Calibrated:
    for name, file in (("--camera", options.camera), ("--pen", options.pen)):
        if file is None:
            raise _lacking(name, options.images)
    camera = read_camera(options.camera)
    pen = _read_pen(options)
    separation = _separation(options)
    if options.centers is not None:
        _require_one_each(options.centers, 1, RIG_NEEDED)
        given = [str(options.centers[0])]
    else:
        if len(options.images) > 1 and any(Path(p).is_dir() for p in options.images):
            _require_one_each(options.images, 1, RIG_NEEDED)
        given = options.images
    observe = partial(
        _observe, options.json, camera, pen, is_centers=options.centers is not None
    )
    observations, files = observe(given)
    second = None
    if separation is not None:
        others, more_files = observe([options.second_cone])
        second, files = SecondSwing(others, separation), files + more_files
    origin = _origin(options.camera, options.pen, *files)
    return _Calibrated(
        calibrate(camera, pen, observations, _assumptions(options), second),
        pen.nominal_tip,
        SwingLimits(),
        origin,
        lambda: Inputs(
            camera=hashed(options.camera),
            pen=hashed(options.pen),
            observations=all_hashed(files),
            nominal_tip=pen.nominal_tip,
            origin=origin,
        ),
    )


def _origin(*files: Path) -> Origin:
    """Return what a calibration from files is of."""
    return Origin.SIMULATED if any(map(is_simulated, files)) else Origin.RECORDED


def _read_pen(options: argparse.Namespace) -> Pen:
    nominal_tip = None if options.nominal_tip is None else np.array(options.nominal_tip)
    return read_pen(options.pen, options.units, options.led_diameter, nominal_tip)


def _from_rig(options: argparse.Namespace) -> _Calibrated:
    if options.camera is not None:
        raise UsageError(
            sentence(
                "cli.rig-and-camera",
                "The rig file names the files of its cameras. Leave out --camera.",
            )
        )
    if options.second_cone is not None:
        raise UsageError(
            sentence(
                "cli.rig-and-second-cone",
                "A second cone is taken up with a single camera only. Leave out "
                "--second-cone, --distance and --distance-sigma.",
            )
        )
    if options.pen is None:
        raise _lacking("--pen", ())
    rig_file = read_rig(options.rig)
    rig = rig_file.rig
    pen = _read_pen(options)
    in_order = sentence(
        "cli.one-of-each-camera",
        "The rig has {n_cameras} cameras: give one for each, in the order of its file "
        "({names}), and a pattern in quotation marks.",
        n_cameras=rig.n_cameras,
        names=", ".join(rig.names),
    )
    if options.centers is not None:
        _require_one_each(options.centers, rig.n_cameras, in_order)
        centers = [read_centers(file, pen.n_leds) for file in options.centers]
        files: tuple[Path, ...] = tuple(options.centers)
        pairing = pair_images([list(map(str, c.frames)) for c in centers], rig.names)
        observations = observe_rig_centers(centers, pairing, rig, pen)
    else:
        _require_one_each(options.images, rig.n_cameras, in_order)
        _require_other_names(options.images, rig.names)
        sources = [find_images(place) for place in options.images]
        files = tuple(file for source in sources for file in source.files)
        require_other_file(options.json, *files, *rig_file.camera_files)
        pairing = pair_images([source.names for source in sources], rig.names)
        with progress("Finding LEDs") as report:
            observations = observe_rig_images(sources, pairing, rig, pen, report)
    if pairing.by_order:
        _note(
            sentence(
                "rig.paired-by-order",
                "The names of the images do not tell which are of the same moment: the "
                "first of each camera are taken as one moment, and so on.",
            )
        )
    origin = _origin(options.rig, options.pen, *rig_file.camera_files, *files[:1])
    return _Calibrated(
        calibrate_rig(rig, pen, observations, _assumptions(options)),
        pen.nominal_tip,
        SwingLimits(),
        origin,
        lambda: Inputs(
            camera=hashed(rig_file.camera_files[0]),
            pen=hashed(options.pen),
            observations=all_hashed(files),
            nominal_tip=pen.nominal_tip,
            rig=RigInputs(hashed(options.rig), all_hashed(rig_file.camera_files)),
            origin=origin,
        ),
    )


def _require_one_each(
    given: Sequence[str | Path], n_cameras: int, why: Sentence
) -> None:
    """Refuse another number of places than of cameras, and one that is given twice."""
    if len(given) != n_cameras:
        raise UsageError(
            sentence(
                "cli.other-number",
                "Folders or files given: {n_given}. {why}",
                n_given=len(given),
                why=why,
            )
        )
    places = [os.path.realpath(place) for place in given]
    if len(set(places)) < len(places):
        raise UsageError(
            sentence("cli.place-twice", "A place is given twice. {why}", why=why)
        )


def _require_other_names(places: Sequence[str], names: Sequence[str]) -> None:
    """Refuse folders that are called as the cameras, but in another order."""
    folders = [Path(place).name.casefold() for place in places]
    cameras = [name.casefold() for name in names]
    if folders != cameras and sorted(folders) == sorted(cameras):
        raise UsageError(
            sentence(
                "cli.other-order",
                "The folders {folders} are in another order than the cameras of the "
                "rig file, {names}. Give them in the order of the file.",
                folders=", ".join(map(str, places)),
                names=", ".join(names),
            )
        )


def _observe(
    record: Path | None,
    camera: Camera,
    pen: Pen,
    given: Sequence[str],
    *,
    is_centers: bool,
) -> tuple[Observations, tuple[Path, ...]]:
    """Return what images or a file of centres show, and the files of it."""
    if is_centers:
        path = Path(given[0])
        require_other_file(record, path)
        centers = read_centers(path, pen.n_leds)
        return observe_centers(centers, camera, pen), (path,)
    source = find_images(*given)
    require_other_file(record, *source.files)
    with progress("Finding LEDs") as report:
        return observe_images(source, camera, pen, report), source.files


@printing
def _simulate(options: argparse.Namespace) -> None:
    # Imported here as the simulator is not needed to calibrate.
    from lightpen.simulator.sample_pens import SAMPLE_PENS
    from lightpen.simulator.sample_rigs import row_of_cameras
    from lightpen.simulator.scene_files import write_rig_scene, write_scene
    from lightpen.simulator.scenes import LEDS, SCENES, Scene
    from lightpen.simulator.sensor import Sensor

    looks = LEDS[options.leds]

    scene = Scene(
        n_images=options.images,
        seed=options.seed,
        swing=options.swing,
        disturbances=SCENES[options.scene],
        sensor=Sensor(bits=options.bits),
        faces=looks.faces,
        optics=replace(looks.optics, psf_sigma=options.blur),
        pen=replace(SAMPLE_PENS[options.pen](), diameter=options.led_diameter),
    )
    with progress("Rendering") as report:
        if options.cameras == 1:
            x, y, z = write_scene(scene, options.out, report)
            written = f"{scene.n_images} images, camera.yaml"
        else:
            rig = row_of_cameras(options.cameras, options.baseline)
            x, y, z = write_rig_scene(scene, rig, options.out, report)
            folders = ", ".join(rig.names)
            written = (
                f"{scene.n_images} images of each camera (folders {folders}), their "
                "camera files, rig.json"
            )
    print(
        shown(
            f"{written}, leds.csv and the true answer (truth.json) are in "
            f"{options.out}.\nThe true tip is {x:.4f} {y:.4f} {z:.4f} mm in the "
            "frame of leds.csv."
        )
    )


@printing
def _pivot(options: argparse.Namespace) -> None:
    require_other_file(options.json, options.poses)
    poses = read_poses(options.poses)
    calibration = calibrate_pivot(
        poses.rotations,
        poses.translations,
        poses.covariances,
        robust=not options.least_squares,
    )
    print(pivot_text(calibration))
    if options.json is not None:
        record = pivot_record(calibration, hashed(options.poses), options.least_squares)
        write_record(options.json, record)


@printing
def _pen(options: argparse.Namespace) -> None:
    if are_same(options.raw, options.out):
        raise UsageError(
            sentence(
                "cli.pen-over-raw",
                "{out} would replace the measured LEDs that it is made from. Give the "
                "pen file another name.",
                out=str(options.out),
            )
        )
    raw = read_raw_pen(options.raw, options.units, options.led_diameter)
    write_pen(raw, options.out)
    print(shown(f"{raw.n_leds} LEDs in the pen frame are in {options.out}."))
