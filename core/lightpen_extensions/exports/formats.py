"""The formats of other programs in which a calibration is exported, in one table.

Another format is a function from `CalibrationFile` to text and an entry of
`MORE_FORMATS`, which the command ``lightpen export`` and the menu of the wizard offer.
Transforms keep the axes of the pen: the tip is the origin of a frame parallel to that
of the pen.
"""

from collections.abc import Sequence
from itertools import product

import yaml

from lightpen.estimation.reports.verdict import AXES
from lightpen.local_time import local_time
from lightpen.messages import message, printable
from lightpen.record.calibrations.calibrations import CalibrationFile
from lightpen.record.exports.formats import (
    TABLE_FORMATS,
    ExportFormat,
    as_lines,
    export_remark,
)
from lightpen_extensions.exports.dcc import dcc_text

MILLIMETRES = 1000.0  # in a metre, the unit of ROS
N_DECIMALS = 6  # of a length in mm in a file for statistics
PEN_FRAME, TIP_FRAME = "pen", "tip"


def _slicer(file: CalibrationFile) -> str:
    """Return an ITK transform that 3D Slicer reads as pen_from_tip.

    ITK's axes point left and to the back where Slicer's point right and to the front,
    and Slicer takes its transforms to go from the parent: of a shift only the last
    entry changes sign.
    """
    x, y, z = file.calibration.tip_pen_mm
    return _itk_shift((x, y, -z), "for 3D Slicer alone", export_remark(file))


def _itk(file: CalibrationFile) -> str:
    """Return an ITK transform that maps points from the tip frame to the pen frame."""
    words = "TransformPoint maps from the tip frame to the pen frame, mm"
    return _itk_shift(file.calibration.tip_pen_mm, words, export_remark(file))


def _itk_shift(shift: Sequence[float], *remarks: str) -> str:
    return as_lines(
        "#Insight Transform File V1.0",
        *(f"# {remark}" for remark in remarks),
        "#Transform 0",
        "Transform: AffineTransform_double_3_3",
        f"Parameters: 1 0 0 0 1 0 0 0 1 {' '.join(map(repr, shift))}",
        "FixedParameters: 0 0 0",
    )


def _plus(file: CalibrationFile) -> str:
    """Return the ``CoordinateDefinitions`` of a device set of PLUS.

    ``Error`` is the residual of the pivot calibration, mm, as fCal writes it.
    """
    x, y, z = file.calibration.tip_pen_mm
    when = file.when.strftime("%m%d%y_%H%M%S")
    matrix = f"1 0 0 {x!r} 0 1 0 {y!r} 0 0 1 {z!r} 0 0 0 1"
    error = f"{file.calibration.rms_mm:.{N_DECIMALS}f}"
    return as_lines(
        f"<!-- {export_remark(file)} -->",
        "<CoordinateDefinitions>",
        f'  <Transform From="StylusTip" To="Stylus" Matrix="{matrix}"',
        f'    Error="{error}" Date="{when}" />',
        "</CoordinateDefinitions>",
    )


def _ros(file: CalibrationFile) -> str:
    """Return a ``geometry_msgs/TransformStamped`` of ROS as YAML, in metres."""
    metres = [x / MILLIMETRES for x in file.calibration.tip_pen_mm]
    seconds = file.when.timestamp()
    stamp = {"sec": int(seconds), "nanosec": int(seconds % 1 * 1e6) * 1000}
    transform = {
        "header": {"stamp": stamp, "frame_id": PEN_FRAME},
        "child_frame_id": TIP_FRAME,
        "transform": {
            "translation": dict(zip(AXES, metres, strict=True)),
            "rotation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        },
    }
    comment = f"# {export_remark(file)}\n"
    return comment + yaml.safe_dump(transform, sort_keys=False)


def _qdas(file: CalibrationFile) -> str:
    """Return a file of Q-DAS (AQDEF): x, y and z of the tip, and U of each.

    Each calibration is one value of six characteristics of a part, the pen with its
    tip, so that the files of many make the series. Operator, station and pen are those
    of the catalogues of operators, machines and gauges. Where the tip has a limit of
    change, the specification limits lie that far from the tip as found.
    """
    calibration, names, change = file.calibration, file.names, file.change
    pen, tip = printable(names.pen), printable(names.tip)
    values = [*calibration.tip_pen_mm, *calibration.expanded_uncertainty_mm]
    titles = map("".join, product(("Tip ", "U (k=2) of tip "), AXES))
    nominal = calibration.nominal_tip_mm or (None,) * 3
    limits: list[tuple[float, float] | None] = [None] * 3
    if change is not None and change.limit_mm is not None:
        limit = change.limit_mm
        limits = [(x - limit, x + limit) for x in change.as_found_mm]
    limits += [(0.0, calibration.verdict.limits.max_uncertainty_mm)] * 3
    lines = [
        f"K0100 {len(values)}",
        f"K1001 {pen}",
        f"K1002 Light pen {pen}, tip {tip}",
        f"K1003 {tip}",
        f"K1900 {export_remark(file)}",
        f"K4062/1 {printable(names.station)}",
        f"K4063/1 Station {printable(names.station)}",
        f"K4072/1 {pen}",
        f"K4073/1 Light pen {pen}",
        f"K4092/1 {printable(names.operator)}",
    ]
    each = zip(titles, (*nominal, None, None, None), limits, strict=True)
    for i, (title, target, bounds) in enumerate(each, start=1):
        lines += [f"K2001/{i} {i}", f"K2002/{i} {title}"]
        lines += [f"K2022/{i} {N_DECIMALS}", f"K2142/{i} mm"]
        if target is not None:
            lines.append(f"K2101/{i} {target:.{N_DECIMALS}f}")
        if bounds is not None:
            lower, upper = bounds
            lines.append(f"K2110/{i} {lower:.{N_DECIMALS}f}")
            lines.append(f"K2111/{i} {upper:.{N_DECIMALS}f}")
    when = f"{local_time(file.when):%d.%m.%Y/%H:%M:%S}"
    for i, value in enumerate(values, start=1):
        lines += [f"K0001/{i} {value:.{N_DECIMALS}f}", f"K0002/{i} 0"]  # 0: valid
        lines += [f"K0004/{i} {when}", f"K0008/{i} 1", f"K0010/{i} 1", f"K0012/{i} 1"]
    return as_lines(*lines)


MORE_FORMATS = (
    ExportFormat(
        "slicer",
        message("export.slicer"),
        "_tip.tfm",
        _slicer,
        message("content.slicer"),
    ),
    ExportFormat(
        "itk", message("export.itk"), "_itk.tfm", _itk, message("content.itk")
    ),
    ExportFormat(
        "plus", message("export.plus"), "_plus.xml", _plus, message("content.plus")
    ),
    ExportFormat(
        "ros", message("export.ros"), "_tip.yaml", _ros, message("content.ros")
    ),
    ExportFormat(
        "qdas", message("export.qdas"), "_tip.dfq", _qdas, message("content.qdas")
    ),
    ExportFormat(
        "dcc",
        message("export.dcc"),
        "_dcc.xml",
        dcc_text,
        message("content.dcc"),
        needs_laboratory=True,
    ),
)
FORMATS = (*TABLE_FORMATS, *MORE_FORMATS)
