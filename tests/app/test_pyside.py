"""The installed PySide6 bears long use; some releases abort on some Pythons."""

import subprocess
import sys

# PySide6 6.12.0 on Python 3.11 drops a reference to True with each emit and dies
# after some hundred; an abort is seen only from outside the process.
LONG_USE = """
from PySide6.QtCore import QObject, Signal

class Source(QObject):
    fired = Signal(bool)

source = Source()
seen = []
source.fired.connect(seen.append)
for i in range(20_000):
    source.setObjectName(f"source {i}")
for _ in range(5_000):
    source.fired.emit(True)
print(source.objectName(), len(seen))
"""


def run(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-X", "utf8", "-c", code],
        capture_output=True,
        text=True,
        check=False,
    )


def test_thousands_of_names_and_signals_leave_the_process_alive() -> None:
    result = run(LONG_USE)

    assert result.returncode == 0, result.stderr
    assert result.stdout.split() == ["source", "19999", "5000"]
