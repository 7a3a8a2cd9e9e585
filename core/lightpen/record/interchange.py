"""A calibrated tip as other programs read it: trackers, robots, statistics.

The pen keeps its axes in all of them: the tip is where a frame parallel to the pen's
has its origin.
"""

import csv
import io
from collections.abc import Callable, Sequence

import yaml

from lightpen.arrays import FloatArray
from lightpen.estimation.verdict import AXES
from lightpen.formats.files import printable
from lightpen.local_time import local_time
from lightpen.record.calibrations import CalibrationFile

MILLIMETRES = 1000.0  # in a metre, which ROS counts in
N_DECIMALS = 6  # of a length in mm in a file for statistics
PEN_FRAME, TIP_FRAME = "pen", "tip"


def slicer_transform(calibration: CalibrationFile) -> str:
    """Return an ITK transform that 3D Slicer opens as that of the tip to the pen.

    ITK's axes point left and to the back where Slicer's point right and to the front,
    and its transforms go from the parent: of a shift only the last entry changes sign.
    """
    x, y, z = calibration.tip_pen.tolist()
    turn = "1 0 0 0 1 0 0 0 1"
    return _lines(
        "#Insight Transform File V1.0",
        "#Transform 0",
        "Transform: AffineTransform_double_3_3",
        f"Parameters: {turn} {x!r} {y!r} {-z!r}",
        "FixedParameters: 0 0 0",
    )


def plus_transform(calibration: CalibrationFile) -> str:
    """Return the line of a device set of PLUS, for its ``CoordinateDefinitions``."""
    x, y, z = calibration.tip_pen.tolist()
    when = calibration.when.strftime("%m%d%y_%H%M%S")
    matrix = f"1 0 0 {x!r} 0 1 0 {y!r} 0 0 1 {z!r} 0 0 0 1"
    return _lines(
        f'<Transform From="StylusTip" To="Stylus" Matrix="{matrix}" Date="{when}" />'
    )


def ros_transform(calibration: CalibrationFile) -> str:
    """Return a ``geometry_msgs/TransformStamped`` of ROS as YAML, in metres."""
    metres = (calibration.tip_pen / MILLIMETRES).tolist()
    seconds = calibration.when.timestamp()
    stamp = {"sec": int(seconds), "nanosec": int(seconds % 1 * 1e6) * 1000}
    return yaml.safe_dump(
        {
            "header": {"stamp": stamp, "frame_id": PEN_FRAME},
            "child_frame_id": TIP_FRAME,
            "transform": {
                "translation": dict(zip(AXES, metres, strict=True)),
                "rotation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
            },
        },
        sort_keys=False,
    )


def qdas_file(calibration: CalibrationFile) -> str:
    """Return a file of Q-DAS (AQDEF): x, y and z of the tip, and U of each.

    Each calibration is one value of six characteristics of a part, the pen with its
    tip, so that the files of many make the series.
    """
    when = f"{local_time(calibration.when):%d.%m.%Y/%H:%M:%S}"
    values = [*calibration.tip_pen.tolist(), *calibration.uncertainty.tolist()]
    titles = [f"Tip {axis}" for axis in AXES] + [f"U (k=2) of tip {a}" for a in AXES]
    head = [
        f"K0100 {len(values)}",
        f"K1001 {printable(calibration.pen)}",
        f"K1002 {printable(f'Light pen {calibration.pen}, tip {calibration.tip}')}",
        f"K1003 {printable(calibration.tip)}",
    ]
    characteristics = [
        line
        for i, title in enumerate(titles, start=1)
        for line in (
            *(f"K2001/{i} {i}", f"K2002/{i} {title}"),
            *(f"K2022/{i} {N_DECIMALS}", f"K2142/{i} mm"),
        )
    ]
    measured = [
        line
        for i, value in enumerate(values, start=1)
        for line in (
            f"K0001/{i} {value:.{N_DECIMALS}f}",
            f"K0002/{i} 0",  # a value that counts
            f"K0004/{i} {when}",
        )
    ]
    return _lines(*head, *characteristics, *measured)


def offset_text(calibration: CalibrationFile) -> str:
    """Return x, y and z in mm, parted by tabs."""
    return _lines("\t".join(map(repr, calibration.tip_pen.tolist())))


def offset_csv(calibration: CalibrationFile) -> str:
    """Return a table of one row: pen, tip, time, the tip and U (k = 2) in mm."""
    head = ["pen", "tip", "calibrated", *(f"tip_{axis}_mm" for axis in AXES)]
    head += [f"expanded_uncertainty_{axis}_mm" for axis in AXES]
    row = [calibration.pen, calibration.tip, calibration.when.isoformat()]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerow([*row, *_numbers(calibration.tip_pen, calibration.uncertainty)])
    return text.getvalue()


TEXT_OF: dict[str, Callable[[CalibrationFile], str]] = {
    "slicer": slicer_transform,
    "plus": plus_transform,
    "ros": ros_transform,
    "qdas": qdas_file,
    "text": offset_text,
    "csv": offset_csv,
}


def _numbers(*vectors: FloatArray) -> Sequence[float]:
    return [number for vector in vectors for number in vector.tolist()]


def _lines(*lines: str) -> str:
    return "\n".join(lines) + "\n"
