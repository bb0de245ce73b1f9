"""Images of solids without a graphics card: depth by ray casting, then lighting."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Sequence
from math import inf, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierarchy.avoidance import Capsule
from hierarchy.avoidance.self_collision import pack_capsules
from hierarchy.jit import compiled
from hierarchy.problem import Array
from scenarios.cell.sensors.camera import Pinhole
from scenarios.cell.sensors.rendering import draw_scene

Colour = tuple[int, int, int]

_SUN = np.array([0.25, 0.35, 0.9]) / np.linalg.norm([0.25, 0.35, 0.9])
_NOBODY = (np.zeros(0, np.int64), np.zeros((0, 7)))
_NOTHING = np.zeros((0, 16))
_AT_REST = np.zeros((1, 12))


class Picture:
    """An image (h, w, 3) of bytes with the depth [m] of the nearest surface in each pixel."""

    def __init__(self, pinhole: Pinhole, ground: Colour) -> None:
        size = (pinhole.height, pinhole.width)
        self.pinhole, self.eye = pinhole, pinhole.packed()
        self.image = np.full((*size, 3), ground, np.uint8)
        self.depth = np.full(size, inf, np.float32)
        self._layer = np.empty(size, np.float32)

    def draw_links(self, links: Sequence[Capsule], placements: Array, colour: Colour) -> None:
        """Draw capsules on bodies with placements (J + 1, 12), as in a State."""
        draw_scene(self._layer, self.eye, inf, _NOTHING, 0.0, placements, *pack_capsules(links))
        self._light(colour)

    def draw_obstacles(self, table: Array, point_radius: float, colour: Colour) -> None:
        """Draw a table (H, 16) of `Obstacles`."""
        draw_scene(self._layer, self.eye, inf, table, point_radius, _AT_REST, *_NOBODY)
        self._light(colour)

    def tint(self, table: Array, point_radius: float, colour: Colour, share: float) -> None:
        """Draw a table of obstacles as transparent surfaces."""
        draw_scene(self._layer, self.eye, inf, table, point_radius, _AT_REST, *_NOBODY)
        seen = self._layer < self.depth
        mixed = (1.0 - share) * self.image[seen] + share * np.array(colour)
        self.image[seen] = mixed.astype(np.uint8)

    def is_seen(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether points (N, 3) [m] are in the image and not hidden: (N,)."""
        u, v, depth = self.pinhole.project(points).T
        height, width = self.depth.shape
        inside = (u >= 0) & (u < width - 0.5) & (v >= 0) & (v < height - 0.5) & (depth > 0)
        at = np.where(inside, v, 0).round().astype(int), np.where(inside, u, 0).round().astype(int)
        return np.asarray(inside & (depth <= self.depth[at] + 0.003))

    def _light(self, colour: Colour) -> None:
        _light(self._layer, self.depth, self.eye, _SUN, np.array(colour, float), self.image)


@compiled
def _light(layer, depth, eye, sun, colour, image):
    """Draw pixels nearer than all before into the image, lit from `sun`, with a highlight."""
    height, width = layer.shape
    for v in range(height):
        for u in range(width):
            z = layer[v, u]
            if not z < depth[v, u]:
                continue
            depth[v, u] = z
            # Of a plane n . p = 1 the inverse depth is n . (rx, ry, 1), so its slopes give n.
            a = eye[0] * _slope(layer[v, max(u - 1, 0)], z, layer[v, min(u + 1, width - 1)])
            b = eye[1] * _slope(layer[max(v - 1, 0), u], z, layer[min(v + 1, height - 1), u])
            w = 1.0 - a * (u - eye[2]) / eye[0] - b * (v - eye[3]) / eye[1]
            length = -sqrt(a * a + b * b + w * w)  # toward the camera
            x, y, w = a / length, b / length, w / length
            nx = eye[7] * x + eye[8] * y + eye[9] * w
            ny = eye[10] * x + eye[11] * y + eye[12] * w
            nz = eye[13] * x + eye[14] * y + eye[15] * w
            to_sun = max(nx * sun[0] + ny * sun[1] + nz * sun[2], 0.0)
            light = 0.42 + 0.1 * (1.0 + nz) + 0.46 * to_sun
            for c in range(3):
                image[v, u, c] = np.uint8(min(colour[c] * light + 40.0 * to_sun**20, 255.0))


@compiled
def _slope(before, here, after):
    """Return the change of 1 / depth per pixel, times depth, on the side of the same surface."""
    ahead, behind = (here - after) / after, (before - here) / before
    if not np.isfinite(after):
        ahead = np.inf
    if not np.isfinite(before):
        behind = np.inf
    slope = ahead if abs(ahead) < abs(behind) else behind
    return slope if np.isfinite(slope) else 0.0
