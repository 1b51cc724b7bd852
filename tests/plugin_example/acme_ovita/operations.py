"""An operation that policies may call; importing this module enters it."""

import numpy as np

from ovita.toolkit import arguments
from ovita.toolkit.catalogue import operation


@operation("Objects: come closer, stay away, pass")
def arc_over(traj, obj, height):
    """Fly over an object in an arc, so many metres above its centre.

    Args:
        height: [m], >= 0.
    """
    rows = arguments.waypoints(traj)
    centre = arguments.point(obj)
    height = arguments.number(height, "height", low=0.0)
    along = np.linspace(0.0, np.pi, len(rows))
    peak = max(float(centre[2] + height - rows[:, 2].max()), 0.0)
    rows[:, 2] += peak * np.sin(along)
    return rows
