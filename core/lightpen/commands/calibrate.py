"""``lightpen calibrate``: the tip from a swing."""

import argparse
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.commands.calibrate_options import add_calibrate_options, assumptions_of
from lightpen.commands.console import (
    centers_at,
    images_at,
    lacking,
    note,
    printing,
    progress,
    require_other_file,
    shown,
    write_record,
)
from lightpen.detection.observations import Observations, leave_out
from lightpen.detection.reasons import Reason
from lightpen.detection.rig_observations import observe_rig_centers, observe_rig_images
from lightpen.errors import UsageError
from lightpen.estimation.calibrate import Calibration, calibrate_rig
from lightpen.estimation.reports.report import calibration_record
from lightpen.estimation.reports.summary import calibration_text, convergence_text
from lightpen.estimation.reports.verdict import judge
from lightpen.formats.camera_files import read_camera
from lightpen.formats.files import is_simulated
from lightpen.formats.observation_files import Pairing, pair_images
from lightpen.formats.opened_files import Inputs, RigInputs, all_hashed, with_content
from lightpen.formats.pen_files import read_pen
from lightpen.formats.rig_files import read_rig
from lightpen.local_time import local_now
from lightpen.messages import Message, message
from lightpen.model.camera import Camera, unmodelled_effects_of
from lightpen.model.limits import SwingLimits
from lightpen.model.names import Origin
from lightpen.model.pen import Pen
from lightpen.model.rigid import Rig, of_camera, rig_of
from lightpen.record.recomputing import recompute
from lightpen.record.swings.reading import (
    is_record,
    open_record,
    record_files,
    unacknowledged_images,
)
from lightpen.record.swings.solving import record_inputs, solve_again, solve_record


def add_calibrate(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen calibrate``."""
    parser.set_defaults(run=_calibrate)
    add_calibrate_options(parser)


@dataclass(frozen=True, eq=False)
class _Calibrated:
    """A calibration and its input; hashes are read when needed."""

    calibration: Calibration
    nominal_tip: FloatArray | None
    limits: SwingLimits
    origin: Origin | None
    inputs: Callable[[], Inputs]


@printing
def _calibrate(options: argparse.Namespace) -> None:
    given = (any(options.images), options.centers, options.from_record)
    if sum(map(bool, given)) != 1:
        raise UsageError("cli.images-or-centers")
    inputs = (options.camera, options.rig, options.pen, *(options.centers or ()))
    require_other_file(options.json, options.from_record, *inputs)
    if options.from_record is not None:
        calibrated = _from_json(options)
    elif len(options.images) == 1 and is_record(Path(options.images[0])):
        calibrated = _from_record(options)
    else:
        calibrated = _from_observations(options)
    calibration = calibrated.calibration
    if options.method is not None:
        calibration = replace(calibration, method=options.method)
    verdict = judge(calibration, calibrated.limits)
    text = calibration_text(
        calibration, calibrated.nominal_tip, verdict, calibrated.origin
    )
    print(shown(text))
    if options.verbose:
        print(f"\n{convergence_text(calibration.two_stage)}")
    if options.json is not None:
        record = calibration_record(calibration, calibrated.inputs(), calibrated.limits)
        write_record(options.json, record)


def _from_json(options: argparse.Namespace) -> _Calibrated:
    _require_none_given(options, options.from_record, "from", "until")
    found = recompute(options.from_record)
    return _Calibrated(
        found.calibration,
        found.inputs.nominal_tip,
        found.limits,
        found.inputs.origin,
        lambda: found.inputs,
    )


def _require_none_given(
    options: argparse.Namespace, record: Path, *others: str
) -> None:
    """Reject options that duplicate the content of a record."""
    own = (
        "camera rig pen units led-diameter nominal-tip camera-sigma scale-sigma "
        "temperature temperature-sigma humidity form-error center-bias fps bits"
    )
    values = vars(options)
    given = [
        f"--{name}"
        for name in (*own.split(), *others)
        if values[name.replace("-", "_")] is not None
    ]
    if given:
        raise UsageError(
            "cli.record-brings-its-own", folder=record, options=", ".join(given)
        )


def _from_record(options: argparse.Namespace) -> _Calibrated:
    folder = Path(options.images[0])
    _require_none_given(options, folder)
    record = open_record(folder)
    require_other_file(options.json, *record_files(record))
    _note_unacknowledged(unacknowledged_images(record))
    with progress("Finding LEDs") as report:
        solution = solve_record(record, report)
    outside = _outside(options, len(solution.numbers))
    if outside:
        numbers = solution.numbers.tolist()
        reasons = {numbers[i]: str(Reason.OUTSIDE) for i in outside}
        solution = solve_again(solution, {**solution.excluded, **reasons})
    return _Calibrated(
        solution.calibration,
        solution.source.pen.nominal_tip,
        record.header.limits,
        solution.source.origin,
        lambda: record_inputs(solution.source),
    )


def _note_unacknowledged(names: Sequence[str]) -> None:
    """Report images that are excluded because no journal names them."""
    if names:
        n_images, first = len(names), names[0]
        note(message("record.images-unacknowledged", n_images=n_images, first=first))


def _note_doubts(camera: Camera, options: argparse.Namespace, name: str = "") -> None:
    """Report why the intrinsics of a camera, of a rig if named, may be outdated."""
    for doubt in unmodelled_effects_of(camera, local_now().date(), options.temperature):
        note(of_camera(name, doubt) if name else doubt)


def _from_observations(options: argparse.Namespace) -> _Calibrated:
    """Calibrate by images or centres of one camera, or of those of a rig."""
    if options.rig is not None and options.camera is not None:
        raise UsageError("cli.rig-and-camera")
    for name, file in (
        ("--camera", options.rig or options.camera),
        ("--pen", options.pen),
    ):
        if file is None:
            raise lacking(name)
    camera_files: tuple[Path, ...] = (options.camera,)
    if options.rig is None:
        rig = rig_of(read_camera(options.camera))
    else:
        rig_file = read_rig(options.rig)
        rig, camera_files = rig_file.rig, rig_file.camera_files
    for c, camera in enumerate(rig.cameras):
        _note_doubts(camera, options, rig.names[c] if rig.names else "")
    pen = _read_pen(options)
    observations, files = _observe(options, rig, pen)
    beside = () if options.rig is None else (options.rig,)
    origin = _origin(options.pen, *beside, *camera_files, *files)
    return _Calibrated(
        calibrate_rig(
            rig,
            pen,
            [_timed(_part_of(each, options), options) for each in observations],
            assumptions_of(options),
        ),
        pen.nominal_tip,
        SwingLimits(),
        origin,
        lambda: Inputs(
            camera=with_content(camera_files[0]),
            pen=with_content(options.pen),
            observations=all_hashed(files),
            nominal_tip=pen.nominal_tip,
            rig=None
            if options.rig is None
            else RigInputs(
                with_content(options.rig), tuple(map(with_content, camera_files))
            ),
            origin=origin,
            units=options.units,
            led_diameter=options.led_diameter,
        ),
    )


def _outside(options: argparse.Namespace, n_images: int) -> list[int]:
    """Return the indices of the images before ``--from`` and after ``--until``."""
    given = vars(options)
    first, last = int(given["from"] or 1), int(given["until"] or n_images)
    return [i for i in range(n_images) if not first <= i + 1 <= last]


def _part_of(seen: Observations, options: argparse.Namespace) -> Observations:
    outside = _outside(options, len(seen.names))
    return leave_out(seen, dict.fromkeys(outside, Reason.OUTSIDE))


def _timed(seen: Observations, options: argparse.Namespace) -> Observations:
    """Return observations with the image rate, if it is given."""
    interval_ms = None if options.fps is None else 1000 / options.fps
    return replace(seen, interval_ms=interval_ms)


def _origin(*files: Path) -> Origin:
    """Return the origin of a calibration from files."""
    return Origin.SIMULATED if any(map(is_simulated, files)) else Origin.RECORDED


def _read_pen(options: argparse.Namespace) -> Pen:
    nominal_tip = None if options.nominal_tip is None else np.array(options.nominal_tip)
    return read_pen(options.pen, options.units, options.led_diameter, nominal_tip)


def _require_one_each(
    given: Sequence[str | Path], n_cameras: int, why: Message
) -> None:
    """Refuse another number of places than of cameras, and one that is given twice."""
    if len(given) != n_cameras:
        raise UsageError("cli.other-number", n_given=len(given), why=why)
    places = [os.path.realpath(place) for place in given]
    if len(set(places)) < len(places):
        raise UsageError("cli.place-twice", why=why)


def _observe(
    options: argparse.Namespace, rig: Rig, pen: Pen
) -> tuple[Sequence[Observations], tuple[Path, ...]]:
    """Return the observations of each camera, and the files of images or centres."""
    places: Sequence[str | Path] = options.centers or options.images
    needed = message("cli.rig-needed")
    if options.centers is not None:
        needed = message("cli.one-table")
    if options.rig is not None:
        names = ", ".join(rig.names)
        needed = message("cli.one-of-each-camera", n_cameras=rig.n_cameras, names=names)
    # Images of one camera may be given one by one, as a shell makes them of a pattern.
    each: list[Sequence[str]] = [[str(place)] for place in places]
    is_pattern = options.centers is None and not any(map(os.path.isdir, places))
    if options.rig is None and is_pattern:
        each = [list(map(str, places))]
    else:
        _require_one_each(places, rig.n_cameras, needed)
    if options.centers is not None:
        files = tuple(options.centers)
        require_other_file(options.json, *files)
        centers = [centers_at(file, pen) for file in files]
        pairing = _paired([list(map(str, c.frames)) for c in centers], rig)
        return observe_rig_centers(centers, pairing, rig, pen), files
    sources = [images_at(*given).of_bits(options.bits) for given in each]
    files = tuple(file for source in sources for file in source.files)
    require_other_file(options.json, *files)
    pairing = _paired([source.names for source in sources], rig)
    with progress("Finding LEDs") as report:
        return observe_rig_images(sources, pairing, rig, pen, report), files


def _paired(names: Sequence[Sequence[str]], rig: Rig) -> Pairing:
    """Return which images are simultaneous, and say if only their order tells."""
    if rig.n_cameras == 1:
        return Pairing(np.arange(len(names[0]))[:, None])
    pairing = pair_images(names, rig.names)
    if pairing.by_order:
        note(message("rig.paired-by-order"))
    return pairing
