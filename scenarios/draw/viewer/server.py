"""The page's server, for this machine only: requests of others fail; its camera and layout."""

from __future__ import annotations

import io
import socket
import webbrowser
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager, redirect_stdout
from html import escape
from http import HTTPStatus
from math import cos, radians, sin, tan
from typing import Any
from urllib.parse import urlsplit

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array

_TITLE = b"<title>Viser</title>"
DARK = "Dark page"
_FOLLOW = """<script>
  // Once its switch is there, the page is as dark as the browser asks for.
  const waiting = setInterval(() => {
    const label = [...document.querySelectorAll("label")].find(one => one.textContent === "SWITCH");
    const box = label && document.getElementById(label.htmlFor);
    if (!box) return;
    clearInterval(waiting);
    if (matchMedia("(prefers-color-scheme: dark)").matches !== box.checked) box.click();
  }, 200);
</script>""".replace("SWITCH", DARK)
NAMES = ("127.0.0.1", "localhost")


def is_own(headers: Mapping[str, str]) -> bool:
    """Whether a request names this machine as its host and comes from no page of another host.

    A page elsewhere whose name is made to lead to 127.0.0.1 (DNS rebinding) has another Host; a
    script of another page, another Origin.
    """
    host, origin = headers.get("Host", ""), headers.get("Origin")
    own = urlsplit(f"//{host}").hostname in NAMES
    return own and (origin is None or urlsplit(origin).netloc == host)


def _titled(response: Any, title: str) -> Any:
    """Give a page of viser another title, and let it follow the browser into the dark."""
    if response is not None and response.body and _TITLE in response.body:
        response.body = response.body.replace(
            _TITLE, f"<title>{escape(title)}</title>{_FOLLOW}".encode(), 1)
        del response.headers["Content-Length"]
        response.headers["Content-Length"] = str(len(response.body))
    return response


@contextmanager
def guarded(title: str) -> Iterator[None]:
    """Let a server that is started meanwhile reject the requests of others, and title its page."""
    from websockets.asyncio import server

    serve = server.serve

    def start(*arguments: Any, process_request: Callable[..., Any] | None = None,
              **options: Any) -> Any:
        def judge(connection: Any, request: Any) -> Any:
            if not is_own(request.headers):
                return connection.respond(HTTPStatus.FORBIDDEN, "Only pages of this machine.\n")
            if process_request is None:
                return None
            if urlsplit(request.path).path in ("/", "/index.html"):
                request.headers.pop("Accept-Encoding", None)  # compressed, it has no title to find
            return _titled(process_request(connection, request), title)

        return serve(*arguments, process_request=judge, **options)

    server.serve = start  # type: ignore[assignment,misc]
    try:
        yield
    finally:
        server.serve = serve  # type: ignore[misc]


HOST = "127.0.0.1"
_ELEVATION = 22.0  # [deg] of the camera
_FIELD_OF_VIEW = 38.0  # [deg]
_ASPECT = 0.9  # width over height of the area between the panels
_NARROW = 600  # [px] width of a window below which the panel hides its lower part
_HIDDEN = 0.6  # of the height of such a window
_MARGIN = 0.12  # [m] that bodies and labels reach beyond the points to see
_ROOM = 1.06   # relative to the distance at which all points are just visible
# Of the floor's cells, sections and plane. The dark one leaves black paths visible.
_LIGHT = ((226, 230, 235), (196, 203, 211), (247, 248, 250))
_DARK = ((108, 115, 124), (128, 136, 146), (92, 98, 107))
_BOTH = 1000  # [px] width of a window below which the curves are folded
_WIDTH = 330  # [px] width of the panels


def open_server(port: int, label: str) -> Any:
    """Return a viser server that listens on 127.0.0.1; port 0 takes a free port.

    `label` is the title of the page. Requests of pages of other hosts are rejected.

    Raises HierarchyError if viser is not installed or the port is in use.
    """
    try:
        import viser
    except ImportError as error:
        raise HierarchyError("the page in the browser needs viser, which is not installed: "
                             "pip install 'task-hierarchy[view]'") from error
    port = _free(port)
    with redirect_stdout(io.StringIO()), guarded(label):  # viser prints a table
        server = viser.ViserServer(host=HOST, port=port, label=label, verbose=False)
    _theme(server, dark=False)
    return server


def add_dark(server: Any, height: float) -> None:
    """Add a switch between the light and the dark page, with a floor at a height [m]."""
    dark = server.gui.add_checkbox(DARK, initial_value=False)

    @dark.on_update  # type: ignore[untyped-decorator]
    def _(_: object) -> None:
        _theme(server, dark.value)
        lay_floor(server, height, dark.value)


def _theme(server: Any, dark: bool) -> None:
    server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium",
                               brand_color=(0, 114, 178), dark_mode=dark)


def close(server: Any) -> None:
    """Stop the server."""
    with redirect_stdout(io.StringIO()):
        server.stop()


def address(server: Any) -> str:
    """Return the address of the page."""
    return f"http://{HOST}:{server.get_port()}"


def announce(server: Any, browser: bool) -> None:
    """Print the address of the page, and open it if `browser` is set."""
    print(f"Page: {address(server)}   (Ctrl-C ends)", flush=True)
    if browser:
        webbrowser.open(address(server))


def right(azimuth: float) -> Array:
    """Return the horizontal direction (3,) to the right of a camera at an azimuth [rad]."""
    return np.array([-sin(azimuth), cos(azimuth), 0.0])


def look_at_all(server: Any, points: Array, azimuth: float) -> None:
    """Place the camera at an azimuth [rad] so that what is at points (N, 3) [m] fills the view.

    That is what the panels leave free: in a narrow window one floats in its lower part.
    """
    points = np.vstack([points - _MARGIN, points + _MARGIN])
    _place(server.initial_camera, points, azimuth, _ASPECT)

    def fit(client: Any) -> None:
        width, height = client.camera.image_width, max(client.camera.image_height, 1)
        if width < _NARROW:
            _place(client.camera, points, azimuth, width / height, _HIDDEN)
        else:
            free = (width - _WIDTH * (2 if width >= _BOTH else 1)) / height
            _place(client.camera, points, azimuth, min(free, _ASPECT))

    server.on_client_connect(fit)


def _place(camera: Any, points: Array, azimuth: float, aspect: float, hidden: float = 0.0) -> None:
    """Place a camera; `hidden` is the lower share of its view that something covers."""
    e, half_field = radians(_ELEVATION), radians(_FIELD_OF_VIEW / 2)
    away = np.array([cos(e) * cos(azimuth), cos(e) * sin(azimuth), sin(e)])
    axes = np.array([right(azimuth), np.cross(away, right(azimuth)), away])
    seen = points @ axes.T
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2
    off = np.abs(seen - middle) / (aspect, 1.0 - hidden, 1.0)
    distance = float((off[:, :2].max(axis=1) / tan(half_field) + seen[:, 2] - middle[2]).max())
    middle[1] -= hidden * distance * tan(half_field)
    camera.fov = 2.0 * half_field
    camera.position = middle @ axes + _ROOM * distance * away
    camera.look_at = middle @ axes  # after the position, which takes it along


def lay_out(server: Any) -> Any:
    """Dock the main panel on the right; return the panel on the left, a context to fill."""
    main, left = server.gui.main_panel, server.gui.add_panel()
    main.dock_right()
    main.set_width(_WIDTH)
    left.dock_left()
    left.set_width(_WIDTH)

    @server.on_client_connect  # type: ignore[untyped-decorator]
    def _(client: Any) -> None:
        if client.camera.image_width < _BOTH:
            left.minimize()

    return left.add_tab("Curves")


def lay_floor(server: Any, height: float, dark: bool = False) -> None:
    """Draw a grid at a height [m], with shadows."""
    cell, section, plane = _DARK if dark else _LIGHT
    server.scene.add_grid("/floor", 8.0, 8.0, cell_size=0.1, section_size=0.5,
                          cell_color=cell, section_color=section, plane_color=plane,
                          plane_opacity=1.0, shadow_opacity=0.25, fade_distance=9.0,
                          fade_from="origin", position=(0.0, 0.0, height))
    server.scene.world_axes.visible = False
    server.scene.configure_default_lights(cast_shadow=True)


def _free(port: int) -> int:
    """Return the port if it is free, or any free port for 0."""
    with closing(socket.socket()) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except (OSError, OverflowError) as error:
            raise HierarchyError(f"--port {port} cannot be used: {error}") from error
        return int(probe.getsockname()[1])
