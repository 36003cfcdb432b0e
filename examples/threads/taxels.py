"""A skin of many taxels lies on the tip, and only one of them fires. What should the others read?

A soft tip touches with a patch, not with a point: here a tip with the law `hemisphere` that presses with 8 N, with 127
taxels in rings. Those that its depth brings into the patch all feel it, the middle ones most, and their sum is the
force; the patch lies off the middle of the tip, since the tip carries the box. In MuJoCo a ball on a face is one
contact point: the one `touch` sensor that has it reads all of the force. Its `tactile` sensor reads depths at all
taxels, in metres; there is no force in them to be summed.

Example: python examples/threads/taxels.py
"""

import numpy as np
from peer import mujoco, show

import softhand

SIDE, PITCH, RADIUS, SQUEEZE = 7, 1.6e-3, 0.010, 8.0  # taxels, [m], [m], [N]
TAXELS = 127  # on the whole tip
CENTRES = PITCH * (np.arange(SIDE) - SIDE // 2)
SCENE = """<mujoco><option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="10"/>
<asset><mesh name="skin" inertia="shell" vertex="{vertices}" face="{faces}"/></asset><worldbody><body pos="-0.0385 0 0">
  <joint name="jaw" type="slide" axis="1 0 0" damping="10"/><geom type="sphere" size="0.01" mass="0.1"/>{sites}
  <geom name="skin" type="mesh" mesh="skin" mass="0" contype="0" conaffinity="0"/></body>
  <geom type="box" size="0.028 0.018 0.030"/></worldbody><actuator><motor joint="jaw"/></actuator>
<sensor><tactile name="tactile" geom="skin" mesh="skin"/>{sensors}</sensor></mujoco>"""


def ours():
    """Force [N], depth [m] and distance from the axis [m] of each taxel, shape (TAXELS,); the pressing force [N]."""
    tip = {"law": "hemisphere", "radius": RADIUS, "friction": 0.6, "contact": "coulomb"}
    changes = {
        "fingertip": tip,
        "tactile": {"count": TAXELS, "pattern": "rings"},
        "reference": {"kind": "hold"},
        "duration": 0.01,
    }
    run = softhand.simulate("gripper", overrides=changes)
    beside = RADIUS * np.linalg.norm(softhand.taxel_pattern(TAXELS, "rings")[:, 1:], axis=1)
    return run.tactile_normal_force[-1, 0], run.penetration_depth[-1, 0], beside, run.contact_force[-1, 0, 2]


def theirs():
    """MuJoCo's `touch` of each taxel [N] and its `tactile` [m], each of shape (SIDE * SIDE,)."""
    points = [(np.sqrt(RADIUS**2 - y**2 - z**2), y, z) for y in CENTRES for z in CENTRES]
    corners = [SIDE * i + j for i in range(SIDE - 1) for j in range(SIDE - 1)]
    faces = [k for c in corners for k in (c, c + 1, c + SIDE, c + 1, c + SIDE + 1, c + SIDE)]
    half = 0.5 * PITCH
    sites = "".join(
        f'<site name="{k}" type="box" size="0.003 {half} {half}" pos="{x} {y} {z}"/>'
        for k, (x, y, z) in enumerate(points)
    )
    text = SCENE.format(
        vertices=" ".join(f"{x:.6f}" for point in points for x in point), faces=" ".join(map(str, faces)), sites=sites,
        sensors="".join(f'<touch site="{k}"/>' for k in range(SIDE**2)),
    )  # fmt: skip
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.ctrl[0] = SQUEEZE
    for _ in range(1000):
        mujoco.mj_step(model, data)
    return data.sensordata[3 * SIDE**2 :].copy(), data.sensor("tactile").data[: SIDE**2].copy()


def main():
    """Returns ours, and MuJoCo's two."""
    (force, depth, beside, normal), peer = ours(), theirs() if mujoco else None
    rows = [
        ("taxels that feel a force", f"{np.count_nonzero(force)} of {TAXELS}",
         peer and f"{np.count_nonzero(peer[0])} of {SIDE**2}"),
        (f"their sum, of {normal:.1f} N", f"{force.sum():.4f} N", peer and f"{peer[0].sum():.4f} N"),
        ("largest", f"{force.max():.3f} N", peer and f"{peer[0].max():.3f} N"),
        ("taxels that read a depth", f"{np.count_nonzero(depth)}", peer and f"{np.count_nonzero(peer[1])}"),
    ]  # fmt: skip
    show("Which taxels does a soft tip fire?", rows)
    return force, beside, normal, peer


if __name__ == "__main__":
    main()
