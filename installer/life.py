"""The life of an installation, step by step: each says what it expects of it."""

import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

from installer.places import IS_WINDOWS
from installer.trial import (
    CLASSES,
    IMAGE,
    UNINSTALL,
    UNINSTALL_ALL,
    Trial,
    await_so,
    last_option,
)

from lightpen.detection.pen_detection import detect_pen
from lightpen.formats.opened_files import CameraFile, PenFile
from lightpen.model.limits import SwingLimits
from lightpen.record.swings.header import Names
from lightpen.record.swings.reading import OPENER, open_record
from lightpen.record.swings.writing import RecordWriter
from lightpen.swing.preparation import Preparation
from lightpen.swing.swing_recorder import record_header
from lightpen_extensions.simulator.image_plans import plan_scene, render_plan
from lightpen_extensions.simulator.scene_files import write_sample_files
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import paper_camera
from lightpen_program.self_test import FILE_LIST, damaged_files

RUNNING, NEWER, FOREIGN = 5, 6, 7  # exit status of the installer
USUAL_PLATFORM = "offscreen"  # on which windows are seen nowhere
NOTES = "my notes 笔记.txt"
# For cameras, for archives, for workbooks, and for the keys of stations.
NEEDED = (
    "harvesters.core",
    "psycopg",
    "python_calamine",
    "cryptography.hazmat.bindings._rust",
)
SIZE_LIMIT = 350e6  # bytes installed
PERIOD_S = 0.1  # s from image to image
# With blanks and letters that a Windows of another language has no code page for.
NAMES = Names("Prüfstand 1", "自检", "SELF-TEST", "T-1 ä", "C-1", 10.0)
SCENE = Scene(n_images=60, camera=paper_camera(binning=2), led_noise=0.0)


def try_installation(trial: Trial, version: str) -> None:
    """Install in silence, and look at all that is there then."""
    outcome = trial.install("/DESKTOP")
    trial.expect("installs in silence", outcome.status == 0, outcome)
    look_over(trial, version)
    trial.expect("icon on the desktop", _desktop(trial).exists())


def look_over(trial: Trial, version: str) -> None:
    """Compare files, registry and menu with what an installation must bring."""
    wrong = damaged(trial)
    trial.expect("all files as they were built", not wrong, wrong[:5])
    size = sum(p.stat().st_size for p in trial.folder.rglob("*") if p.is_file())
    trial.expect(f"{size / 1e6:.0f} MB installed", size <= SIZE_LIMIT)
    trial.expect(
        f"version {version}", trial.value(UNINSTALL, "DisplayVersion") == version
    )
    place = trial.value(UNINSTALL, "InstallLocation")
    # The console of Wine has no letters of the user's name.
    is_there = place.endswith(r"\AppData\Local\Programs\Lightpen")
    trial.expect("place", is_there, place)
    quiet = trial.value(UNINSTALL, "QuietUninstallString")
    trial.expect("quiet uninstaller", quiet.endswith('uninstall.exe" /S'), quiet)
    for kind in ("Swing", "Result"):
        command = trial.value(rf"{CLASSES}\Lightpen.{kind}\shell\open\command")
        is_right = command.endswith(r'\Lightpen.exe" open "%1"')
        trial.expect(f"opens a {kind.lower()}", is_right, command)
    owner = trial.value(rf"{CLASSES}\.lightpen")
    trial.expect("owns .lightpen", owner == "Lightpen.Swing", owner)
    links = sorted(path.name for path in _menu(trial).glob("*.lnk"))
    trial.expect("two entries in the menu", len(links) == 2, links)
    system = trial.value(UNINSTALL_ALL, "DisplayName")
    trial.expect("nothing for all users", not system, system)


def try_chinese(trial: Trial) -> None:
    """Install on a Chinese Windows, and remove it again."""
    trial.install()
    links = [path.name for path in _menu(trial).glob("*.lnk")]
    trial.expect("speaks Chinese", "Lightpen 命令行.lnk" in links, links)
    trial.uninstall()
    trial.expect("and is removed", not trial.folder.exists())


def try_self_test(trial: Trial, platform: str) -> dict[str, Any]:
    """Run the self-test, and return its report."""
    there = replace(trial, machine=trial.machine.with_platform(platform))
    report = there.self_test()
    trial.machine.with_platform(USUAL_PLATFORM)
    failed = [check for check in report["checks"] if not check["ok"]]
    trial.expect(f"self-test on {platform}", report["ok"], failed or report)
    if report["ok"]:
        found = {check["name"]: check["found"] for check in report["checks"]}
        drawn = found["window system"]
        trial.expect(f"it draws through {platform}", drawn == platform, drawn)
        for name in NEEDED:
            loads = name in found["imports"]
            trial.expect(f"{name} loads", loads, found["imports"])
        program = report["executable"]
        trial.expect("it is Lightpen.exe that runs", program.endswith(IMAGE), program)
    return report


def try_entry_points(trial: Trial, version: str) -> None:
    """Use the command line."""
    said = trial.console("--version")
    trial.expect("console tells its version", said.output.strip() == version, said)
    work = trial.machine.drive / "Messung ä 测量"
    work.mkdir()
    made = trial.console("simulate", "set 校", "--images", "20", folder=work)
    trial.expect("console simulates", made.status == 0, made)
    files = ("--camera", "set 校/camera.yaml", "--pen", "set 校/leds.csv")
    record = ("--json", "record.json")
    found = trial.console("calibrate", "set 校/images", *files, *record, folder=work)
    has_tip = re.search(r"^ *joint .*[0-9]", found.output, re.MULTILINE) is not None
    trial.expect("console calibrates", found.status == 0 and has_tip, found)
    trials = ("record.json", "--monte-carlo", "20", "--workers", "2")
    again = trial.console("recalculate", *trials, folder=work)
    is_done = again.status == 0 and "20 trials" in again.output
    trial.expect("console computes in processes of its own", is_done, again)
    unknown = trial.console("calibrate", "nothing", *files, folder=work)
    trial.expect("console hands its exit status on", unknown.status == 2, unknown)
    shutil.rmtree(work)


def try_demo(trial: Trial) -> None:
    """Play the whole demo unseen, by the words that its button goes by."""
    played = trial.console("-m", "lightpen_program", "--demo")
    tip = re.search(r"^ *joint .*[0-9]", played.output, re.MULTILINE)
    is_accepted = played.status == 0 and tip is not None
    shown = "" if tip is None else tip[0].strip()
    what = f"demo accepts its tip, {played.seconds:.0f} s: {shown}"
    trial.expect(what, is_accepted, played)


def record_swing(folder: Path, files: Path) -> None:
    """Render a swing and record it; write the files of camera and pen to a folder."""
    written = write_sample_files(SCENE, files)
    preparation = Preparation(
        names=NAMES,
        camera_file=CameraFile.read(written.camera),
        pen_file=PenFile.read(written.pen),
        limits=replace(SwingLimits(), min_per_field=0),
    )
    setup = preparation.swing_setup()
    with RecordWriter.create(folder, record_header(preparation)) as writer:
        for image_plan in plan_scene(SCENE).image_plans:
            image = render_plan(SCENE, image_plan)
            seen = detect_pen(image, setup.camera, setup.pen)
            writer.append(
                image,
                seen.pixels,
                seen.rotation,
                seen.translation,
                image_plan.index * PERIOD_S,
            )


def try_double_click(trial: Trial) -> None:
    """Open a recorded swing by its file, as a double click does."""
    shown = _show_classes_to_wine(trial)
    record = trial.data / "records" / "swing 一"
    record_swing(record, trial.data / "files")
    with RecordWriter.resume(open_record(record)) as writer:
        writer.conclude("pass")
    trial.settings.unlink(missing_ok=True)
    trial.machine.open_document(record / OPENER)
    # The wizard takes the names of the swing over, and keeps them.
    is_open = await_so(lambda: NAMES.pen in _settings(trial))
    trial.expect("a double click opens a swing", is_open, _settings(trial))
    trial.end_programs()
    for key in shown:
        trial.machine.run(["reg", "delete", key, "/f"])


def try_refusals(trial: Trial) -> None:
    """See that a program that runs and a folder of others are left alone."""
    process = trial.start_window()
    trial.expect("the window opens", trial.await_window())
    status = trial.machine.run([trial.machine.windows_path(trial.setup), "/S"]).status
    trial.expect("no installation while it runs", status == RUNNING, status)
    # In its place, as it tells its status only then.
    place = last_option("_?", trial.machine.windows_path(trial.folder))
    status = trial.machine.run([trial.program("uninstall.exe"), "/S", *place]).status
    trial.expect("no removal while it runs", status == RUNNING, status)
    trial.end_programs()
    process.wait()
    trial.expect("it is whole all the same", not damaged(trial))

    other = trial.machine.drive / "other 文件"
    other.mkdir()
    (other / NOTES).write_text("mine")
    status = trial.install(place=trial.machine.windows_path(other)).status
    left = [path.name for path in other.iterdir()]
    trial.expect("no installation among others' files", status == FOREIGN, status)
    trial.expect("which stay alone", left == [NOTES], left)
    shutil.rmtree(other)


def try_upgrade(trial: Trial, newer: Path, version: str, newer_version: str) -> None:
    """Install a newer version over it, and the older one again."""
    stale = trial.folder / "runtime/Lib/site-packages/lightpen/stale.py"
    stale.touch()
    (trial.folder / NOTES).write_text("mine")
    trial.data.mkdir(exist_ok=True)
    trial.settings.write_text("{}")
    outcome = trial.install(setup=newer)
    trial.expect("upgrades", outcome.status == 0, outcome)
    look_over(trial, newer_version)
    trial.expect("no stale module", not stale.exists())
    trial.expect("the user's own file stays", (trial.folder / NOTES).exists())
    trial.expect("settings stay", trial.settings.read_text() == "{}")
    refused = trial.install()
    now = trial.value(UNINSTALL, "DisplayVersion")
    is_kept = refused.status == NEWER and now == newer_version
    trial.expect("no downgrade unasked", is_kept, (refused, now))
    asked = trial.install("/DOWNGRADE")
    trial.expect("a downgrade that is asked for", asked.status == 0, asked)
    look_over(trial, version)
    (trial.folder / NOTES).unlink()


def try_remains(trial: Trial) -> None:
    """See that what is installed is noticed, so that no trial begins on it."""
    remains = trial.remains()
    is_noticed = {str(trial.folder), UNINSTALL} <= set(remains)
    trial.expect("an installation keeps trials away", is_noticed, remains)


def try_removal(trial: Trial, files: frozenset[str], registry: frozenset[str]) -> None:
    """Uninstall, and see that nothing is left but the user's data; then that, too.

    Parameters
    ----------
    files, registry : frozenset of str
        What was there before the installation.
    """
    record = trial.data / "records" / "kept" / "journal.jsonl"
    record.parent.mkdir(parents=True, exist_ok=True)
    record.write_text("kept")
    outcome = trial.uninstall()
    trial.expect("uninstalls in silence", outcome.status == 0, outcome)
    trial.expect("the user's data stay", record.exists())
    shutil.rmtree(trial.data)
    shutil.rmtree(trial.keys, ignore_errors=True)  # which always stay
    expect_nothing_left(trial, files, registry)

    again = trial.install()
    trial.data.mkdir(exist_ok=True)
    trial.settings.write_text("{}")
    outcome = trial.uninstall("/PURGE")
    is_gone = not trial.data.exists()
    trial.expect("the user's data go when asked", is_gone, (again, outcome))
    expect_nothing_left(trial, files, registry)


def damaged(trial: Trial) -> tuple[str, ...]:
    """Return the installed files that are not as they were built."""
    files = trial.folder / FILE_LIST
    return damaged_files(files) if files.exists() else (FILE_LIST,)


def expect_nothing_left(
    trial: Trial, files: frozenset[str], registry: frozenset[str]
) -> None:
    """See that files and registry are as they were before."""
    found = trial.machine.files() - files
    # An empty folder for the programs of all makers may stay.
    left = {name for name in found if not name.endswith("AppData/Local/Programs")}
    trial.expect("no file is left", not left, sorted(left)[:10])
    entries = trial.machine.registry() - registry
    trial.expect("nothing is left in the registry", not entries, sorted(entries)[:10])


def _settings(trial: Trial) -> str:
    file = trial.settings
    return file.read_text("utf-8") if file.exists() else ""


def _menu(trial: Trial) -> Path:
    roaming = trial.machine.home / "AppData" / "Roaming"
    return roaming / "Microsoft/Windows/Start Menu/Programs/Lightpen"


def _desktop(trial: Trial) -> Path:
    return trial.machine.home / "Desktop" / "Lightpen.lnk"


def _show_classes_to_wine(trial: Trial) -> list[str]:
    """Copy the file type to where Wine 8 looks for it, unlike Windows.

    Returns
    -------
    list of str
        The copies, to be deleted afterwards.
    """
    shown = []
    for name in () if IS_WINDOWS else (".lightpen", "Lightpen.Swing"):
        shown.append(rf"HKLM\Software\Classes\{name}")
        copy = ["reg", "copy", rf"{CLASSES}\{name}", shown[-1], "/s", "/f"]
        trial.machine.run(copy)
    return shown
