"""A style machine of motions: features, models, style space and full poses in one value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionstyle.body.body import Body
from motionstyle.body.layout import CONTACT_POINTS
from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.motion.motion import Motion
from motionstyle.motion.resample import resample
from motionstyle.shmm.features import (
    FeatureSpace,
    coordinates_of,
    learn_features,
    mean_body,
    pose_channels,
)
from motionstyle.shmm.poses import PoseMachine, RemapSettings, remap
from motionstyle.shmm.schedule import Schedule
from motionstyle.shmm.style_space import StyleSpace, style_space
from motionstyle.shmm.training import StyleMachine, TrainingSettings, train

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MachineSettings:
    """How a style machine is learnt from motions; a section of `config/style_machines.yaml`.

    Attributes
    ----------
    rate_hz : all motions are brought to it. longest_s : longer ones are cut to their middle.
    dimensions : d of the features. own_mean : see `FeatureSpace`. style_dof : S, at most R.
    block_weights : of means, covariances and dwell times in the style space.
    hint_dimensions : of the low-dimensional model whose occupancies start the training; 0: none.
    """

    states: int = 24
    dimensions: int = 8
    own_mean: bool = True
    style_dof: int = 3
    block_weights: tuple[float, float, float] = (1.0, 1.0, 1.0)
    rate_hz: float = 60.0
    longest_s: float = 3.5
    hint_dimensions: int = 2
    seed: int = 0
    start: str = "spread"
    schedule: Schedule = Schedule(start_temperature=2.0, steps=60)  # noqa: RUF009 - frozen
    remap: RemapSettings = RemapSettings()  # noqa: RUF009 - frozen

    @staticmethod
    def from_config(values: Mapping[str, Any]) -> MachineSettings:
        """Build settings from a section of the configuration."""
        plain = dict(values)
        schedule = Schedule.from_config(plain.pop("schedule", {}))
        poses = RemapSettings(**plain.pop("remap", {}))
        if "block_weights" in plain:
            plain["block_weights"] = tuple(plain["block_weights"])
        return MachineSettings(**plain, schedule=schedule, remap=poses)

    def training(self) -> TrainingSettings:
        """Return the settings of `train`."""
        return TrainingSettings(
            self.states,
            self.start,
            self.seed,
            schedule=self.schedule,  # type: ignore[arg-type]
        )


@dataclass(frozen=True)
class MotionMachine:
    """What was learnt from motions.

    names : of the R specific models. motions : what they were learnt from, at the common rate.
    """

    names: tuple[str, ...]
    motions: tuple[Motion, ...]
    features: FeatureSpace
    machine: StyleMachine
    poses: PoseMachine
    space: StyleSpace
    body: Body
    rate_hz: float

    def index(self, name: str) -> int:
        """Return which specific model has a name.

        Raises
        ------
        MotionStyleError
            If none has; the message names the nearest ones.
        """
        if name not in self.names:
            raise MotionStyleError(
                f"'{name}' is no model of this style machine{near_matches(name, self.names)}; "
                f"known are {', '.join(self.names)}"
            )
        return self.names.index(name)

    def coordinates(self, name: str) -> Array:
        """Return the style coordinates v of a model, (S,)."""
        return self.space.coordinates[self.index(name)]

    def content(self, name: str) -> Array:
        """Return γ of a model's first sequence, (T, N)."""
        own = self.index(name)
        return self.machine.occupancy[int(np.flatnonzero(self.machine.owners == own)[0])]


def prepared(motion: Motion, settings: MachineSettings) -> Motion:
    """Return a motion at the common rate, cut to its middle where it is long."""
    found = resample(motion, settings.rate_hz)
    longest = max(2, round(settings.longest_s * settings.rate_hz))
    if found.frames <= longest:
        return found
    first = (found.frames - longest) // 2
    return found.window(first, first + longest - 1)


def learn_machine(
    motions: Sequence[Motion], names: Sequence[str], settings: MachineSettings
) -> MotionMachine:
    """Learn a style machine; motions of one name share a specific model.

    Neither styles nor phases are told to it: the names only say which motions are one model.
    """
    order = tuple(dict.fromkeys(names))
    owners = [order.index(name) for name in names]
    ready = [prepared(m, settings) for m in motions]
    space = learn_features(ready, settings.dimensions, own_mean=settings.own_mean)
    features = [space.features(m) for m in ready]
    training = settings.training()
    occupancy: Sequence[Array] | None = None
    if settings.hint_dimensions:
        hinted = train(
            low_dimensional(ready, settings.hint_dimensions), training, owners=[0] * len(ready)
        )
        occupancy = hinted.occupancy
        training = replace(training, states=hinted.states)
    machine = train(features, training, owners=owners, occupancy=occupancy)
    channels = [pose_channels(m) for m in ready]
    poses = remap(channels, machine.occupancy, machine.owners, settings.remap)
    dof = min(settings.style_dof, len(order))
    styles = style_space(
        machine.generic, machine.specifics, dof, block_weights=settings.block_weights
    )
    body = mean_body(ready)
    return MotionMachine(order, tuple(ready), space, machine, poses, styles, body, settings.rate_hz)


def low_dimensional(motions: Sequence[Motion], dimensions: int) -> list[Array]:
    """Return few principal components of each motion without its mean and its size.

    The paper's hint: an HMM on a very low-dimensional representation shows the phases that all
    sequences share.
    """
    space = learn_features(motions, dimensions, own_mean=False)
    features = [space.features(m) for m in motions]
    return [f / max(float(np.sqrt((f**2).mean())), 1e-9) for f in features]


def motion_from(
    id: str,
    channels: Array,
    machine: MotionMachine,
    *,
    body: Body | None = None,
    **provenance: object,
) -> Motion:
    """Return pose channels as a motion without contacts; the root is integrated.

    What no training motion shows stays unobserved.
    """
    coordinates, jumps = coordinates_of(channels, machine.rate_hz)
    frames, points = len(coordinates), len(CONTACT_POINTS)
    observed = np.any([m.observed for m in machine.motions], axis=0)
    return Motion(
        id=id,
        kind="shmm",
        rate_hz=machine.rate_hz,
        coordinates=coordinates,
        body=machine.body if body is None else body,
        contacts=np.zeros((frames, points), dtype=bool),
        contact_normals=np.broadcast_to([0.0, 1.0, 0.0], (frames, points, 3)).copy(),
        observed=observed,
        rebranched=jumps,
        provenance=provenance,
    )
