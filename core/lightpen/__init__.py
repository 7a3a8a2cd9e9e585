"""Calibration of a light pen: the numerics, free of Qt.

Conventions used everywhere in this package:

* Lengths are in millimetres, angles in radians, image points in pixels.
* Pixel (0, 0) is the centre of the top-left pixel; x runs right, y down.
* The camera frame has u right, v down, w forward along the optical axis.
* The frame of several cameras (a rig) is the frame of the first.
* ``cam_from_pen`` maps pen coordinates to camera coordinates, so that
  ``p_cam = R @ p_pen + t`` and neighbouring names cancel.
* A point carries its frame as a suffix: ``tip_pen``, ``cone_cam``.
* Arrays over frames have the frame as first axis, arrays over LEDs the LED as
  the axis before the coordinates.
* ``data`` is a data folder; ``now`` returns date and time with the time zone.
* What reads or writes files raises `FileError` where they cannot be read or written, or
  are damaged; the archive `ArchiveError`. A docstring names other errors only.

The names below are public; the modules behind them may move. See docs/python.md.
"""

import logging
from importlib import import_module

__version__ = "1.0.0"

# The module of each public name, imported when the name is used; `__init__.pyi` tells
# type checkers the same.
_PLACES = {
    "Calibration": "estimation.calibrate",
    "Camera": "model.camera",
    "LightpenError": "errors",
    "Pen": "model.pen",
    "calibrate": "estimation.calibrate",
    "calibrate_pivot": "estimation.pivot_calibration",
    "calibrate_rig": "estimation.calibrate",
    "calibration_text": "estimation.reports.summary",
    "detect": "detection.observations",
    "find_images": "formats.images",
    "judge": "estimation.reports.verdict",
    "read_calibration": "record.calibrations",
    "read_camera": "formats.camera_files",
    "read_pen": "formats.pen_files",
    "read_poses": "formats.observation_files",
    "read_rig": "formats.rig_files",
    "reported": "estimation.reports.report_warnings",
}
_OTHERWISE = {"detect": "observe_images"}  # names in their modules
__all__ = list(_PLACES)

logging.getLogger(__name__).addHandler(logging.NullHandler())


def __getattr__(name: str) -> object:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module = import_module(f"{__name__}.{_PLACES[name]}")
    return getattr(module, _OTHERWISE.get(name, name))


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
