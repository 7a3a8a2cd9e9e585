"""The simulated pen as a live camera.

Exposure and gain act as on a real sensor: the light of an LED fills the same fraction
of full scale when one is doubled and the other halved, but then fewer electrons make it
up and the image is noisier.
"""

from dataclasses import replace
from math import ceil, floor, pi
from threading import Event, Lock
from typing import Literal

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.cameras.pairing import Clock, MachineClock
from lightpen.cameras.protocol import (
    CameraCapabilities,
    CameraSettings,
    ConfigError,
    Frame,
    FrameTimeout,
    Range,
    Stats,
    sealed,
)
from lightpen.messages import SWING_TO_SEAT
from lightpen.model.rigid import FIRST_LEAN, UPRIGHT, Posture, Rig
from lightpen.swing.capture.state import Phase, SwingState
from lightpen_extensions.simulator.hand import HandPose, SimulatedOperator
from lightpen_extensions.simulator.image_plans import ImagePlan, led_gains, render_plan
from lightpen_extensions.simulator.render import OtherLight, View
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import leds_in_camera

GENTLE_LEANS = tuple(Posture(0.2, i * 2 * pi / 3, 0.0) for i in range(3))
LEAN_TIME = 0.6  # s until the next one


class GuidedOperator:
    """Moves the hand of a simulated operator by the states of a swing.

    The heading is the operator's right as the camera sees it, rad.
    """

    def __init__(self, operator: SimulatedOperator, heading: float = 0.0) -> None:
        self._operator = operator
        self._heading = heading
        self._wish: Posture | None = None

    def follow(self, state: SwingState) -> None:
        """React to a state of the swing."""
        swings = state.phase is Phase.SEEN and state.message == SWING_TO_SEAT
        if swings:
            step = int((state.time - state.since) / LEAN_TIME)
            self._lean_towards(GENTLE_LEANS[step % len(GENTLE_LEANS)])
        elif state.phase is Phase.CAPTURING:
            self._lean_towards(self._wanted(state))
        elif self._wish in GENTLE_LEANS or state.phase is Phase.VERDICT:
            # So that the first tilt differs from these; and at the end as asked.
            self._lean_towards(UPRIGHT)
        elif self._wish != UPRIGHT:
            self._wish = None  # a hand that was stopped must be led again

    def _wanted(self, state: SwingState) -> Posture | None:
        if state.heading is None and not state.was_upright:
            return UPRIGHT
        if state.heading is None:
            return Posture(FIRST_LEAN.tilt, self._heading, FIRST_LEAN.turn)
        return state.target

    def _lean_towards(self, wish: Posture | None) -> None:
        if wish is not None and wish != self._wish:
            self._wish = wish
            self._operator.lean_towards(wish.tilt, wish.direction, wish.turn)


SERIAL = "SIM-1"
EXPOSURE_US = Range(10.0, 50_000.0, 1.0)
GAIN_DB = Range(0.0, 24.0, 0.1)
FRAME_RATE = Range(0.1, 200.0)
USUAL_EXPOSURE_US = 1000.0  # short, so that the swing hardly blurs
USUAL_FRAME_RATE = 20.0
UNSEEN = 4  # times the period, while no image is displayed
BITS: dict[str, Literal[8, 12, 16]] = {"Mono8": 8, "Mono12": 12, "Mono16": 16}

N_BUFFERED = 16  # images that wait for a late reader, as with real cameras
MAX_POSES = 64  # through one exposure
STILL = 0.02  # px moved during the exposure that blur hides


class SimulatedCamera:
    """A camera with a simulated operator and pen in view.

    With a `SkippingClock` images come as fast as they are made, and waits for its
    reader; else a busy computer gets fewer images.

    Parameters
    ----------
    scene : Scene, optional
        Pen, camera, tip, cone, optics and sensor; its swing and its disturbances are
        left out.
    operator : SimulatedOperator, optional
        Must use the same clock.
    rig : Rig, optional
        The camera is the second of it, and the scene before the first.
    others : tuple of OtherLight
        In the picture.
    """

    def __init__(
        self,
        scene: Scene | None = None,
        clock: Clock | None = None,
        operator: SimulatedOperator | None = None,
        *,
        others: tuple[OtherLight, ...] = (),
        serial: str = SERIAL,
        rig: Rig | None = None,
    ) -> None:
        self.scene = scene or Scene()
        self._place = np.eye(3), np.zeros(3)  # cam_from_rig
        if rig is not None:
            self._place = rig.rotations[1], rig.translations[1]
            self.scene = replace(self.scene, camera=rig.cameras[1], viewpoint=1)
        self._clock = clock or MachineClock()
        n_leds = self.scene.pen.n_leds
        self.operator = operator or SimulatedOperator(
            self._clock, self.scene.seed, n_leds=n_leds
        )
        self._others = others
        self._serial = serial
        self._gains = led_gains(self.scene)
        self._settings = self._usual_settings
        self._stats = Stats()
        self.is_seen = True  # displayed; else fewer images are made
        self._next_seq = 0
        self._is_open = self._is_streaming = False
        self._next_end = 0.0  # of the exposure of the next image

    def follower(self) -> GuidedOperator:
        """Return what leads the operator through a swing."""
        return GuidedOperator(self.operator)

    @property
    def serial(self) -> str:
        """Serial number."""
        return self._serial

    @property
    def caps(self) -> CameraCapabilities:
        """Capabilities of the camera."""
        self._check_open()
        usual = f"Mono{self.scene.sensor.bits}"
        others = tuple(name for name in BITS if name != usual)
        return CameraCapabilities(
            width=self.scene.camera.width,
            height=self.scene.camera.height,
            pixel_formats=(usual, *others),
            exposure_us=EXPOSURE_US,
            gain_db=GAIN_DB,
            frame_rate=FRAME_RATE,
            waits=not self._clock.is_real,
        )

    def open(self) -> None:
        """Open the camera; no-op if it is open."""
        self._is_open = True

    def close(self) -> None:
        """Stop and close the camera."""
        self.stop()
        self._is_open = False

    def configure(self, settings: CameraSettings) -> CameraSettings:
        """Apply settings before the start; return the actual ones."""
        self.probe()
        if self._is_streaming:
            raise ValueError("`configure` needs a stopped camera.")
        now = self._settings
        pixel_format = settings.pixel_format or now.pixel_format
        if pixel_format not in BITS:
            raise ConfigError(
                "camera.pixel-format", wanted=str(pixel_format), offered=", ".join(BITS)
            )
        self._settings = CameraSettings(
            exposure_us=_applied(EXPOSURE_US, settings.exposure_us, now.exposure_us),
            gain_db=_applied(GAIN_DB, settings.gain_db, now.gain_db),
            frame_rate=_applied(FRAME_RATE, settings.frame_rate, now.frame_rate),
            pixel_format=pixel_format,
        )
        return self._settings

    def set_exposure(self, exposure_us: float) -> float:
        """Set the exposure of the next images; return the actual one, us."""
        self.probe()
        applied = EXPOSURE_US.nearest(exposure_us)
        self._settings = replace(self._settings, exposure_us=applied)
        return applied

    def set_gain(self, gain_db: float) -> float:
        """Set the gain of the next images; return the actual one, dB."""
        self.probe()
        applied = GAIN_DB.nearest(gain_db)
        self._settings = replace(self._settings, gain_db=applied)
        return applied

    def start(self) -> None:
        """Start streaming; no-op while streaming."""
        self.probe()
        if not self._is_streaming:
            self._is_streaming = True
            # On the beat of the clock, as if one signal triggered all cameras.
            self._next_end = (floor(self._now / self._period) + 1) * self._period

    def stop(self) -> None:
        """Stop streaming; no-op if stopped."""
        self._is_streaming = False

    def read(self, timeout_s: float) -> Frame:
        """Return the next image, rendered now."""
        self._check_streaming()
        self._await_image(timeout_s)
        frame = self._take_image()
        self._stats = replace(self._stats, delivered=self._stats.delivered + 1)
        return frame

    def probe(self) -> None:
        """Raise an error unless the camera responds."""
        self._check_open()

    def stats(self) -> Stats:
        """Return the frame counters."""
        return self._stats

    @property
    def _now(self) -> float:
        return self._clock.now_ns() * 1e-9

    @property
    def _usual_settings(self) -> CameraSettings:
        return CameraSettings(
            exposure_us=USUAL_EXPOSURE_US,
            gain_db=0.0,
            frame_rate=USUAL_FRAME_RATE,
            pixel_format=f"Mono{self.scene.sensor.bits}",
        )

    @property
    def _exposure(self) -> float:
        return (self._settings.exposure_us or USUAL_EXPOSURE_US) * 1e-6

    @property
    def _period(self) -> float:
        rate = self._settings.frame_rate or USUAL_FRAME_RATE
        unseen = 1 if self.is_seen else UNSEEN
        return unseen * max(1 / rate, self._exposure)

    def _check_open(self) -> None:
        if not self._is_open:
            raise ValueError("The camera is not open: call `open` first.")

    def _check_streaming(self) -> None:
        self._check_open()
        if not self._is_streaming:
            raise ValueError("The camera delivers no images: call `start` first.")

    def _await_image(self, timeout_s: float) -> None:
        """Wait until the exposure of the next image has ended."""
        limit = self._now + timeout_s
        end = self._schedule_next()
        if end > limit:
            self._clock.wait(limit - self._now)
            self._stats = replace(self._stats, timeouts=self._stats.timeouts + 1)
            raise FrameTimeout("camera.no-image", serial=self._serial, waited=timeout_s)
        self._clock.wait(end - self._now)

    def _schedule_next(self) -> float:
        """Return the end of the exposure of the next image, s."""
        n_late = ceil((self._now - self._next_end) / self._period - N_BUFFERED)
        if n_late > 0:
            self._leave_out(n_late)
        return self._next_end

    def _leave_out(self, n_frames: int) -> None:
        """Make no images of a time that is over; they are not lost on any way."""
        self._next_end += n_frames * self._period

    def _take_image(self) -> Frame:
        end = self._next_end
        self._next_end += self._period
        seq = self._next_seq
        self._next_seq += 1
        return self._expose(seq, end)

    def _expose(self, seq: int, end: float) -> Frame:
        settings = self._settings
        pixel_format = settings.pixel_format or "Mono8"
        times = end - self._exposure * np.array([1.0, 0.5, 0.0])
        scene = _with_gain(self.scene, settings)
        image = render_plan(scene, self._image_plan(scene, seq, times))
        return Frame(
            image=sealed(image),
            seq=seq,
            host_ts_ns=self._clock.now_ns(),
            device_ts_ns=round(times[0] * 1e9),
            exposure_us=settings.exposure_us,
            gain_db=settings.gain_db,
            pixel_format=pixel_format,
            full_scale=2 ** BITS[pixel_format] - 1,
        )

    def _image_plan(self, scene: Scene, seq: int, times: FloatArray) -> ImagePlan:
        """Return the plan of the image exposed between the first and the last time."""
        held = self.operator.held(times)
        rotations, translations = self._poses(scene, held)
        moved = _pixels_moved(scene, rotations, translations)
        if held.is_away or moved <= STILL:
            path = slice(1, 2)
            shown = rotations[path], translations[path]
        else:
            n_poses = min(3 + int(moved / scene.optics.psf_sigma), MAX_POSES)
            parts = (np.arange(n_poses) + 0.5) / n_poses
            between = times[0] + parts * (times[-1] - times[0])
            shown = self._poses(scene, self.operator.held(between))
        gains = np.zeros_like(self._gains) if held.is_away else self._gains.copy()
        gains[[led - 1 for led in held.covered]] = 0
        view = View(*shown, gains, self._others)
        return ImagePlan(seq, view, scene.optics, rotations[1], translations[1])

    def _poses(self, scene: Scene, held: HandPose) -> tuple[FloatArray, FloatArray]:
        """Return cam_from_pen of a hand pose."""
        R, t = self._place
        rotations = held.postures.rotations
        translations = scene.cone_cam + held.offsets - rotations @ scene.tip_pen
        return R @ rotations, translations @ R.T + t


def _applied(
    offered: Range, wanted: float | None, present: float | None
) -> float | None:
    return present if wanted is None else offered.nearest(wanted)


def _with_gain(scene: Scene, settings: CameraSettings) -> Scene:
    """Return the scene with exposure and gain applied."""
    gain = 10 ** ((settings.gain_db or 0.0) / 20)
    exposure = (settings.exposure_us or USUAL_EXPOSURE_US) / USUAL_EXPOSURE_US
    optics = replace(scene.optics, exposure=scene.optics.exposure * exposure * gain)
    sensor = replace(
        scene.sensor,
        bits=BITS[settings.pixel_format or "Mono8"],
        full_well=scene.sensor.full_well / gain,
        offset=scene.sensor.offset / gain,  # the same number in the image
    )
    return replace(scene, optics=optics, sensor=sensor)


def _pixels_moved(
    scene: Scene, rotations: FloatArray, translations: FloatArray
) -> float:
    """Return the largest displacement of an LED between the two poses, px."""
    leds, _ = leds_in_camera(scene.pen, rotations[[0, -1]], translations[[0, -1]])
    first, last = scene.camera.project(leds)
    return float(np.linalg.norm(last - first, axis=-1).max())


class SkippingClock:
    """A clock that advances only by waiting, at once.

    With it a simulated hour takes as long as its images take to make, and the same
    calls give the same images. If it ``rests``, a wait that can be interrupted takes
    real time, so that a camera without a reader does not occupy the processor.
    """

    is_real = False

    def __init__(self, *, rests: bool = False) -> None:
        self._rests = rests
        self._now_ns = 0
        self._lock = Lock()

    def now_ns(self) -> int:
        """Return the sum of all waits, ns."""
        return self._now_ns

    def wait(self, seconds: float, wake: Event | None = None) -> bool:
        """Advance by ``seconds`` unless ``wake`` is set; return whether it is."""
        if wake is not None and wake.wait(max(seconds, 0.0) if self._rests else 0.0):
            return True
        with self._lock:
            self._now_ns += round(max(seconds, 0.0) * 1e9)
        return False
