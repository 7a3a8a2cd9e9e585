"""Results do not depend on the processor: on kernels of BLAS or of NumPy."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.simulated_centers import simulate_centers

from lightpen.arrays import FloatArray
from lightpen.formats.pen_files import write_pen
from lightpen.formats.rig_files import write_camera
from lightpen.model.rigid import rotation_from_vector, rotations_of
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    PAPER_TIP,
    paper_camera,
    paper_pen,
    swing_poses,
)

CAMERA, PEN = paper_camera(), paper_pen()
RUN = """
import json, sys
from lightpen_program.extensions import main
sys.exit(max(main(words) for words in json.load(sys.stdin)))
"""
PLAN = """\
name: Part
features:
  - {name: ring, kind: circle}
  - {name: flat, kind: plane}
  - {name: edge, kind: line}
characteristics:
  - {quantity: diameter, of: [ring], nominal: 63.5, tolerance: 0.1}
  - {quantity: roundness, of: [ring], tolerance: 0.2}
  - {quantity: flatness, of: [flat], tolerance: 0.2}
  - {quantity: straightness, of: [edge], tolerance: 0.2}
  - {quantity: parallelism, of: [edge], datum: flat, tolerance: 0.2}
"""
# Of what is in records, the U of each.
FIGURES = {
    "tip_pen_mm": "expanded_uncertainty_mm",
    "cone_cam_mm": "cone_expanded_uncertainty_mm",
    "tip_change_mm": "tip_change_expanded_uncertainty_mm",
    "mean_error_mm": "expanded_uncertainty_mm",
    "size_error_mm": "expanded_uncertainty_mm",
    "error_mm": "expanded_uncertainty_mm",
    "deviation": "expanded_uncertainty",
}
# The sets of instructions beyond the least ones that NumPy found here.
FOUND = " ".join(np.show_config(mode="dicts")["SIMD Extensions"].get("found", ()))
FLAT = np.array([[1.0, 0.1, 0.0], [0.0, 0.9, 0.4]])


def write_centers(path: Path, rotations: FloatArray, translations: FloatArray) -> None:
    rng = np.random.default_rng(1)
    images = simulate_centers(CAMERA, PEN, rotations, translations, 0.02, rng)
    lines = ["frame,led,x_px,y_px"]
    for i, centers in enumerate(images, start=1):
        lines += [f"{i},{j},{x},{y}" for j, (x, y) in enumerate(centers, start=1)]
    path.write_text("\n".join(lines), encoding="utf-8")


def write_swing(path: Path) -> None:
    """Write a swing in a seat that jitters and is out of round.

    So there is something to find by the thresholds of the adjustment.
    """
    rng = np.random.default_rng(2)
    swing = swing_poses(20, rng)
    turns = 2 * np.arctan2(swing.rotations[:, 0, 1], swing.rotations[:, 2, 1])
    moves = 0.008 * rng.standard_normal((20, 3))
    moves[:, 0] += 0.02 * np.cos(turns)
    write_centers(path, swing.rotations, swing.translations + moves)


def write_touches(path: Path, points: FloatArray) -> None:
    """Write touches of points near the cone, (N, 3), mm, each in another posture."""
    n, rng = len(points), np.random.default_rng(len(points))
    around = np.linspace(0, 2 * np.pi, n, endpoint=False)
    rotations = rotations_of(PEN, np.full(n, 0.3), around, rng.uniform(-0.2, 0.2, n))
    off = 0.01 * rng.standard_normal((n, 3))
    write_centers(path, rotations, PAPER_CONE + points + off - rotations @ PAPER_TIP)


@pytest.fixture(scope="module")
def commands(
    tmp_path_factory: pytest.TempPathFactory, scene: Callable[..., Path]
) -> list[list[str]]:
    """Words of commands, each but for the file that its record is written to."""
    place = tmp_path_factory.mktemp("inputs")
    camera, pen, swing = (
        place / name for name in ("camera.yaml", "leds.json", "swing.csv")
    )
    write_camera(CAMERA, camera)
    write_pen(PEN, pen)
    write_swing(swing)
    angles = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    ring = 31.75 * np.column_stack([np.cos(angles), np.sin(angles)]) @ FLAT
    ring *= (31.75 / np.linalg.norm(ring, axis=1))[:, None]
    grid = np.stack(np.meshgrid([-60.0, 0.0, 60.0], [-40.0, 0.0, 40.0]), axis=-1)
    touched = {
        "ring": ring @ rotation_from_vector(np.array([0.1, 0.0, 0.0])).T,
        "flat": grid.reshape(-1, 2) @ FLAT,
        "edge": np.linspace(-60, 60, 8)[:, None] * [1.0, 0.1, 0.2],
        "cone": np.zeros((8, 3)),
    }
    for name, points in touched.items():
        write_touches(place / f"{name}.csv", points)
    plan = place / "plan.yaml"
    plan.write_text(PLAN, encoding="utf-8")
    images = scene("--images", "12", "--seed", "4")
    tip = place / "tip.json"
    files = ["--camera", str(camera), "--pen", str(pen)]
    use = [*files, "--tip", str(tip), "--frames", "1"]

    def verify(task: str, name: str, *options: str) -> list[str]:
        return ["verify", task, *options, "--centers", str(place / f"{name}.csv"), *use]

    by_centers = ["calibrate", "--centers", str(swing), *files]
    features = [f"{name}={place / name}.csv" for name in ("ring", "flat", "edge")]
    calibrate = subprocess.run(
        [sys.executable, "-c", RUN],
        input=json.dumps([[*by_centers, "--json", str(tip)]]),
        encoding="utf-8",
        capture_output=True,
        check=False,
    )
    assert tip.exists(), calibrate.stderr
    return [
        by_centers,
        ["recalculate", str(tip), "--monte-carlo", "20", "--workers", "1"],
        [
            *("calibrate", str(images / "images")),
            *("--camera", str(images / "camera.yaml")),
            *("--pen", str(images / "leds.csv")),
        ],
        verify("fixed-point", "cone"),
        verify("circle", "ring", "--radius", "31.75"),
        ["measure", str(plan), *features, *use],
    ]


def recorded(
    commands: list[list[str]], place: Path, environment: Mapping[str, str]
) -> list[dict[str, Any]]:
    """Return the records that commands write in an environment."""
    files = [place / f"{i}.json" for i in range(len(commands))]
    told = [
        [*words, "--json", str(file)]
        for words, file in zip(commands, files, strict=True)
    ]
    outcome = subprocess.run(
        [sys.executable, "-c", RUN],
        input=json.dumps(told),
        encoding="utf-8",
        env=os.environ | environment,
        capture_output=True,
        check=False,
    )
    assert all(file.exists() for file in files), outcome.stdout + outcome.stderr
    return [json.loads(file.read_bytes()) for file in files]


def compared(record: dict[str, Any]) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield figures of a record, each with its U."""
    for part in (record, *record.get("characteristics", ())):
        for name, of_uncertainty in FIGURES.items():
            if part.get(name) is not None:
                uncertainty = np.array(part[of_uncertainty])
                yield np.array(part[name]), uncertainty
                yield uncertainty, uncertainty
    for each in record.get("calibrations", ()):
        by_trials = np.array(each["monte_carlo"]["standard_uncertainty_mm"])
        yield by_trials, 2 * by_trials


@pytest.fixture(scope="module")
def usual(
    commands: list[list[str]], tmp_path_factory: pytest.TempPathFactory
) -> list[dict[str, Any]]:
    place = tmp_path_factory.mktemp("usual")
    return recorded(commands, place, {"OPENBLAS_CORETYPE": "Haswell"})


@pytest.mark.parametrize(
    "environment",
    [
        {"OPENBLAS_CORETYPE": "Prescott"},
        pytest.param(
            {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": FOUND},
            marks=pytest.mark.slow,
        ),
    ],
    ids=["BLAS", "NumPy"],
)
@pytest.mark.skipif(not FOUND, reason="is a processor with one set of kernels")
def test_results_by_other_kernels_agree_to_a_hundredth_of_u(
    commands: list[list[str]],
    usual: list[dict[str, Any]],
    tmp_path: Path,
    environment: Mapping[str, str],
) -> None:
    found = recorded(commands, tmp_path, environment)

    differences = []
    for words, before, now in zip(commands, usual, found, strict=True):
        verdicts = [each.get("verdict", {}).get("code") for each in (before, now)]
        assert verdicts[0] == verdicts[1], words
        figures = list(zip(compared(before), compared(now), strict=True))
        assert figures, words
        for (one, uncertainty), (other, _) in figures:
            differences.append(np.max(np.abs(other - one) / uncertainty))
            assert differences[-1] < 0.01, words
    assert max(differences) > 0  # else they were the same kernels
