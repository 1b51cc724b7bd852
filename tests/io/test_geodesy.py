"""Geodetic coordinates and local metres, against formulas that share no code with ours."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ovita.errors import RequestError
from ovita.io.geodesy import Home, to_geodetic, to_local

ZURICH = Home(47.3977419, 8.5455938, 488.2)
homes = st.builds(Home, st.floats(-89, 89), st.floats(-180, 180), st.floats(-100, 5000))


def vincenty(lat1, lon1, lat2, lon2):
    """Length [m] and first azimuth [rad] of the geodesic on WGS-84 (Vincenty's inverse formula, Survey Review 1975)."""
    a, f = 6378137.0, 1 / 298.257223563
    b = (1 - f) * a
    u1, u2 = (math.atan((1 - f) * math.tan(math.radians(v))) for v in (lat1, lat2))
    big_l = lam = math.radians(lon2 - lon1)
    for _ in range(100):
        ss = math.hypot(
            math.cos(u2) * math.sin(lam), math.cos(u1) * math.sin(u2) - math.sin(u1) * math.cos(u2) * math.cos(lam)
        )
        cs = math.sin(u1) * math.sin(u2) + math.cos(u1) * math.cos(u2) * math.cos(lam)
        sigma = math.atan2(ss, cs)
        sa = math.cos(u1) * math.cos(u2) * math.sin(lam) / ss
        ca2 = 1 - sa**2
        c2m = cs - 2 * math.sin(u1) * math.sin(u2) / ca2 if ca2 else 0.0
        c = f / 16 * ca2 * (4 + f * (4 - 3 * ca2))
        before = lam
        lam = big_l + (1 - c) * f * sa * (sigma + c * ss * (c2m + c * cs * (2 * c2m**2 - 1)))
        if abs(lam - before) < 1e-14:
            break
    w = ca2 * (a * a - b * b) / (b * b)
    big_a = 1 + w / 16384 * (4096 + w * (-768 + w * (320 - 175 * w)))
    big_b = w / 1024 * (256 + w * (-128 + w * (74 - 47 * w)))
    step = big_b / 6 * c2m * (4 * ss**2 - 3) * (4 * c2m**2 - 3)
    delta = big_b * ss * (c2m + big_b / 4 * (cs * (2 * c2m**2 - 1) - step))
    azimuth = math.atan2(
        math.cos(u2) * math.sin(lam), math.cos(u1) * math.sin(u2) - math.sin(u1) * math.cos(u2) * math.cos(lam)
    )
    return b * big_a * (sigma - delta), azimuth


@given(st.floats(-80, 80), st.floats(-179, 179), st.floats(-0.02, 0.02), st.floats(-0.02, 0.02))
@settings(derandomize=True, deadline=None, max_examples=60)
def test_distances_on_the_ground_agree_with_vincenty_to_a_millimetre_within_kilometres(lat, lon, up, along):
    if max(abs(up), abs(along)) < 1e-5:
        return
    length, azimuth = vincenty(lat, lon, lat + up, lon + along)
    east, north, down = to_local(np.array([[lat + up, lon + along, 0.0]]), Home(lat, lon))[0]
    # The straight line through the earth is shorter than the geodesic by its cube over 24 R^2.
    chord = math.sqrt(east**2 + north**2 + down**2)
    assert chord + length**3 / (24 * 6371000.0**2) == pytest.approx(length, abs=1e-3)
    turned = math.atan2(east, north) - azimuth
    assert abs(math.remainder(turned, 2 * math.pi)) * length < 2e-3


def test_known_places():
    # One second of arc along the equator is a 1,296,000th of its length; heights go straight up.
    east = to_local(np.array([[0.0, 1 / 3600, 0.0]]), Home(0.0, 0.0))[0]
    assert east == pytest.approx([2 * math.pi * 6378137.0 / 1296000, 0.0, -7.5e-5], abs=1e-5)
    up = to_local(np.array([[ZURICH.latitude, ZURICH.longitude, 500.0]]), ZURICH)[0]
    np.testing.assert_allclose(up, [0, 0, 11.8], atol=1e-8)
    # A degree of latitude at the pole, by the polar radius of curvature a^2/b.
    arc = to_local(np.array([[90 - 1 / 3600, 0.0, 0.0]]), Home(90.0, 0.0))[0]
    assert math.hypot(*arc[:2]) == pytest.approx(6399593.6258 * math.radians(1 / 3600), abs=1e-5)


@given(homes, st.lists(st.tuples(*[st.floats(-10_000, 10_000)] * 2, st.floats(-500, 5000)), min_size=1, max_size=20))
@settings(derandomize=True, deadline=None, max_examples=60)
def test_there_and_back_is_exact_to_a_hundredth_of_a_micrometre(home, points):
    local = np.array(points)
    np.testing.assert_allclose(to_local(to_geodetic(local, home), home), local, atol=1e-8)


def test_what_is_no_home():
    with pytest.raises(RequestError, match="latitude 95 is not within"):
        Home(95.0, 0.0)
    with pytest.raises(RequestError, match="longitude nan"):
        Home(0.0, math.nan)
    for text in ("47,8,400,1", "here", "47", ""):
        with pytest.raises(RequestError, match="is not latitude,longitude,altitude"):
            Home.parse(text)
    assert Home.parse("47.5, -8.25") == Home(47.5, -8.25, None)
