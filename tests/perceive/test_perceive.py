import numpy as np
import pytest
from depth_pictures import Thing, picture

from ovita.perceive import perceive


@pytest.mark.parametrize("yaw", [0.0, 0.5, 1.2])
def test_a_box_on_a_table_is_found_where_it_is(yaw):
    box = Thing("box", (0.05, -0.04, 0.06), (0.16, 0.1, 0.12), yaw)
    (seen,) = perceive([picture([box], noise=0.0025)]).scene
    assert np.linalg.norm(seen.position - box.position) < 0.012
    assert np.sort(seen.size) == pytest.approx(np.sort(box.size), abs=0.015)
    assert seen.extra["points"] > 100
