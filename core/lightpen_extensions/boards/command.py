"""``lightpen intrinsics`` and ``lightpen extrinsics``: cameras by views of a board."""

import argparse
from dataclasses import replace
from pathlib import Path

from lightpen.commands.arguments import add_json, number_from
from lightpen.commands.console import (
    are_same,
    images_at,
    printing,
    progress,
    require_other_file,
    shown,
    write_record,
)
from lightpen.errors import UsageError
from lightpen.formats.camera_files import COLDEST, WARMEST, read_camera
from lightpen.formats.observation_files import pair_images
from lightpen.formats.own_json import plain
from lightpen.formats.rig_files import write_camera, write_rig
from lightpen.local_time import local_now
from lightpen_extensions.boards.boards import parse_board
from lightpen_extensions.boards.calibration import calibrate_camera
from lightpen_extensions.boards.observing import observe_board, observe_board_of_rig
from lightpen_extensions.boards.pair import (
    SCALE_SIGMA,
    calibrate_pair,
    pair_record,
    pair_text,
)
from lightpen_extensions.boards.report import intrinsics_record, intrinsics_text

SIDES = ("left", "right")  # names of the cameras


def add_intrinsics(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen intrinsics``."""
    parser.set_defaults(run=_intrinsics)
    parser.add_argument(
        "images",
        nargs="+",
        metavar="IMAGES",
        help="board images: folder, file name pattern, or video",
    )
    _add_board(parser)
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("camera.yaml"),
        metavar="FILE.yaml",
        help="intrinsics file to write (camera.yaml)",
    )
    parser.add_argument(
        "--serial", default="", metavar="TEXT", help="serial number of the camera"
    )
    _add_temperature(parser)
    add_json(parser)


def add_extrinsics(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen extrinsics``."""
    parser.set_defaults(run=_extrinsics)
    parser.add_argument("left", metavar="LEFT", help="board images of the first camera")
    parser.add_argument(
        "right",
        metavar="RIGHT",
        help="board images of the second camera, paired by name",
    )
    _add_board(parser)
    parser.add_argument(
        "--cameras",
        type=Path,
        nargs=2,
        metavar=("LEFT.yaml", "RIGHT.yaml"),
        help="intrinsics files (default: calibrated from the same images)",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("rig.json"),
        metavar="FILE.json",
        help="rig file to write (rig.json); without --cameras the intrinsics files are "
        "written next to it",
    )
    parser.add_argument(
        "--scale-sigma",
        type=number_from(1e-9, 0.1, "share", "of 1"),
        default=SCALE_SIGMA,
        metavar="SHARE",
        help=f"relative standard uncertainty of the board's scale ({SCALE_SIGMA:g})",
    )
    _add_temperature(parser)
    add_json(parser)


def _add_board(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--board",
        required=True,
        metavar="BOARD",
        help="such as chessboard:11x8:20 (inner corners, side of a square in mm), "
        "charuco:12x9:20:15:DICT_5X5_100 (squares, side, marker), circles:9x7:20:10 "
        "(distance, diameter), asymmetric-circles:4x11:20:10",
    )


def _add_temperature(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--temperature",
        type=number_from(COLDEST, WARMEST, "temperature", "degrees Celsius"),
        metavar="CELSIUS",
        help="temperature at the camera, stored in its file",
    )


@printing
def _intrinsics(options: argparse.Namespace) -> None:
    board = parse_board(options.board)
    source = images_at(*options.images)
    require_other_file(options.json, *source.files, options.out)
    _require_new_file(options.out, *source.files)
    with progress("Finding the board") as report:
        observed = observe_board(source, board, report)
    calibration = calibrate_camera(observed.views, local_now().date())
    camera = replace(
        calibration.camera, serial=options.serial, temperature_c=options.temperature
    )
    write_camera(camera, options.out)
    print(shown(intrinsics_text(calibration, observed)))
    print(shown(f"\nThe intrinsics file is {options.out}."))
    if options.json is not None:
        record = intrinsics_record(calibration, observed.unseen)
        write_record(options.json, plain(record))


@printing
def _extrinsics(options: argparse.Namespace) -> None:
    board = parse_board(options.board)
    sources = [images_at(options.left), images_at(options.right)]
    files = [file for source in sources for file in source.files]
    given = options.cameras or []
    require_other_file(options.json, *files, *given, options.out)
    _require_new_file(options.out, *files, *given)
    cameras = tuple(read_camera(file) for file in given)
    pairing = pair_images([source.names for source in sources], SIDES)
    with progress("Finding the board") as report:
        observed = observe_board_of_rig(sources, pairing, board, report)
    for camera, size, file in zip(
        cameras, observed.views.image_sizes, given, strict=False
    ):
        if camera.image_size != size:
            raise UsageError(
                "cli.camera-of-other-size",
                file=file,
                width=camera.width,
                height=camera.height,
                seen_width=size[0],
                seen_height=size[1],
            )
    calibration = calibrate_pair(observed.views, SIDES, cameras, options.scale_sigma)
    written = list(given)
    if not written:
        for name, camera in zip(SIDES, calibration.rig.cameras, strict=True):
            file = options.out.with_name(f"{options.out.stem}-{name}.yaml")
            write_camera(
                replace(
                    camera,
                    calibrated_on=local_now().date(),
                    temperature_c=options.temperature,
                ),
                file,
            )
            written.append(file)
    write_rig(
        calibration.rig, options.out, [_from_there(f, options.out) for f in written]
    )
    print(shown(pair_text(calibration, observed)))
    print(shown(f"\nThe rig file is {options.out}."))
    if options.json is not None:
        record = pair_record(calibration, observed)
        write_record(options.json, plain(record))


def _require_new_file(out: Path, *inputs: Path) -> None:
    """Refuse to write over one of the files that it is made from."""
    if any(are_same(path, out) for path in inputs):
        raise UsageError("cli.cameras-over-input", out=out)


def _from_there(file: Path, rig_file: Path) -> str:
    """Return the name of a camera file from the folder of the rig file."""
    if are_same(file.parent, rig_file.parent):
        return file.name
    return str(file.resolve())
