"""Ray casting: the depth of spheres, capsules and boxes in each pixel of a pinhole camera.

`eye` (16,) is `Pinhole.packed`: fx, fy, cx, cy, position, rotation. A depth is along the optical
axis [m], infinite where a ray meets nothing. The ray of a pixel is (rx, ry, 1) in the camera's
frame, so that its point at share t has the depth t. Only the rectangle around the projection of a
shape is visited. A shape that the camera is inside of is not seen.
"""

from math import ceil, floor, sqrt

import numpy as np

from hierarchy.jit import compiled, inlined, internal
from hierarchy.kinematics import dot, place, turned

_ALONG = 1e-12  # squared sine between ray and axis below which the side of a capsule is not met


@compiled
def draw_scene(depth, eye, backdrop, obstacles, point_radius, placements, joints, capsules):
    """Draw a wall across the optical axis at `backdrop` (infinite: none), obstacles and robot.

    depth (h, w) is overwritten; obstacles (H, 16) a table of `Obstacles`, whose points are drawn
    as balls of `point_radius` [m]; placements of a State, joints (K,) and capsules (K, 7) packed.
    """
    depth[:, :] = backdrop
    for h in range(obstacles.shape[0]):
        row = obstacles[h]
        if row[1] > 0.0:
            _draw_box(depth, eye, row)
            continue
        radius, half = row[0] if row[0] > 0.0 else point_radius, row[3]
        x, y, z = in_camera(eye, row[4], row[5], row[6])
        ax, ay, az = turned_into_camera(eye, half * row[9], half * row[12], half * row[15])
        _draw_capsule(depth, eye, (x - ax, y - ay, z - az), (2 * ax, 2 * ay, 2 * az), radius)
    _draw_robot(depth, eye, placements, joints, capsules, 0.0)


@compiled
def draw_robot(depth, eye, placements, joints, capsules, margin):
    """Draw the robot alone, every capsule thicker by `margin` [m]; depth (h, w) is overwritten."""
    depth[:, :] = np.inf
    _draw_robot(depth, eye, placements, joints, capsules, margin)


@internal
def _draw_robot(depth, eye, placements, joints, capsules, margin):
    for k in range(len(joints)):
        T, capsule = placements[joints[k]], capsules[k]
        x, y, z = place(T, capsule)
        ax, ay, az = turned(T, capsule[3:6])
        _draw_capsule(depth, eye, in_camera(eye, x, y, z), turned_into_camera(eye, ax, ay, az),
                      capsule[6] + margin)


@internal
def _draw_capsule(depth, eye, start, along, radius):
    """Draw a capsule from its start along its axis, both in the camera's frame."""
    (x, y, z), (ax, ay, az) = start, along
    height, width = depth.shape
    u0, u1 = _pixels_of_capsule(eye[0], eye[2], width, x, z, ax, az, radius)
    v0, v1 = _pixels_of_capsule(eye[1], eye[3], height, y, z, ay, az, radius)
    aa, am = dot((ax, ay, az), (ax, ay, az)), dot((ax, ay, az), (x, y, z))
    mm = dot((x, y, z), (x, y, z)) - radius * radius
    bx, by, bz = x + ax, y + ay, z + az
    nn = dot((bx, by, bz), (bx, by, bz)) - radius * radius
    for v in range(v0, v1):
        ry = (v - eye[3]) / eye[1]
        for u in range(u0, u1):
            rx = (u - eye[2]) / eye[0]
            rr, ra, rm = rx * rx + ry * ry + 1.0, rx * ax + ry * ay + az, rx * x + ry * y + z
            A = aa * rr - ra * ra
            met = np.inf
            if A > _ALONG * aa * rr:  # the side: |(t r - m) x a| = radius |a|
                B = aa * rm - ra * am
                under = B * B - A * (aa * mm - am * am)
                if under < 0.0:  # beside the cylinder, which holds the caps
                    continue
                t = (B - sqrt(under)) / A
                if 0.0 < t * ra - am < aa and t > 0.0:
                    met = t
            if met == np.inf:
                met = min(_ball(rr, rm, mm), _ball(rr, rx * bx + ry * by + bz, nn))
            if met < depth[v, u]:
                depth[v, u] = met


@inlined
def _ball(rr, rm, mm):
    """Depth at which a ray enters a ball: |t r - m|^2 = radius^2, mm = m . m - radius^2."""
    under = rm * rm - rr * mm
    if under < 0.0 or rm <= 0.0 or mm <= 0.0:
        return np.inf
    return (rm - sqrt(under)) / rr


@inlined
def _pixels_of_capsule(f, c, size, x, z, ax, az, radius):
    """First and end of its pixels along one axis of the image; see `pixels_of_ball`."""
    if min(z, z + az) <= radius < max(z, z + az):  # it reaches past the camera
        return 0, size
    first, end = pixels_of_ball(f, c, size, x, z, radius)
    other_first, other_end = pixels_of_ball(f, c, size, x + ax, z + az, radius)
    return min(first, other_first), max(end, other_end)


@internal
def _draw_box(depth, eye, row):
    height, width = depth.shape
    cx, cy, cz = in_camera(eye, row[4], row[5], row[6])
    around = sqrt(dot(row[1:4], row[1:4]))  # radius of the ball
    u0, u1 = pixels_of_ball(eye[0], eye[2], width, cx, cz, around)
    v0, v1 = pixels_of_ball(eye[1], eye[3], height, cy, cz, around)
    ax, ay, az = turned_into_camera(eye, row[7], row[10], row[13])
    bx, by, bz = turned_into_camera(eye, row[8], row[11], row[14])
    dx, dy, dz = turned_into_camera(eye, row[9], row[12], row[15])
    c = cx, cy, cz
    a, b, d = dot((ax, ay, az), c), dot((bx, by, bz), c), dot((dx, dy, dz), c)
    ha, hb, hd = row[1], row[2], row[3]
    for v in range(v0, v1):
        ry = (v - eye[3]) / eye[1]
        for u in range(u0, u1):
            rx = (u - eye[2]) / eye[0]
            a0, a1 = _between_faces(rx * ax + ry * ay + az, a, ha)
            b0, b1 = _between_faces(rx * bx + ry * by + bz, b, hb)
            d0, d1 = _between_faces(rx * dx + ry * dy + dz, d, hd)
            enter, leave = max(a0, b0, d0), min(a1, b1, d1)
            if 0.0 < enter <= leave and enter < depth[v, u]:
                depth[v, u] = enter


@inlined
def _between_faces(along, centre, half):
    """Where a ray that goes by `along` a unit is within `half` of a centre: from, to."""
    if along == 0.0:  # all along, or never
        return (-np.inf, np.inf) if abs(centre) <= half else (np.inf, -np.inf)
    per = 1.0 / along
    near, far = (centre - half) * per, (centre + half) * per
    return min(near, far), max(near, far)


@inlined
def pixels_of_ball(f, c, size, x, z, radius):
    """First and end of the pixels along one axis of the image in which a ball may be seen.

    f, c [px] of that axis, which has `size` pixels; x, z of the centre along it and in depth. The
    bounds of x / z over the ball are the slopes of its two tangents.
    """
    if z <= radius:
        return 0, (size if z > -radius else 0)
    root, over = radius * sqrt(x * x + z * z - radius * radius), z * z - radius * radius
    first, last = f * (x * z - root) / over + c, f * (x * z + root) / over + c
    return (ceil(min(max(first, 0.0), float(size))),
            floor(min(max(last, -1.0), size - 1.0)) + 1)


@inlined
def in_camera(eye, x, y, z):
    """A world point in the camera's frame."""
    return turned_into_camera(eye, x - eye[4], y - eye[5], z - eye[6])


@inlined
def turned_into_camera(eye, x, y, z):
    """A world vector in the camera's frame."""
    return (eye[7] * x + eye[10] * y + eye[13] * z, eye[8] * x + eye[11] * y + eye[14] * z,
            eye[9] * x + eye[12] * y + eye[15] * z)
