"""Ray casting: the depth of spheres, capsules and boxes in each pixel of a pinhole camera.

`eye` (16,) is `Pinhole.packed`: fx, fy, cx, cy, position, rotation. A depth is along the optical
axis [m], infinite where a ray meets nothing. The ray of a pixel is (rx, ry, 1) in the camera's
frame, so that its point at share t has the depth t. Only the rectangle around the projection of a
shape is visited. A shape that the camera is inside of is not seen.
"""

from math import ceil, floor, sqrt

import numpy as np

from hierarchy.jit import compiled, inlined, internal
from hierarchy.kinematics import dot, less, place, plus, times, turned

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
        radius, middle = row[0] if row[0] > 0.0 else point_radius, in_camera(eye, row[4:7])
        half = turned_into_camera(eye, times(row[3], (row[9], row[12], row[15])))
        _draw_capsule(depth, eye, less(middle, half), times(2.0, half), radius)
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
        _draw_capsule(depth, eye, in_camera(eye, place(T, capsule)),
                      turned_into_camera(eye, turned(T, capsule[3:6])), capsule[6] + margin)


@internal
def _draw_capsule(depth, eye, start, along, radius):
    """Draw a capsule from its start along its axis, both in the camera's frame."""
    height, width = depth.shape
    u0, u1 = _pixels_of_capsule(eye[0], eye[2], width, start, along, 0, radius)
    v0, v1 = _pixels_of_capsule(eye[1], eye[3], height, start, along, 1, radius)
    aa, am, end = dot(along, along), dot(along, start), plus(start, along)
    mm, nn = dot(start, start) - radius * radius, dot(end, end) - radius * radius
    for v in range(v0, v1):
        ry = (v - eye[3]) / eye[1]
        for u in range(u0, u1):
            r = (u - eye[2]) / eye[0], ry, 1.0
            rr, ra, rm = dot(r, r), dot(r, along), dot(r, start)
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
                met = min(_ball(rr, rm, mm), _ball(rr, dot(r, end), nn))
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
def _pixels_of_capsule(f, c, size, start, along, i, radius):
    """First and end of its pixels along axis i of the image; see `pixels_of_ball`."""
    z, end_z = start[2], start[2] + along[2]
    if min(z, end_z) <= radius < max(z, end_z):  # it reaches past the camera
        return 0, size
    first, end = pixels_of_ball(f, c, size, start[i], z, radius)
    other_first, other_end = pixels_of_ball(f, c, size, start[i] + along[i], end_z, radius)
    return min(first, other_first), max(end, other_end)


@internal
def _draw_box(depth, eye, row):
    height, width = depth.shape
    middle = in_camera(eye, row[4:7])
    around = sqrt(dot(row[1:4], row[1:4]))  # radius of the ball
    u0, u1 = pixels_of_ball(eye[0], eye[2], width, middle[0], middle[2], around)
    v0, v1 = pixels_of_ball(eye[1], eye[3], height, middle[1], middle[2], around)
    a = turned_into_camera(eye, (row[7], row[10], row[13]))
    b = turned_into_camera(eye, (row[8], row[11], row[14]))
    d = turned_into_camera(eye, (row[9], row[12], row[15]))
    ca, cb, cd = dot(a, middle), dot(b, middle), dot(d, middle)
    ha, hb, hd = row[1], row[2], row[3]
    for v in range(v0, v1):
        ry = (v - eye[3]) / eye[1]
        for u in range(u0, u1):
            r = (u - eye[2]) / eye[0], ry, 1.0
            a0, a1 = _between_faces(dot(r, a), ca, ha)
            b0, b1 = _between_faces(dot(r, b), cb, hb)
            d0, d1 = _between_faces(dot(r, d), cd, hd)
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
def in_camera(eye, p):
    """A world point in the camera's frame."""
    return turned_into_camera(eye, less(p, eye[4:7]))


@inlined
def turned_into_camera(eye, a):
    """A world vector in the camera's frame."""
    return dot(eye[7:16:3], a), dot(eye[8:16:3], a), dot(eye[9:16:3], a)
