"""Inverse dynamics against the paper's own equation, differences, and laws of mechanics."""

import casadi as ca
import numpy as np
import pytest

from motionstyle.body.kinematics import (
    contact_points,
    coordinate_axes,
    forward_kinematics,
    point_jacobian,
    points_in_world,
)
from motionstyle.body.layout import CONTACT_POINT_NODES, JOINT_SLICES, JOINTS, NODES, PARENTS
from motionstyle.dynamics.functions import dynamics_functions
from motionstyle.dynamics.inverse import GRAVITY
from motionstyle.dynamics.symbols import parameter_vector

BLOCKS = ("q", "qd", "qdd", "f")


def dense(function, values, output):
    rows, columns = function.pattern(output)
    full = np.zeros((len(values), *function.function.size_out(output)))
    full[:, rows, columns] = values
    return full


def at_rest(frames=1):
    return [np.zeros((frames, n)) for n in (35, 35, 35, 24)]


def test_slopes_agree_with_automatic_differentiation(functions, states, plain_body):
    parameters = parameter_vector(plain_body)
    forces, slopes = dynamics_functions()
    symbols = [ca.SX.sym(n, *slopes.size_in(i)) for i, n in enumerate((*BLOCKS, "p"))]
    tau = forces(*symbols)
    expected = ca.Function("ad", symbols, [ca.jacobian(tau, s) for s in symbols[:4]])
    found = functions["forces_and_slopes"](*states, parameters)
    for t in range(len(states[0])):
        wanted = expected(*(s[t] for s in states), parameters)
        for k in range(4):
            block = dense(functions["forces_and_slopes"], found[k + 1], k + 1)[t]
            scale = np.abs(np.array(wanted[k])).max()
            np.testing.assert_allclose(block, np.array(wanted[k]), atol=1e-11 * scale)


@pytest.mark.parametrize("argument", range(4), ids=BLOCKS)
def test_slopes_agree_with_finite_differences(functions, states, plain_body, argument):
    parameters, function = parameter_vector(plain_body), functions["forces"]
    with_slopes = functions["forces_and_slopes"]
    block = dense(with_slopes, with_slopes(*states, parameters)[argument + 1], argument + 1)
    step = 1e-6
    for column in range(states[argument].shape[1]):
        up, down = ([s.copy() for s in states] for _ in range(2))
        up[argument][:, column] += step
        down[argument][:, column] -= step
        slope = (function(*up, parameters)[0] - function(*down, parameters)[0]) / (2 * step)
        np.testing.assert_allclose(block[:, :, column], slope, atol=2e-5 * np.abs(block).max())


def test_both_functions_give_the_same_forces(functions, states, plain_body):
    parameters = parameter_vector(plain_body)
    one = functions["forces"](*states, parameters)[0]
    two = functions["forces_and_slopes"](*states, parameters)[0]
    np.testing.assert_allclose(one, two, rtol=1e-12, atol=1e-9)


def homogeneous(rotation, place):
    return ca.vertcat(ca.horzcat(rotation, place), ca.SX([[0, 0, 0, 1]]))


def rodrigues(v):
    angle = ca.norm_2(v)
    cross = ca.skew(v / angle)
    return ca.SX.eye(3) + ca.sin(angle) * cross + (1 - ca.cos(angle)) * cross @ cross


def test_inertia_is_equation_3_by_brute_force(functions, states, plain_body):
    """Σ tr(∂W/∂q M Ẅᵀ) of eq. (3), each W built from textbook rotations and differentiated."""
    q, qd, qdd = (ca.SX.sym(n, 35) for n in BLOCKS[:3])
    transforms, total = [], ca.SX.zeros(35)
    for i, (joint, block) in enumerate(zip(JOINTS, JOINT_SLICES, strict=True)):
        axes = np.array(joint.axes).reshape(-1, 3)
        angles = q[block]
        if joint.kind == "free":
            local = homogeneous(rodrigues(angles[3:6]), angles[0:3])
        else:
            rotation = ca.SX.eye(3)
            if joint.kind == "exponential":
                rotation = rodrigues(axes.T @ angles)
            elif joint.kind == "hinges":
                for k, axis in enumerate(axes):
                    rotation = rotation @ rodrigues(ca.SX(axis) * angles[k])
            local = homogeneous(rotation, ca.SX(plain_body.joint_offsets[i]))
        parent = PARENTS[i]
        transforms.append(local if parent < 0 else transforms[parent] @ local)
        w = transforms[i]
        rate = ca.jtimes(ca.vec(w), q, qd)
        second = ca.jtimes(rate, q, qd) + ca.jtimes(rate, qd, qdd)
        mass, com = plain_body.masses[i], plain_body.coms[i]
        inertia = plain_body.inertias[i]
        spread = np.trace(inertia) / 2 * np.eye(3) - inertia + mass * np.outer(com, com)
        tensor = np.block([[spread, mass * com[:, None]], [mass * com[None], np.array([[mass]])]])
        weighted = ca.vec(ca.reshape(second, 4, 4) @ tensor)
        total += ca.jtimes(ca.vec(w), q, weighted, True)
        gravity = ca.SX([0, -GRAVITY * mass, 0])
        total -= ca.jtimes((w @ ca.SX([*com, 1]))[0:3], q, gravity, True)
    brute = ca.Function("brute", [q, qd, qdd], [total])
    quiet = [*states[:3], np.zeros((5, 24))]
    found = functions["forces"](*quiet, parameter_vector(plain_body))[0]
    for t in range(5):
        wanted = np.array(brute(*(s[t] for s in quiet[:3]))).ravel()
        np.testing.assert_allclose(found[t], wanted, atol=1e-9 * np.abs(wanted).max())


def test_standing_still_needs_the_body_s_weight(functions, plain_body):
    tau = functions["forces"](*at_rest(), parameter_vector(plain_body))[0][0]
    assert tau[1] == pytest.approx(plain_body.mass * GRAVITY, rel=1e-12)
    np.testing.assert_allclose(tau[[0, 2]], 0, atol=1e-9)


def test_free_fall_needs_no_force(functions, plain_body):
    q, qd, qdd, f = at_rest()
    q[0, 6:] = np.random.default_rng(1).uniform(-0.5, 0.5, 29)
    qdd[0, 1] = -GRAVITY
    tau = functions["forces"](q, qd, qdd, f, parameter_vector(plain_body))[0]
    np.testing.assert_allclose(tau, 0, atol=1e-9)


def test_contact_forces_do_virtual_work_at_their_points(functions, states, plain_body):
    """Eq. (8): the generalised force of a contact is its point's Jacobian, transposed."""
    parameters = parameter_vector(plain_body)
    free = functions["forces"](*states[:3], np.zeros((5, 24)), parameters)[0]
    loaded = functions["forces"](*states, parameters)[0]
    pose = forward_kinematics(plain_body, states[0])
    points = contact_points(plain_body, pose)
    axes = coordinate_axes(pose, states[0])
    jacobian = point_jacobian(pose, axes, np.array(CONTACT_POINT_NODES), points)
    work = np.einsum("fpaj,fpa->fj", jacobian, states[3].reshape(5, 8, 3))
    np.testing.assert_allclose(free - loaded, work, rtol=1e-10, atol=1e-8)


def energy(body, q, qd):
    """Kinetic and potential energy (J) from node poses and their differences."""
    step = 1e-5
    poses = [forward_kinematics(body, (q + s * step * qd)[None]) for s in (-1, 0, 1)]
    nodes = np.arange(len(NODES))
    coms = [points_in_world(p, nodes, body.coms)[0] for p in poses]
    velocity = (coms[2] - coms[0]) / (2 * step)
    rate = (poses[2].rotations[0] - poses[0].rotations[0]) / (2 * step)
    turning = rate @ np.swapaxes(poses[1].rotations[0], 1, 2)
    spin = np.stack([turning[:, 2, 1], turning[:, 0, 2], turning[:, 1, 0]], axis=1)
    world = poses[1].rotations[0] @ body.inertias @ np.swapaxes(poses[1].rotations[0], 1, 2)
    kinetic = 0.5 * (body.masses @ (velocity**2).sum(axis=1))
    kinetic += 0.5 * np.einsum("na,nab,nb->", spin, world, spin)
    return kinetic + GRAVITY * body.masses @ coms[1][:, 1]


def test_energy_is_kept_in_free_flight(functions, plain_body):
    """Integrate the equations of motion without joint forces: energy must not change."""
    parameters, with_slopes = parameter_vector(plain_body), functions["forces_and_slopes"]
    rng = np.random.default_rng(3)
    state = np.concatenate([0.3 * rng.standard_normal(35), 1.5 * rng.standard_normal(35)])

    def slope(x):
        q, qd = x[None, :35], x[None, 35:]
        values = with_slopes(q, qd, np.zeros((1, 35)), np.zeros((1, 24)), parameters)
        mass = dense(with_slopes, values[3], 3)[0]
        return np.concatenate([x[35:], -np.linalg.solve(mass, values[0][0])])

    before, step = energy(plain_body, state[:35], state[35:]), 1e-3
    for _ in range(150):
        a = slope(state)
        b = slope(state + step / 2 * a)
        c = slope(state + step / 2 * b)
        d = slope(state + step * c)
        state = state + step / 6 * (a + 2 * b + 2 * c + d)
    after = energy(plain_body, state[:35], state[35:])
    assert abs(after - before) < 1e-4
    assert np.abs(state[35:]).max() > 0.5
