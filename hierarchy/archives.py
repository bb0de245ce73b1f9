"""Archives of arrays (.npz) from anywhere: their headers are checked before they are read."""

import io
import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError, naming

LARGEST = 1 << 30  # bytes that an archive may unpack to, if it takes less on disk

_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0,
            (2, 0): np.lib.format.read_array_header_2_0}


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of an archive by name; raises as `read_members` and `array_in`."""
    return {name.removesuffix(".npy"): array_in(name, content)
            for name, content in read_members(path).items()}


def read_members(path: Path) -> dict[str, bytes]:
    """Return the files in an archive by name.

    zipfile unpacks no more of a file than its size in the directory. Raises HierarchyError, with
    the reason and without the path, for what is no archive, is damaged, or unpacks to too much.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            total = sum(member.file_size for member in archive.infolist())
            if total > max(LARGEST, path.stat().st_size):
                raise HierarchyError(f"it unpacks to {total} bytes, more than {LARGEST}")
            return {name: archive.read(name) for name in archive.namelist()}
    except Exception as error:  # zipfile, and what it unpacks with, raise ten kinds of errors
        raise HierarchyError(str(error)) from error


def array_in(name: str, content: bytes) -> NDArray[Any]:
    """Return the array of an .npy file; raises a HierarchyError, naming it, if there is none.

    numpy makes an array of the shape that the header says before it reads a number.
    """
    with naming(name, of=Exception):  # whatever numpy makes of a damaged header
        stream = io.BytesIO(content)
        shape, _, kind = _HEADERS[np.lib.format.read_magic(stream)](stream)
        size = math.prod(shape) * kind.itemsize
        left = len(content) - stream.tell()
        if size > left:
            raise HierarchyError(f"its header says {size} bytes, and {left} follow")
        return np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)
