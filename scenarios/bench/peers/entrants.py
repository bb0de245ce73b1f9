"""The packages that are compared, and their requirements from PyPI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, final

_HERE = "scenarios.bench.peers"


@final
@dataclass(frozen=True)
class Package:
    """What pip is asked for, into an environment of that name.

    Its own, since these packages want different versions of pinocchio, numpy and MuJoCo. `module`
    is what is imported. An empty tuple of requirements: part of this project's own environment.
    """

    name: str
    module: str
    requirements: tuple[str, ...] = ()


@final
@dataclass(frozen=True)
class Entrant:
    """One to be compared: an `Adapter` by MODULE:CLASS, and its options."""

    label: str
    package: Package
    adapter: str
    options: Mapping[str, Any] = field(default_factory=dict)


OWN = Package("task-hierarchy", "hierarchy")
DAQP = Package("daqp", "daqp")
PINK = Package("pin-pink", "pink", ("pin-pink==4.4.0", "daqp==0.11.0"))
MINK = Package("mink", "mink", ("mink==1.3.0", "daqp==0.11.0"))
PLACO = Package("placo", "placo", ("placo==0.10.2",))
# 1.10.0 aborts in its first constructor with pinocchio 4.0 and 4.1. Of the older ones with wheels
# for this Python 1.7.1 is the newest, made for just these libraries, which it does not ask for.
TSID = Package("tsid", "tsid", ("tsid==1.7.1", "pin==3.4.0", "cmeel-urdfdom<5",
                                "cmeel-tinyxml2<11"))
EMBODIK = Package("embodik", "embodik", ("embodik==0.23.2",))
ROBOPLAN = Package("roboplan", "roboplan", ("roboplan==0.7.0",))
# jax as frax's own documents advise for processors.
FRAX = Package("frax", "frax", ("frax==0.1.0", "jax==0.4.30", "jaxlib==0.4.30", "numpy<2.1"))
PACKAGES = (PINK, MINK, PLACO, TSID, EMBODIK, ROBOPLAN, FRAX)

ENTRANTS = (
    Entrant("tpm", OWN, f"{_HERE}.ours:Bounds", {"resolver": "tpm"}),
    Entrant("sns", OWN, f"{_HERE}.ours:Bounds", {"resolver": "sns"}),
    Entrant("hcod", OWN, f"{_HERE}.ours:Ours", {"resolver": "hcod"}),
    Entrant("weighted", OWN, f"{_HERE}.ours:Weighted", {"resolver": "weighted", "ratio": 1000.0}),
    Entrant("DAQP by hand", DAQP, f"{_HERE}.by_hand:Daqp"),
    Entrant("placo", PLACO, f"{_HERE}.with_placo:Placo"),
    Entrant("placo hard", PLACO, f"{_HERE}.with_placo:PlacoHard"),
    Entrant("placo scaled", PLACO, f"{_HERE}.with_placo:PlacoScaled"),
    Entrant("tsid", TSID, f"{_HERE}.with_tsid:Tsid"),
    Entrant("tsid hard", TSID, f"{_HERE}.with_tsid:TsidHard"),
    Entrant("embodiK", EMBODIK, f"{_HERE}.with_embodik:Embodik"),
    Entrant("OInK", ROBOPLAN, f"{_HERE}.with_roboplan:Oink"),
    Entrant("frax", FRAX, f"{_HERE}.with_frax:Frax"),
    Entrant("mink", MINK, f"{_HERE}.with_mink:Mink"),
    Entrant("mink hard", MINK, f"{_HERE}.with_mink:MinkHard"),
    Entrant("pink", PINK, f"{_HERE}.with_pink:Pink"),
    Entrant("pink hard", PINK, f"{_HERE}.with_pink:PinkHard"),
)
