"""Inverse dynamics of the 35-DOF body with its exact Jacobian, symbolically.

Liu et al. 2005, eqs. (1)–(5), (8), (10), (11). Newton–Euler in world axes about the pelvis'
position, with a derivation of the Jacobian that costs little more than the forces themselves:

Joint k turns its subtree T(k) about the axis s through the point o. Any small change of how the
subtree is carried is three vectors (η, β, γ): the change of acceleration at the origin, of
angular acceleration (with the Coriolis part), and of angular velocity. A body at x with velocity
ẋ answers with δa = η + β×x + 2γ×ẋ and δα = β + γ×ω, so that a whole subtree answers through five
sums: mass M, h = Σmx, l = Σmẋ, the inertia Ī, and D (see `_Subtree`):

    δforce = Mη + β×h + 2γ×l,      δmoment = h×η + Īβ + Dγ.

With b the body before the joint, the rate u of joint k, and a the acceleration of o:
    ∂/∂angle:   γ = ω_b×s,  β = α_b×s + ω_b×γ,  η = a×s − β×o − 2γ×ȯ,  and T(k)'s wrench turns;
    ∂/∂u:       γ = s,      β = (ω_b + ω_after)×s,  η = −β×o − 2γ×ȯ;
    ∂/∂u̇:       γ = 0,      β = s,  η = −β×o.
Angles of exponential-map joints are first taken as turns about the child's axes; `_Joints` holds
the chain rule to coordinates. Contact forces are inputs, fixed in the world.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from motionstyle.body.layout import (
    CONTACT_POINT_NODES,
    CONTACT_POINTS,
    COORDINATE_NODE,
    COORDINATES,
    JOINT_SLICES,
    JOINTS,
    PARENTS,
)
from motionstyle.dynamics.symbols import BodyParameters, exponential_map

GRAVITY = 9.81  # m/s²
COUNT = len(COORDINATES)


@dataclass
class _Turn:
    """One rotational degree of freedom: axis and the state of the bodies before and after it."""

    axis: ca.SX
    node: int
    spin_before: ca.SX
    spin_after: ca.SX
    rate_before: ca.SX


@dataclass
class _Joints:
    """Chain rule from coordinates to turns (δφ, δu, δu̇).

    δφ = g δq, δu = g δq̇ + u_q δq, δu̇ = g δq̈ + d_qd δq̇ + d_q δq.
    """

    g: ca.SX = field(default_factory=lambda: ca.SX(COUNT, COUNT))
    u_q: ca.SX = field(default_factory=lambda: ca.SX(COUNT, COUNT))
    d_q: ca.SX = field(default_factory=lambda: ca.SX(COUNT, COUNT))
    d_qd: ca.SX = field(default_factory=lambda: ca.SX(COUNT, COUNT))


@dataclass
class _Node:
    """World rotation, and position, velocity, acceleration of the joint centre, of one node."""

    rotation: ca.SX
    place: ca.SX
    velocity: ca.SX
    acceleration: ca.SX
    spin: ca.SX
    rate: ca.SX


@dataclass
class _Subtree:
    """Sums over a subtree, about the pelvis' position: see the module's text.

    force, moment : of inertia; push, twist : of contacts; contact_dot = Σ y·f and
    contact_outer = Σ f yᵀ over contact points y.
    """

    mass: ca.SX
    h: ca.SX
    momentum: ca.SX
    inertia: ca.SX
    d: ca.SX
    force: ca.SX
    moment: ca.SX
    push: ca.SX = field(default_factory=lambda: ca.SX(3, 1))
    twist: ca.SX = field(default_factory=lambda: ca.SX(3, 1))
    contact_dot: ca.SX = field(default_factory=lambda: ca.SX(1, 1))
    contact_outer: ca.SX = field(default_factory=lambda: ca.SX(3, 3))

    def add(self, other: _Subtree) -> None:
        """Take in a child's subtree."""
        for name in self.__dataclass_fields__:
            setattr(self, name, getattr(self, name) + getattr(other, name))


@dataclass(frozen=True)
class InverseDynamics:
    """τ (35) and its Jacobians; sparse where coordinates do not meet.

    tau : [inertia] − Q_g − Q_c of eqs. (10), (11): joints N·m, root N and N·m in coordinates.
    by_q, by_qd, by_qdd : (35, 35); by_force : (35, 24), N per N.
    """

    tau: ca.SX
    by_q: ca.SX
    by_qd: ca.SX
    by_qdd: ca.SX
    by_force: ca.SX


def inverse_dynamics(
    q: ca.SX, qd: ca.SX, qdd: ca.SX, f: ca.SX, body: BodyParameters
) -> InverseDynamics:
    """Return inverse dynamics for symbols q, q̇, q̈ (35) and contact forces f (24, world, N)."""
    nodes, turns, joints = _motion(q, qd, qdd, body)
    points = _points(nodes, body)
    trees = _subtrees(nodes, points, f, body)
    phi = _turn_forces(nodes, turns, trees)
    k_phi, k_u, k_d = _turn_jacobians(nodes, turns, trees, qdd)
    g = joints.g
    by_q = g.T @ (k_phi @ g + k_u @ joints.u_q + k_d @ joints.d_q) + _force_map_slope(q, phi)
    return InverseDynamics(
        tau=g.T @ phi,
        by_q=by_q,
        by_qd=g.T @ (k_u @ g + k_d @ joints.d_qd),
        by_qdd=g.T @ (k_d @ g),
        by_force=g.T @ _by_force(nodes, turns, points),
    )


def inverse_forces(q: ca.SX, qd: ca.SX, qdd: ca.SX, f: ca.SX, body: BodyParameters) -> ca.SX:
    """Return τ (35) of `InverseDynamics` alone, for automatic differentiation."""
    nodes, turns, joints = _motion(q, qd, qdd, body)
    trees = _subtrees(nodes, _points(nodes, body), f, body)
    return joints.g.T @ _turn_forces(nodes, turns, trees)


def foot_points(q: ca.SX, body: BodyParameters) -> ca.SX:
    """Return the eight foot points in the world, m, (24); `inverse_dynamics` leaves out q[:3]."""
    still = ca.SX.zeros(COUNT)
    nodes, _turns, _joints = _motion(q, still, still, body)
    return ca.vertcat(*(q[:3] + point for point in _points(nodes, body)))


def _points(nodes: list[_Node], body: BodyParameters) -> list[ca.SX]:
    """Return the foot points relative to the pelvis' position."""
    return [
        nodes[n].place + nodes[n].rotation @ body.points[k]
        for k, n in enumerate(CONTACT_POINT_NODES)
    ]


def _hinge(axis: np.ndarray, angle: ca.SX) -> ca.SX:
    """Return the rotation about a coordinate axis, either sign."""
    letter = int(np.argmax(np.abs(axis)))
    sine, cosine = axis[letter] * ca.sin(angle), ca.cos(angle)
    a, b = (letter + 1) % 3, (letter + 2) % 3
    rotation = ca.SX(3, 3)
    rotation[letter, letter] = 1
    rotation[a, a] = rotation[b, b] = cosine
    rotation[a, b], rotation[b, a] = -sine, sine
    return rotation


def _basis(joint_index: int) -> np.ndarray:
    """Return the axes of an exponential-map joint as columns: v = basis · q."""
    return np.array(JOINTS[joint_index].axes)[-3:].T


def _exponential_block(
    joints: _Joints, block: slice, basis: np.ndarray, q: ca.SX, qd: ca.SX, qdd: ca.SX
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return R, u and u̇ of an exponential-map joint, and enter its chain rule in `joints`."""
    x, xd, xdd = (ca.SX.sym(name, 3) for name in ("x", "xd", "xdd"))
    turn = exponential_map(basis @ x, basis @ xd)
    g = turn.jacobian @ basis
    u, u_dot = g @ xd, g @ xdd + turn.jacobian_rate
    parts = [turn.rotation, u, u_dot, g, ca.jacobian(u, x)]
    parts += [ca.jacobian(u_dot, x), ca.jacobian(u_dot, xd)]
    values = ca.Function("block", [x, xd, xdd], parts)(q[block], qd[block], qdd[block])
    rotation, u, u_dot, *slopes = values
    for name, slope in zip(("g", "u_q", "d_q", "d_qd"), slopes, strict=True):
        getattr(joints, name)[block, block] = slope
    return rotation, u, u_dot


def _motion(
    q: ca.SX, qd: ca.SX, qdd: ca.SX, body: BodyParameters
) -> tuple[list[_Node], dict[int, _Turn], _Joints]:
    nodes: list[_Node] = []
    turns: dict[int, _Turn] = {}
    joints = _Joints()
    zero = ca.SX(3, 1)
    for i, (joint, block) in enumerate(zip(JOINTS, JOINT_SLICES, strict=True)):
        if joint.kind == "free":
            before = _Node(ca.SX.eye(3), zero, zero, qdd[0:3] + ca.SX([0, GRAVITY, 0]), zero, zero)
            joints.g[0:3, 0:3] = ca.SX.eye(3)
            block = slice(3, 6)  # noqa: PLW2901 - the translations are done
        else:
            parent = nodes[PARENTS[i]]
            arm = parent.rotation @ body.offsets[i]
            swing = ca.cross(parent.spin, arm)
            before = _Node(
                parent.rotation,
                parent.place + arm,
                parent.velocity + swing,
                parent.acceleration + ca.cross(parent.rate, arm) + ca.cross(parent.spin, swing),
                parent.spin,
                parent.rate,
            )
        after = before
        if joint.kind in {"free", "exponential"}:
            turned, u, u_dot = _exponential_block(joints, block, _basis(i), q, qd, qdd)
            rotation = before.rotation @ turned
            relative = rotation @ u
            spin = before.spin + relative
            rate = before.rate + ca.cross(before.spin, relative) + rotation @ u_dot
            for k in range(3):
                axis = rotation[:, k]
                turns[block.start + k] = _Turn(axis, i, before.spin, spin, before.rate)
            after = _with(before, rotation, spin, rate)
        elif joint.kind == "hinges":
            for k, direction in enumerate(np.array(joint.axes)):
                at = block.start + k
                axis = after.rotation @ ca.SX(direction)
                spin = after.spin + axis * qd[at]
                rate = after.rate + axis * qdd[at] + ca.cross(after.spin, axis) * qd[at]
                turns[at] = _Turn(axis, i, after.spin, spin, after.rate)
                after = _with(after, after.rotation @ _hinge(direction, q[at]), spin, rate)
                joints.g[at, at] = 1
        nodes.append(after)
    return nodes, turns, joints


def _with(node: _Node, rotation: ca.SX, spin: ca.SX, rate: ca.SX) -> _Node:
    return _Node(rotation, node.place, node.velocity, node.acceleration, spin, rate)


def _subtrees(
    nodes: list[_Node], points: list[ca.SX], f: ca.SX, body: BodyParameters
) -> list[_Subtree]:
    trees = []
    for i, node in enumerate(nodes):
        mass, arm = body.masses[i], node.rotation @ body.coms[i]
        swing = ca.cross(node.spin, arm)
        x, x_dot = node.place + arm, node.velocity + swing
        acceleration = node.acceleration + ca.cross(node.rate, arm) + ca.cross(node.spin, swing)
        inertia = _symmetric(node.rotation @ body.inertias[i] @ node.rotation.T)
        carried = inertia @ node.spin
        spin = ca.skew(node.spin)
        force = mass * acceleration
        moment = inertia @ node.rate + ca.cross(node.spin, carried) + ca.cross(x, force)
        outer = x @ x.T
        shifted = inertia + mass * (ca.trace(outer) * ca.SX.eye(3) - outer)
        d = spin @ inertia - inertia @ spin - ca.skew(carried)
        d += 2 * mass * (ca.dot(x, x_dot) * ca.SX.eye(3) - x_dot @ x.T)
        trees.append(_Subtree(mass, mass * x, mass * x_dot, _symmetric(shifted), d, force, moment))
    for k, node in enumerate(CONTACT_POINT_NODES):
        y, push = points[k], f[3 * k : 3 * k + 3]
        tree = trees[node]
        tree.push = tree.push + push
        tree.twist = tree.twist + ca.cross(y, push)
        tree.contact_dot = tree.contact_dot + ca.dot(y, push)
        tree.contact_outer = tree.contact_outer + push @ y.T
    for i in reversed(range(1, len(nodes))):
        trees[PARENTS[i]].add(trees[i])
    return trees


def _symmetric(matrix: ca.SX) -> ca.SX:
    """Return the matrix with its upper triangle mirrored, so that it is computed once."""
    return ca.triu2symm(ca.triu(matrix))


def _turn_forces(nodes: list[_Node], turns: dict[int, _Turn], trees: list[_Subtree]) -> ca.SX:
    phi = ca.SX.zeros(COUNT)
    phi[0:3] = trees[0].force - trees[0].push
    for j, turn in turns.items():
        tree, place = trees[turn.node], nodes[turn.node].place
        moment = tree.moment - tree.twist - ca.cross(place, tree.force - tree.push)
        phi[j] = ca.dot(turn.axis, moment)
    return phi


def _is_before(k: int, j: int) -> bool:
    """Whether coordinate k is nearer to the root than j on the same chain."""
    a, b = COORDINATE_NODE[k], COORDINATE_NODE[j]
    if a == b:
        return k < j and JOINTS[a].kind == "hinges"
    while b >= 0:
        if b == a:
            return True
        b = PARENTS[b]
    return False


def _same_turn(k: int, j: int) -> bool:
    """Whether both belong to one exponential-map joint."""
    a = COORDINATE_NODE[k]
    return a == COORDINATE_NODE[j] and JOINTS[a].kind in {"free", "exponential"} and j >= 3


def _turn_jacobians(
    nodes: list[_Node], turns: dict[int, _Turn], trees: list[_Subtree], qdd: ca.SX
) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return ∂(turn forces)/∂(angle, u, u̇) of all turns, each (35, 35)."""
    results = [ca.SX(COUNT, COUNT) for _ in range(3)]
    wrench_rows = {j: _wrench_row(nodes, turn) for j, turn in turns.items()}
    answers = {j: _answer_row(nodes, turn, trees) for j, turn in turns.items()}
    lifted = trees[0]
    for k in range(3):  # the pelvis' acceleration carries everything
        unit = ca.SX.eye(3)[:, k]
        results[2][0:3, k] = ca.densify(lifted.mass * unit)
        for j in turns:
            results[2][j, k] = ca.dot(answers[j][0], unit)
    for k, turn in turns.items():
        node, tree, s = nodes[turn.node], trees[turn.node], turn.axis
        for kind, (eta, beta, gamma) in enumerate(_changes(node, turn)):
            force = tree.mass * eta + ca.cross(beta, tree.h)
            moment = ca.cross(tree.h, eta) + tree.inertia @ beta
            if gamma is not None:
                force += 2 * ca.cross(gamma, tree.momentum)
                moment += tree.d @ gamma
            if kind == 0:
                about_joint = tree.moment - ca.cross(node.place, tree.force)
                turned = ca.cross(s, tree.force)
                force += turned
                moment += ca.cross(node.place, turned) + ca.cross(s, about_joint)
                moment -= _contacts_below(tree, node.place, s)
            results[kind][0:3, k] = force
            for j in turns:
                if _is_before(j, k) or j == k or _same_turn(j, k):
                    value = ca.dot(wrench_rows[j][0], moment) + ca.dot(wrench_rows[j][1], force)
                    if kind == 0 and _same_turn(j, k):
                        value += _axis_turns_too(nodes, trees, turns, j, k)
                    results[kind][j, k] = value
                elif _is_before(k, j):
                    by_eta, by_beta, by_gamma, by_turn = answers[j]
                    value = ca.dot(by_eta, eta) + ca.dot(by_beta, beta)
                    if gamma is not None:
                        value += ca.dot(by_gamma, gamma)
                    if kind == 0:
                        value += ca.dot(by_turn, s)
                    results[kind][j, k] = value
    return results[0], results[1], results[2]


def _changes(node: _Node, turn: _Turn) -> list[tuple[ca.SX, ca.SX, ca.SX | None]]:
    """Return (η, β, γ) of a unit change of the angle, of u and of u̇."""
    s, place, velocity = turn.axis, node.place, node.velocity
    gamma = ca.cross(turn.spin_before, s)
    beta = ca.cross(turn.rate_before, s) + ca.cross(turn.spin_before, gamma)
    eta = ca.cross(node.acceleration, s) - ca.cross(beta, place) - 2 * ca.cross(gamma, velocity)
    coriolis = ca.cross(turn.spin_before + turn.spin_after, s)
    return [
        (eta, beta, gamma),
        (-ca.cross(coriolis, place) - 2 * ca.cross(s, velocity), coriolis, s),
        (-ca.cross(s, place), s, None),
    ]


def _wrench_row(nodes: list[_Node], turn: _Turn) -> tuple[ca.SX, ca.SX]:
    """Return (a, b) with turn force = a·moment + b·force, moments about the pelvis."""
    return turn.axis, -ca.cross(turn.axis, nodes[turn.node].place)


def _answer_row(
    nodes: list[_Node], turn: _Turn, trees: list[_Subtree]
) -> tuple[ca.SX, ca.SX, ca.SX, ca.SX]:
    """Return the turn force's response to (η, β, γ) of its own subtree, as three covectors.

    The fourth: to a turn s of the limb under contact forces that stay,
    a·(Σ (y−o)×(f×s)) = s·(a Σ f·(y−o) − Σ (y−o)(f·a)).
    """
    a, b = _wrench_row(nodes, turn)
    tree, place = trees[turn.node], nodes[turn.node].place
    by_eta = ca.cross(a, tree.h) + tree.mass * b
    by_beta = tree.inertia @ a + ca.cross(tree.h, b)
    by_gamma = tree.d.T @ a + 2 * ca.cross(tree.momentum, b)
    by_turn = a * (tree.contact_dot - ca.dot(tree.push, place))
    by_turn -= tree.contact_outer.T @ a - place * ca.dot(tree.push, a)
    return by_eta, by_beta, by_gamma, by_turn


def _contacts_below(tree: _Subtree, place: ca.SX, s: ca.SX) -> ca.SX:
    """Return how the contacts' moment about the pelvis changes when their points turn with s.

    Σ (s×(y−o))×f = Σ (y−o)(f·s) − s Σ f·(y−o).
    """
    along = tree.contact_outer.T @ s - place * ca.dot(tree.push, s)
    return along - s * (tree.contact_dot - ca.dot(tree.push, place))


def _axis_turns_too(
    nodes: list[_Node], trees: list[_Subtree], turns: dict[int, _Turn], j: int, k: int
) -> ca.SX:
    """Return s_k×s_j · moment: the axes of an exponential-map joint are fixed in its child."""
    tree, place = trees[turns[j].node], nodes[turns[j].node].place
    moment = tree.moment - tree.twist - ca.cross(place, tree.force - tree.push)
    return ca.dot(ca.cross(turns[k].axis, turns[j].axis), moment)


def _force_map_slope(q: ca.SX, phi: ca.SX) -> ca.SX:
    """Return ∂(gᵀφ)/∂q at fixed φ, block-diagonal (35, 35)."""
    slope = ca.SX(COUNT, COUNT)
    for i, (joint, whole) in enumerate(zip(JOINTS, JOINT_SLICES, strict=True)):
        if joint.kind not in {"free", "exponential"}:
            continue
        block = slice(whole.stop - 3, whole.stop)
        x, force = ca.SX.sym("x", 3), ca.SX.sym("n", 3)
        basis = _basis(i)
        turn = exponential_map(basis @ x, ca.SX(3, 1))
        mapped = (turn.jacobian @ basis).T @ force
        value = ca.Function("slope", [x, force], [ca.jacobian(mapped, x)])
        slope[block, block] = value(q[block], phi[block])
    return slope


def _by_force(nodes: list[_Node], turns: dict[int, _Turn], points: list[ca.SX]) -> ca.SX:
    """Return ∂(turn forces)/∂(contact forces), (35, 24): minus the points' Jacobian, eq. (8)."""
    result = ca.SX(COUNT, 3 * len(CONTACT_POINTS))
    for k, node in enumerate(CONTACT_POINT_NODES):
        columns = slice(3 * k, 3 * k + 3)
        result[0:3, columns] = -ca.SX.eye(3)
        at = node
        while at >= 0:
            for j, turn in turns.items():
                if turn.node == at:
                    arm = points[k] - nodes[at].place
                    result[j, columns] = -ca.cross(turn.axis, arm).T
            at = PARENTS[at]
    return result
