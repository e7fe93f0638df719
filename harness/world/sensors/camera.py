"""A colour camera, drawn by PyBullet's software renderer."""

import math

import numpy as np
import numpy.typing as npt
import shapely

from harness.task.camera_params import CameraParams
from harness.world.map.scene import Scene
from harness.world.map.shapes import Rect
from harness.world.physics.bodies import static_index
from harness.world.physics.elevation import elevation_of
from harness.world.physics.engine import Server, bullet
from navstack.types import FloatArray, Pose2D

Image = npt.NDArray[np.uint8]
Color = tuple[float, float, float]

NEAREST = 0.05  # [m] of what is drawn
# [m] the robot moves before the choice is made anew; beyond the range that bodies stay
RENEW, KEPT = 5.0, 10.0
COLORS: dict[str, Color] = {  # of obstacles and zones by kind
    "building_glass": (0.55, 0.62, 0.70),
    "mailbox": (0.10, 0.25, 0.65),
    "trash_bin": (0.20, 0.35, 0.25),
    "plant": (0.20, 0.50, 0.18),
    "fence": (0.45, 0.35, 0.25),
    "bollard": (0.75, 0.65, 0.15),
    "hydrant": (0.75, 0.12, 0.10),
    "barrier": (0.90, 0.45, 0.10),
    "traffic_light": (0.15, 0.15, 0.15),
    "road": (0.25, 0.25, 0.27),
    "sidewalk": (0.66, 0.65, 0.62),
    "crosswalk": (0.85, 0.85, 0.85),
    "plaza": (0.70, 0.66, 0.58),
    "lawn": (0.35, 0.55, 0.25),
    "construction": (0.60, 0.50, 0.35),
}
OTHER: Color = (0.50, 0.50, 0.50)
SKIN: Color = (0.85, 0.65, 0.50)
HEAD = 0.11  # [m] radius
CLOTHES: tuple[Color, ...] = (
    (0.75, 0.20, 0.20),
    (0.20, 0.30, 0.70),
    (0.85, 0.75, 0.30),
    (0.25, 0.25, 0.28),
)
NOWHERE = (0.0, 0.0, -1000.0)  # [m]
BEYOND = 50.0  # [m] of ground beyond the map's edge
GROUND = -0.5  # [m] below the lowest zone: the ground beside all zones


class Camera:
    """Draws pictures from the robot's place.

    It sees shapes in the colours of their kinds, and no textures.
    """

    def __init__(self, scene: Scene, params: CameraParams, radius: float, height: float) -> None:
        """Set the scene up.

        Args:
            scene: what stands around.
            params: of the camera.
            radius: [m] of people.
            height: [m] of people.
        """
        self._params, self._server = params, Server()
        self._client = self._server.client
        self._index = static_index(scene)
        self._elevation = elevation_of(scene)
        self._bodies: dict[int, int] = {}  # of the obstacles that are drawn, by their numbers
        self._center = (math.inf, math.inf)
        self._persons = [self._person(radius, height, clothes) for clothes in CLOTHES]
        self._people: list[int] = []
        self._lay_ground(scene)
        vertical = 2.0 * math.atan(math.tan(0.5 * params.fov) * params.height / params.width)
        self._projection = bullet.computeProjectionMatrixFOV(
            math.degrees(vertical), params.width / params.height, NEAREST, params.range
        )

    def picture(self, pose: Pose2D, people: FloatArray) -> Image:
        """What the camera of a robot sees, shape (height, width, 3).

        Args:
            pose: of the robot, upright on the ground; map frame.
            people: (n, >= 2) x, y [m]; NaN: not there.
        """
        self._renew(pose.x, pose.y)
        self._put_people(people)
        params, (ahead, left, up) = self._params, self._params.position
        cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
        x, y = pose.x + cos * ahead - sin * left, pose.y + sin * ahead + cos * left
        z = self._elevation.level(pose.x, pose.y) + up
        flat, down = math.cos(params.pitch), -math.sin(params.pitch)
        view = bullet.computeViewMatrix(
            (x, y, z), (x + cos * flat, y + sin * flat, z + down), (0.0, 0.0, 1.0)
        )
        drawn = bullet.getCameraImage(
            params.width,
            params.height,
            view,
            self._projection,
            shadow=0,
            renderer=bullet.ER_TINY_RENDERER,
            physicsClientId=self._client,
        )
        return np.ascontiguousarray(
            np.reshape(drawn[2], (params.height, params.width, 4))[..., :3].astype(np.uint8)
        )

    def _renew(self, x: float, y: float) -> None:
        """Have bodies for the obstacles in range, and for few others."""
        if math.hypot(x - self._center[0], y - self._center[1]) < RENEW:
            return
        self._center = (x, y)
        reach = self._params.range + RENEW
        kept = set(self._index.near(x, y, reach + KEPT)[0])
        for number in self._bodies.keys() - kept:
            bullet.removeBody(self._bodies.pop(number), physicsClientId=self._client)
        for number in self._index.near(x, y, reach)[0]:
            if number not in self._bodies:
                obstacle = self._index.obstacles[number]
                bottom = self._elevation.level(*obstacle.polygon.mean(axis=0).tolist())
                color = COLORS.get(obstacle.kind, OTHER)
                self._bodies[number] = self._prism(
                    obstacle.polygon, bottom, bottom + obstacle.height, color
                )

    def _put_people(self, people: FloatArray) -> None:
        while len(self._people) > len(people):  # of another delivery
            bullet.removeBody(self._people.pop(), physicsClientId=self._client)
        while len(self._people) < len(people):
            person = self._persons[len(self._people) % len(CLOTHES)]
            self._people.append(self._body(person, NOWHERE))
        for body, (x, y) in zip(self._people, people[:, :2].tolist(), strict=True):
            place = (x, y, self._elevation.level(x, y)) if math.isfinite(x) else NOWHERE
            bullet.resetBasePositionAndOrientation(
                body, place, (0.0, 0.0, 0.0, 1.0), physicsClientId=self._client
            )

    def _lay_ground(self, scene: Scene) -> None:
        lowest = min((zone.elevation for zone in scene.zones), default=0.0)
        grid, corner = scene.geometry, scene.geometry.origin
        side = grid.resolution * max(grid.data.shape)
        square = Rect(corner.x, corner.y, corner.x + side, corner.y + side)
        self._prism(square.grown(BEYOND).polygon, lowest + GROUND, lowest - 1e-3, OTHER)
        for number, zone in enumerate(scene.zones):  # of two that overlap the later one is seen
            top = zone.elevation + 1e-3 * number / max(1, len(scene.zones))
            self._prism(zone.polygon, lowest + GROUND, top, COLORS.get(zone.kind, OTHER))

    def _prism(self, polygon: FloatArray, bottom: float, top: float, color: Color) -> int:
        """A body between two heights [m] over a polygon (N, 2).

        Its sides, and its top in triangles.
        """
        center = polygon.mean(axis=0)
        outline = polygon - center
        lower = np.column_stack((outline, np.full(len(polygon), bottom)))
        upper = np.column_stack((outline, np.full(len(polygon), top)))
        next_lower, next_upper = np.roll(lower, -1, axis=0), np.roll(upper, -1, axis=0)
        triangles: list[FloatArray] = []
        for a, b, c, d in zip(lower, next_lower, next_upper, upper, strict=True):
            triangles += [np.array((a, b, c)), np.array((a, c, d))]
        for part in shapely.constrained_delaunay_triangles(shapely.Polygon(outline)).geoms:
            corners = np.array(shapely.geometry.polygon.orient(part).exterior.coords)[:3, :2]
            triangles.append(np.column_stack((corners, np.full(3, top))))
        vertices = np.concatenate(triangles)
        shape = bullet.createVisualShape(
            bullet.GEOM_MESH,
            vertices=vertices.tolist(),
            indices=list(range(len(vertices))),
            rgbaColor=(*color, 1.0),
            physicsClientId=self._client,
        )
        return self._body(int(shape), (*center.tolist(), 0.0))

    def _person(self, radius: float, height: float, clothes: Color) -> int:
        """A body with a head, feet on the ground."""
        body = height - 2.0 * HEAD
        return int(
            bullet.createVisualShapeArray(
                [bullet.GEOM_CYLINDER, bullet.GEOM_SPHERE],
                radii=[radius, HEAD],
                lengths=[body, 0.0],
                visualFramePositions=[(0.0, 0.0, 0.5 * body), (0.0, 0.0, height - HEAD)],
                rgbaColors=[(*clothes, 1.0), (*SKIN, 1.0)],
                physicsClientId=self._client,
            )
        )

    def _body(self, shape: int, position: tuple[float, float, float]) -> int:
        return int(bullet.createMultiBody(0.0, -1, shape, position, physicsClientId=self._client))
