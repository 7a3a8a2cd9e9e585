"""The next posture: the one that reduces the tip's uncertainty most.

What an image of a posture would say of tip and cone follows from the contact model
before it is taken [1]_. Images are taken on the way to a posture as well, so a posture
is judged by all the images that the pen would give until it is there: by how much they
would shrink the variance of the tip, per image.

References
----------
.. [1] A. C. Atkinson, A. N. Donev, "Optimum experimental designs" (1992), chapter 10.
.. [2] M. Roberts, "The unreasonable effectiveness of quasirandom sequences" (2018).
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import BoolArray, FloatArray, IntArray
from lightpen.detection.labelling.constellation import certain_leds
from lightpen.estimation.contact.joint import ContactModel, reduce
from lightpen.model.coverage import N_DIRECTIONS
from lightpen.model.pen import Pen
from lightpen.model.posture import Posture, angles_between, rotations_of
from lightpen.model.rig import Rig
from lightpen.model.rigid import rotation_from_vector, vector_from_rotation

TILTS = (np.radians(14.0), np.radians(28.0))  # in the middle of the rings of the dial
TURNS = (np.radians(-25.0), 0.0, np.radians(25.0))
WITHIN = np.radians([5.0, 18.0, 12.0])  # of a field, from its middle: tilt and turns
EVEN_STEPS = np.array([0.8191725, 0.6710436, 0.5497005])  # of a sequence in a cube [2]_
N_ON_THE_WAY = 3  # postures that represent all in between
MAX_INCIDENCE = np.radians(70.0)  # an LED seen flatter is a line, and dim
MIN_GAP = 4.0  # px between the edges of two LEDs; blur joins closer ones


@dataclass(frozen=True, eq=False)
class GuidanceInput:
    """Inputs for the choice of the next posture."""

    rig: Rig  # one of its cameras must see enough of the pen
    pen: Pen
    tip_pen: FloatArray  # (3,), mm
    cone_cam: FloatArray  # (3,), mm
    information: FloatArray  # (6, 6), all information on (tip, cone), 1/mm^2
    sigma: float  # noise of one image coordinate, px
    rotations: FloatArray  # (N, 3, 3), postures of the images kept so far; cam_from_pen
    spacing: float  # least angle between a new posture and these, rad


def next_posture(
    outlook: GuidanceInput,
    present: FloatArray,
    wanted: BoolArray | None = None,
    avoided: Posture | None = None,
) -> Posture | None:
    """Return the posture to lean the pen to from ``present``, cam_from_pen (3, 3).

    ``wanted`` (3, 8) are the fields of the dial to choose from, all unless given:
    upright (in the first column), leaning and leaning far, by direction from the right.
    ``avoided`` is not chosen.
    None if the LEDs could be seen in none of the postures. Where there are images on
    all ways to the middles of these fields, it is beside a middle.
    """
    best = None
    for beside in (np.zeros(3), _beside(len(outlook.rotations))):
        postures, rotations, fields = _candidates(outlook.pen, beside)
        fit = _is_seen(outlook, rotations)
        if wanted is not None:
            fit &= wanted[fields[:, 0], fields[:, 1]]
        fit &= [posture != avoided for posture in postures]
        chosen = np.flatnonzero(fit)
        if not len(chosen):
            continue
        worth = _worth(outlook, present, rotations[chosen])
        best = postures[int(chosen[np.argmax(worth)])]
        if worth.max() > 0:
            break
    return best


def visible_fields(outlook: GuidanceInput) -> BoolArray:
    """Return in which fields of the dial the pen shows enough LEDs, (3, 8)."""
    _, rotations, fields = _candidates(outlook.pen, np.zeros(3))
    row, column = fields[_is_seen(outlook, rotations)].T
    visible = np.zeros((3, N_DIRECTIONS), dtype=bool)
    visible[row, column] = True
    return visible


def image_information(outlook: GuidanceInput, rotations: FloatArray) -> FloatArray:
    """Predict the information (N, 6, 6), 1/mm^2, of images about (tip, cone).

    Their rotations (N, 3, 3) are cam_from_pen.
    """
    rig, pen = outlook.rig, outlook.pen
    none = np.zeros((len(rotations), rig.n_cameras, pen.n_leds, 2))
    model = ContactModel(rig, pen, none)
    state = model.at(rotations, outlook.tip_pen, outlook.cone_cam)
    seen = usable_leds(outlook, rotations).astype(float)
    return np.asarray(reduce(state, seen).S / outlook.sigma**2)


def usable_leds(outlook: GuidanceInput, rotations: FloatArray) -> BoolArray:
    """Return the mask of LEDs that are whole, separate and face the camera, (N, C L).

    The LEDs in one camera after those in the other.
    """
    rig = outlook.rig
    each = [_usable_leds(outlook, rotations, c) for c in range(rig.n_cameras)]
    return np.concatenate(each, axis=1)


def _usable_leds(outlook: GuidanceInput, rotations: FloatArray, c: int) -> BoolArray:
    """Return this mask for the c-th camera, (N, L)."""
    camera, pen = outlook.rig.cameras[c], outlook.pen
    R, t = outlook.rig.rotations[c], outlook.rig.translations[c]
    turned = np.swapaxes(R @ rotations, 1, 2)
    leds = (pen.leds - outlook.tip_pen) @ turned + R @ outlook.cone_cam + t
    cosines = -np.einsum("nli,nli->nl", leds, pen.normals @ turned)
    cosines /= np.linalg.norm(leds, axis=2)
    pixels = camera.project(leds)
    radii = max(camera.fx, camera.fy) * pen.diameter / 2 / leds[..., 2]
    size = np.array(camera.image_size)
    room = np.minimum(pixels + 0.5, size - 0.5 - pixels).min(axis=2)
    apart = np.linalg.norm(pixels[:, :, None] - pixels[:, None], axis=3)
    apart -= radii[:, :, None] + radii[:, None]
    apart += np.where(np.eye(pen.n_leds, dtype=bool), np.inf, 0)
    return np.asarray(
        (cosines > np.cos(MAX_INCIDENCE))
        & (leds[..., 2] > 0)
        & (room > radii)
        & (apart.min(axis=2) > MIN_GAP)
    )


def _beside(n: int) -> FloatArray:
    """Return the n-th of places spread evenly in a cube from -1 to 1, (3,) [2]_."""
    return 2 * ((0.5 + n * EVEN_STEPS) % 1) - 1


def _candidates(
    pen: Pen, beside: FloatArray
) -> tuple[list[Posture], FloatArray, IntArray]:
    """Return postures in the fields of the dial, rotations, and row and column.

    ``beside`` (3,) is how far they lie from the middles of the fields, from -1 to 1.
    """
    fields = [(0, 0)] + [(row, k) for row in (1, 2) for k in range(N_DIRECTIONS)]
    places = [(row, column, turn) for row, column in fields for turn in TURNS]
    up, right, about = beside * WITHIN
    postures = [
        Posture(
            abs((0.0, *TILTS)[row] + up),
            column * 2 * np.pi / N_DIRECTIONS + right,
            turn + about,
        )
        for row, column, turn in places
    ]
    numbers = np.array([(p.tilt, p.direction, p.turn) for p in postures])
    rotations = rotations_of(pen, numbers[:, 0], numbers[:, 1], numbers[:, 2])
    return postures, rotations, np.array([place[:2] for place in places])


def _is_seen(outlook: GuidanceInput, rotations: FloatArray) -> BoolArray:
    """Return in which postures a camera shows enough LEDs."""
    least = certain_leds(outlook.pen)
    each = [
        _usable_leds(outlook, rotations, c).sum(axis=1) >= least
        for c in range(outlook.rig.n_cameras)
    ]
    return np.asarray(np.any(each, axis=0))


def _worth(
    outlook: GuidanceInput, present: FloatArray, rotations: FloatArray
) -> FloatArray:
    """Return the expected reduction of the tip's variance on the way, mm^2.

    Per image; ``rotations`` (C, 3, 3) gives (C,).
    """
    vectors = vector_from_rotation(rotations @ present.T)
    shares = np.arange(1, N_ON_THE_WAY + 1) / N_ON_THE_WAY
    steps = rotation_from_vector(vectors[:, None] * shares[:, None]) @ present
    steps = steps.reshape(-1, 3, 3)
    new = np.ones(len(steps))
    if len(outlook.rotations):
        nearest = angles_between(steps, outlook.rotations).min(axis=1)
        new = (nearest >= outlook.spacing).astype(float)
    each = image_information(outlook, steps) * new[:, None, None]
    by_way = each.reshape(len(rotations), N_ON_THE_WAY, 6, 6).mean(axis=1)
    n_images = np.maximum(np.linalg.norm(vectors, axis=1) / outlook.spacing, 1.0)
    after = np.linalg.inv(outlook.information + n_images[:, None, None] * by_way)
    before = np.linalg.inv(outlook.information)
    gain = _tip_variance(np.asarray(before)) - _tip_variance(np.asarray(after))
    return np.asarray(gain / n_images)


def _tip_variance(covariances: FloatArray) -> FloatArray:
    """Return the variance of the tip, summed over x y z, mm^2."""
    tips: FloatArray = covariances[..., :3, :3]
    return np.asarray(np.trace(tips, axis1=-2, axis2=-1))
