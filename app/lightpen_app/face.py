"""What an extension adds to the window."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeAlias, TypeVar

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import QFrame, QWidget
from typing_extensions import override

from lightpen.record.swings.header import Names
from lightpen_app.look.sounds import Sounds
from lightpen_app.look.theme import Tone
from lightpen_app.widgets.fields import Translated
from lightpen_app.widgets.page import Page
from lightpen_app.widgets.state_banner import StatusMessage
from lightpen_app.work.live_view import LiveView
from lightpen_app.work.workbench import Workbench

if TYPE_CHECKING:  # they take long to be imported
    from lightpen.archive.chains import Event, StoredEntry
    from lightpen.archive.trends import Trend
    from lightpen.live.sources import Operator
    from lightpen.model.names import Laboratory
    from lightpen.record.exports import ExportFormat
    from lightpen.record.swings.solving import Solution
    from lightpen.swing.status import SwingStatus
    from lightpen_app.work.chosen_files import SavePlace

T = TypeVar("T")
W = TypeVar("W", bound=QWidget)


@dataclass(frozen=True)
class ReadinessItem:
    """One precondition of a swing."""

    step: str  # key of the step where it is put right
    name: str  # a word or two
    message: StatusMessage
    action: str  # the main button that leads there, a verb first

    @property
    def is_amber(self) -> bool:
        """Whether it needs an action."""
        return self.message.tone is Tone.WARN


@dataclass(frozen=True)
class RowWords:
    """Texts on interrupted work."""

    heading: str
    description: str
    question: str
    # Label of each button, and its accessible name.
    resume: tuple[str, str]
    discard: tuple[str, str]


class InterruptedWork:
    """Work of an extension that was interrupted."""

    names: Names | None = None  # what it was done with; None of what is damaged

    def words(self) -> RowWords:
        """Return the texts of its row, in the language of the window."""
        raise NotImplementedError

    def resume(self) -> str:
        """Go on with it, with its names chosen; return what the user waits for."""
        raise NotImplementedError

    def closing_text(self) -> str:
        """Return what the user waits for while it is closed."""
        raise NotImplementedError

    def close(self) -> None:
        """Close it as abandoned, in a job."""
        raise NotImplementedError

    def closed_text(self) -> str:
        """Return the sentence once it is closed."""
        raise NotImplementedError


@dataclass(frozen=True)
class DemoStep:
    """What the demo shows of an extension after a tip is accepted."""

    key: str  # of its page
    text: str
    begin: Callable[[], None]
    is_done: Callable[[], bool]  # asked again and again


@dataclass(frozen=True)
class MenuEntry:
    """An entry of the menu of options."""

    text: Callable[[], str]  # in the language of the window
    choose: Callable[[QWidget], None]  # given the window


class ReportPrinter(QObject):
    """Shows the report of a result; this one cannot, without an extension that does."""

    saved = Signal(object)  # Path: the PDF that was written
    failed = Signal(str)  # the sentence why something is not shown, or was not saved

    is_here = False

    def show(self, find: Callable[[], Path]) -> None:
        """Show the report of the calibration that a function finds on the disk."""

    def show_verification(self, path: Path) -> None:
        """Show the report of a verification."""

    def shut_down(self) -> None:
        """Cancel what is not shown yet."""


class SimulatorControls(Translated, QFrame):
    """Controls of the simulated operator, hidden with a real pen; these are empty.

    A subclass calls `_follow_connection` once it has its buttons.
    """

    def __init__(self, live: LiveView) -> None:
        super().__init__()
        self._live = live
        self.hide()

        # Connections
        live.connection_changed.connect(self._follow_connection)

    def invite(self) -> None:
        """Let the operator work, as the button of `set_inviting` invites to."""

    def set_inviting(self, inviting: bool) -> None:
        """Draw a button filled: one button of a page is, at most."""

    def _follow_connection(self) -> None:
        """Show the controls for a simulated operator; each camera has its own."""
        self.setVisible(self._live.operator is not None)

    def _command(self, act: "Callable[[Operator], object]") -> None:
        """Have the operator do something, if there is one."""
        if operator := self._live.operator:
            act(operator)


class BudgetRow(QWidget):
    """Checks the budget of a solution, below its plot."""

    def set_value(self, solution: "Solution") -> None:
        """Show another solution and discard what was found of the earlier one."""
        raise NotImplementedError

    def stop(self) -> None:
        """Compute no more."""
        raise NotImplementedError


class PressComparison(QObject):
    """Compares a swing with firm pressure with the light one; this one cannot."""

    compared = Signal(object)  # Callable[[], StatusMessage]: words on the bending

    is_here = False

    def follow(self, status: "SwingStatus") -> None:
        """Compare the swings of a status, if there are two."""

    def shut_down(self) -> None:
        """Compare no more."""


class SelectionTab(QWidget):
    """A tab of the step History on the entries that are selected there."""

    verification_kept = Signal(object)  # Path: it is entered, and to be reported

    def title(self) -> str:
        """Return its title, in the language of the window."""
        raise NotImplementedError

    def set_value(self, selected: "Sequence[StoredEntry]", trend: "Trend") -> None:
        """Show other entries, and the trend of the current one."""
        raise NotImplementedError


class Service(QObject):
    """An extension at work in one window; by default it does nothing.

    It is made after the workbench and before the pages. What it starts and ends with
    the workbench it adds to the workbench's `parts`.
    """

    remark_changed = Signal()  # `remark` is different
    changed = Signal()  # `readiness` or `is_here` may be different
    resumed = Signal(str)  # interrupted work goes on at the step of this key
    refused = Signal()  # interrupted work cannot go on

    step_requested = Signal(str)  # key of the step to show

    verify_step = ""  # key of its page where a tip is verified
    calibrates_cameras = False  # by `calibrate_camera`
    discovers = False  # finds pen and camera without files, by `discover`

    @property
    def is_here(self) -> bool:
        """Whether an operator is present, who is shown its page and not the swing."""
        return False

    def titles(self) -> tuple[str, ...]:
        """Return the titles of its pages, shown before these are made."""
        return ()

    def pages(self, sounds: Sounds) -> Iterator[Page]:
        """Make its pages one after the other, and import their modules only then."""
        return iter(())

    def menu_entries(self) -> tuple[MenuEntry, ...]:
        """Return what it adds to the menu of options."""
        return ()

    def remark(self) -> StatusMessage:
        """Return what is shown beside the steps on every page."""
        return StatusMessage()

    def discover(self, window: QWidget, *, is_camera_known: bool) -> None:
        """Show what finds pen and camera, or the pen alone, without files."""
        raise NotImplementedError

    def calibrate_camera(self, page: QWidget, on_saved: Callable[[str], None]) -> None:
        """Show what calibrates a camera; call with the path of each file written."""
        raise NotImplementedError

    def close(self) -> None:
        """Close its windows: that of the program closes."""

    def readiness(self) -> tuple[ReadinessItem, ...]:
        """Return its preconditions of a swing."""
        return ()

    def export_formats(self) -> "tuple[ExportFormat, ...]":
        """Return formats in which a calibration can be saved."""
        return ()

    def ask_laboratory(
        self, page: QWidget, then: "Callable[[Laboratory], object]"
    ) -> None:
        """Ask for the laboratory that its formats name, and pass it on."""
        raise NotImplementedError

    def report_printer(self, place: "SavePlace", page: QWidget) -> ReportPrinter | None:
        """Make what shows reports, for a page."""
        return None

    def budget_row(self) -> BudgetRow | None:
        """Make a check of the budget."""
        return None

    def swing_controls(self) -> SimulatorControls | None:
        """Make the controls of the simulated operator for the step Swing."""
        return None

    def press_comparison(self) -> PressComparison | None:
        """Make what compares a press test, for the step Review."""
        return None

    def selection_tab(self) -> SelectionTab | None:
        """Make a tab of the step History."""
        return None

    def event_text(self, event: "Event") -> str:
        """Return the kind of its entry in the archive; empty for an entry of others."""
        return ""

    def find_interrupted(self) -> tuple[InterruptedWork, ...]:
        """Return interrupted work, in a job."""
        return ()

    def demo_steps(self) -> tuple[DemoStep, ...]:
        """Return what the demo shows of it."""
        return ()


class WindowService(Service, Generic[W]):
    """Shows a window of its own, made when it is first asked for."""

    def __init__(self, workbench: Workbench) -> None:
        super().__init__(workbench)
        self._workbench = workbench
        self._window: W | None = None

    def _show_window(self, make: Callable[[], W]) -> W:
        if self._window is None:
            self._window = make()
        self._window.show()
        self._window.raise_()
        return self._window

    @override
    def close(self) -> None:
        if self._window is not None:
            self._window.close()


Services: TypeAlias = Sequence[Service]


def first_of(services: Services, part: Callable[[Service], T]) -> T | None:
    """Return what the first extension that has it gives for a part."""
    return next(filter(None, map(part, services)), None)


def verify_step(services: Services) -> str:
    """Return the key of the page where a tip is verified; empty for none."""
    return first_of(services, lambda each: each.verify_step) or ""


def report_printer(
    services: Services, place: "SavePlace", page: QWidget
) -> ReportPrinter:
    """Return what shows reports for a page."""
    found = first_of(services, lambda each: each.report_printer(place, page))
    return found or ReportPrinter(page)
