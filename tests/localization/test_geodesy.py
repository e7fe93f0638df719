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


@pytest.mark.parametrize("datum", [(-33.9, 151.2), (0.0, 179.9999), (89.0, 0.0)])
def test_the_heading_turns_the_axes(datum):
    longitude, latitude, _ = Geod(ellps="WGS84").fwd(datum[1], datum[0], 60.0, 900.0)
    bearing = math.radians(90.0 - 60.0) - 0.8  # counter-clockwise from the x axis
    expected = (900.0 * math.cos(bearing), 900.0 * math.sin(bearing))
    assert LocalFrame(*datum, heading=0.8).to_local(latitude, longitude) == pytest.approx(
        expected, abs=1e-6
    )


@pytest.mark.parametrize("given", [(91.0, 0.0), (0.0, 400.0), (math.nan, 0.0), (0.0, math.inf)])
def test_what_is_not_on_earth(given):
    with pytest.raises(InputError, match="is not on Earth; give -90 to 90"):
        LocalFrame(*given)
    with pytest.raises(InputError, match="is not on Earth"):
        LocalFrame(*DATUM).to_local(*given)


def test_what_is_too_far():
    frame = LocalFrame(*DATUM)
    for far in ((0.0, 0.0), (-42.3758, 108.8526)):  # the second lies opposite
        with pytest.raises(
            InputError, match=r"more than 100 km from the datum \(42.3758, -71.1474\)"
        ):
            frame.to_local(*far)
    with pytest.raises(InputError, match="heading nan"):
        LocalFrame(0.0, 0.0, math.nan)
