"""The page docs/python.md: its examples run, and it names all that is public."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np

import lightpen
from lightpen_extensions.simulator.scene_files import write_scene
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import PAPER_TIP, swing_poses

PAGE = (Path(__file__).parents[1] / "docs" / "python.md").read_text("utf-8")
BY_IMAGES, BY_POSES = re.findall("```python\n(.*?)```", PAGE, re.DOTALL)
NUMBER = r"-?\d+\.\d+"


def printed_numbers(code: str, folder: Path) -> list[float]:
    """Run an example in a folder; return the numbers that it prints."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [float(number) for number in re.findall(NUMBER, done.stdout)]


def test_images_in_give_the_tip_within_three_standard_uncertainties(
    tmp_path: Path,
) -> None:
    true_tip = write_scene(Scene(n_images=20), tmp_path / "swing")

    numbers = printed_numbers(BY_IMAGES, tmp_path)

    tip, u = np.array(numbers).reshape(3, 2).T
    assert (u > 0).all()
    assert (abs(tip - true_tip) < 1.5 * u).all()


def test_exact_poses_in_give_the_exact_tip(tmp_path: Path) -> None:
    swing = swing_poses(60, np.random.default_rng(1))
    rows = np.column_stack([swing.rotations.reshape(-1, 9), swing.translations])
    np.savetxt(tmp_path / "poses.csv", rows, fmt="%.15g")

    numbers = printed_numbers(BY_POSES, tmp_path)

    np.testing.assert_allclose(numbers[:3], PAPER_TIP, atol=1e-6)


def test_the_page_names_all_that_is_public_and_each_name_is_explained() -> None:
    named = {name for row in PAGE.splitlines() if row.startswith("| `")
             for name in re.findall(r"`(\w+)`", row)}  # fmt: skip

    assert named == set(lightpen.__all__)
    assert all(getattr(lightpen, name).__doc__ for name in lightpen.__all__)


def test_the_namespace_imports_nothing_before_a_name_is_used() -> None:
    code = "import sys, lightpen; sys.exit('numpy' in sys.modules)"

    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
