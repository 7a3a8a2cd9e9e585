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
"""

import logging

__version__ = "1.0.0"

logging.getLogger(__name__).addHandler(logging.NullHandler())
