"""Elements of a contact side by side, each with a memory and a share of friction of its own: partial slip in a run.

The model of Iwan (1966): springs in parallel, each in series with a slider. An element is 1/n of the law and slips by
itself, so that the contact has the energy U = (1/n) sum_j U(d, s_j) and the normal force P = dU/dd. With b from 0, the
middle, to 1, the rim, its limit is 1/n of mu_b P,

    mu_b = (3/2) mu (1 - b^2)

the elements loaded together from nothing to the share x of the displacement D at which all slip hold

    Q = mu P {1 - (1 - x)^(3/2)}

which is the law of Cattaneo and Mindlin; those within b stick, b = c / a. Each element has the mean of mu_b over its
cell, so that the mean of all is mu. All have the shape and the lever of the limit surface of the contact, so that it
slides as a whole as one that has no elements.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from softhand.contact.leaning import set_moment
from softhand.contact.limit import limit_use
from softhand.contact.scaled import traction
from softhand.numerics.compiled import compiled
from softhand.numerics.symbols import NotStraightError
from softhand.numerics.tracing import MEANINGS

DISPLACEMENT, SLIP, RATE, BEFORE, LAW, LEAN, ELASTIC, DASHPOT, RECALLED, FORCE, USE = (
    0, 3, 6, 9, 12, 16, 18, 22, 26, 30, 34,
)  # fmt: skip
TRIAL, MULTIPLIER, SLIPS, LEAN_ELASTIC, LEAN_RECALLED, ROW = 35, 38, 39, 40, 42, 44
"""Where a row of `rows_at` has `deformation` without dr, `slip`, `slip_rate`, `force_before`, `deformation_force`,
`lean_force`, `elastic`, `dashpot`, `recalled`, `force` and `limit_surface_use` of `records.CONTACT`, as of a contact
that is all like this element; its displacement if nothing slips, the multiplier of its slip and whether it slips;
`lean_elastic` and `lean_recalled`; how long it is."""

STIFFNESS, DAMPING, ROLLING, LEANING, SUMS = 0, 16, 20, 23, 31
"""Where the row behind those of the elements has the sums of `stiffness`, `damping`, `rolling` and `leaning`, and where
they end."""

AT_LIMIT = 0.99
"""Use of the limit from which an element counts among those that slip."""


@intrinsic
def _rows_at(typing_context, address, count):
    """The numbers at an address: what was found for each element, and a row for sums, shape (count + 1, ROW)."""

    def generate(context, builder, signature, values):
        rows = make_array(signature.return_type)(context, builder)
        size = values[1].type
        populate_array(
            rows,
            data=builder.inttoptr(values[0], ir.DoubleType().as_pointer()),
            shape=[builder.add(values[1], size(1)), size(ROW)],
            strides=[size(8 * ROW), size(8)],
            itemsize=size(8),
            meminfo=None,
        )
        return rows._getvalue()

    return types.Array(types.float64, 2, "C")(address, count), generate


def _not_straight(address: object, count: object) -> object:
    raise NotStraightError("elements of a contact")


rows_at: Any = _rows_at  # whose type mypy takes for one with the typing context
MEANINGS[rows_at] = _not_straight


@compiled
def share_of(element, count):
    """mu of an element over that of the contact: the mean of (3/2) (1 - b^2) over its cell."""
    return 1.5 - (1.5 * element * (element + 1.0) + 0.5) / (count * count)


@compiled
def put_element(contact, row):
    """The contact, evaluated for an element, into the row of that element."""
    for k in range(3):
        row[DISPLACEMENT + k] = contact.deformation[1 + k]
        row[SLIP + k] = contact.slip[k]
        row[RATE + k] = contact.slip_rate[k]
    for k in range(4):
        row[LAW + k] = contact.deformation_force[k]
        row[ELASTIC + k] = contact.elastic[k]
        row[DASHPOT + k] = contact.dashpot[k]
        row[RECALLED + k] = contact.recalled[k]
        row[FORCE + k] = contact.force[k]
    row[USE] = contact.limit_surface_use
    for k in range(2):
        row[LEAN + k] = contact.lean_force[k]
        row[LEAN_ELASTIC + k] = contact.lean_elastic[k]
        row[LEAN_RECALLED + k] = contact.lean_recalled[k]


@compiled
def get_element(contact, row):
    """The other way."""
    for k in range(3):
        contact.deformation[1 + k] = row[DISPLACEMENT + k]
        contact.slip[k] = row[SLIP + k]
        contact.slip_rate[k] = row[RATE + k]
    for k in range(4):
        contact.deformation_force[k] = row[LAW + k]
        contact.elastic[k] = row[ELASTIC + k]
        contact.dashpot[k] = row[DASHPOT + k]
        contact.recalled[k] = row[RECALLED + k]
        contact.force[k] = row[FORCE + k]
    contact.limit_surface_use = row[USE]
    for k in range(2):
        contact.lean_force[k] = row[LEAN + k]
        contact.lean_elastic[k] = row[LEAN_ELASTIC + k]
        contact.lean_recalled[k] = row[LEAN_RECALLED + k]


@compiled
def sum_elements(pad, contact, grip):
    """The contact as a whole: means of its elements, each of which is 1/n of it.

    Args:
        pad: one row of `records.PAD`.
        contact: one row of `records.CONTACT`.
        grip: mu of the limit of all of it.
    """
    n = pad.elements
    rows = rows_at(pad.element_rows, n)
    for k in range(3):
        contact.deformation[1 + k] = _mean(rows, n, DISPLACEMENT + k)
        contact.slip[k] = _mean(rows, n, SLIP + k)
        contact.slip_rate[k] = _mean(rows, n, RATE + k)
    for k in range(4):
        contact.deformation_force[k] = _mean(rows, n, LAW + k)
        contact.elastic[k] = _mean(rows, n, ELASTIC + k)
        contact.dashpot[k] = _mean(rows, n, DASHPOT + k)
        contact.recalled[k] = _mean(rows, n, RECALLED + k)
        contact.force[k] = _mean(rows, n, FORCE + k)
    if pad.slope_function != 0:
        for k in range(2):
            contact.lean_force[k] = _mean(rows, n, LEAN + k)
            contact.lean_elastic[k] = _mean(rows, n, LEAN_ELASTIC + k)
            contact.lean_recalled[k] = _mean(rows, n, LEAN_RECALLED + k)
        set_moment(contact)
    contact.grip = grip
    contact.limit_surface_use = limit_use(contact, traction(contact), grip * contact.force[2])
    stuck = 0.0
    for element in range(n):
        if rows[element, USE] < AT_LIMIT:
            stuck += 1.0
    contact.slipped_share = 1.0 - (stuck / n) * (stuck / n)


@compiled
def _mean(rows, n, column):
    total = 0.0
    for element in range(n):
        total += rows[element, column]
    return total / n


@compiled
def let_go_of_elements(pad, contact, memory, lead):
    """All elements of a tip that does not touch: nothing is stored, no force."""
    rows = rows_at(pad.element_rows, pad.elements)
    for element in range(pad.elements):
        first, row = element * pad.block, rows[element]
        for k in range(LAW, ROW):
            row[k] = 0.0
        for k in range(3):
            row[DISPLACEMENT + k], row[RATE + k] = 0.0, 0.0
            row[SLIP + k] = memory[first + k] + lead * contact.deformation_rate[1 + k]
    for k in range(3):
        contact.slip[k] = _mean(rows, pad.elements, SLIP + k)
    contact.slipped_share, contact.pressed = 0.0, 0.0
