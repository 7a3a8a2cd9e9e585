"""Description of the machine of the measurements."""

import datetime
import os
import platform
from pathlib import Path

import cv2
import numpy as np


def description() -> str:
    """Return date, processor and versions in one sentence."""
    today = datetime.datetime.now(tz=datetime.UTC).date()
    return (
        f"Measured on {today} on {_processor()}, {os.cpu_count()} cores, "
        f"{platform.system()}, with Python {platform.python_version()}, "
        f"numpy {np.__version__}, OpenCV {cv2.__version__}."
    )


def _processor() -> str:
    path = Path("/proc/cpuinfo")
    if path.is_file():
        for line in path.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
