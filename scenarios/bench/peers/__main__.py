"""`python -m scenarios.bench.peers --install`, then without it, or `hierarchy bench peers`."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def main() -> int:
    """Run from the command line; the numbers go to a new folder in runs/."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if sys.argv[1:] == ["--install"]:
        from scenarios.bench.peers.environments import install

        said = install()
        for name, why in said.items():
            print(f"{name}: {why or 'installed'}")
        return int(any(said.values()))
    if sys.argv[1:]:
        print("usage: python -m scenarios.bench.peers [--install]", file=sys.stderr)
        return 2
    from scenarios.bench.peers import run
    from scenarios.files import next_free

    folder = next_free(Path("runs") / "peers")
    run(folder)
    print(f"\nNumbers: {folder}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
