import math

import pytest
from pyproj import Geod

from navstack.errors import InputError
from navstack.localization.geodesy import LocalFrame

DATUM = (42.3758, -71.1474)


@pytest.mark.parametrize("azimuth", [0.0, 37.0, 90.0, 200.0, 315.0])
@pytest.mark.parametrize("distance", [1.0, 500.0, 20_000.0])
def test_distance_and_azimuth_from_the_datum_are_those_on_the_ellipsoid(azimuth, distance):
    longitude, latitude, _ = Geod(ellps="WGS84").fwd(DATUM[1], DATUM[0], azimuth, distance)
    x, y = LocalFrame(*DATUM).to_local(latitude, longitude)
    assert x == pytest.approx(distance * math.sin(math.radians(azimuth)), abs=1e-6)
    assert y == pytest.approx(distance * math.cos(math.radians(azimuth)), abs=1e-6)


def test_there_and_back():
    for datum in (DATUM, (-33.9, 151.2), (0.0, 179.9999), (89.0, 0.0)):
        frame = LocalFrame(*datum, heading=0.8)
        for point in ((0.0, 0.0), (12.0, -7.0), (-900.0, 3000.0)):
            assert frame.to_local(*frame.to_geodetic(*point)) == pytest.approx(point, abs=1e-6)


def test_the_heading_turns_the_axes():
    east_of = LocalFrame(*DATUM).to_geodetic(10.0, 0.0)
    assert LocalFrame(*DATUM, heading=math.pi / 2).to_local(*east_of) == pytest.approx((0.0, -10.0), abs=1e-6)


def test_lengths_across_the_line_of_sight():
    """At 10 km from the datum they err by 4e-7, as the class says."""
    frame, radius, step = LocalFrame(*DATUM), 10_000.0, 1e-3
    (lat1, lon1), (lat2, lon2) = (
        frame.to_geodetic(radius * math.cos(angle), radius * math.sin(angle)) for angle in (0.0, step)
    )
    length = Geod(ellps="WGS84").inv(lon1, lat1, lon2, lat2)[2]
    assert length / (2.0 * radius * math.sin(0.5 * step)) - 1.0 == pytest.approx(-4.1e-7, rel=0.02)


@pytest.mark.parametrize("given", [(91.0, 0.0), (0.0, 400.0), (math.nan, 0.0), (0.0, math.inf)])
def test_what_is_not_on_earth(given):
    with pytest.raises(InputError, match="is not on Earth; give -90 to 90"):
        LocalFrame(*given)
    with pytest.raises(InputError, match="is not on Earth"):
        LocalFrame(*DATUM).to_local(*given)


def test_what_is_too_far():
    frame = LocalFrame(*DATUM)
    for far in ((0.0, 0.0), (-42.3758, 108.8526)):  # the second lies opposite
        with pytest.raises(InputError, match=r"more than 100 km from the datum \(42.3758, -71.1474\)"):
            frame.to_local(*far)
    with pytest.raises(InputError, match="more than 100 km"):
        frame.to_geodetic(math.nan, 0.0)
    with pytest.raises(InputError, match="heading nan"):
        LocalFrame(0.0, 0.0, math.nan)
