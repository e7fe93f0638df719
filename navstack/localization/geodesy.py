"""Latitude and longitude in metres about a datum, and back."""

import math

from pyproj import Proj
from pyproj.exceptions import ProjError

from navstack.errors import InputError

# [m] from the datum: no robot's site is larger, and lengths across the line of sight err by 4e-5
FARTHEST = 100_000.0


class LocalFrame:
    """A plane that touches the WGS 84 ellipsoid at a datum.

    The projection is PROJ's ellipsoidal azimuthal equidistant one (Snyder, Map Projections: A
    Working Manual, USGS Professional Paper 1395, 1987, pp. 191-202): distance and azimuth from the
    datum are true; at 10 km from it lengths across err by 4e-7. The x axis points ``heading``
    counter-clockwise from east, so that 0 gives x east and y north (REP 103).
    """

    def __init__(self, datum_latitude: float, datum_longitude: float, heading: float = 0.0) -> None:
        """Touch the Earth.

        Args:
            datum_latitude: [deg] of the frame's origin, north positive.
            datum_longitude: [deg], east positive.
            heading: [rad] of the x axis, counter-clockwise from east.

        Raises:
            InputError: a coordinate that is not on Earth, or a heading that is not a number.
        """
        _check(datum_latitude, datum_longitude)
        if not math.isfinite(heading):
            raise InputError(
                f"heading {heading} of a local frame is not a finite number; give [rad] from east"
            )
        self.datum = (datum_latitude, datum_longitude)
        self._cos, self._sin = math.cos(heading), math.sin(heading)
        self._projection = Proj(
            proj="aeqd", ellps="WGS84", lat_0=datum_latitude, lon_0=datum_longitude
        )

    def to_local(self, latitude: float, longitude: float) -> tuple[float, float]:
        """The point x, y [m] of a latitude and longitude [deg].

        Raises:
            InputError: a coordinate that is not on Earth, or farther than ``FARTHEST`` from the
                datum.
        """
        _check(latitude, longitude)
        try:
            east, north = self._projection(longitude, latitude, errcheck=True)
        except ProjError:  # the antipodes
            east = north = math.inf
        self._check_distance(f"({latitude}, {longitude}) degrees", east, north)
        return self._cos * east + self._sin * north, self._cos * north - self._sin * east

    def to_geodetic(self, x: float, y: float) -> tuple[float, float]:
        """The latitude and longitude [deg] of a point [m].

        Raises:
            InputError: it is farther than ``FARTHEST`` from the datum.
        """
        self._check_distance(f"({x}, {y}) m", x, y)
        east, north = self._cos * x - self._sin * y, self._sin * x + self._cos * y
        longitude, latitude = self._projection(east, north, inverse=True)
        return latitude, longitude

    def _check_distance(self, point: str, x: float, y: float) -> None:
        if not math.hypot(x, y) <= FARTHEST:
            latitude, longitude = self.datum
            raise InputError(
                f"{point} is more than {FARTHEST / 1000.0:.0f} km "
                f"from the datum ({latitude}, {longitude}) degrees; "
                "give a datum near the robot"
            )


def _check(latitude: float, longitude: float) -> None:
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 360.0):
        raise InputError(
            f"latitude {latitude}, longitude {longitude} is not on Earth; "
            "give -90 to 90 and -180 to 180 degrees"
        )
