"""Fixtures that every test may use."""

import gc
import io
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack, redirect_stderr, redirect_stdout
from functools import cache
from hashlib import sha256
from importlib.abc import MetaPathFinder
from pathlib import Path
from random import Random
from subprocess import CompletedProcess
from typing import IO, TYPE_CHECKING, Any

import pytest
from filelock import FileLock
from hypothesis import settings

if TYPE_CHECKING:
    from jsonschema import Draft202012Validator
    from tests.gige_simulator import GigeSimulator

    from lightpen.cameras.source import SourcePlace

# As the program does; NumPy reads it when it is imported. Threads of two test processes
# that wait for each other take several times as long.
assert "numpy" not in sys.modules
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# No windows on the desk of whoever runs the tests; set it to see them.
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

# How long an example takes depends on what else the machine does. The examples are the
# same in every run, as all that is random here.
settings.register_profile("patient", deadline=None, derandomize=True)
settings.load_profile("patient")


class Absent(MetaPathFinder):
    """Skips what imports an extension that the tree lacks: a file, or a test in it.

    In a copy that `test_without_extensions.py` made; elsewhere such an import fails.
    """

    def find_spec(self, name: str, *_: object) -> None:
        """Find nothing: asked last, for what is not there."""
        if re.fullmatch(r"lightpen_(app_)?extensions\.\w+", name):
            pytest.skip(f"{name} is not in this tree", allow_module_level=True)


if "LIGHTPEN_WITHOUT_EXTENSIONS" in os.environ:
    sys.meta_path.append(Absent())

HOLDER = """
import sys, time
from pathlib import Path
from lightpen.record.swings.reading import open_record
from lightpen.record.swings.writing import RecordWriter

with RecordWriter.resume(open_record(Path(sys.argv[1]))):
    print("held", flush=True)
    time.sleep(600)
"""


WATCHED = """
import sys
from pathlib import Path
from lightpen_program.extensions import main

status = main(sys.argv[2:])
reported = Path("/proc/self/status")
if reported.exists():
    Path(sys.argv[1]).write_bytes(reported.read_bytes())
sys.exit(status)
"""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add ``--slow``."""
    parser.addoption("--slow", action="store_true", help="also run the slow tests")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Let two more processes work than there are cores: tests wait for cameras."""
    return (os.cpu_count() or 1) + 2


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Let each process compile other files first; it reads what the others compiled."""
    report = yield
    if isinstance(collector, pytest.Directory):
        Random(os.environ.get("PYTEST_XDIST_WORKER")).shuffle(report.result)
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(
    config: pytest.Config, items: list[pytest.Item]
) -> None:
    """Leave out slow tests unless they are asked for; begin with what takes longest.

    So no process is left with that at the end.
    """
    is_named = config.option.markexpr or any("::" in each for each in config.args)
    if not (config.getoption("--slow") or is_named):
        slow = [item for item in items if item.get_closest_marker("slow")]
        config.hook.pytest_deselected(items=slow)
        items[:] = [item for item in items if not item.get_closest_marker("slow")]
    items.sort(key=lambda item: (_how_small(item.path), item.path))


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Let the garbage collector pass by thousands of tests, which stay."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.collect()
        gc.freeze()
        gc.enable()


@pytest.fixture(scope="session", autouse=True)
def no_power_cut() -> Iterator[None]:
    """Nothing waits for the disk; what is killed leaves its files to the system."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("os.fsync", lambda descriptor: None)
        yield


@pytest.fixture(scope="session", autouse=True)
def other_data_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """No command writes into the log, or the keys, of whoever runs the tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_DATA_HOME", str(tmp_path_factory.mktemp("data-home")))
        patch.setenv("LIGHTPEN_KEYS", str(tmp_path_factory.mktemp("keys")))
        yield


@pytest.fixture(scope="session", autouse=True)
def one_thread_of_opencv() -> None:
    """OpenCV does not spread an image over threads, as in the program."""
    import cv2

    cv2.setNumThreads(1)


@pytest.fixture(scope="session", autouse=True)
def no_broadcast() -> Iterator[None]:
    """All sources are there, and no test asks the network for cameras."""
    import lightpen_program.extensions  # noqa: F401
    from lightpen.cameras.sources import source_named

    with pytest.MonkeyPatch.context() as patch:
        if source_named("aravis") is not None:  # there are drivers in the tree
            listed = "lightpen_extensions.drivers.aravis._listed"
            patch.setattr(listed, lambda library: range(0))
        yield


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of image sets with truth, or skip the test without it."""
    folder = os.environ.get("LIGHTPEN_DATA")
    if folder is None:
        pytest.skip("LIGHTPEN_DATA does not name the folder of test image sets")
    path = Path(folder).resolve()
    if not (path / "swing-clean").is_dir():
        pytest.fail(f"LIGHTPEN_DATA={folder} holds no folder swing-clean")
    return path


def require_library(key: str) -> None:
    """Skip the test without the library of a source, but where it must be there."""
    import lightpen_extensions.drivers  # noqa: F401 - skips a tree without it
    from lightpen.cameras.sources import source_named

    source = source_named(key)
    assert source is not None
    why_absent = source.why_absent()
    if why_absent is not None:
        if os.environ.get("LIGHTPEN_CAMERAS") == "required":
            pytest.fail(str(why_absent))
        pytest.skip(str(why_absent))


@pytest.fixture
def loopback() -> Iterator[str]:
    """Return the address of the loopback; one test at a time has a camera there."""
    require_library("aravis")
    from tests.gige_simulator import ADDRESS

    lock = FileLock(Path(tempfile.gettempdir()) / "lightpen-gige.lock")
    # Asked for so often that no process with one such test after the other keeps it.
    with lock.acquire(poll_interval=0.002):
        yield ADDRESS


@pytest.fixture
def second_loopback(loopback: str) -> Iterator[str]:
    """Return another address of the loopback, for a second camera."""
    from tests.gige_simulator import SECOND_ADDRESS

    words = ("ip", "address", "{0}", f"{SECOND_ADDRESS}/8", "dev", "lo")
    added = [word.format("replace") for word in words]  # a killed run left it there
    if shutil.which("ip") is None or subprocess.run(added, check=False).returncode:
        if os.environ.get("LIGHTPEN_CAMERAS") == "required":
            pytest.fail("The loopback needs a second address.")
        pytest.skip("the loopback has one address only")
    yield SECOND_ADDRESS
    subprocess.run([word.format("delete") for word in words], check=True)


@pytest.fixture
def gige(loopback: str) -> Iterator["GigeSimulator"]:
    """Return a simulated camera on the loopback."""
    from tests.gige_simulator import GigeSimulator

    simulator = GigeSimulator(address=loopback)
    yield simulator
    simulator.unplug()


@pytest.fixture
def aravis(gige: "GigeSimulator") -> "SourcePlace":
    """Return where Aravis finds the simulated camera."""
    from tests.gige_simulator import ADDRESS

    from lightpen.cameras.source import SourcePlace

    return SourcePlace(ADDRESS)


@pytest.fixture
def genicam() -> "SourcePlace":
    """Return the camera of the GenTL producer that comes with Harvesters' GenICam."""
    require_library("genicam")
    import genicam

    # It needs the shared library of Python, which a bare Debian lacks.
    pytest.importorskip("genicam.gentl", exc_type=ImportError)

    from lightpen.cameras.source import SourcePlace

    return SourcePlace("1", str(Path(genicam.__file__).with_name("viky.cti")))


@pytest.fixture(scope="session")
def lightpen() -> Callable[..., CompletedProcess[str]]:
    """Return a function that runs the command line in this process."""
    # Imported here: a broken command line must not keep the other tests from running.
    from lightpen_program.extensions import main

    def run(*arguments: str | Path) -> CompletedProcess[str]:
        words = [str(argument) for argument in arguments]
        out, err = io.StringIO(), io.StringIO()
        with redirect_stdout(out), redirect_stderr(err):
            try:
                status = main(words)
            except SystemExit as stop:  # argparse ends so
                status = stop.code if isinstance(stop.code, int) else 1
        return CompletedProcess(words, status, out.getvalue(), err.getvalue())

    return run


@pytest.fixture(scope="session")
def validator() -> "Draft202012Validator":
    """Return what tells whether the record of a calibration is as is published."""
    from jsonschema import Draft202012Validator

    file = Path(__file__).parents[1] / "docs" / "calibration.schema.json"
    schema = json.loads(file.read_bytes())
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


@pytest.fixture(scope="session")
def script() -> Callable[..., CompletedProcess[str]]:
    """Return a function that runs the installed console script, as a user does."""
    name = "lightpen.exe" if os.name == "nt" else "lightpen"
    program = Path(sys.executable).with_name(name)

    def run(
        *arguments: str | Path,
        stdout: int | IO[str] = subprocess.PIPE,
        stderr: int = subprocess.PIPE,
        encoding: str = "utf-8",
        environment: dict[str, str] | None = None,
        before: Callable[[], None] | None = None,
        timeout: float = 120,
    ) -> CompletedProcess[str]:
        return subprocess.run(
            [program, *arguments],
            stdout=stdout,
            stderr=stderr,
            encoding=encoding,
            env=None if environment is None else os.environ | environment,
            preexec_fn=before,
            timeout=timeout,
            check=False,
        )

    return run


@pytest.fixture(scope="session")
def rewrite_header() -> Callable[..., None]:
    """Return a function that gives a record's header other entries, also in part."""
    from lightpen.formats.own_json import with_checksum

    def rewrite(folder: Path, **entries: object) -> None:
        path = folder / "header.json"
        header = json.loads(path.read_bytes())
        del header["checksum"]
        for name, entry in entries.items():
            is_part = isinstance(entry, dict)
            header[name] = header[name] | entry if is_part else entry
        path.write_bytes(with_checksum(json.dumps(header).encode()))

    return rewrite


MakeOnce = Callable[[str, Callable[[Path], object]], Path]


@pytest.fixture(scope="session")
def once(tmp_path_factory: pytest.TempPathFactory) -> MakeOnce:
    """Return a function that has a folder made once, by whoever needs it first.

    It belongs to all processes of a parallel run: copy it before you change it.
    """
    own = tmp_path_factory.getbasetemp()
    is_parallel = "PYTEST_XDIST_WORKER" in os.environ
    shelf = (own.parent if is_parallel else own) / "made-once"
    shelf.mkdir(exist_ok=True)

    def made(what: str, make: Callable[[Path], object]) -> Path:
        place = shelf / sha256(what.encode()).hexdigest()[:16]
        with FileLock(place.with_suffix(".lock")):
            if not place.exists():
                draft = place.with_suffix(".draft")
                shutil.rmtree(draft, ignore_errors=True)  # of one who failed
                draft.mkdir()
                make(draft)
                draft.rename(place)
        return place

    return made


@pytest.fixture(scope="session")
def scene(
    lightpen: Callable[..., CompletedProcess[str]], once: MakeOnce
) -> Callable[..., Path]:
    """Return a function that simulates a set with `options`, each set once.

    After ``hard``, ``clean`` or a kind of swing they are number of images, seed,
    binning, pen and, if not 8, bits of a pixel.
    """

    def simulated(*options: str) -> Path:
        def simulate(folder: Path) -> None:
            if not options[0].startswith("-"):
                _write_set(folder / "set", *options)
                return
            outcome = lightpen("simulate", folder / "set", *options)
            assert outcome.returncode == 0, outcome.stderr

        return once(f"scene {options}", simulate) / "set"

    return simulated


def _write_set(
    folder: Path,
    kind: str,
    n_images: str,
    seed: str,
    binning: str,
    pen: str,
    bits: str = "8",
) -> None:
    from tests.simulated_disturbances import HARD, Disturbances, write_disturbed
    from tests.simulated_pens import SAMPLE_PENS
    from tests.simulated_swings import plan_kind

    from lightpen_extensions.simulator.scene_files import write_set
    from lightpen_extensions.simulator.scenes import Scene, Sensor
    from lightpen_extensions.simulator.swings import paper_camera

    scene = Scene(
        int(n_images),
        int(seed),
        sensor=Sensor(bits=int(bits)),  # type: ignore[arg-type]
        pen=SAMPLE_PENS[pen](),
        camera=paper_camera(int(binning)),
    )
    if kind in ("hard", "clean"):
        write_disturbed(scene, folder, HARD if kind == "hard" else Disturbances())
    else:
        write_set(plan_kind(scene, kind), folder)  # type: ignore[arg-type]


@pytest.fixture(scope="session")
def calibration_of(
    lightpen: Callable[..., CompletedProcess[str]], once: MakeOnce
) -> Callable[..., Path]:
    """Return a function that calibrates from a set or a recorded swing, each once.

    It returns a folder with what was printed, `printed.txt`, and the JSON,
    `calibration.json`.
    """

    def calibrated(folder: Path, *options: str) -> Path:
        files: tuple[str | Path, ...] = ()
        images = folder
        if (folder / "leds.csv").exists():
            files = "--camera", folder / "camera.yaml", "--pen", folder / "leds.csv"
            images = folder / "images"

        def calibrate(place: Path) -> None:
            given = options if "--centers" in options else (images, *options)
            json_file = place / "calibration.json"
            outcome = lightpen("calibrate", *given, *files, "--json", json_file)
            assert outcome.returncode == 0, outcome.stderr
            (place / "printed.txt").write_text(outcome.stdout, encoding="utf-8")

        return once(f"record {folder} {options}", calibrate)

    return calibrated


@pytest.fixture(scope="session")
def record(calibration_of: Callable[..., Path]) -> Callable[..., dict[str, Any]]:
    """Return a function that calibrates as `calibration_of`, and reads the JSON.

    The JSON holds the printed text, too, as `text`.
    """

    @cache
    def read(folder: Path, *options: str) -> dict[str, Any]:
        place = calibration_of(folder, *options)
        fields: dict[str, Any] = json.loads(
            (place / "calibration.json").read_text(encoding="utf-8"),
            parse_constant=_refuse_constant,
        )
        return fields | {"text": (place / "printed.txt").read_text(encoding="utf-8")}

    return read


@pytest.fixture(scope="session")
def swing_full(shared_data: Path, once: MakeOnce) -> Path:
    """Return where a process of its own has calibrated from the 300 images, once.

    There is the JSON, with the paper's nominal tip, and, where the system is Linux,
    what it tells of the process at its end, as `status`.
    """
    folder = shared_data / "swing-full"

    def calibrate(place: Path) -> None:
        words = (
            *("calibrate", folder / "images"),
            *("--camera", folder / "camera.yaml", "--pen", folder / "leds.csv"),
            *("--nominal-tip", "0", "-90", "-25"),
            *("--json", place / "calibration.json"),
        )
        subprocess.run(
            [sys.executable, "-c", WATCHED, place / "status", *words],
            stdout=subprocess.DEVNULL,
            check=True,
        )

    return once("swing-full", calibrate)


@pytest.fixture(scope="session")
def stated() -> dict[str, Any]:
    """Return the record of a good calibration, as its JSON has it; only read it.

    Of its 60 images one has too few LEDs and one is of a tip that slipped.
    """
    import numpy as np
    from benchmarks.small_records import entries_of
    from tests.simulated_centers import calibrate_pixels, simulate_centers

    from lightpen.estimation.reports.report import calibration_record
    from lightpen.formats.opened_files import InputFile, Inputs
    from lightpen.model.limits import SwingLimits
    from lightpen.model.names import Origin
    from lightpen_extensions.simulator import swings

    camera, pen = swings.paper_camera(), swings.paper_pen()
    rng = np.random.default_rng(1)
    poses = swings.swing_poses(60, rng)
    translations = poses.translations.copy()
    translations[5] += [0.5, 0, 0]
    pixels = simulate_centers(*(camera, pen, poses.rotations, translations), 0.02, rng)
    pixels[3, 2:] = np.nan
    calibration = calibrate_pixels(pixels, camera, pen)
    file = InputFile(Path("folder/file.csv"), 64 * "0")
    inputs = Inputs(file, file, (file,), pen.nominal_tip, origin=Origin.RECORDED)
    limits = SwingLimits(max_uncertainty=0.05, min_images=12)
    return entries_of(calibration_record(calibration, inputs, limits))


@pytest.fixture(scope="session")
def swung(once: MakeOnce) -> Callable[..., Path]:
    """Return a function that records a swing of small images and leaves it unfinished.

    Each record is made once; copy it before you change it.
    """

    def recorded(n_images: int = 20, *, by_two: bool = False) -> Path:
        place = once(
            f"swung {n_images} {by_two}",
            lambda place: _record_swing(place / "swing", n_images, by_two=by_two),
        )
        return place / "swing"

    return recorded


@pytest.fixture
def holding() -> Iterator[Callable[[Path], "subprocess.Popen[str]"]]:
    """Return a function that lets another process hold a record to write to it."""
    with ExitStack() as stack:

        def hold(folder: Path) -> "subprocess.Popen[str]":
            process = stack.enter_context(
                subprocess.Popen(
                    [sys.executable, "-c", HOLDER, str(folder)],
                    stdout=subprocess.PIPE,
                    text=True,
                )
            )
            stack.callback(process.kill)
            assert process.stdout is not None
            assert process.stdout.readline() == "held\n"
            return process

        yield hold


@pytest.fixture(scope="session")
def obedient() -> Sequence[str]:
    """Return the words before a command that keep it from what even root may not."""
    if not hasattr(os, "geteuid"):
        pytest.skip("files have no mode here")
    if os.geteuid() != 0:
        return ()
    words = ("setpriv", "--bounding-set=-dac_override,-dac_read_search")
    if shutil.which(words[0]) is None or subprocess.run([*words, "true"]).returncode:
        pytest.skip("root reads every file here")
    return words


@pytest.fixture(scope="session")
def truth() -> Callable[[Path], dict[str, Any]]:
    """Return a function that reads the true answer of a set."""

    def read(folder: Path) -> dict[str, Any]:
        text = (folder / "truth.json").read_text(encoding="utf-8")
        fields: dict[str, Any] = json.loads(text)
        return fields

    return read


def _how_small(file: Path) -> tuple[bool, bool, bool]:
    """Return a key of a test file: the whole program, its windows, then its parts.

    Of the parts, that first which has the GigE camera, of which there is one, longest:
    others that need it would wait.
    """
    place = file.relative_to(Path(__file__).parent).parent.parts
    return len(place) > 1, file.name != "test_aravis.py", place[:1] != ("app",)


def _record_swing(folder: Path, n_images: int, *, by_two: bool) -> None:
    """Record a guided swing of the simulated pen, seen with a quarter of the pixels."""
    from dataclasses import replace

    from lightpen.cameras.protocol import CameraSettings
    from lightpen.detection.pen_detection import PenDetection, detect_pen
    from lightpen.formats.opened_files import CameraFile, PenFile
    from lightpen.formats.rig_files import read_rig
    from lightpen.live.sources import SourceEnvironment, cameras_of
    from lightpen.model.limits import SwingLimits
    from lightpen.record.swings.header import Names
    from lightpen.record.swings.writing import RecordWriter, SecondaryView
    from lightpen.swing.capture.state import start_swing
    from lightpen.swing.preparation import Preparation, SecondCamera
    from lightpen.swing.swing_recorder import capture_image, record_header
    from lightpen_extensions.simulator.camera import (
        GuidedOperator,
        SimulatedCamera,
        SkippingClock,
    )
    from lightpen_extensions.simulator.scene_files import write_sample_files
    from lightpen_extensions.simulator.scenes import Scene
    from lightpen_extensions.simulator.simulator import SceneSimulator
    from lightpen_extensions.simulator.swings import paper_camera

    scene = Scene(camera=paper_camera(binning=2))
    files = write_sample_files(scene, folder.parent / "files")
    preparation = Preparation(
        names=Names("Hall 2", "Ann", "LP-04", "T-10", "C-1", 10.0),
        camera_file=CameraFile.read(files.camera),
        pen_file=PenFile.read(files.pen),
        limits=SwingLimits(max_uncertainty=1e-6, min_images=n_images),
    )
    clock = SkippingClock()
    sources = [preparation.source]
    if by_two:
        second = SecondCamera(rig_file=read_rig(files.rig))
        preparation = replace(preparation, second=second)
        sources.append(second.source)
    live = cameras_of(sources, SourceEnvironment(SceneSimulator(scene), clock))
    for camera in live:
        camera.open()
        if by_two:  # looking at two images a moment takes long
            camera.configure(CameraSettings(frame_rate=10.0))
        camera.start()
    assert isinstance(live[0], SimulatedCamera)
    live[0].operator.seat()
    follower = GuidedOperator(live[0].operator)
    before: Sequence[PenDetection | None] = [None] * len(live)
    setup = preparation.swing_setup()
    state = start_swing(setup)
    with RecordWriter.create(folder, record_header(preparation)) as writer:
        while state.n_kept < n_images:
            frames = [camera.read(1.0) for camera in live]
            before = detection, *others = [
                detect_pen(
                    frame.image,
                    region.camera,
                    region.pen,
                    region.mask,
                    last,
                    is_followed=True,
                )
                for frame, region, last in zip(
                    frames, setup.regions, before, strict=True
                )
                if region.camera is not None and region.pen is not None
            ]
            state = capture_image(
                *(setup, state, writer, frames[0].image),
                replace(detection, others=tuple(others)),
                *(clock.now_ns() * 1e-9, frames[0].device_ts_ns),
                others=[
                    SecondaryView(frame.image, seen.pixels, frame.device_ts_ns)
                    for frame, seen in zip(frames[1:], others, strict=True)
                ],
            ).state
            follower.follow(state)
    for camera in live:
        camera.close()


def _refuse_constant(name: str) -> None:
    raise ValueError(f"JSON has no {name}")
