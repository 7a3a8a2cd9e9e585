"""A GigE Vision camera of 2448 x 2048 on the loopback that sees a pen being swung.

Usage: python benchmarks/linked_camera.py

It says "there" once it answers, and serves until it is killed. The images are rendered
before, so that it takes no more of the machine than sending them does.
"""

import sys
from itertools import count
from pathlib import Path
from threading import Event

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.gige_simulator import GigeSimulator

from lightpen.arrays import Image
from lightpen_extensions.simulator.camera import SimulatedCamera, SkippingClock
from lightpen_extensions.simulator.hand import SimulatedOperator

N_RENDERED = 24  # a second of a swing, shown forward and backward
SEATING = 6.0  # s until the pen is in its cone


def main() -> None:
    """Render, and serve until killed."""
    clock = SkippingClock()
    camera = SimulatedCamera(
        clock=clock, operator=SimulatedOperator(clock, seated=True)
    )
    camera.operator.swing()
    clock.wait(SEATING)
    camera.open()
    camera.start()
    images = [camera.read(1.0).image for _ in range(N_RENDERED)]
    to_and_fro = images + images[-2:0:-1]
    numbers = count()

    def scene(exposure_us: float, gain: int) -> Image:
        return to_and_fro[next(numbers) % len(to_and_fro)]

    simulator = GigeSimulator()
    simulator.widen(*camera.scene.camera.image_size)
    simulator.serve(scene)
    sys.stdout.write("there\n")
    sys.stdout.flush()
    Event().wait()


if __name__ == "__main__":
    main()
