"""What the program is for, in pictures: the pen, the cone, and the steps."""

import math

import numpy as np
from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QGridLayout,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from lightpen.model.posture import Posture
from lightpen.simulator.swings import PAPER_TIP, paper_pen
from lightpen_app.look.theme import GRID, TextSize, text_label
from lightpen_app.widgets.pen_in_space import PenInSpace, PenStand
from lightpen_app.widgets.push_button import PushButton

WIDTH, PICTURE_SIDE = 112 * GRID, 16 * GRID  # px; all fits 940 x 500
UPRIGHT = Posture(0.0, 0.0, 0.0)
LEANING = Posture(math.radians(25), math.radians(200), math.radians(15))
RIGHT = Posture(math.radians(25), 0.0, math.radians(-15))


class Introduction(QDialog):
    """Shows what is calibrated, how, and in which steps.

    Signals
    -------
    trial_requested()
        A simulated pen is to be calibrated.
    """

    trial_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setWindowTitle(self.tr("What is this?"))

        # Widgets
        heading = text_label(TextSize.TITLE)
        heading.setText(self.tr("Where is the tip of the pen?"))
        pictures = (
            (
                _picture(UPRIGHT, None),
                self.tr(
                    "The pen carries LEDs that a camera sees. What it touches with its "
                    "tip can be measured, once it is known where the tip is from the "
                    "LEDs. That is what is calibrated."
                ),
            ),
            (
                _picture(LEANING, RIGHT),
                self.tr(
                    "The tip rests in a cone and stays there while the pen is leaned "
                    "to all sides. The only point of the pen that does not move is "
                    "the centre of its tip."
                ),
            ),
        )
        steps = text_label(TextSize.BODY)
        steps.setTextFormat(Qt.TextFormat.RichText)
        steps.setText(
            "<ol>"
            + "".join(
                f"<li><b>{name}</b> \N{EN DASH} {what}</li>"
                for name, what in (
                    (self.tr("Start"), self.tr("say which pen and which tip.")),
                    (
                        self.tr("Camera"),
                        self.tr("see that the images are bright and sharp."),
                    ),
                    (
                        self.tr("LEDs"),
                        self.tr("see that the file of the LEDs is that of this pen."),
                    ),
                    (
                        self.tr("Swing"),
                        self.tr("lean the pen as the arrow shows; no key is needed."),
                    ),
                    (
                        self.tr("Review"),
                        self.tr("see how certain the tip is, and accept it."),
                    ),
                )
            )
            + "</ol>"
        )
        buttons = QDialogButtonBox()
        close = PushButton()
        close.setText(self.tr("Close"))
        trial = PushButton()
        trial.setText(self.tr("Try it with a simulated pen"))
        buttons.addButton(close, QDialogButtonBox.ButtonRole.RejectRole)
        buttons.addButton(trial, QDialogButtonBox.ButtonRole.AcceptRole)
        trial.setDefault(True)

        # Layout
        layout = QVBoxLayout(self)
        margin = 3 * GRID
        layout.setContentsMargins(margin, margin, margin, margin)
        layout.setSpacing(2 * GRID)
        layout.addWidget(heading)
        grid = QGridLayout()
        grid.setSpacing(2 * GRID)
        for column, (picture, text) in enumerate(pictures):
            words = text_label(TextSize.BODY)
            words.setText(text)
            words.setAlignment(Qt.AlignmentFlag.AlignTop)
            grid.addWidget(picture, 0, column, Qt.AlignmentFlag.AlignCenter)
            grid.addWidget(words, 1, column)
            grid.setColumnStretch(column, 1)
        layout.addLayout(grid)
        layout.addWidget(steps)
        layout.addWidget(buttons)
        self.setFixedSize(WIDTH, layout.totalHeightForWidth(WIDTH))

        # Connections
        buttons.rejected.connect(self.reject)
        buttons.accepted.connect(self.accept)
        self.accepted.connect(self.trial_requested)


def _picture(posture: Posture, target: Posture | None) -> PenInSpace:
    picture = PenInSpace()
    fixed = QSizePolicy.Policy.Fixed
    picture.setSizePolicy(fixed, fixed)
    picture.setFixedSize(PICTURE_SIDE, PICTURE_SIDE)
    picture.set_value(PenStand(paper_pen(), np.array(PAPER_TIP), posture, target))
    return picture
