"""Every fingertip law that ships, with a tip of 10 mm."""

from __future__ import annotations

from softhand.laws.bulk import Bulk
from softhand.laws.conservative import Conservative
from softhand.laws.fingerpad import Fingerpad
from softhand.laws.hemisphere import Hemisphere
from softhand.laws.hertz import Hertz
from softhand.laws.law import Law
from softhand.laws.nakashima import Nakashima
from softhand.laws.parallel_distributed import ParallelDistributed
from softhand.laws.planar import Planar
from softhand.laws.point import Point
from softhand.laws.power import Power
from softhand.laws.radial import Radial
from softhand.laws.tabulated import Tabulated
from softhand.validation.rigs import RADIUS

LAWS: tuple[Law, ...] = (
    Radial(radius=RADIUS),
    Power(radius=RADIUS),
    Hertz(radius=RADIUS),
    ParallelDistributed(radius=RADIUS),
    Nakashima(radius=RADIUS, k_r=0.377e6, k_phi=0.166e6, k_theta=0.0266e9, k_psi=0.0488e9),
    Conservative(radius=RADIUS),
    Hemisphere(radius=RADIUS),
    Tabulated(radius=RADIUS),
    Planar(radius=RADIUS),
    Point(radius=RADIUS),
    Fingerpad(radius=RADIUS),
    Bulk(radius=RADIUS),
)


def name_of(law: Law) -> str:
    """Of its class."""
    return type(law).__name__
