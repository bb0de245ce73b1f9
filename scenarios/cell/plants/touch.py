"""How the contacts of a robot touch the floor in MuJoCo: forces, slip and centres of pressure."""

from __future__ import annotations

from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.contacts import Contacts
from hierarchy.problem import Array

_ROUNDING = 1e-9  # [m]
_LOADED = 1.0  # [N] of normal force from which a contact carries
_CORNERS = np.array([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1)])  # of a box, its bottom


@final
class Touch:
    """Reads what the floor does to each of C contacts, in their order, after a step.

    `force` (C, 3) [N] in world axes; `slip` (C,) [m], how far a contact has moved along the floor
    since it touched down, NaN if it is to slide; `margin` (C,) [m], of the centre of pressure from
    the nearest edge of the sole, NaN for a point or without force; `balance` () [m], how far inside
    the support polygon, the hull of all points of the loaded contacts, the centre of mass is from
    above, NaN below three such points, or if they are on a line.
    `signals` has these arrays by the names of signals.
    """

    def __init__(self, mujoco: Any, model: Any, contacts: Contacts) -> None:
        self.names = contacts.names
        self._force_of, self._model = mujoco.mj_contactForce, model
        self._geoms = [model.geom(name).id for name in self.names]
        self._sole = [contact.is_surface for contact in contacts.contacts]
        self._slides = [contact.slides for contact in contacts.contacts]
        self._of_geom = {geom: c for c, geom in enumerate(self._geoms)}
        count = len(self.names)
        self.force, self.slip = np.zeros((count, 3)), np.zeros(count)
        self.margin, self.balance = np.full(count, np.nan), np.full((), np.nan)
        self.signals: dict[str, NDArray[Any]] = {
            "floor_force": self.force, "slip": self.slip, "pressure_margin": self.margin,
            "support_margin": self.balance}
        self._wrench, self._moment = np.zeros(6), np.zeros((count, 3))
        self._anchor: list[Array | None] = [None] * count
        self._points = [_CORNERS * model.geom_size[geom] if sole else np.zeros((1, 3))
                        for geom, sole in zip(self._geoms, self._sole, strict=True)]

    def look(self, data: Any) -> None:
        """Read the contacts of the step just made."""
        self.force[:], self._moment[:] = 0.0, 0.0  # moment: sum of normal force times place
        for i in range(data.ncon):
            contact = data.contact[i]
            first = self._of_geom.get(contact.geom1)
            c = self._of_geom.get(contact.geom2) if first is None else first
            if c is None:  # two links of the robot
                continue
            self._force_of(self._model, data, i, self._wrench)
            force = contact.frame.reshape(3, 3).T @ self._wrench[:3]
            self.force[c] += force if first is None else -force
            self._moment[c] += self._wrench[0] * contact.pos
        self.balance[...] = inside(self._support(data), data.subtree_com[0][:2])
        for c, geom in enumerate(self._geoms):
            self._note(c, data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3))

    def _support(self, data: Any) -> Array:
        """Return the points (k, 2) of the loaded contacts from above."""
        points = [data.geom_xpos[geom] + own @ data.geom_xmat[geom].reshape(3, 3).T
                  for geom, own, force in zip(self._geoms, self._points, self.force, strict=True)
                  if force[2] > _LOADED]
        return np.concatenate([np.empty((0, 3)), *points])[:, :2]

    def _note(self, c: int, place: Array, axes: Array) -> None:
        """Note slip and margin of a contact whose geometry is at `place`, with these axes."""
        load = self.force[c, 2]
        if load <= 0.0:
            self.slip[c], self.margin[c], self._anchor[c] = 0.0, np.nan, None
            return
        anchor = self._anchor[c]
        if anchor is None:
            self._anchor[c] = anchor = place[:2].copy()
        moved = place[:2] - anchor
        self.slip[c] = np.nan if self._slides[c] else np.sqrt(moved @ moved)
        if self._sole[c]:
            pressure = axes.T @ (self._moment[c] / load - place)
            half = self._model.geom_size[self._geoms[c]]
            self.margin[c] = (half[:2] - np.abs(pressure[:2])).min()


def inside(points: Array, place: Array) -> float:
    """Return how far [m] `place` (2,) is inside the convex hull of points (k, 2).

    That is the distance from the nearest edge, negative outside; NaN for points on a line.
    """
    edge = points - points[:, None]  # (k, k, 2), from each point to each other
    length = np.hypot(edge[..., 0], edge[..., 1])
    normal = np.stack([edge[..., 1], -edge[..., 0]], axis=-1)
    normal /= np.where(length, length, 1.0)[..., None]
    beyond = np.einsum("ijx,kijx->ijk", normal, points[:, None, None] - points[None, :, None])
    of_hull = (length > 0.0) & (beyond <= _ROUNDING).all(axis=2)
    if not (beyond < -_ROUNDING).any():
        return np.nan
    return float(-np.einsum("ijx,ijx->ij", normal, place - points[:, None])[of_hull].max())
