"""An operation that policies may call; importing this module enters it."""

import numpy as np

from ovita.toolkit import arguments
from ovita.toolkit.catalogue import operation


@operation("Reshape the whole")
def acme_bow(traj, height):
    """Bow the path upwards between its ends, so many metres in its middle.

    Args:
        height: [m], >= 0.
    """
    rows = arguments.waypoints(traj)
    height = arguments.number(height, "height", low=0.0)
    rows[:, 2] += height * np.sin(np.linspace(0.0, np.pi, len(rows)))
    return rows
