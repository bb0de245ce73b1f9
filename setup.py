"""What pyproject.toml cannot say about a build: the page of README.md, and where packages go.

TASK_HIERARCHY_URL: address under which the files of the repository can be read; links of README
that are relative lead there, and are plain text without it.
TASK_HIERARCHY_INSIDE=1: the three packages go into `task_hierarchy/inside`, so that the wheel
writes no folder that another package may write; `import task_hierarchy` finds them there.
"""

import os
import re
from pathlib import Path

from setuptools import find_namespace_packages, setup

PACKAGES = ("hierarchy", "solvers", "scenarios")
LINK = re.compile(r"(!?)\[([^\]]*)\]\((?![a-z]+:|#)([^)]+)\)")


def page(url: str) -> str:
    """Return README.md with absolute links."""
    def absolute(link: re.Match[str]) -> str:
        picture, text, path = link.groups()
        if not url:
            return "" if picture else text
        return f"{picture}[{text}]({url.rstrip('/')}/{path}{'?raw=true' * bool(picture)})"

    return LINK.sub(absolute, Path("README.md").read_text(encoding="utf-8"))


os.umask(0o022)  # files of a wheel have the same modes, whoever builds it
NAMES = find_namespace_packages(include=["task_hierarchy", *(f"{name}*" for name in PACKAGES)])
INSIDE = {f"task_hierarchy.inside.{name}": name.replace(".", "/") for name in NAMES
          if name != "task_hierarchy"}
MOVED = os.environ.get("TASK_HIERARCHY_INSIDE") == "1"
URL = os.environ.get("TASK_HIERARCHY_URL", "")
setup(long_description=page(URL),
      project_urls={"Source": URL.partition("/blob/")[0]} if URL else {},
      long_description_content_type="text/markdown", include_package_data=True,
      packages=["task_hierarchy", *INSIDE] if MOVED else NAMES,
      package_dir=INSIDE if MOVED else {},
      package_data={f"{'task_hierarchy.inside.' * MOVED}hierarchy": ["jit/objects/*.kernels"]})
