"""A hemispherical tip of a material by finite elements: its stiffnesses by the depth, and what a mesh leaves open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from softhand.errors import SofthandError
from softhand.laws.hemisphere import Hemisphere
from softhand.laws.tabulated import Tabulated
from softhand.material.half_section import half_section
from softhand.material.modulus import Material
from softhand.material.press import press
from softhand.material.section import Section
from softhand.material.stuck import stuck
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record

SHARES = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4)
"""Depths over the radius."""
LEVELS = (0, 1)
"""Meshes, the coarse one and the one whose results are given; each has four times the triangles of the one before."""
_LEAST_NU = 1e-9  # in place of 0, where the pressure of the volume would have no stiffness

COLUMNS = ("normal", "shear", "torsion", "coupling", "tilt")


@dataclass(frozen=True, eq=False)
class MaterialTip(Record):
    """A bonded neo-Hookean hemisphere, pressed at its apex against a plane; a row a depth.

    Attributes:
        material: its modulus, and how sure that is.
        radius: of the hemisphere.
        depth: rows, shape (n,).
        normal: force without friction.
        shear: force per displacement of the plane along itself, all that touches sticking.
        torsion: moment per turn of the plane about its normal.
        coupling: moment about the tangent per displacement along the plane, in the plane.
        tilt: moment per turn of the plane about a tangent.
        contact_radius: of the disc that touches.
        mesh: by the name of a column, share by which two meshes differ, shape (n,): how far the finer may be off.
    """

    units: ClassVar = {
        "radius": "m", "depth": "m", "normal": "N", "shear": "N/m", "torsion": "N m/rad", "coupling": "N",
        "tilt": "N m/rad", "contact_radius": "m", "mesh": "1", "shear_modulus": "N/m^2", "poisson": "1", "spread": "1",
        "misses": "1",
    }  # fmt: skip
    unreported: ClassVar = frozenset({"material"})

    material: Material
    radius: float
    depth: Array
    normal: Array
    shear: Array
    torsion: Array
    coupling: Array
    tilt: Array
    contact_radius: Array
    mesh: dict[str, Array]

    @property
    def shear_modulus(self) -> float:
        """G."""
        return self.material.G

    @property
    def poisson(self) -> float:
        """nu."""
        return self.material.nu

    @property
    def spread(self) -> float:
        """Share by which G, and with it every force, may be off."""
        return self.material.spread

    def hemisphere(self, stiffer: float = 1.0) -> Hemisphere:
        """The law of this material, its modulus so many times."""
        return Hemisphere(radius=self.radius, G=stiffer * self.material.G, nu=self.material.nu)

    def tabulated(self) -> Tabulated:
        """The law of these rows."""
        rows = {name: tuple(getattr(self, name).tolist()) for name in ("normal", "shear", "torsion")}
        return Tabulated(radius=self.radius, depths=tuple(self.depth.tolist()), **rows)

    @property
    def misses(self) -> dict[str, Array]:
        """By the name of a column, by which share the law `hemisphere` is off, shape (n,)."""
        law = self.hemisphere()
        rows = np.array([law([d, 1e-6 * self.radius, 0.0, 1e-6], 0.5 * np.pi) for d in self.depth])
        found = {"normal": rows[:, 0], "shear": rows[:, 1] / (1e-6 * self.radius), "torsion": rows[:, 3] / 1e-6}
        return {name: values / getattr(self, name) - 1.0 for name, values in found.items()}

    def rows(self) -> list[tuple[str, ...]]:
        """Each depth with force and stiffnesses, what the mesh leaves open, and what the law misses."""
        misses, scales = self.misses, {"normal": 1.0, "shear": 1e-3, "torsion": 1e3}
        return [
            (
                f"{1e3 * d:.3g}",
                *(f"{scale * getattr(self, name)[k]:.4g} +- {100.0 * self.mesh[name][k]:.1f} %"
                  for name, scale in scales.items()),
                " ".join(f"{100.0 * misses[name][k]:+.0f}" for name in scales),
            )
            for k, d in enumerate(self.depth)
        ]  # fmt: skip


HEADER = ("depth\n[mm]", "force\n[N]", "shear\n[N/mm]", "torsion\n[N mm/rad]", "law off by\n[%]")
"""Of `MaterialTip.rows`."""


def material_tip(material: Material, radius: float, progress: Callable[[float], None] | None = None) -> MaterialTip:
    """Press, twist, shear and tilt a tip of the material.

    Args:
        material: any of nu from 0 to 0.5.
        radius: of the hemisphere [m].
        progress: is told which share is done.

    Raises:
        SofthandError: scikit-fem is not installed, or no balance is found.
    """
    try:
        import skfem  # noqa: F401
    except ModuleNotFoundError as error:
        raise SofthandError(
            "The package 'scikit-fem' is not installed; install it with: pip install 'softhand[material]'.",
            extra="material",
        ) from error
    done, found = 0.0, []
    for level in LEVELS:
        section, nu, rows = Section(half_section(level)), max(material.nu, _LEAST_NU), []
        for pressed in press(section, nu, np.array(SHARES)):
            own = stuck(section, nu, pressed)
            rows.append((pressed.force, own.shear, own.twist, own.coupling, own.tilt, pressed.radius))
            done += 4.0 ** (level - LEVELS[-1]) / (1.25 * len(SHARES))
            if progress is not None:
                progress(min(done, 1.0))
        found.append(np.array(rows).T)
    coarse, fine = found
    powers = np.array([2, 1, 3, 2, 3])  # of the radius: force, force per length, moment per angle
    values: dict[str, Any] = dict(zip(COLUMNS, fine[:5] * (material.G * radius**powers)[:, None], strict=True))
    mesh = dict(zip(COLUMNS, np.abs(coarse[:5] / fine[:5] - 1.0), strict=True))
    return MaterialTip(
        material, radius, radius * np.array(SHARES), **values, contact_radius=radius * fine[5], mesh=mesh
    )
