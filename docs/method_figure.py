"""Draw the figure of the help about the method: ``python docs/method_figure.py``.

The errors of the joint fit and of the paper's two-stage method from the same simulated
swings, with a fixed seed, as resources/lightpen_resources/help/en/method.png. The
largest error of each is printed.
"""

import os
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QGuiApplication, QImage, QPainter, QPen
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.detection.observations import observe_centers
from lightpen.estimation.calibrate import calibrate
from lightpen.formats.observation_files import Centers
from lightpen_extensions.simulator.swings import paper_camera, paper_pen, swing_poses
from lightpen_resources import RESOURCES

FILE = RESOURCES / "help" / "en" / "method.png"
N_SWINGS, N_IMAGES, SIGMA = 24, 100, 0.05
WIDTH, HEIGHT, MARGIN = 960, 320, 50
RANGE = 50.0  # um, of the axis to either side
JOINT, PAPER, GREY = QColor("#0072b2"), QColor("#d55e00"), QColor("#808080")


def errors() -> FloatArray:
    """Return the errors of the tip by joint fit and paper, (N_SWINGS, 2, 3), um."""
    camera, pen, found = paper_camera(), paper_pen(), []
    for seed in range(N_SWINGS):
        rng = np.random.default_rng(seed)
        swing = swing_poses(N_IMAGES, rng)
        pixels = simulate_centers(
            camera, pen, swing.rotations, swing.translations, SIGMA, rng
        )
        centers = Centers(np.arange(N_IMAGES), pixels, Path("simulated"))
        result = calibrate(camera, pen, observe_centers(centers, camera, pen))
        tips = np.array([result.joint.tip_pen, result.two_stage.tip_pen])
        found.append(1000 * (tips - swing.tip_pen))
    return np.array(found)


def draw(found: FloatArray) -> QImage:
    """Draw one field an axis, the swings from left to right."""
    image = QImage(WIDTH, HEIGHT, QImage.Format.Format_RGB32)
    image.fill(Qt.GlobalColor.white)
    painter = QPainter(image)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    width = (WIDTH - 4 * MARGIN) / 3
    bottom = HEIGHT - MARGIN
    for axis, name in enumerate("xyz"):
        left = MARGIN + axis * (width + MARGIN)
        painter.setPen(QPen(GREY, 1))
        painter.drawRect(QRectF(left, MARGIN, width, bottom - MARGIN))
        for tick in np.arange(-RANGE, RANGE + 1, 25):
            y = _height(float(tick))
            painter.drawLine(QPointF(left, y), QPointF(left + width, y))
            painter.drawText(QPointF(left - 32, y + 4), f"{tick:+.0f}")
        painter.setPen(Qt.GlobalColor.black)
        painter.drawText(QPointF(left, MARGIN - 10), f"{name} / µm")
        for m, color in enumerate((JOINT, PAPER)):
            painter.setPen(QPen(color, 2))
            painter.setBrush(color if m == 0 else Qt.GlobalColor.white)
            for k, value in enumerate(found[:, m, axis]):
                x = left + (k + 0.5) * width / N_SWINGS
                painter.drawEllipse(QPointF(x, _height(float(value))), 4, 4)
    painter.end()
    return image


def _height(value: float) -> float:
    middle, span = HEIGHT / 2, HEIGHT / 2 - MARGIN
    return middle - float(np.clip(value / RANGE, -1, 1)) * span


if __name__ == "__main__":
    app = QGuiApplication([])
    found = errors()
    draw(found).save(str(FILE))
    largest = np.abs(found).max(axis=0).round(1).tolist()
    print(f"largest error / um: joint {largest[0]}, two-stage {largest[1]}")
