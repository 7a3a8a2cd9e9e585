"""``lightpen simulate``: write a simulated swing."""

import argparse
from pathlib import Path

from lightpen.commands.arguments import whole_number
from lightpen.commands.console import printing, progress, shown

MAX_RENDERED = 30_000  # images


def add_simulate(parser: argparse.ArgumentParser) -> None:
    """Add ``lightpen simulate``."""
    parser.set_defaults(run=_simulate)
    parser.add_argument("out", type=Path, metavar="OUT", help="folder to write")
    parser.add_argument(
        "--images",
        type=_n_images,
        default=60,
        metavar="N",
        help="number of images (60)",
    )
    parser.add_argument(
        "--seed",
        type=whole_number,
        default=0,
        metavar="S",
        help="seed of the random numbers (0)",
    )
    parser.add_argument(
        "--binning",
        type=int,
        choices=(1, 2, 4),
        default=1,
        help="binning factor in rows and columns",
    )
    parser.add_argument(
        "--cameras",
        type=int,
        choices=(1, 2),
        default=1,
        help="number of cameras; with two, OUT gets a folder for each, and rig.json",
    )


def _n_images(text: str) -> int:
    number = whole_number(text)
    if number == 0:
        raise argparse.ArgumentTypeError("at least one image is needed.")
    if number > MAX_RENDERED:
        raise argparse.ArgumentTypeError(f"at most {MAX_RENDERED} images are rendered.")
    return number


@printing
def _simulate(options: argparse.Namespace) -> None:
    # Imported here as the simulator is not needed to calibrate.
    from lightpen_extensions.simulator.scene_files import write_rig_scene, write_scene
    from lightpen_extensions.simulator.scenes import Scene, beside
    from lightpen_extensions.simulator.swings import paper_camera

    camera = paper_camera(options.binning)
    scene = Scene(n_images=options.images, seed=options.seed, camera=camera)
    with progress("Rendering") as report:
        if options.cameras == 1:
            x, y, z = write_scene(scene, options.out, report)
            written = f"{scene.n_images} images, camera.yaml"
        else:
            rig = beside(camera, scene.cone_cam)
            x, y, z = write_rig_scene(scene, rig, options.out, report)
            folders = ", ".join(rig.names)
            written = (
                f"{scene.n_images} images of each camera (folders {folders}), their "
                "intrinsics files, rig.json"
            )
    print(
        shown(
            f"{written}, leds.csv and the true answer (truth.json) are in "
            f"{options.out}.\nThe true tip is {x:.4f} {y:.4f} {z:.4f} mm in the "
            "frame of leds.csv."
        )
    )
