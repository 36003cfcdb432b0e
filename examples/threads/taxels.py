"""A skin of many taxels lies on the tip, and only one of them fires. What should the others read?

A soft tip touches with a patch, not with a point: here a tip with the law `hemisphere` that presses with 8 N. Its depth
d makes a patch of radius a = sqrt(r d) with Hertz's pressure, p = 3 N / (2 pi a^2) sqrt(1 - rho^2 / a^2), which is also
the one that softhand takes for the limit of friction. Summed over taxels of 1.6 mm it must give back the force, and
those inside the patch all feel it. In MuJoCo a ball on a face is one contact point: the one `touch` sensor that has it
reads all of the force. Its `tactile` sensor reads depths at all taxels, in metres; there is no force in them to be
summed.

Example: python examples/threads/taxels.py
"""

import numpy as np
from peer import mujoco, show

import softhand

SIDE, PITCH, RADIUS, SQUEEZE = 7, 1.6e-3, 0.010, 8.0  # taxels, [m], [m], [N]
CENTRES = PITCH * (np.arange(SIDE) - SIDE // 2)
SCENE = """<mujoco><option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="10"/>
<asset><mesh name="skin" inertia="shell" vertex="{vertices}" face="{faces}"/></asset><worldbody><body pos="-0.0385 0 0">
  <joint name="jaw" type="slide" axis="1 0 0" damping="10"/><geom type="sphere" size="0.01" mass="0.1"/>{sites}
  <geom name="skin" type="mesh" mesh="skin" mass="0" contype="0" conaffinity="0"/></body>
  <geom type="box" size="0.028 0.018 0.030"/></worldbody><actuator><motor joint="jaw"/></actuator>
<sensor><tactile name="tactile" geom="skin" mesh="skin"/>{sensors}</sensor></mujoco>"""


def ours():
    """Force on each taxel [N], shape (SIDE, SIDE), and the pressing force [N]."""
    tip = {"law": "hemisphere", "radius": RADIUS, "friction": 0.6, "contact": "coulomb"}
    changes = {"fingertip": tip, "reference": {"kind": "hold"}, "duration": 0.01}
    run = softhand.simulate("gripper", overrides=changes)
    normal, depth = run.contact_force[-1, 0, 2], run.deformation[-1, 0, 0]
    a, parts = np.sqrt(RADIUS * depth), 60
    fine = PITCH * ((np.arange(SIDE * parts) + 0.5) / parts - 0.5 * SIDE)
    rho = np.hypot(*np.meshgrid(fine, fine))
    pressure = 1.5 * normal / (np.pi * a**2) * np.sqrt(np.maximum(1.0 - (rho / a) ** 2, 0.0))
    return pressure.reshape(SIDE, parts, SIDE, parts).sum(axis=(1, 3)) * (PITCH / parts) ** 2, normal


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
    """Returns ours, the pressing force, and MuJoCo's two."""
    (force, normal), peer = ours(), theirs() if mujoco else None
    fired = int(np.count_nonzero(force))
    rows = [
        (f"taxels that feel a force, of {SIDE**2}", f"{fired}", peer and f"{np.count_nonzero(peer[0])}"),
        (f"their sum, of {normal:.1f} N", f"{force.sum():.4f} N", peer and f"{peer[0].sum():.4f} N"),
        ("largest", f"{force.max():.3f} N", peer and f"{peer[0].max():.3f} N"),
        ("taxels that read a depth", "", peer and f"{np.count_nonzero(peer[1])}"),
    ]
    show("Which taxels does a soft tip fire?", rows)
    return force, normal, peer


if __name__ == "__main__":
    main()
