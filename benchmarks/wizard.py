"""The wizard as its operator meets it: its start, its pace, its memory."""

import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.rows import Row

from lightpen.cameras.sources import source_named

HERE = Path(__file__).parent
N_STARTS = 5
IDLE_SECONDS = 20
QUIET_LIMIT, WATCHED_LIMIT = 0.05, 0.10  # of one core, without and with a live image
QUIET = ("start", "minimised")
CAPTURING = "swing, capturing"  # of `idle_wizard.py`
START_LIMIT = 1.0  # s
LINK_SECONDS = 20
LEAST_LINK_RATE = 20.0  # images/s
MOST_REPORTED, MOST_BACK, MOST_CLOSING = 7.0, 5.0, 3.0  # s
LONGEST_END = 60.0  # s that a process is given to end
SOAK_SECONDS = 600
LEAST_RATE = 18.0  # images/s
MOST_LATE = 50.0  # ms
LEAST_PLOT_RATE = 5.0  # Hz
MOST_MEMORY = 500.0  # MB
# Of Qt; the second opens real windows where there is an X server without a monitor.
PLATFORMS = ("offscreen", "xcb") if shutil.which("xvfb-run") else ("offscreen",)
EVENT_SECONDS = 600
MOST_LATE_AT_EVENTS = 100.0  # ms
EVENT_GROWTH = 30.0  # MB, after every page was opened
OPENED_MINUTES = 2
GROWTH = 10.0  # MB after the first minute that count as none: two images


def start_rows() -> list[Row]:
    """Return how long the wizard takes to start."""
    what = "wizard: process start to a painted window that answers a key"
    if sys.platform != "linux":
        return [Row(what, "needs Linux")]
    command = (sys.executable, str(HERE / "start_wizard.py"))
    rows = []
    for platform in PLATFORMS:
        with tempfile.TemporaryDirectory() as folder:
            compiled = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": folder}
            times = [
                # as once it is installed
                [float(each) for each in _shown(platform, command, compiled).split()]
                for _ in range(N_STARTS + 1)
            ][1:]
        median, busy = map(statistics.median, zip(*times, strict=True))
        rows.append(
            Row(
                f"{what}, {platform}",
                f"{median:.2f} s; of processor time {busy:.2f} s",
                f"<= {START_LIMIT} s",
                met=median <= START_LIMIT,
            )
        )
    return rows


def idle_rows(seconds: float = IDLE_SECONDS) -> list[Row]:
    """Return how busy the wizard keeps a processor core while nothing happens."""
    what = "wizard, idle: share of one core"
    if sys.platform != "linux":
        return [Row(what, "needs Linux")]
    command = (sys.executable, str(HERE / "idle_wizard.py"), str(seconds))
    rows = []
    for platform in PLATFORMS:
        shares = json.loads(_shown(platform, command))
        for page, share in shares.items():
            limit = QUIET_LIMIT if page in QUIET else WATCHED_LIMIT
            if page == CAPTURING:
                limit = 1.0
            elif page.startswith(CAPTURING):  # the window is hidden
                limit = 0.5 * shares[CAPTURING]
            rows.append(
                Row(
                    f"{what}, {page}, {platform}",
                    f"{share:.1%}",
                    f"<= {limit:.0%}",
                    met=share <= limit,
                )
            )
    return rows


def link_rows(seconds: float = LINK_SECONDS) -> list[Row]:
    """Return how many images of a camera on a link a swing takes."""
    what = (
        "wizard, swing from Aravis' GigE Vision simulator: 2448 x 2048 Mono8 at 25 "
        "images a second, packets of 16000"
    )
    aravis = source_named("aravis")
    if aravis is None or aravis.why_absent() is not None:
        return [Row(what, "needs Aravis")]
    command = [sys.executable, str(HERE / "linked_wizard.py"), str(seconds)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as wizard:
        assert wizard.stdout is not None
        found = json.loads(wizard.stdout.readline())
        start = time.perf_counter()
        wizard.communicate(timeout=LONGEST_END)
        closing = time.perf_counter() - start
    rate = (found["delivered"] - found["skipped"]) / found["seconds"]
    return [
        Row(
            f"{what}: images processed",
            f"{rate:.1f} a second; {found['incomplete']} incomplete, "
            f"{found['missed']} missed, {found['skipped']} skipped, all counted",
            f">= {LEAST_LINK_RATE:.0f} a second",
            met=rate >= LEAST_LINK_RATE,
        ),
        Row(
            "- link cut: time until reported; link restored: time until images arrive",
            f"{found['reported']:.1f} s; {found['back']:.1f} s",
            f"<= {MOST_REPORTED:.0f} s; <= {MOST_BACK:.0f} s",
            met=found["reported"] <= MOST_REPORTED and found["back"] <= MOST_BACK,
        ),
        Row(
            "- the program closed while it is cut off",
            f"{closing:.1f} s",
            f"<= {MOST_CLOSING:.0f} s",
            met=closing <= MOST_CLOSING,
        ),
    ]


def soak_rows(seconds: float = SOAK_SECONDS) -> list[Row]:
    """Return pace and memory of swing after swing at 2448 x 2048."""
    minutes = seconds / 60
    name = f"wizard, {minutes:.0f} minutes of swings at 2448 x 2048, 20 images a second"
    if sys.platform != "linux":
        return [Row(name, "needs Linux")]
    found = json.loads(
        _output([sys.executable, str(HERE / "soak_wizard.py"), str(seconds)])
    )
    rate = found["images"] / found["seconds"]
    median, late, latest = found["lateness_ms"]
    sizes = found["memory_minutes_mb"]
    growth = sizes[-1] - sizes[min(1, len(sizes) - 1)]  # the second follows the first
    minutes_mb = ", ".join(f"{size:.0f}" for size in sizes)
    return [
        Row(
            f"{name}: images processed",
            f"{rate:.1f} a second, {found['lost']} lost, {found['swings']} swings "
            "solved meanwhile",
            f">= {LEAST_RATE:.0f} a second",
            met=rate >= LEAST_RATE,
        ),
        Row(
            "- lateness of a 10 ms timer on the GUI thread, p99",
            f"{late:.0f} ms (median {median:.1f}, most {latest:.0f})",
            f"< {MOST_LATE:.0f} ms",
            met=late < MOST_LATE,
        ),
        Row(
            f"- slowest of {found['n_plots']} plots",
            f"painted {found['plots_hz']:.1f} times a second",
            f">= {LEAST_PLOT_RATE:.0f}",
            met=found["plots_hz"] >= LEAST_PLOT_RATE,
        ),
        Row(
            "- memory at most; from the second minute to the last",
            f"{found['memory_mb']:.0f} MB; {growth:+.0f} MB (by the minute: "
            f"{minutes_mb})",
            f"<= {MOST_MEMORY:.0f} MB, no growth (to {GROWTH:.0f} MB)",
            met=found["memory_mb"] <= MOST_MEMORY and growth <= GROWTH,
        ),
    ]


def event_rows(seconds: float = EVENT_SECONDS) -> list[Row]:
    """Return what random events do to the wizard with two cameras at 2448 x 2048."""
    name = f"wizard, {seconds / 60:.0f} minutes of random events, two cameras"
    if sys.platform != "linux":
        return [Row(name, "needs Linux")]
    command = [sys.executable, str(HERE / "random_events.py"), str(seconds)]
    found = json.loads(_output(command).splitlines()[-1])
    median, late, latest = found["lateness_ms"]
    on_core, computed = found["lateness_on_core_ms"][1], found["thread_ms"]
    sizes = found["memory_minutes_mb"]
    settled = sizes[OPENED_MINUTES:] or sizes
    growth = max(settled) - settled[0]
    minutes_mb = ", ".join(f"{size:.0f}" for size in sizes)
    return [
        Row(
            f"{name}: uncaught exceptions, of {found['events']} events",
            str(found["errors"]),
            "0",
            met=not found["errors"],
        ),
        Row(
            "- lateness of a 10 ms timer on the GUI thread, p99",
            f"{late:.0f} ms (median {median:.1f}, most {latest:.0f}); without "
            f"waiting for a processor core {on_core:.0f} ms; of processor time "
            f"{computed[1]:.0f} ms (most {computed[2]:.0f}); other programs took "
            f"{found['cores_of_others']:.1f} cores",
            f"< {MOST_LATE_AT_EVENTS:.0f} ms",
            met=late < MOST_LATE_AT_EVENTS,
        ),
        Row(
            "- memory, the largest later minute above the third",
            f"{growth:+.0f} MB (by the minute: {minutes_mb})",
            f"<= {EVENT_GROWTH:.0f} MB",
            met=growth <= EVENT_GROWTH,
        ),
    ]


def _shown(
    platform: str, command: Sequence[str], variables: Mapping[str, str] | None = None
) -> str:
    """Return what a program prints that opens windows on a platform of Qt's."""
    if platform == "xcb":
        command = ("xvfb-run", "-a", *command)
    return _output(command, {"QT_QPA_PLATFORM": platform, **(variables or {})})


def _output(command: Sequence[str], variables: Mapping[str, str] | None = None) -> str:
    return subprocess.run(
        command,
        check=True,
        stdout=subprocess.PIPE,
        encoding="utf-8",
        env={**os.environ, **(variables or {})},
    ).stdout
