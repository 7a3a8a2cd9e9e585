"""The command line: ``lightpen calibrate | simulate | pivot | pen``.

Exit status: 0 done, 1 the data cannot give a tip, 2 wrong usage or unreadable input.
"""

import argparse
import math
import os
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib.metadata import version
from io import TextIOWrapper
from pathlib import Path

import cv2
import numpy as np

from lightpen.calibrate import calibrate
from lightpen.errors import CalibrationError, LightpenError, UsageError
from lightpen.files import sha256, write_whole
from lightpen.formats.camera_files import read_camera
from lightpen.formats.observation_files import read_centers, read_poses
from lightpen.formats.pen_files import UNITS, read_pen, read_raw_pen, write_pen
from lightpen.images import find_images
from lightpen.observe import observe_centers, observe_images
from lightpen.pivot import fit_pivot
from lightpen.report import (
    METHODS,
    InputFile,
    Inputs,
    calibration_json,
    calibration_text,
    encoded,
    pivot_json,
    pivot_text,
)

DONE, NO_TIP, BAD_INPUT = 0, 1, 2
BAR_WIDTH = 72  # characters
NEGATIVE_NUMBER = re.compile(r"-\.?[0-9]")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit status."""
    given = sys.argv[1:] if arguments is None else arguments
    # argparse takes "-90." and "-9e1" for options, but not with a blank before them.
    options = _parser().parse_args(
        [f" {text}" if NEGATIVE_NUMBER.match(text) else text for text in given]
    )
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # a console may lack letters of a name
            stream.reconfigure(errors="backslashreplace")
    cv2.setNumThreads(1)  # images are spread over threads, one each
    run: Callable[[argparse.Namespace], None] = options.run
    try:
        run(options)
        if sys.stdout is not None:
            sys.stdout.flush()
    except CalibrationError as error:
        print(f"lightpen: {error}", file=sys.stderr)
        return NO_TIP
    except LightpenError as error:
        print(f"lightpen: {error}", file=sys.stderr)
        return BAD_INPUT
    except OSError as error:  # files have errors of their own: this is our output
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):  # its reader has seen enough
            return DONE
        print(
            f"lightpen: The result cannot be printed: {error.strerror}. Free some "
            "space, or print it elsewhere.",
            file=sys.stderr,
        )
        return BAD_INPUT
    except KeyboardInterrupt:
        print("lightpen: stopped.", file=sys.stderr)
        return BAD_INPUT
    return DONE


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="lightpen",
        description="Calibrate the probe tip of a light pen.",
        epilog="Exit status: 0 done, 1 the data cannot give a tip, 2 wrong usage or "
        "unreadable input.",
    )
    parser.add_argument("--version", action="version", version=version("lightpen"))
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_calibrate(commands.add_parser("calibrate", help="find the tip from a swing"))
    _add_simulate(commands.add_parser("simulate", help="write a simulated swing"))
    _add_pivot(commands.add_parser("pivot", help="find the tip from given poses"))
    _add_pen(commands.add_parser("pen", help="put measured LEDs into the pen frame"))
    return parser


def _add_calibrate(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_calibrate)
    parser.add_argument(
        "images", nargs="*", metavar="IMAGES", help="a folder, a pattern or a video"
    )
    parser.add_argument(
        "--centers",
        type=Path,
        metavar="FILE.csv",
        help="LED centres (frame,led,x_px,y_px) in place of IMAGES",
    )
    parser.add_argument("--camera", type=Path, required=True, metavar="FILE")
    parser.add_argument("--pen", type=Path, required=True, metavar="FILE")
    _add_pen_options(parser)
    parser.add_argument("--method", choices=METHODS, default="joint")
    parser.add_argument(
        "--nominal-tip", type=_finite, nargs=3, metavar=("X", "Y", "Z"), help="mm"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the record")


def _add_simulate(parser: argparse.ArgumentParser) -> None:
    parser.set_defaults(run=_simulate)
    parser.add_argument("out", type=Path, metavar="OUT", help="folder to write")
    parser.add_argument("--images", type=_n_images, default=60, metavar="N")
    parser.add_argument("--seed", type=_whole_number, default=0, metavar="S")
    parser.add_argument(
        "--scene", choices=("clean", "hard"), default="clean", help="what goes wrong"
    )
    parser.add_argument(
        "--swing",
        choices=("field", "cone", "operator", "one-axis", "upright"),
        default="field",
        help="how the pen moves",
    )
    parser.add_argument("--bits", type=int, choices=(8, 12, 16), default=8)
    parser.add_argument(
        "--pen",
        choices=("paper", "six", "eight", "near-symmetric", "fanned"),
        default="paper",
        help="layout of the LEDs",
    )


def _whole_number(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text} is not a whole number of 0 or more.")
    return int(text)


def _n_images(text: str) -> int:
    number = _whole_number(text)
    if number == 0:
        raise argparse.ArgumentTypeError("at least one image is needed.")
    return number


def _finite(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise argparse.ArgumentTypeError(f"{text} is not a number.")
    return number


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
    _add_pen_options(parser)


def _add_pen_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--units", choices=sorted(UNITS), help="of a pen file that does not say"
    )
    parser.add_argument(
        "--led-diameter",
        type=_finite,
        metavar="MM",
        help="of the LED discs, where the pen file does not say (10)",
    )


def _calibrate(options: argparse.Namespace) -> None:
    if bool(options.images) == (options.centers is not None):
        raise UsageError("Give either IMAGES or --centers FILE.csv.")
    _require_other_file(options.json, options.camera, options.pen, options.centers)
    camera = read_camera(options.camera)
    nominal_tip = None if options.nominal_tip is None else np.array(options.nominal_tip)
    pen = read_pen(options.pen, options.units, options.led_diameter, nominal_tip)
    if options.centers is not None:
        centers = read_centers(options.centers, pen.n_leds)
        files: tuple[Path, ...] = (options.centers,)
        observations = observe_centers(centers, camera, pen)
    else:
        source = find_images(*options.images)
        files = source.files
        with _progress("Finding LEDs") as report:
            observations = observe_images(source, camera, pen, report)
    calibration = calibrate(camera, pen, observations)
    print(calibration_text(calibration, options.method, pen.nominal_tip))
    if options.json is not None:
        inputs = Inputs(
            camera=_hashed(options.camera),
            pen=_hashed(options.pen),
            observations=_all_hashed(files),
            nominal_tip=pen.nominal_tip,
        )
        record = calibration_json(calibration, inputs, options.method)
        write_whole(options.json, encoded(record))


def _simulate(options: argparse.Namespace) -> None:
    # Imported here as the simulator is not needed to calibrate.
    from lightpen.simulator.sample_pens import SAMPLE_PENS
    from lightpen.simulator.scene_files import write_scene
    from lightpen.simulator.scenes import SCENES, Scene
    from lightpen.simulator.sensor import Sensor

    scene = Scene(
        n_images=options.images,
        seed=options.seed,
        swing=options.swing,
        disturbances=SCENES[options.scene],
        sensor=Sensor(bits=options.bits),
        pen=SAMPLE_PENS[options.pen](),
    )
    with _progress("Rendering") as report:
        x, y, z = write_scene(scene, options.out, report)
    print(
        f"{scene.n_images} images, camera.yaml, leds.csv and the true answer "
        f"(truth.json) are in {options.out}.\nThe true tip is {x:.4f} {y:.4f} {z:.4f} "
        "mm in the frame of leds.csv."
    )


def _pivot(options: argparse.Namespace) -> None:
    _require_other_file(options.json, options.poses)
    poses = read_poses(options.poses)
    fit = fit_pivot(
        poses.rotations,
        poses.translations,
        poses.covariances,
        robust=not options.least_squares,
    )
    print(pivot_text(fit))
    if options.json is not None:
        record = pivot_json(fit, _hashed(options.poses), options.least_squares)
        write_whole(options.json, encoded(record))


def _pen(options: argparse.Namespace) -> None:
    raw = read_raw_pen(options.raw, options.units, options.led_diameter)
    write_pen(raw, options.out)
    print(f"{raw.n_leds} LEDs in the pen frame are in {options.out}.")


def _require_other_file(record: Path | None, *inputs: Path | None) -> None:
    """Refuse to write the record over one of the files that it is made from."""
    if record is None:
        return
    for path in inputs:
        if path is not None and path.resolve() == record.resolve():
            raise UsageError(
                f"--json {record} would replace the input file of that name. Give the "
                "record another name."
            )


def _hashed(path: Path) -> InputFile:
    return InputFile(path, sha256(path))


def _all_hashed(paths: Sequence[Path]) -> tuple[InputFile, ...]:
    with ThreadPoolExecutor() as executor:
        return tuple(executor.map(_hashed, paths))


@contextmanager
def _progress(title: str) -> Iterator[Callable[[float], None]]:
    """Show a progress bar on a terminal, and nothing elsewhere."""
    if not sys.stderr.isatty():
        yield lambda fraction: None
        return
    from tqdm import tqdm

    layout = "{desc} {bar} {percentage:3.0f}%"
    with tqdm(total=1.0, desc=title, bar_format=layout, ncols=BAR_WIDTH) as bar:

        def report(fraction: float) -> None:
            bar.update(fraction - bar.n)

        yield report
