"""Introduction in pictures: pen, cone and steps."""

import math

import numpy as np
from PySide6.QtCore import QCoreApplication, Qt
from PySide6.QtWidgets import QSizePolicy, QWidget

from lightpen.model.posture import Posture
from lightpen.simulator.swings import PAPER_TIP, paper_pen
from lightpen_app.look.layouts import grid_layout
from lightpen_app.look.theme import GRID, TextSize, set_size, text_label
from lightpen_app.widgets.pen_in_space import DisplayedPosture, PenInSpace
from lightpen_app.widgets.translated import Translated

LEAST_SIDE = 16 * GRID  # px, of a picture; with its words all fits 940 x 500
ANY_HEIGHT = 16777215  # QWIDGETSIZE_MAX
UPRIGHT = Posture(0.0, 0.0, 0.0)
LEANING = Posture(math.radians(25), math.radians(200), math.radians(15))
RIGHT = Posture(math.radians(25), 0.0, math.radians(-15))
STANDS = ((UPRIGHT, None), (LEANING, RIGHT))

translate = QCoreApplication.translate


class Pictures(Translated, QWidget):
    """Shows item, method and steps."""

    def __init__(self) -> None:
        super().__init__()

        # Widgets
        self._heading = text_label(TextSize.TITLE)
        self._pictures = [_picture(*stand) for stand in STANDS]
        self._words = [text_label(TextSize.BODY) for _ in STANDS]
        self._steps = text_label(TextSize.BODY)
        self._steps.setTextFormat(Qt.TextFormat.RichText)

        # Layout
        layout = self._layout = grid_layout(self, spacing=2 * GRID)
        layout.addWidget(self._heading, 0, 0, 1, 2)
        for column, words in enumerate(self._words):
            layout.addWidget(self._pictures[column], 1, column)
            words.setAlignment(Qt.AlignmentFlag.AlignTop)
            layout.addWidget(words, 2, column)
            layout.setColumnStretch(column, 1)
        layout.setRowStretch(1, 1)
        layout.addWidget(self._steps, 3, 0, 1, 2)

        self._retranslate()

    def set_very_large(self) -> None:
        """Set the large layout: steps beside larger pictures."""
        for picture in self._pictures:
            picture.setMaximumHeight(ANY_HEIGHT)
        for label in (*self._words, self._steps):
            set_size(label, TextSize.LEAD)
        self._layout.addWidget(self._steps, 1, len(STANDS))
        self._layout.setColumnStretch(len(STANDS), 1)

    def _retranslate(self) -> None:
        self._heading.setText(translate("Introduction", "Where is the tip of the pen?"))
        texts = (
            translate(
                "Introduction",
                "The pen carries LEDs that a camera observes. To measure points "
                "with the tip, the position of the tip relative to the LEDs must be "
                "known. The calibration determines this position.",
            ),
            translate(
                "Introduction",
                "The tip rests in a cone while the pen is tilted to all sides. The "
                "only point of the pen that does not move is the tip centre.",
            ),
        )
        for label, text in zip(self._words, texts, strict=True):
            label.setText(text)
        rows = "".join(
            f"<li><b>{name}</b> \N{EN DASH} {what}</li>" for name, what in _steps()
        )
        self._steps.setText(f"<ol>{rows}</ol>")


def _steps() -> tuple[tuple[str, str], ...]:
    return (
        (
            translate("Introduction", "Start"),
            translate("Introduction", "select the pen and the tip."),
        ),
        (
            translate("Introduction", "Camera"),
            translate("Introduction", "check exposure and focus of the images."),
        ),
        (
            translate("Introduction", "LEDs"),
            translate("Introduction", "check that the LED file belongs to this pen."),
        ),
        (
            translate("Introduction", "Swing"),
            translate(
                "Introduction", "tilt the pen as the arrow shows; no key is needed."
            ),
        ),
        (
            translate("Introduction", "Review"),
            translate(
                "Introduction", "check the uncertainty of the tip, and accept it."
            ),
        ),
    )


def _picture(posture: Posture, target: Posture | None) -> PenInSpace:
    picture = PenInSpace()
    expanding = QSizePolicy.Policy.Expanding
    picture.setSizePolicy(expanding, expanding)
    picture.setFixedHeight(LEAST_SIDE)
    picture.set_value(
        DisplayedPosture(paper_pen(), np.array(PAPER_TIP), posture, target)
    )
    return picture
