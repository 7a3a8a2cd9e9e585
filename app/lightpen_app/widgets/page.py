"""Base of the wizard pages: title, rules and main action of a step."""

from dataclasses import dataclass

from PySide6.QtCore import QCoreApplication, Signal
from PySide6.QtWidgets import QWidget
from typing_extensions import override

from lightpen_app.look.theme import Tone
from lightpen_app.widgets.fields import Translated


@dataclass(frozen=True)
class MainAction:
    """The main button of a page."""

    text: str  # label, a verb first
    # Why it cannot be pressed now; empty when it can. The reason is shown.
    why_not: str = ""
    # Whether only someone at the screen can press it, not a remote.
    at_screen: bool = False
    # Whether the step is not complete yet; the button then stands back.
    is_early: bool = False


def step_titles() -> dict[str, str]:
    """Return the names of the steps by their keys, one to three words each, in order.

    They are shown before the pages are made.
    """
    translate = QCoreApplication.translate
    return {
        "start": translate("StartPage", "Start"),
        "camera": translate("CameraPage", "Camera"),
        "leds": translate("LedsPage", "LEDs"),
        "swing": translate("SwingPage", "Swing"),
        "review": translate("ReviewPage", "Review"),
        "history": translate("HistoryPage", "History"),
    }


class Page(Translated, QWidget):
    """Base of the pages; methods that raise NotImplementedError are abstract.

    A page takes the room that it is given: what needs more scrolls in it, or is
    arranged otherwise.

    The rules behind `is_complete` and `why_closed` live in the core, where they are
    tested without Qt. A page touches no other page and no window: it emits.
    """

    # Names the step in the settings and its help file: "start", "camera" and so on.
    key = ""
    shows_images = False  # whether live images are shown on it
    changed = Signal()  # properties of the page, such as its main action, have changed
    advance_requested = Signal()  # show the next step
    # Key of the step to show, such as the one of a resumed swing.
    step_requested = Signal(str)
    operator_value_changed = Signal(object)  # OperatorValue
    data_folder_requested = Signal()  # choose another data folder
    discovery_requested = Signal()  # find pen and camera without files

    def title(self) -> str:
        """Return the name of the step."""
        return step_titles()[self.key]

    def heading(self) -> str:
        """Return the heading of the page; by default, the name of the step."""
        return self.title()

    def lead(self) -> str:
        """Return the purpose of the step, a sentence below the title."""
        return ""

    def lead_tone(self) -> Tone:
        """Return the colour of that sentence."""
        return Tone.QUIET

    def is_complete(self) -> bool:
        """Return whether the step is complete."""
        raise NotImplementedError

    def is_doubtful(self) -> bool:
        """Return whether the step was completed with warnings."""
        return False

    def why_closed(self) -> str:
        """Return why the step is locked; empty if it is not."""
        return ""

    def main_action(self) -> MainAction:
        """Return the present action of the main button."""
        raise NotImplementedError

    def run_main_action(self) -> None:
        """Run the main action; by default, go to the next step."""
        self.advance_requested.emit()

    def show_missing_input(self) -> None:
        """Focus the first missing input."""

    def is_hands_free(self) -> bool:
        """Return whether the operator is at the cone, away from the keys.

        Then Space, PageUp and PageDown work wherever the focus is.
        """
        return False

    def toggle_pause(self) -> None:
        """Pause or resume on Space."""

    def first_control(self) -> QWidget | None:
        """Return the initial focus; None for the first widget."""
        return None

    def entered(self) -> None:
        """Begin: the page is now shown."""

    def left(self) -> None:
        """Stop everything that only a visible page does."""

    def unsaved(self) -> str:
        """Return the question before the window closes; empty if nothing is unsaved."""
        return ""

    def shut_down(self) -> None:
        """Cancel jobs, stop threads, close cameras: the window closes."""

    @override
    def _refresh(self) -> None:
        """Translate every text; by default there is none."""
