"""The problem behind the physics fit: settings, targets, weights, and what stays fixed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.kinematics import contact_points, points_in_world
from motionstyle.body.layout import COORDINATES, NODES
from motionstyle.body.ranges import joint_ranges
from motionstyle.dynamics.codegen import FrameFunction
from motionstyle.dynamics.shoes import Shoes
from motionstyle.dynamics.symbols import parameter_vector
from motionstyle.errors import MotionStyleError
from motionstyle.motion.markers import MarkerPaths
from motionstyle.motion.motion import Motion
from motionstyle.spacetime.forces import cone_basis
from motionstyle.spacetime.ground import Ground, find_ground
from motionstyle.spacetime.sharing import expected_shares
from motionstyle.spacetime.splines import SplineBasis

Array = NDArray[np.float64]
COUNT = len(COORDINATES)
MARKER_ARM = 0.10  # m
FEWEST_FRAMES = 8
FEET = (slice(0, 4), slice(4, 8))  # contact points of the right and the left foot


@dataclass(frozen=True)
class PhysicalSettings:
    """Weights as the error each term is allowed (one standard deviation), and solver limits.

    marker_m : distance of a marker. unobserved_rad, anchored_rad : from the kinematic motion, of
    a coordinate that markers do not show, and of any where measured markers are the target.
    torque_nm : muscle torque. force_n : normal force at a settled foot point from what it is
    expected to bear; settled_m and settled_mps say at which height and speed a point is no
    longer settled and bears less.
    ridge_n : each edge of a friction cone. share_bw : a foot's normal force from what it is
    expected to bear, in body weights. slip_m, sink_m : a bearing point from its place, a free one
    into the ground. range_rad : a joint beyond its range. fade_s : over which the hold on a stance
    comes and goes. spread_s : by which stances are widened for forces. shoe_stiffness,
    shoe_rest_m : of eq. (9), to start from and as wide a prior; shoes : whether there are any.
    root_* : the multiplier method's allowed root residual, N and N·m, from first to least.
    outer, inner : rounds of it, and steps in each; a round ends when the cost falls by less than
    `tolerance` a frame.
    """

    frames_per_knot: float = 2.0
    marker_m: float = 0.01
    unobserved_rad: float = 0.15
    anchored_rad: float = 0.3
    torque_nm: float = 400.0
    force_n: float = 1200.0
    ridge_n: float = 5000.0
    share_bw: float = 0.6
    slip_m: float = 0.004
    sink_m: float = 0.002
    range_rad: float = 0.02
    friction: float = 0.8
    settled_m: float = 0.01
    settled_mps: float = 0.3
    fade_s: float = 0.05
    spread_s: float = 0.035
    shoes: bool = True
    shoe_stiffness: float = 20000.0
    shoe_rest_m: float = 0.01
    root_n: float = 20.0
    root_shrink: float = 0.6
    root_least_n: float = 0.3
    root_goal_n: float = 0.1
    outer: int = 16
    inner: int = 8
    tolerance: float = 2e-3


def settings_from(config: Mapping[str, Any]) -> PhysicalSettings:
    """Return settings from the section `physical` of the configuration."""
    names = {field.name for field in fields(PhysicalSettings)}
    return PhysicalSettings(**{k: v for k, v in config.items() if k in names})


@dataclass(frozen=True)
class Handles:
    """Points on the body and where they should be: M markers.

    nodes : (M,). local : on the node, (M, 3), m. targets : (F, M, 3), m. precision : of each in
    each frame, (F, M), 1/m². measured : paths to be judged by, and whether seen, (F, M, 3), (F, M).
    """

    nodes: NDArray[np.int64]
    local: Array
    targets: Array
    precision: Array
    measured: Array
    seen: NDArray[np.bool_]


@dataclass
class Problem:
    """A motion to be fitted. Only the multipliers (`shift`, `root_n`) change while it is solved.

    cone : edges of friction cones, (F, 8, 4, 3). lift : their normal components, (F, 8, 4).
    bearing : which points may push, (F, 8). prices : of a squared newton of normal force away from
    what each point is expected to bear, `settled`, both (F, 8). expected : normal force of each
    foot, (F, 2), N, NaN where nothing is expected. ranges : of
    coordinates, (35, 2). prior_weights : on the distance from the kinematic coordinates, (35,).
    """

    motion: Motion
    settings: PhysicalSettings
    slopes: FrameFunction
    basis: SplineBasis
    parameters: Array
    handles: Handles
    ground: Ground
    bearing: NDArray[np.bool_]
    prices: Array
    cone: Array
    lift: Array
    expected: Array
    settled: Array
    ranges: Array
    prior_weights: Array
    shift: Array
    root_n: float
    patterns: list[tuple[NDArray[np.int64], NDArray[np.int64]]]

    @property
    def prior(self) -> Array:
        """Kinematic coordinates, (F, 35)."""
        return self.motion.coordinates

    @property
    def shoes(self) -> Shoes | None:
        """The shoes to start from, if there are any."""
        settings = self.settings
        return Shoes(settings.shoe_stiffness, settings.shoe_rest_m) if settings.shoes else None


def set_up(
    motion: Motion,
    functions: dict[str, FrameFunction],
    settings: PhysicalSettings,
    markers: MarkerPaths | None = None,
) -> Problem:
    """Return the problem of a kinematic motion.

    Parameters
    ----------
    markers : measured ones, at the motion's frames; without, points on the kinematic body serve.

    Raises
    ------
    MotionStyleError
        If the motion is too short, or the markers do not cover its frames.
    """
    if motion.frames < FEWEST_FRAMES:
        raise MotionStyleError(
            f"motion {motion.id}: {motion.frames} frames are too few, need {FEWEST_FRAMES}"
        )
    if markers is not None and len(markers.smooth) != motion.frames:
        raise MotionStyleError(
            f"motion {motion.id}: {motion.frames} frames, but its markers have "
            f"{len(markers.smooth)}; delete both and run Snakemake again"
        )
    body, rate = motion.body, motion.rate_hz
    points = contact_points(body, motion.pose())
    ranges, margin = joint_ranges(), np.radians(5)
    low = np.minimum(ranges[:, 0], motion.coordinates.min(axis=0) - margin)
    high = np.maximum(ranges[:, 1], motion.coordinates.max(axis=0) + margin)
    prior = np.where(motion.observed, 0.0, 1 / settings.unobserved_rad**2)
    if markers is not None:
        prior[6:] = np.maximum(prior[6:], 1 / settings.anchored_rad**2)
    slopes = functions["forces_and_slopes"]
    cone = cone_basis(motion.contact_normals, settings.friction)
    ground = find_ground(points, motion, round(settings.fade_s * rate))
    bearing = _spread(motion.contacts, round(settings.spread_s * rate))
    basis = SplineBasis.uniform(motion.frames, rate, settings.frames_per_knot)
    parameters = parameter_vector(body)
    prices = _force_prices(points, ground, rate, settings)
    expected, settled = _expected_forces(motion, bearing, prices, basis, slopes, parameters)
    return Problem(
        motion=motion,
        settings=settings,
        slopes=slopes,
        basis=basis,
        parameters=parameters,
        handles=_virtual(motion, settings) if markers is None else _measured(markers, settings),
        ground=ground,
        bearing=bearing,
        prices=prices,
        cone=cone,
        lift=np.einsum("fpca,fpa->fpc", cone, motion.contact_normals),
        expected=expected,
        settled=settled,
        ranges=np.stack([low, high], axis=1),
        prior_weights=prior,
        shift=np.zeros((motion.frames, 6)),
        root_n=settings.root_n,
        patterns=[slopes.pattern(k) for k in range(1, 5)],
    )


def _virtual(motion: Motion, settings: PhysicalSettings) -> Handles:
    """Return four points on each node of the kinematic body, of one marker's weight together."""
    arms = np.concatenate([np.zeros((1, 3)), MARKER_ARM * np.eye(3)])
    nodes = np.repeat(np.arange(len(NODES)), len(arms))
    local = np.tile(arms, (len(NODES), 1))
    targets = points_in_world(motion.pose(), nodes, local)
    precision = np.full(targets.shape[:2], 1 / len(arms) / settings.marker_m**2)
    return Handles(nodes, local, targets, precision, targets, np.ones_like(precision, dtype=bool))


def _measured(markers: MarkerPaths, settings: PhysicalSettings) -> Handles:
    precision = markers.weights / settings.marker_m**2
    seen = markers.weights > 0
    return Handles(markers.nodes, markers.local, markers.smooth, precision, markers.measured, seen)


def _force_prices(
    points: Array, ground: Ground, rate_hz: float, settings: PhysicalSettings
) -> Array:
    """Return what a squared newton of normal force costs at each foot point, (F, 8).

    A point that is still settling or already leaving bears little: its price grows with its
    height and speed, so that weight passes along the sole as it does on force plates.
    """
    speed = np.linalg.norm(np.gradient(points, 1 / rate_hz, axis=0), axis=-1)
    clearance = ground.clearance(points)[0]
    height = clearance - clearance.min(axis=0)
    unrest = (height / settings.settled_m) ** 2 + (speed / settings.settled_mps) ** 2
    return (1 + unrest) ** 2 / settings.force_n**2


def _expected_forces(
    motion: Motion,
    bearing: NDArray[np.bool_],
    prices: Array,
    basis: SplineBasis,
    slopes: FrameFunction,
    parameters: Array,
) -> tuple[Array, Array]:
    """Return normal forces to be expected, N: of each foot (F, 2), and of each point (F, 8).

    What weight and acceleration of the kinematic motion need, in the splines of the fit: shared
    between the feet by `expected_shares`, NaN where unknown, and between bearing points by the
    inverse of their prices. Being expected rather than merely cheap, forces keep their sum: a
    price on the force itself would let the trunk sink to be rid of it.
    """
    q, qd, qdd = basis.evaluate(basis.fit(motion.coordinates))
    needed = slopes(q, qd, qdd, np.zeros((motion.frames, 24)), parameters)[0][:, :3]
    along = np.maximum(np.einsum("fa,fpa->fp", needed, motion.contact_normals), 0.0)
    shares = expected_shares(np.stack([motion.contacts[:, f].any(axis=1) for f in FEET], axis=1))
    feet = np.stack([along[:, f].mean(axis=1) for f in FEET], axis=1) * shares
    cheap = bearing / prices
    total = cheap.sum(axis=1, keepdims=True)
    return feet, along * np.divide(cheap, total, out=np.zeros_like(cheap), where=total > 0)


def _spread(mask: NDArray[np.bool_], frames: int) -> NDArray[np.bool_]:
    """Return the mask widened by some frames on both sides of each stance."""
    wide = mask.copy()
    for shift in range(1, frames + 1):
        wide[shift:] |= mask[:-shift]
        wide[:-shift] |= mask[shift:]
    return wide
