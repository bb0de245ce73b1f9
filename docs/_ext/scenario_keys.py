"""Write the tables of keys into the page of the scenario file: `python docs/_ext/scenario_keys.py`.

They stand below a mark, and are what `hierarchy help KEY` prints.
"""

from pathlib import Path

PAGE = Path(__file__).parents[1] / "api" / "scenario-file.md"
MARK = "<!-- below: written by `python docs/_ext/scenario_keys.py` -->\n"


def written():
    """Return the page with its tables as they should be."""
    from scenarios.config.reference import page

    return f"{PAGE.read_text(encoding='utf-8').partition(MARK)[0]}{MARK}\n{page()}"


if __name__ == "__main__":
    PAGE.write_text(written(), encoding="utf-8")
