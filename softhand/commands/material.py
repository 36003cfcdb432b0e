"""softhand material: a fingertip from its material, by finite elements, or from a table of one's own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from softhand.commands.app import command
from softhand.commands.console import Printer, progress
from softhand.commands.options import Json, OutFolder, Quiet
from softhand.commands.places import check_folder, make_folder, new_folder, write_text
from softhand.errors import SofthandError

_CAPTION = (
    "Shear and torsion are stiffnesses while all that touches sticks. +- is what the mesh leaves open. The last column "
    "is the law hemisphere: force, shear, torsion."
)


@command("softhand material --shore-a 20 --radius 10mm; softhand material --table tip.csv --radius 8mm")
def material(
    radius: Annotated[str, typer.Option(metavar="LENGTH", help="Radius of the tip, such as 10mm.")],
    shore_a: Annotated[float | None, typer.Option(metavar="S", help="Hardness of a rubber, Shore A, 20 to 80.")] = None,
    shore_00: Annotated[
        float | None, typer.Option("--shore-00", metavar="S", help="Hardness of a soft rubber, Shore 00, 20 to 80.")
    ] = None,
    young: Annotated[str | None, typer.Option(metavar="E", help="Young's modulus, such as 0.18MPa.")] = None,
    shear: Annotated[str | None, typer.Option(metavar="G", help="Shear modulus, such as 60kPa.")] = None,
    nu: Annotated[float, typer.Option(metavar="NU", help="Poisson's ratio, 0 to 0.5, 0.5 for a rubber [1].")] = 0.5,
    table: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.csv", help="A table in place of a material: depth, force, shear, torsion, with units."
        ),
    ] = None,
    tabulated: Annotated[
        bool, typer.Option("--tabulated", help="Write the table as the law, in place of hemisphere.")
    ] = False,
    friction: Annotated[
        float | None, typer.Option(metavar="MU", help="Coefficient of friction, written into fingertip.toml.")
    ] = None,
    relaxes: Annotated[
        list[str],
        typer.Option(metavar="SHARE@TIME", help="Share of the force that relaxes, 0.2@50ms; may be repeated."),
    ] = [],  # noqa: B006  typer copies it
    out: OutFolder = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Compute a fingertip from its material, by finite elements.

    A hemisphere bonded at its flat face, neo-Hookean. Writes fingertip.toml, table.csv and material.png. Needs
    the extra: pip install 'softhand[material]'. With --table no material is needed.
    """
    check_folder(out)
    from softhand.identification.files.lengths import read_length
    from softhand.laws.law import Law
    from softhand.material.modulus import material_of
    from softhand.material.snippet import read_relaxation, snippet, stiffening
    from softhand.material.table_file import read_tip_table, tip_table
    from softhand.material.tip import HEADER, material_tip
    from softhand.plots.material import draw_material
    from softhand.plots.style import save_figure

    size = read_length(radius, "--radius")
    relaxing = [read_relaxation(text) for text in relaxes]
    stiffer = stiffening(relaxing)
    if friction is not None and not 0.0 < friction < float("inf"):
        raise SofthandError(f"--friction: got {friction:g}; it must be > 0.")
    known: dict[str, str | float | None] = {"shear": shear, "young": young, "shore_a": shore_a, "shore_00": shore_00}
    printer = Printer(quiet, as_json)
    if table is not None:
        if any(value is not None for value in known.values()):
            raise SofthandError(f"--table: {table} and a modulus are given; give one of the two.")
        rows, law, mesh, title = read_tip_table(table, size), None, None, f"{table.name}, radius {1e3 * size:g} mm"
        chosen: Law = rows.stiffer(stiffer)
        remarks = [f"of {table.name}"]
        printer.json({"law": "tabulated", **dict(rows)})
    else:
        own = material_of(nu, **known)
        with progress("pressing, twisting and shearing two meshes", 1.0, quiet) as report:
            found = material_tip(own, size, report)
        rows, law, mesh = found.tabulated(), found.hemisphere(), found.mesh
        title = f"{own.source}: G = {own.G / 1e3:.4g} kPa, nu = {own.nu:g}, radius {1e3 * size:g} mm"
        spread = f"a rubber of this hardness may be off by {100.0 * own.spread:.0f} %" if own.spread else ""
        chosen = found.tabulated().stiffer(stiffer) if tabulated else found.hemisphere(stiffer)
        remarks = [title, *([spread] if spread else [])]
        printer.json(found)
        printer.table(title, found.rows(), HEADER, _CAPTION)
        if spread:
            printer.say(f"{own.source}: {spread}, all forces with it", "note")
    if stiffer > 1.0:
        remarks.append(f"stiffness of a fast motion, {stiffer:.3g} times that at rest")
    folder = out or new_folder("material")
    make_folder(folder)
    save_figure(draw_material(rows, law, mesh, title), folder / "material.png")
    write_text(folder / "fingertip.toml", snippet(chosen, friction, relaxing, remarks))
    write_text(folder / "table.csv", tip_table(rows))
    printer.say(f"wrote fingertip.toml, table.csv, material.png in {folder}/")
