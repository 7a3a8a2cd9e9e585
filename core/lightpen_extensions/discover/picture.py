"""A picture of a pen from the front, with the numbers of its LEDs and its tip."""

import cv2
import numpy as np

from lightpen.formats.decoding import encode_png
from lightpen_extensions.discover.found import Discovery

HEIGHT, MARGIN = 900, 90  # px
DISC, LED, WORDS, LINE = 235, 90, 20, 160  # grey values
FONT, SIZE, THICK = cv2.FONT_HERSHEY_SIMPLEX, 0.9, 2


def picture_of_pen(found: Discovery) -> bytes:
    """Return a PNG: x to the right, y up, as the camera sees the upright pen."""
    leds = found.pen.leds
    points = np.concatenate([leds, found.tip_pen[None]])[:, :2]
    low, high = points.min(axis=0), points.max(axis=0)
    scale = (HEIGHT - 2 * MARGIN) / float((high - low)[1] or 1.0)
    width = round(scale * float((high - low)[0])) + 4 * MARGIN
    places = np.column_stack(
        [
            2 * MARGIN + scale * (points[:, 0] - low[0]),
            HEIGHT - MARGIN - scale * (points[:, 1] - low[1]),
        ]
    )
    places = np.rint(places).astype(int)
    image = np.full((HEIGHT, width), 255, np.uint8)
    *discs, tip = [(x, y) for x, y in places.tolist()]
    top = discs[int(np.argmax(leds[:, 1]))]
    cv2.line(image, tip, top, LINE, 1, cv2.LINE_AA)
    radius = max(6, round(scale * found.pen.diameter / 2))
    for number, (x, y) in enumerate(discs, 1):
        cv2.circle(image, (x, y), radius, DISC, -1, cv2.LINE_AA)
        cv2.circle(image, (x, y), radius, LED, 2, cv2.LINE_AA)
        at = (x + radius + 6, y + 10)
        cv2.putText(image, str(number), at, FONT, SIZE, WORDS, THICK, cv2.LINE_AA)
    cv2.drawMarker(image, tip, WORDS, cv2.MARKER_CROSS, 24, THICK)
    at = (tip[0] + 18, tip[1] + 10)
    cv2.putText(image, "tip", at, FONT, SIZE, WORDS, THICK, cv2.LINE_AA)
    return encode_png(image)
