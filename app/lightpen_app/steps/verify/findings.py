"""What the touches of a task tell, while they are taken and when they are done."""

from itertools import chain

import numpy as np
from PySide6.QtCore import QSize
from PySide6.QtWidgets import QBoxLayout, QHBoxLayout, QVBoxLayout, QWidget
from typing_extensions import override

from lightpen.arrays import FloatArray
from lightpen.model.posture import Posture, posture_of
from lightpen.verification.choices import TaskKind
from lightpen.verification.circle import MIN_ANGLE, Circle, residuals_of
from lightpen.verification.fixed_point import (
    FixedPoint,
    Scatter,
    nominal_scatter,
    scatter_of,
)
from lightpen.verification.length import Length
from lightpen.verification.session import drift_so_far, ring_fit
from lightpen.verification.session_state import SessionSetup, SessionState
from lightpen.verification.touch import Touch
from lightpen_app.look.quantities import number_text
from lightpen_app.look.theme import GRID, TextSize, Tone, text_label
from lightpen_app.steps.verify.ring_view import RingValue, RingView
from lightpen_app.widgets.number_table import Figures, NumberTable
from lightpen_app.widgets.posture_dial import DialValue, PostureDial, field_of
from lightpen_app.widgets.rearranged import NO_ROOM, Rearranged
from lightpen_app.widgets.translated import Translated

AXES = ("u", "v", "w")
DECIMALS = 4  # of mm
DIAL_SHARE, LARGE_DIAL_SHARE, TABLES_SHARE = 3, 9, 13  # of the width
LATEST = 6  # touches of a ring, which fit beside it
TENTHS_OF_PER_MILLE = 1e4  # as the paper tells a relative error


class TaskFinding(Translated, QWidget):
    """Base of the views: each shows a session, as far as it is one of its task."""

    kind: TaskKind

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._shown: tuple[SessionSetup, SessionState] | None = None

    def set_value(self, setup: SessionSetup | None, state: SessionState | None) -> None:
        """Show a session, or that there is none."""
        self._shown = None if setup is None or state is None else (setup, state)
        self._refresh()

    def _own_touches(self) -> tuple[Touch, ...]:
        """Return the touches of the run at hand, if it is one of this task."""
        if self._shown is None:
            return ()
        setup, state = self._shown
        return state.touches if state.task(setup) is self.kind else ()

    def _own_runs(self) -> tuple[tuple[Touch, ...], ...]:
        """Return the runs that are done of the task at hand, if it is this one."""
        if self._shown is None:
            return ()
        setup, state = self._shown
        return state.runs if state.task(setup) is self.kind else ()

    def _refresh(self) -> None:
        raise NotImplementedError


class FixedPointFinding(Rearranged, TaskFinding):
    """The postures, u v w of each touch, and both tips beside each other."""

    kind = TaskKind.FIXED_POINT
    narrow_below = 116 * GRID  # px; then one table is below the other
    large_from = QSize(160 * GRID, 80 * GRID)  # px; then all is larger

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._room = NO_ROOM  # so that its least size at first widens no window

        # Widgets
        self._dial = PostureDial()
        self._dial.setMinimumSize(22 * GRID, 22 * GRID)
        self._touches = NumberTable()
        self._summary = NumberTable()
        self._heads = [text_label(TextSize.SMALL, Tone.QUIET) for _ in range(2)]

        # Layout
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(2 * GRID)
        layout.addWidget(self._dial)
        self._tables = QBoxLayout(QBoxLayout.Direction.LeftToRight)
        self._tables.setSpacing(2 * GRID)
        for head, table, share in zip(
            self._heads, (self._touches, self._summary), (6, 7), strict=True
        ):
            column = QVBoxLayout()
            column.setSpacing(GRID // 2)
            column.addWidget(head)
            column.addWidget(table)
            column.addStretch(1)
            self._tables.addLayout(column, share)
        layout.addLayout(self._tables, TABLES_SHARE)
        self._columns = layout
        self._use_room()

        self._retranslate()

    @override
    def _use_room(self) -> None:
        direction = QBoxLayout.Direction
        self._tables.setDirection(
            direction.TopToBottom if self._room.is_narrow else direction.LeftToRight
        )
        is_large = self._room.is_large
        for table in (self._touches, self._summary):
            table.set_large(is_large)
        self._columns.setStretch(0, LARGE_DIAL_SHARE if is_large else DIAL_SHARE)

    @override
    def _retranslate(self) -> None:
        names = (
            self.tr("Cone in the frame of the camera / mm"),
            self.tr("Both tips / mm"),
        )
        tables = self._touches, self._summary
        for head, table, name in zip(self._heads, tables, names, strict=True):
            head.setText(name)
            table.setAccessibleName(name)
        self._refresh()

    @override
    def _refresh(self) -> None:
        found = None if self._shown is None else self._shown[1].fixed_point
        touches = self._own_touches() if found is None else found.touches
        self._dial.set_value(self._dial_value(touches))
        points = scatter_of(touches).points.reshape(-1, 3)
        names = tuple(str(i + 1) for i in range(len(touches)))
        self._touches.set_value(Figures(AXES, names, tuple(map(_lengths, points))))
        self._summary.set_value(self._both(touches, found))

    def _dial_value(self, touches: tuple[Touch, ...]) -> DialValue:
        if self._shown is None:
            return DialValue()
        setup, state = self._shown
        pen = setup.instrument.pen
        return dial_of(
            [posture_of(pen, touch.rotation) for touch in touches],
            live_posture(setup, state),
        )

    def _both(self, touches: tuple[Touch, ...], found: FixedPoint | None) -> Figures:
        if self._shown is None or len(touches) < 2:
            return Figures(AXES)
        setup, _ = self._shown
        own = scatter_of(touches)
        nominal = nominal_scatter(touches, setup.instrument, setup.nominal_tip)
        rows = [(self.tr("Average"), _lengths(own.mean)), *self._spread(own)]
        if found is not None:
            change, within = found.tip_change, found.tip_change_uncertainty
            rows += [
                (self.tr("U (k = 2) of it"), _lengths(found.uncertainty)),
                (self.tr("Std expected"), _lengths(found.expected_deviation)),
                (self.tr("Tip wanted less own"), _lengths(change)),
                (self.tr("its U (k = 2)"), _lengths(within)),
            ]
        if nominal is not None:
            average = _lengths(nominal.mean)
            rows += [(self.tr("Nominal tip"), average), *self._spread(nominal)]
        names, cells = zip(*rows, strict=True)
        return Figures(AXES, tuple(names), tuple(cells))

    def _spread(self, scatter: Scatter) -> list[tuple[str, tuple[str, ...]]]:
        return [
            (self.tr("Std"), _lengths(scatter.deviation)),
            (self.tr("Range"), _lengths(scatter.range)),
        ]


class RingFinding(TaskFinding):
    """The ring as it fills, how far touches are off it, and the radius of each run."""

    kind = TaskKind.CIRCLE

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)

        # Widgets
        self._ring = RingView()
        self._table = NumberTable()

        # Layout
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(3 * GRID)
        layout.addWidget(self._ring, 2)
        column = QVBoxLayout()
        column.addWidget(self._table)
        column.addStretch(1)
        layout.addLayout(column, 2)

        self._retranslate()

    @override
    def _retranslate(self) -> None:
        self._table.setAccessibleName(self.tr("Radius of each run / mm"))
        self._refresh()

    @override
    def _refresh(self) -> None:
        found = None if self._shown is None else self._shown[1].circle
        self._ring.set_value(self._ring_value(found))
        self._table.set_value(self._live() if found is None else self._runs(found))
        has_figures = found is not None or bool(self._own_touches())
        self._table.setVisible(has_figures)

    def _ring_value(self, found: Circle | None) -> RingValue:
        fit = ring_fit(self._own_touches()) if found is None else found.runs[-1].fit
        if fit is None:
            return RingValue()
        return RingValue(tuple(fit.angles.tolist()), fit.covered, MIN_ANGLE)

    def _live(self) -> Figures:
        """Return how far the last touches are off the ring so far."""
        touches = self._own_touches()
        fit = ring_fit(touches)
        if fit is None:
            return Figures()
        off = residuals_of(fit, [touch.point_cam for touch in touches])
        heads = self.tr("Off the ring / mm"), self.tr("Off the plane / mm")
        names = tuple(str(i + 1) for i in range(len(touches)))
        cells = tuple(map(_lengths, off))
        return Figures(heads, names[-LATEST:], cells[-LATEST:])

    def _runs(self, found: Circle) -> Figures:
        runs, errors = found.runs, found.errors
        relative = TENTHS_OF_PER_MILLE * errors / found.certified
        fits = [run.fit for run in runs]
        n_touches = np.array([float(len(run.touches)) for run in runs])
        rows = (
            (self.tr("Radius / mm"), found.radii, DECIMALS),
            (self.tr("Error / mm"), errors, DECIMALS),
            (self.tr("Relative error \xd7 1e-4"), relative, 2),
            (
                self.tr("U (k = 2) / mm"),
                np.array([run.uncertainty for run in runs]),
                DECIMALS,
            ),
            (
                self.tr("Roundness / mm"),
                np.array([fit.roundness for fit in fits]),
                DECIMALS,
            ),
            (
                self.tr("Off the plane / mm"),
                np.array([fit.flatness for fit in fits]),
                DECIMALS,
            ),
            (self.tr("Covered / \xb0"), np.array([fit.covered for fit in fits]), 0),
            (self.tr("Touches"), n_touches, 0),
        )
        heads = [str(i + 1) for i in range(len(runs))]
        if len(runs) > 1:
            heads.append(self.tr("Average"))
        cells = tuple(_numbers(values, decimals) for _, values, decimals in rows)
        return Figures(tuple(heads), tuple(name for name, _, _ in rows), cells)


class LengthFinding(TaskFinding):
    """The touches of both ends, the length at each place, and the scale by all."""

    kind = TaskKind.LENGTH

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)

        # Widgets
        self._table = NumberTable()
        self._scale = text_label(TextSize.BODY, Tone.QUIET)

        # Layout
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(2 * GRID)
        layout.addWidget(self._table)
        layout.addWidget(self._scale)
        layout.addStretch(1)

        self._retranslate()

    @override
    def _retranslate(self) -> None:
        self._table.setAccessibleName(self.tr("Length at each place / mm"))
        self._refresh()

    @override
    def _refresh(self) -> None:
        found = None if self._shown is None else self._shown[1].length
        if self._shown is None or found is None:
            self._table.set_value(self._ends())
            self._scale.clear()
            return
        limit = self._shown[0].choices.limits.length
        heads = (
            self.tr("Length / mm"),
            self.tr("Error / mm"),
            self.tr("U (k = 2) / mm"),
            self.tr("Limit / mm"),
        )
        names = tuple(str(i + 1) for i in range(len(found.runs)))
        self._table.set_value(Figures(heads, names, _places(found, limit)))
        words = self.tr(
            "Scale of the pen by it: {0}, U (k = 2) {1} ppm; without it {2} ppm."
        )
        scale = found.scale
        self._scale.setText(
            words.format(
                number_text(scale.factor, 6),
                number_text(1e6 * scale.uncertainty, 1),
                number_text(1e6 * scale.uncertainty_before, 1),
            )
        )

    def _ends(self) -> Figures:
        """Return where the ends of the place at hand were touched."""
        touches = self._own_touches()
        names = (self.tr("One end"), self.tr("The other end"))[: len(touches)]
        cells = tuple(_lengths(touch.point_cam) for touch in touches)
        heads = tuple(f"{axis} / mm" for axis in AXES)
        return Figures(heads, names, cells) if touches else Figures()


class ArticulationFinding(TaskFinding):
    """The postures, and where each has the point."""

    kind = TaskKind.ARTICULATION

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)

        # Widgets
        self._dial = PostureDial()
        self._dial.setMinimumSize(22 * GRID, 22 * GRID)
        self._table = NumberTable()
        self._form = text_label(TextSize.BODY, Tone.QUIET)
        self._form.setWordWrap(True)

        # Layout
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(3 * GRID)
        layout.addWidget(self._dial, 1)
        column = QVBoxLayout()
        column.setSpacing(2 * GRID)
        column.addWidget(self._table)
        column.addWidget(self._form)
        column.addStretch(1)
        layout.addLayout(column, 2)

        self._retranslate()

    @override
    def _retranslate(self) -> None:
        self._table.setAccessibleName(self.tr("Cone by each posture / mm"))
        self._refresh()

    @override
    def _refresh(self) -> None:
        found = None if self._shown is None else self._shown[1].articulation
        self._dial.set_value(self._dial_value())
        heads = *(f"{axis} / mm" for axis in AXES), self.tr("Spread / mm")
        if found is None:
            places = [scatter_of(run) for run in self._own_runs()]
            locations = [place.mean for place in places]
            spreads = [_farthest(place) for place in places]
        else:
            locations, spreads = list(found.locations), found.spreads.tolist()
        cells = tuple(
            (*_lengths(place), number_text(spread, DECIMALS))
            for place, spread in zip(locations, spreads, strict=True)
        )
        names = tuple(str(i + 1) for i in range(len(cells)))
        self._table.set_value(Figures(heads, names, cells))
        words = self.tr("In the form of ISO 10360-12: five postures of five touches.")
        if found is not None:
            words += " " + self.tr(
                "Location error {0} mm, {1} mm to be expected."
            ).format(
                number_text(found.location_error, DECIMALS),
                number_text(found.expected, DECIMALS),
            )
        self._form.setText(words)

    def _dial_value(self) -> DialValue:
        if self._shown is None:
            return DialValue()
        setup, state = self._shown
        touched = [*chain.from_iterable(self._own_runs()), *self._own_touches()]
        if state.task(setup) is not self.kind:
            return DialValue()
        pen = setup.instrument.pen
        postures = [posture_of(pen, touch.rotation) for touch in touched]
        return dial_of(postures, live_posture(setup, state))


class DriftFinding(TaskFinding):
    """The visits of the witness, and how far it moved since the first."""

    kind = TaskKind.DRIFT

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)

        # Widgets
        self._table = NumberTable()
        self._told = text_label(TextSize.BODY, Tone.QUIET)
        self._told.setWordWrap(True)

        # Layout
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(2 * GRID)
        layout.addWidget(self._table)
        layout.addWidget(self._told)
        layout.addStretch(1)

        self._retranslate()

    @override
    def _retranslate(self) -> None:
        self._table.setAccessibleName(self.tr("Moves of the witness / mm"))
        self._refresh()

    @override
    def _refresh(self) -> None:
        drift = None if self._shown is None else drift_so_far(*self._shown)
        if drift is None:
            self._table.set_value(Figures())
            self._told.setText(
                self.tr(
                    "A cone that stands still is the witness: what it moves by from "
                    "one visit to the next counts in U of what is touched in between."
                )
            )
            return
        heads = (
            *(f"{axis} / mm" for axis in AXES),
            *(self.tr("U of {0} / mm").format(axis) for axis in AXES),
        )
        rows = zip(drift.moves, drift.uncertainties, strict=True)
        cells = tuple((*_lengths(move), *_lengths(u)) for move, u in rows)
        names = tuple(
            self.tr("Visit {0}").format(i + 1) for i in range(len(drift.names))
        )
        self._table.set_value(Figures(heads, names, cells))
        shares = ", ".join(_lengths(drift.share))
        words = self.tr("Standard uncertainty by it along u, v, w: {0} mm.")
        self._told.setText(words.format(shares))


def dial_of(touched: list[Posture], posture: Posture | None) -> DialValue:
    """Return a dial of which each field is full that was touched in."""
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
    """Return how the pen is held now, where it is seen."""
    touching = state.touching
    if not touching.held or touching.n_lost:
        return None
    return posture_of(setup.instrument.pen, touching.held[-1].frame.rotation)


def _places(found: Length, limit: float) -> tuple[tuple[str, ...], ...]:
    rows = zip(
        found.runs, found.errors.tolist(), found.uncertainties.tolist(), strict=True
    )
    return tuple(
        tuple(number_text(x, DECIMALS) for x in (run.measured, error, u, limit))
        for run, error, u in rows
    )


def _farthest(scatter: Scatter) -> float:
    """Return the largest distance of a point from the mean, mm."""
    return float(np.linalg.norm(scatter.points - scatter.mean, axis=1).max())


def _numbers(values: FloatArray, decimals: int) -> tuple[str, ...]:
    """Return the values of the runs, and their average where there are several."""
    average = [values.mean()] if len(values) > 1 else []
    return tuple(number_text(float(x), decimals) for x in [*values, *average])


def _lengths(point: FloatArray) -> tuple[str, ...]:
    return tuple(number_text(float(x), DECIMALS) for x in point)
