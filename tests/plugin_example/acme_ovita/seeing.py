"""A detector: `ovita perceive ... --detector acme`."""

import numpy as np

from ovita.perceive.detect import Found


class CentreDetector:
    """Takes what is in the middle of the picture for the first thing that is looked for.

    Args:
        model: What follows the colon of its name; unused.
        frame: Of the world: which way is up.
    """

    name = "acme"

    def __init__(self, model, frame):
        self.up = frame.direction("up")

    def find(self, view, names, text):
        """The things of a view."""
        mask = np.zeros(view.depth.shape, dtype=bool)
        rows, columns = mask.shape
        mask[rows // 3 : 2 * rows // 3, columns // 3 : 2 * columns // 3] = True
        return (Found(mask, names[0] if names else "thing"),)
