"""What is probed now, in one large figure: picture, live deviation and values."""

from dataclasses import dataclass, field, replace
from itertools import chain

import numpy as np
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget

from lightpen.model.posture import Posture, posture_of
from lightpen_app.look.layouts import horizontal_layout, vertical_layout
from lightpen_app.look.theme import GRID, TextSize
from lightpen_app.widgets.fitted_text import FittedText
from lightpen_app.widgets.posture_dial import DialValue, PostureDial, field_of
from lightpen_app.widgets.push_button import PushButton
from lightpen_app_extensions.measure.band_chart import BandChart
from lightpen_app_extensions.measure.part_view import PartValue, PartView
from lightpen_extensions.measure.session.session import SessionSetup, SessionState
from lightpen_extensions.measure.tasks.task import Band

PICTURE_HEIGHT = 18 * GRID  # px, at least


@dataclass(frozen=True, eq=False)
class FigureValue:
    """Content of the figure."""

    title: str = ""  # what is probed now
    live: str = ""  # the deviation at present, or what the check is for
    picture: PartValue | DialValue | None = None  # None once all is probed
    bands: tuple[Band, ...] = field(default=())
    action: str = ""  # label of the button that begins the check


class FigurePanel(QWidget):
    """Shows the figure."""

    asked = Signal()  # the check is to be done now

    def __init__(self) -> None:
        super().__init__()

        # Widgets
        self._title = FittedText(TextSize.TITLE, wraps=False)
        self._live = FittedText(TextSize.TITLE, least=TextSize.BODY)
        self._do = PushButton()
        self._part, self._dial = PartView(), PostureDial()
        self._bands = BandChart()

        # Layout
        layout = vertical_layout(self, margins=GRID)
        cells = (self._title, 1), (self._live, 1), self._do
        self.head = horizontal_layout(layout, *cells)  # more of it may be added
        for picture in (self._part, self._dial):
            picture.setMinimumHeight(PICTURE_HEIGHT)
            layout.addWidget(picture, 3)
        layout.addWidget(self._bands, 1)

        # Connections
        self._do.clicked.connect(self.asked)

    def set_value(self, value: FigureValue) -> None:
        """Show another moment."""
        self._title.set_text(value.title)
        self._live.set_text(value.live, bold=False)
        self._do.setText(value.action)
        self._do.setVisible(bool(value.action))
        picture = value.picture
        self._part.setVisible(isinstance(picture, PartValue))
        self._dial.setVisible(isinstance(picture, DialValue))
        if isinstance(picture, PartValue):
            self._part.set_value(picture)
        elif isinstance(picture, DialValue):
            self._dial.set_value(picture)
        self._bands.set_bands(value.bands)


def posture_value(setup: SessionSetup, state: SessionState) -> DialValue:
    """Return the postures of the pen at the points of a check, and the present one."""
    points = [*chain.from_iterable(state.runs), *state.touches]
    if state.found is not None:
        points = list(state.found.probed)
    pen = setup.instrument.pen
    dial = dial_of(
        [posture_of(pen, point.rotation) for point in points],
        live_posture(setup, state),
    )
    if state.done is not None:
        return dial
    goal = setup.task.hand(setup.choices, len(state.runs), len(state.touches))
    return replace(dial, target=Posture(goal.tilt, goal.direction, 0.0))


def dial_of(touched: list[Posture], posture: Posture | None) -> DialValue:
    """Return a dial with each field full that has a probed point."""
    counts = np.zeros((3, 8), dtype=np.int64)
    for each in touched:
        ring, sector = field_of(each)
        counts[ring, sector] += 1
    n_upright = int(counts[0].sum())
    return DialValue(
        counts=counts[1:],
        needed=np.minimum(counts[1:], 1),
        n_upright=n_upright,
        n_upright_needed=min(n_upright, 1),
        posture=posture,
    )


def live_posture(setup: SessionSetup, state: SessionState) -> Posture | None:
    """Return the present posture, if detected."""
    touching = state.touching
    if not touching.held or touching.n_lost:
        return None
    return posture_of(setup.instrument.pen, touching.held[-1].frame.rotation)
