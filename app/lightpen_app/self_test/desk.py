"""The checks that need the libraries: window, fonts, records, and the whole wizard."""

import os
import sys
from pathlib import Path
from types import TracebackType

from PySide6.QtCore import QTimer
from PySide6.QtGui import QFont, QFontDatabase, QFontMetrics, QGuiApplication

from lightpen.cameras.clock import SkippingClock
from lightpen.live.sources import Surroundings
from lightpen.record.folder_archive import RECORDS, RESULTS, FolderArchive
from lightpen.record.reading import open_record
from lightpen.record.results import Result
from lightpen_app.application import Wizard, has_display, make_application
from lightpen_app.crash import versions
from lightpen_app.look.theme import FAMILIES, load_fonts
from lightpen_app.self_test.report import SelfTestError, Tip
from lightpen_app.self_test.swing import N_IMAGES, NAMES, SCENE, record_swing
from lightpen_app.self_test.walk import Walk
from lightpen_app.wizard_pages import make_pages
from lightpen_app.work.settings import Settings

LETTERS = "Aaµ°±光笔校准"


class Desk:
    """An application with a data folder of its own.

    Parameters
    ----------
    folder : Path
        For records, results and settings; nothing of the user's is touched.
    """

    def __init__(self, folder: Path) -> None:
        self._data = folder / "data"
        self._files = folder / "files"
        self._settings = folder / "lightpen.json"
        self._record = self._data / RECORDS / "self-test"
        if not has_display():
            os.environ["QT_QPA_PLATFORM"] = "offscreen"
        self._application = make_application(sys.argv[:1])

    def versions(self) -> dict[str, str]:
        """Return the versions of what the program is made of."""
        return versions()

    def platform(self) -> str:
        """Return through what Qt draws."""
        return QGuiApplication.platformName()

    def tested_fonts(self) -> str:
        """Return the fonts that were found to have all letters."""
        load_fonts()
        missing = set(FAMILIES) - set(QFontDatabase.families())
        if missing:
            raise SelfTestError(f"Not among the fonts: {', '.join(sorted(missing))}.")
        metrics = [QFontMetrics(QFont(family)) for family in FAMILIES]
        for letter in LETTERS:
            if not any(each.inFontUcs4(ord(letter)) for each in metrics):
                raise SelfTestError(f"The fonts have no {letter}.")
        return ", ".join(FAMILIES)

    def tested_record(self) -> str:
        """Write a rendered swing, and read it back."""
        record_swing(self._record, self._files)
        n_images = len(open_record(self._record).images)
        if n_images != N_IMAGES:
            raise SelfTestError(f"{n_images} of {N_IMAGES} images came back.")
        return f"{n_images} images written and read back"

    def walked_wizard(self, picture: Path) -> str:
        """Have the wizard find and accept the tip of the swing; draw it at its end."""
        around = Surroundings(SCENE, SkippingClock(rests=True))
        settings = Settings(self._settings)
        wizard = Wizard(self._application, make_pages, settings, self._data, around)
        walk = Walk(wizard, self._record)
        troubles: list[str] = []

        def end() -> None:
            if not wizard.window.grab().save(str(picture)):
                troubles.append(f"The picture {picture} cannot be written.")
            wizard.window.close()

        def give_up(
            kind: type[BaseException],
            error: BaseException,
            trace: TracebackType | None,
        ) -> None:
            previous(kind, error, trace)
            troubles.append(f"{kind.__name__}: {error}")
            wizard.window.close_unasked()

        previous, sys.excepthook = sys.excepthook, give_up
        walk.ended.connect(end)
        wizard.workbench.troubled.connect(troubles.append)
        wizard.window.show()
        wizard.workbench.start()
        QTimer.singleShot(0, walk.start)
        try:
            self._application.exec()
        finally:
            sys.excepthook = previous
        if troubles:
            raise SelfTestError(" ".join(troubles))
        return "opened, finished, reviewed and accepted"

    def tested_result(self) -> str:
        """Return where the accepted result was found again, in force."""
        return f"{self._result().names.pen} in {RESULTS}, grade {self._result().grade}"

    def tip(self) -> Tip:
        """Return the tip of the accepted result, and the true one."""
        result = self._result()
        return Tip(
            result.tip_pen.tolist(),
            SCENE.tip_pen.tolist(),
            result.uncertainty.tolist(),
        )

    def _result(self) -> Result:
        result = FolderArchive(self._data).in_force(
            NAMES.pen, NAMES.tip, is_simulated=True
        )
        if result is None:
            raise SelfTestError("The accepted result is not in force.")
        return result
