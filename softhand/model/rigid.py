"""M, J, C v + N and joint poses of a tree of rigid bodies, compiled: recursive Newton-Euler and composite bodies.

[Featherstone, Rigid Body Dynamics Algorithms, 2008, sections 5.3 and 6.2], with all vectors in world axes and about the
origin of the joint that they belong to, so that no digits are lost to the distance from the origin of the world.
"""

from __future__ import annotations

import math

from softhand.model.coupled import Terms, expand_configuration, expand_velocity, project_terms, set_views
from softhand.model.tree import FLOATS, SLIDES, TURNS
from softhand.numerics.compiled import compiled


@compiled
def rigid_terms(tree, q, v, out):
    """Everything that a `Snapshot` has, at configuration q and velocity v; no array is made.

    Args:
        tree: `tree.Tree`; its scratch is written.
        q: configuration, Pinocchio's, with coupled joints of their motors, shape (nq,).
        v: velocity, likewise, shape (nv,).
        out: `snapshot.Terms` as `tree.room_for_terms` makes them: M (upper triangle; what the
            kernel knows to be zero is left as it is), J, nle and poses are set.
    """
    coupled = tree.coupled
    if coupled.S.shape[0] == 0:
        _tree_terms(tree, q, v, out)
    else:
        expand_configuration(coupled, q)
        expand_velocity(coupled, v)
        _tree_terms(tree, coupled.q, coupled.v, Terms(coupled.M, out.J, coupled.nle, out.poses))
        project_terms(coupled, coupled.M, coupled.nle, out)


@compiled
def _tree_terms(tree, q, v, out):
    """`rigid_terms` of all joints."""
    first = 1
    while first < tree.joints.shape[0]:
        last = first
        while last + 1 < tree.joints.shape[0] and tree.joints[last + 1].parent > 0:
            last += 1
        branch_terms(tree, first, last, q, v, out)
        first = last + 1


@compiled
def branch_terms(tree, first, last, q, v, out):
    """`rigid_terms` of the joints from first to last: of those that begin with one on the world and all behind it."""
    joints, work = tree.joints, tree.work
    world, gravity = work[0], tree.gravity
    for k in range(3):
        world.spin[k] = world.turning[k] = 0.0
        world.lifting[k] = -gravity[k]
    for k in range(12):
        out.poses[0, k] = 1.0 if k < 9 and k % 4 == 0 else 0.0
    for b in range(first, last + 1):
        joint, pose = joints[b], out.poses[b]
        if joint.kind == FLOATS:
            _place_free_flyer(joint, q, pose, out.J)
            _free_flyer_terms(joint, v, pose, gravity, out.M, out.nle)
        else:
            _place_joint(joint, q, out.poses[joint.parent], pose, work[b], out.J)
            _move_body(joint, v[joint.column], pose, work[joint.parent], work[b])
    for b in range(last, first - 1, -1):
        if joints[b].kind != FLOATS:
            _project(joints, work, b, out)
            if joints[b].parent > 0:
                _hand_on(work[b], work[joints[b].parent])


@compiled
def rigid_poses(tree, q, out):
    """J and poses alone, as `rigid_terms` sets them; M and nle stay as they are."""
    coupled = tree.coupled
    if coupled.S.shape[0] == 0:
        _tree_poses(tree, q, out)
    else:
        expand_configuration(coupled, q)
        _tree_poses(tree, coupled.q, out)
        set_views(coupled, out.J)


@compiled
def _tree_poses(tree, q, out):
    """`rigid_poses` of all joints."""
    joints = tree.joints
    for b in range(1, joints.shape[0]):
        joint, pose = joints[b], out.poses[b]
        if joint.kind == FLOATS:
            _place_free_flyer(joint, q, pose, out.J)
        else:
            _place_joint(joint, q, out.poses[joint.parent], pose, tree.work[b], out.J)


@compiled
def _cross(a, b):
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def _turned(pose, x, y, z):
    """R (x, y, z)"""
    return (
        pose[0] * x + pose[3] * y + pose[6] * z,
        pose[1] * x + pose[4] * y + pose[7] * z,
        pose[2] * x + pose[5] * y + pose[8] * z,
    )


@compiled
def _symmetric_times(A, b):
    """A b, A as xx, xy, yy, xz, yz, zz."""
    return (
        A[0] * b[0] + A[1] * b[1] + A[3] * b[2],
        A[1] * b[0] + A[2] * b[1] + A[4] * b[2],
        A[3] * b[0] + A[4] * b[1] + A[5] * b[2],
    )


@compiled
def _place_joint(joint, q, before, pose, body, J):
    """Pose, axis and column of J of a joint of one velocity, and the way to it from the joint before."""
    i, kind = joint.position, joint.kind
    c = s = slide = 0.0
    if kind == TURNS:
        c, s = math.cos(q[i]), math.sin(q[i])
    elif kind == SLIDES:
        slide = q[i]
    else:
        c, s = q[i], q[i + 1]
    still, cosine, sine, axis, place = joint.still, joint.cosine, joint.sine, joint.axis, joint.place
    for k in range(3):
        x = still[k] + c * cosine[k] + s * sine[k]
        y = still[3 + k] + c * cosine[3 + k] + s * sine[3 + k]
        z = still[6 + k] + c * cosine[6 + k] + s * sine[6 + k]
        pose[3 * k], pose[3 * k + 1], pose[3 * k + 2] = _turned(before, x, y, z)
    d = _turned(before, place[0] + slide * axis[0], place[1] + slide * axis[1], place[2] + slide * axis[2])
    a = _turned(before, axis[0], axis[1], axis[2])
    p = before[9] + d[0], before[10] + d[1], before[11] + d[2]
    column = J[:, joint.column]
    first = a
    if kind != SLIDES:
        first = _cross(p, a)
    for k in range(3):
        pose[9 + k], body.step[k], body.axis[k] = p[k], d[k], a[k]
        column[k] = first[k]
        column[3 + k] = 0.0 if kind == SLIDES else a[k]


@compiled
def _move_body(joint, rate, pose, before, body):
    """Motion of a body without accelerations of the joints, what force and moment it takes, and its inertia."""
    w, turning, lifting, d, a = before.spin, before.turning, before.lifting, body.step, body.axis
    w = w[0], w[1], w[2]
    turning = turning[0], turning[1], turning[2]
    # origin: a + w' x d + w x (w x d), and as the joint turns or slides w x (rate axis), twice for what slides
    x, y = _cross(turning, d), _cross(w, _cross(w, d))
    lift = lifting[0] + x[0] + y[0], lifting[1] + x[1] + y[1], lifting[2] + x[2] + y[2]
    u = _cross(w, a)
    if joint.kind == SLIDES:
        lift = lift[0] + 2.0 * rate * u[0], lift[1] + 2.0 * rate * u[1], lift[2] + 2.0 * rate * u[2]
    else:
        w = w[0] + rate * a[0], w[1] + rate * a[1], w[2] + rate * a[2]
        turning = turning[0] + rate * u[0], turning[1] + rate * u[1], turning[2] + rate * u[2]
    m = joint.mass
    h = _turned(pose, joint.first[0], joint.first[1], joint.first[2])
    about = _turned_inertia(pose, joint.inertia)
    x, y, z = _cross(turning, h), _cross(w, _cross(w, h)), _cross(h, lift)
    s, t = _symmetric_times(about, turning), _cross(w, _symmetric_times(about, w))
    for k in range(3):
        body.spin[k], body.turning[k], body.lifting[k] = w[k], turning[k], lift[k]
        body.force[k] = m * lift[k] + x[k] + y[k]
        body.moment[k] = z[k] + s[k] + t[k]
        body.first[k] = h[k]
    for k in range(6):
        body.inertia[k] = about[k]
    body.mass = m


@compiled
def _turned_inertia(pose, own):
    """R I R^T, xx, xy, yy, xz, yz, zz."""
    x = _turned(pose, own[0], own[1], own[3])  # columns of R I
    y = _turned(pose, own[1], own[2], own[4])
    z = _turned(pose, own[3], own[4], own[5])
    return (
        x[0] * pose[0] + y[0] * pose[3] + z[0] * pose[6],
        x[0] * pose[1] + y[0] * pose[4] + z[0] * pose[7],
        x[1] * pose[1] + y[1] * pose[4] + z[1] * pose[7],
        x[0] * pose[2] + y[0] * pose[5] + z[0] * pose[8],
        x[1] * pose[2] + y[1] * pose[5] + z[1] * pose[8],
        x[2] * pose[2] + y[2] * pose[5] + z[2] * pose[8],
    )


@compiled
def _project(joints, work, b, out):
    """nle of a joint, and its column of M: force and moment that move all bodies from here on along its axis."""
    joint, body = joints[b], work[b]
    a, h = body.axis, body.first
    column = joint.column
    if joint.kind == SLIDES:
        f, n, along = (body.mass * a[0], body.mass * a[1], body.mass * a[2]), _cross(h, a), body.force
        own = f
    else:
        f, n, along = _cross(a, h), _symmetric_times(body.inertia, a), body.moment
        own = n
    out.nle[column] = a[0] * along[0] + a[1] * along[1] + a[2] * along[2]
    out.M[column, column] = a[0] * own[0] + a[1] * own[1] + a[2] * own[2] + joint.armature[0]
    while joints[b].parent > 0:
        arm = _cross(work[b].step, f)
        n = n[0] + arm[0], n[1] + arm[1], n[2] + arm[2]
        b = joints[b].parent
        a, own = work[b].axis, n
        if joints[b].kind == SLIDES:
            own = f
        out.M[joints[b].column, column] = a[0] * own[0] + a[1] * own[1] + a[2] * own[2]


@compiled
def _hand_on(body, before):
    """Add force, moment, mass and moments of inertia of a body to those of the joint before, about its origin."""
    d, f, h, m = body.step, body.force, body.first, body.mass
    arm = _cross(d, f)
    for k in range(3):
        before.force[k] += f[k]
        before.moment[k] += body.moment[k] + arm[k]
        before.first[k] += h[k] + m * d[k]
    before.mass += m
    # about a point at -d of the own origin: I + (2 d . h + m d . d) 1 - (d h^T + h d^T + m d d^T)
    x, y, z = d[0], d[1], d[2]
    u, v, w = h[0] + 0.5 * m * x, h[1] + 0.5 * m * y, h[2] + 0.5 * m * z
    own, total = body.inertia, before.inertia
    total[0] += own[0] + 2.0 * (y * v + z * w)
    total[1] += own[1] - (x * v + y * u)
    total[2] += own[2] + 2.0 * (x * u + z * w)
    total[3] += own[3] - (x * w + z * u)
    total[4] += own[4] - (y * w + z * v)
    total[5] += own[5] + 2.0 * (x * u + y * v)


@compiled
def _place_free_flyer(joint, q, pose, J):
    """Pose of a free-flyer and its six columns of J."""
    i, place, still = joint.position, joint.place, joint.still
    x, y, z, w = q[i + 3], q[i + 4], q[i + 5], q[i + 6]
    turn = (
        1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w),
        2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w),
        2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y),
    )  # fmt: skip
    for k in range(3):
        a, b, c = still[3 * k], still[3 * k + 1], still[3 * k + 2]
        pose[9 + k] = place[k] + a * q[i] + b * q[i + 1] + c * q[i + 2]
        for n in range(3):
            pose[3 * n + k] = a * turn[n] + b * turn[3 + n] + c * turn[6 + n]
    p = pose[9], pose[10], pose[11]
    for n in range(3):
        a = pose[3 * n], pose[3 * n + 1], pose[3 * n + 2]
        moving, turning, arm = J[:, joint.column + n], J[:, joint.column + 3 + n], _cross(p, a)
        for k in range(3):
            moving[k], moving[3 + k] = a[k], 0.0
            turning[k], turning[3 + k] = arm[k], a[k]


@compiled
def _free_flyer_terms(joint, v, pose, gravity, M, nle):
    """Six rows of nle and M of one free body, in its own axes, where M does not change."""
    j, m, h, about = joint.column, joint.mass, joint.first, joint.inertia
    u, w = (v[j], v[j + 1], v[j + 2]), (v[j + 3], v[j + 4], v[j + 5])
    lift = (
        -(pose[0] * gravity[0] + pose[1] * gravity[1] + pose[2] * gravity[2]),
        -(pose[3] * gravity[0] + pose[4] * gravity[1] + pose[5] * gravity[2]),
        -(pose[6] * gravity[0] + pose[7] * gravity[1] + pose[8] * gravity[2]),
    )
    # momentum P = m u + w x h and L = I w + h x u; force w x P, moment w x L + u x P
    x, y = _cross(w, h), _cross(h, u)
    P, spin = (m * u[0] + x[0], m * u[1] + x[1], m * u[2] + x[2]), _symmetric_times(about, w)
    f, heavy = _cross(w, P), _cross(h, lift)
    n, t = _cross(w, (spin[0] + y[0], spin[1] + y[1], spin[2] + y[2])), _cross(u, P)
    for k in range(3):
        nle[j + k] = m * lift[k] + f[k]
        nle[j + 3 + k] = heavy[k] + n[k] + t[k]
    M[j, j], M[j + 1, j + 1], M[j + 2, j + 2] = m, m, m
    M[j, j + 4], M[j, j + 5], M[j + 1, j + 5] = h[2], -h[1], h[0]
    M[j + 1, j + 3], M[j + 2, j + 3], M[j + 2, j + 4] = -h[2], h[1], -h[0]
    M[j + 3, j + 3], M[j + 3, j + 4], M[j + 4, j + 4] = about[0], about[1], about[2]
    M[j + 3, j + 5], M[j + 4, j + 5], M[j + 5, j + 5] = about[3], about[4], about[5]
    for k in range(6):
        M[j + k, j + k] += joint.armature[k]
