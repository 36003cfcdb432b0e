"""Fingertip laws: deformation in, force out."""

from typing import TYPE_CHECKING

from softhand.plugins import attributes

if TYPE_CHECKING:  # for editors
    from softhand.laws.bulk import Bulk as Bulk
    from softhand.laws.conservative import Conservative as Conservative
    from softhand.laws.fingerpad import Fingerpad as Fingerpad
    from softhand.laws.hemisphere import Hemisphere as Hemisphere
    from softhand.laws.hertz import Hertz as Hertz
    from softhand.laws.law import Law as Law
    from softhand.laws.nakashima import Nakashima as Nakashima
    from softhand.laws.parallel_distributed import ParallelDistributed as ParallelDistributed
    from softhand.laws.planar import Planar as Planar
    from softhand.laws.point import Point as Point
    from softhand.laws.power import Power as Power
    from softhand.laws.radial import Radial as Radial
    from softhand.laws.tabulated import Tabulated as Tabulated
else:
    __getattr__, __dir__ = attributes("laws")
