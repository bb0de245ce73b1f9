"""The page's server, and how the page looks before anything is drawn."""

from __future__ import annotations

import io
import socket
import webbrowser
from contextlib import closing, redirect_stdout
from math import cos, radians, sin, tan
from typing import Any

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array

HOST = "127.0.0.1"
_ELEVATION = 22.0  # [deg] from where the camera looks
_FIELD_OF_VIEW = 38.0  # [deg]
_ASPECT = 0.9  # width over height of what is left between the panels
_ROOM = 1.06   # of the distance at which all points are just seen
_WIDTH = 330  # [px] of the panels


def open_server(port: int, label: str) -> Any:
    """Return a viser server that listens on 127.0.0.1; port 0 takes a free one.

    Raises HierarchyError where viser is not installed, or the port is taken.
    """
    try:
        import viser
    except ImportError as error:
        raise HierarchyError("the page in the browser needs viser, which is not installed: "
                             "pip install 'task-hierarchy[view]'") from error
    port = _free(port)
    with redirect_stdout(io.StringIO()):  # it prints a table of its own
        server = viser.ViserServer(host=HOST, port=port, label=label, verbose=False)
    server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium",
                               brand_color=(0, 114, 178))
    return server


def close(server: Any) -> None:
    """Stop the server."""
    with redirect_stdout(io.StringIO()):
        server.stop()


def address(server: Any) -> str:
    """Return where the page is."""
    return f"http://{HOST}:{server.get_port()}"


def announce(server: Any, browser: bool) -> None:
    """Say where the page is, and open it in a browser if that is wanted."""
    print(f"Page: {address(server)}   (Ctrl-C ends)", flush=True)
    if browser:
        webbrowser.open(address(server))


def right(azimuth: float) -> Array:
    """The direction (3,) to the right of a camera that looks from an azimuth [rad], level."""
    return np.array([-sin(azimuth), cos(azimuth), 0.0])


def look_at_all(server: Any, points: Array, azimuth: float) -> None:
    """Place the camera, from an azimuth [rad], so that points (N, 3) [m] fill the view."""
    e, half_field = radians(_ELEVATION), radians(_FIELD_OF_VIEW / 2)
    away = np.array([cos(e) * cos(azimuth), cos(e) * sin(azimuth), sin(e)])
    axes = np.array([right(azimuth), np.cross(away, right(azimuth)), away])
    seen = points @ axes.T
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2
    off = np.abs(seen - middle) / (_ASPECT, 1.0, 1.0)
    distance = float((off[:, :2].max(axis=1) / tan(half_field) + seen[:, 2] - middle[2]).max())
    camera = server.initial_camera
    camera.fov, camera.look_at = 2.0 * half_field, middle @ axes
    camera.position = middle @ axes + _ROOM * distance * away


def lay_out(server: Any) -> Any:
    """Dock the main panel to the right; return the one at the left, a context to fill."""
    main, left = server.gui.main_panel, server.gui.add_panel()
    main.dock_right()
    main.set_width(_WIDTH)
    left.dock_left()
    left.set_width(_WIDTH)
    return left.add_tab("Curves")


def lay_floor(server: Any, height: float) -> None:
    """Draw a grid at a height [m], and lights that cast shadows on it."""
    server.scene.add_grid("/floor", 8.0, 8.0, cell_size=0.1, section_size=0.5,
                          cell_color=(226, 230, 235), section_color=(196, 203, 211),
                          plane_color=(247, 248, 250), plane_opacity=1.0, shadow_opacity=0.25,
                          fade_distance=9.0, fade_from="origin", position=(0.0, 0.0, height))
    server.scene.world_axes.visible = False
    server.scene.configure_default_lights(cast_shadow=True)


def _free(port: int) -> int:
    """Return the port if nothing listens there, or any that is free for 0."""
    with closing(socket.socket()) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except (OSError, OverflowError) as error:
            raise HierarchyError(f"--port {port} cannot be used: {error}") from error
        return int(probe.getsockname()[1])
