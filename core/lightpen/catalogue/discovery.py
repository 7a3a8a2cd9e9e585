"""Messages of discovery: code, then template with named values."""

MESSAGES = {
    "discover.no-start": "No focal length from 0.3 to 12 image widths explains the tracks. Check that the tip stayed in the cone, and tilt the pen in all directions, with roll.",
    "discover.no-fit": "No pen, no camera and no fixed tip explain the tracks: the residuals are {misfit:.1f} px. Check that the tip stayed in the cone, that the LEDs are fixed to one pen, and that camera and cone stand still.",
    "discover.camera-changed": "The camera changed during the swing: its focal length was {first:.0f} px first and {second:.0f} px later. Lock zoom, focus and image stabilisation, and repeat the swing.",
    "discover.many-left-out": "Only {n_used} of {n_images} images agree on one tip. Press the tip into the cone, clamp cone and camera, and repeat the swing.",
    "discover.weak-swing": "The swing is too weak: U of the tip is {U:.2g} mm, the focal length is uncertain by {focal:.2g} %, and the pen's tilt varies by {tilt:.0f} degrees. Tilt the pen by 30 degrees in all directions, and turn it about its axis.",
    "discover.mirror-undecided": "The images do not decide between the pen and its mirror image. Tilt the pen further towards the camera and away from it, by 30 degrees or more, and come closer to the camera.",
    "discover.not-followed": "The LEDs cannot be tracked: no {needed} successive images of {n_images} show the same 5 LEDs. Give the images in the order of capture, 10 or more a second, with the whole pen in view.",
    "discover.too-few-images": "There are {n_images} images; at least {needed} are needed, and 300 are usual. Record a swing of 15 seconds or more, 10 images a second or more.",
    "discover.too-few-leds": "{n_leds} LEDs are seen; at least {needed} are needed. Keep the whole pen in view, switch on all LEDs, and check exposure and focus.",
    "discover.two-pens": "{n_others} lights move together, but not with the pen: there is a second pen, or a mirror. Remove or cover it, and repeat the swing.",
    "discover.sketch-count": "{n_found} LEDs are found; the sketch has {n_sketched}. Give a sketch with all LEDs of the pen, or none.",
    "discover.other-sketch": "The LEDs found do not match the sketch in any order. Check that the sketch is of this pen, right-handed, in millimetres and accurate to 5 mm.",
    "discover.no-such-led": "There is no LED {number}; {n_leds} LEDs are found, numbered from the tip upwards and from left to right. Give a length between two of these.",
    "discover.same-led": "The length is between LED {number} and itself. Give the numbers of two LEDs.",
    "discover.lengths-contradict": "The lengths contradict each other: LEDs {first} and {second} are stated {stated:.3f} mm apart; the other lengths give {implied:.3f} mm. Check the numbers of the LEDs, and measure again.",
    "discover.length-of-others": "The length of {length:g} mm does not fit LEDs {first} and {second}: it gives a disc diameter of {found:.2f} mm, stated is {stated:g} mm. It may be the length between LEDs {other} and {another}. Check which LEDs were measured, and the diameter of the discs.",
    "discover.no-length": "A pen file needs one known length. Measure the distance between two LEDs and state it.",
    "discover.relative": "No length is given: all lengths are in hundredths of the largest distance between two LEDs.",
    "discover.length-limits": "The length limits U: a standard uncertainty of {sigma:.3f} mm would reduce U from {now:.0f} to {then:.0f} µm.",
    "discover.centers-outside": "Most centres are outside the image: they extend to ({x:.0f}, {y:.0f}) px; the images have {width} x {height} px. Check the size of the images.",
}
