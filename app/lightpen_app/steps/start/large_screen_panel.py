"""Panel of Start on a very large screen: trend of the tip."""

from typing import TYPE_CHECKING

from PySide6.QtWidgets import QWidget

from lightpen.archive.logbook.lazy_logbook import LazyLogbook
from lightpen_app.look.layouts import vertical_layout
from lightpen_app.widgets.lazy import LazyWidget
from lightpen_app.work.job import LatestJob, Report

if TYPE_CHECKING:
    from lightpen.comparisons.trend import Trend
    from lightpen_app.widgets.trend_panel import TrendPanel

LEAST_TREND = 2  # calibrations; of one there is nothing to see but its figures


class LargeScreenPanel(QWidget):
    """Shows the trend of a tip that has one."""

    def __init__(self, logbook: LazyLogbook) -> None:
        super().__init__()
        self._logbook = logbook
        self._job = LatestJob(self)

        # Widgets
        self._trend = LazyWidget(_make_trend)

        # Layout
        vertical_layout(self, self._trend, spacing=-1)
        self._trend.hide()

    def set_value(self, pen: str, tip: str, *, is_simulated: bool) -> None:
        """Show another tip; one without a name has no trend."""
        self.shut_down()
        if not (pen and tip):
            self._show(None)
            return
        logbook = self._logbook

        def read(_: Report) -> "Trend":
            # Imported here: with the archive it takes 0.25 s.
            from lightpen.archive.history.queries import EntryFilter
            from lightpen.comparisons.trend import trend_of

            wanted = EntryFilter(pen=pen, tip=tip, is_simulated=is_simulated)
            return trend_of(logbook.opened().database, wanted)

        # History shows why it failed.
        self._job.start(read, self._show, lambda _: self._show(None))

    def shut_down(self) -> None:
        """Cancel running jobs."""
        self._job.cancel()

    def _show(self, trend: "Trend | None") -> None:
        has_trend = trend is not None and len(trend.entries) >= LEAST_TREND
        if trend is not None and has_trend:
            self._trend.content().set_value(trend)
        self._trend.setVisible(has_trend)


def _make_trend() -> "TrendPanel":
    # Imported here: plots take a fifth of the start time, and the first window has
    # none.
    from lightpen_app.widgets.trend_panel import TrendPanel

    return TrendPanel()
