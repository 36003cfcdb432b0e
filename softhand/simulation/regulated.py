"""What the motors of coupled joints can regulate, as a recording tells it."""

from __future__ import annotations

import json

from softhand.contact.mobility import Mobility, mobility
from softhand.contact.pairs import contact_pairs
from softhand.model.coupling import Coupling
from softhand.model.world import World
from softhand.sensing.observation import Observation


def mobility_of(world: World, observation: Observation) -> Mobility:
    """That of a grasp as it is observed."""
    inertia = world.model.inertias[world.object_joint]
    length = float((inertia.inertia.trace() / (2.0 * inertia.mass)) ** 0.5)
    return mobility(
        observation.hand_force_jacobian,
        observation.object_force_jacobian.T,
        observation.internal_force_basis,
        length,
    )


def regulated_rows(found: Mobility, coupling: Coupling) -> list[tuple[str, str]]:
    """Label and text of motors, motions and internal forces."""
    tips = 1
    while tips * (tips - 1) // 2 < found.forces.shape[1]:
        tips += 1
    pairs = [f"{i + 1}{j + 1}" for i, j in contact_pairs(tips)]
    return [
        ("motors", f"{len(coupling.motors)} for {len(coupling.joint_names)} joints: {', '.join(coupling.motors)}"),
        ("motions of the object that they regulate", found.motions_text()),
        ("internal forces that they regulate", found.forces_text(pairs)),
    ]


def notes_of(world: World, observation: Observation) -> dict[str, str]:
    """Attributes of a recording; none for a hand without coupled joints."""
    coupling = world.coupling
    if coupling is None:
        return {}
    found = mobility_of(world, observation)
    return {
        "sliding_motors": json.dumps(
            [name for name, slides in zip(coupling.motors, coupling.slides, strict=True) if slides]
        ),
        "regulated": json.dumps(dict(regulated_rows(found, coupling))),
    }
