"""Learning a generic hidden Markov model and one specific model per sequence.

Brand & Hertzmann 2000, §3.4, §4.2; style_machines.md A2. Neither labels nor alignment: states of
different models mean the same because the specific models are held near the generic one while
its entropy falls.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from sklearn.cluster import kmeans_plusplus

from motionstyle.errors import MotionStyleError
from motionstyle.shmm.gaussians import divergences, entropies, estimate, moments
from motionstyle.shmm.inference import (
    Expectations,
    Sequences,
    expectations,
    expectations_of,
    log_emissions,
    pack,
)
from motionstyle.shmm.model import HiddenMarkovModel, normalised, repeat
from motionstyle.shmm.multinomial import entropic_rows, row_entropies, trimmed
from motionstyle.shmm.schedule import Schedule

Array = NDArray[np.float64]
Start = Literal["spread", "random", "seeded"]
NEVER_STARTS = 1e-6
LEAST_FRAMES = 1.0
MERGE_STEPS, MERGE_TRIES = 3, 4


@dataclass(frozen=True)
class TrainingSettings:
    """What is learnt, and how.

    Attributes
    ----------
    states : N at the start. start : Gaussians centred on evenly spread frames, on random ones, or
        on frames that a k-means++ seeding draws far from each other.
    seed : of random starts. width : initial covariances as a share of the data's.
    floor : least eigenvalue of a covariance as a share of each feature's variance.
    start_prior : weight, in sequences, of the states' overall occupancy in the start
        probabilities: an unseen take may begin in any phase.
    schedule : see `Schedule`.
    """

    states: int
    start: Start = "spread"
    seed: int = 0
    width: float = 0.3
    floor: float = 1e-4
    start_prior: float = 1.0
    schedule: Schedule = Schedule()  # noqa: RUF009 - frozen


@dataclass(frozen=True)
class TrainingStep:
    """What one EM step was made with, and what it found (nat, over all frames)."""

    step: int
    temperature: float
    entropy_strength: float
    holding: float
    log_likelihood: float
    log_posterior: float
    states: int
    transitions: int


@dataclass(frozen=True)
class StyleMachine:
    """A generic model, R specific ones, and what they say about their sequences.

    Attributes
    ----------
    generic : one model. specifics : a stack of R, with the generic model's state graph.
    occupancy : γ of each sequence under its own model, (T_r, N) each.
    owners : which specific model each sequence belongs to.
    steps : the course of training.
    """

    generic: HiddenMarkovModel
    specifics: HiddenMarkovModel
    occupancy: tuple[Array, ...]
    owners: NDArray[np.int64]
    steps: tuple[TrainingStep, ...]

    @property
    def states(self) -> int:
        """Number of states left."""
        return self.generic.states


def initial_model(sequences: Sequences, settings: TrainingSettings) -> HiddenMarkovModel:
    """Return the start of training (style_machines.md A2.1).

    Transitions decay with the distance to the next states of a circle; Gaussians sit on evenly
    spread frames of the longest sequence, or on frames drawn from all.

    Raises
    ------
    MotionStyleError
        If the longest sequence (all together for random starts) has fewer frames than states.
    """
    n = settings.states
    longest = int(sequences.lengths.argmax())
    frames = sequences.frames[longest, : sequences.lengths[longest]]
    everything = np.concatenate(sequences.split(sequences.frames))
    available = len(frames) if settings.start == "spread" else len(everything)
    if available < n:
        raise MotionStyleError(
            f"{n} states cannot be started from {available} frames: take fewer states, more "
            "clips, or a higher rate (config/style_machines.yaml)"
        )
    if settings.start == "spread":
        means = frames[np.linspace(0, len(frames) - 1, n).round().astype(int)]
    elif settings.start == "seeded":
        means = kmeans_plusplus(everything, n, random_state=settings.seed)[0]
    else:
        rng = np.random.default_rng(settings.seed)
        means = everything[np.sort(rng.choice(len(everything), n, replace=False))]
    ahead = (np.arange(n)[None, :] - np.arange(n)[:, None]) % n
    behind = n - ahead
    transitions = normalised(np.exp(-ahead / 2.0) + 0.1 * np.exp(-behind / 2.0))
    wide = np.diag(
        np.maximum(settings.width * everything.var(axis=0), floor_of(sequences, settings))
    )
    return HiddenMarkovModel(
        np.full(n, 1.0 / n), transitions, means, np.broadcast_to(wide, (n, *wide.shape)).copy()
    )


def floor_of(sequences: Sequences, settings: TrainingSettings) -> Array:
    """Return the least variance of each feature, (d,); a constant feature gets a tiny one."""
    variance = np.concatenate(sequences.split(sequences.frames)).var(axis=0)
    biggest = max(float(variance.max()), 1e-12)
    return settings.floor * np.maximum(variance, 1e-4 * biggest)


def train(
    sequences: Sequence[Array],
    settings: TrainingSettings,
    *,
    owners: Sequence[int] | None = None,
    start: HiddenMarkovModel | None = None,
    occupancy: Sequence[Array] | None = None,
) -> StyleMachine:
    """Learn a style machine from sequences (T_r, d), neither labelled nor aligned.

    Parameters
    ----------
    owners : which specific model each sequence belongs to, 0 … R−1; by default one each.
    start : the generic model to start from; by default `initial_model`.
    occupancy : γ (T_r, N) to start from instead, from a simpler model of the same sequences.
    """
    packed = pack(sequences)
    own = np.arange(len(sequences)) if owners is None else np.asarray(owners, dtype=np.int64)
    count = int(own.max()) + 1
    if own.shape != (len(sequences),) or set(own) != set(range(count)):
        raise MotionStyleError(
            f"owners {list(own)} of {len(sequences)} sequences must name models 0 to {count - 1}"
        )
    member = (own[:, None] == np.arange(count)).astype(float)  # sequences × models
    generic = initial_model(packed, settings) if start is None else start
    specifics = repeat(generic, count)
    floor = floor_of(packed, settings)
    schedule = settings.schedule
    course: list[TrainingStep] = []
    found: Expectations | None = None
    if occupancy is not None:
        found = _from_occupancy(occupancy, packed)
        generic, specifics = _m_step(
            found, packed, member, generic, specifics, floor, settings, 0.0, schedule.holding_final
        )
    for step in range(schedule.steps):
        found = expectations(specifics[own], packed)
        strength, holding = schedule.strength(step), schedule.holding(step)
        posterior = _log_posterior(found, member, generic, specifics, strength, holding)
        course.append(
            TrainingStep(
                step,
                schedule.temperature(step),
                strength,
                holding,
                float(found.log_likelihood.sum()),
                posterior,
                generic.states,
                int((generic.transitions > 0).sum()),
            )
        )
        if step and schedule.settled(step) and schedule.settled(step - 1):
            former = course[-2]
            same = former.states == generic.states and former.transitions == course[-1].transitions
            if same and abs(posterior - former.log_posterior) < schedule.tolerance * abs(posterior):
                break
        generic, specifics = _m_step(
            found, packed, member, generic, specifics, floor, settings, strength, holding
        )
        if strength > schedule.trim_above and (step + 1) % schedule.trim_every == 0:
            generic, specifics = _trim(found, packed, own, generic, specifics, strength)
    if schedule.state_cost > 0:
        generic, specifics = _merge(packed, member, own, generic, specifics, floor, settings)
    found = expectations(specifics[own], packed)
    return StyleMachine(
        generic, specifics, tuple(packed.split(found.occupancy)), own, tuple(course)
    )


def _merge(
    packed: Sequences,
    member: Array,
    own: NDArray[np.int64],
    generic: HiddenMarkovModel,
    specifics: HiddenMarkovModel,
    floor: Array,
    settings: TrainingSettings,
) -> tuple[HiddenMarkovModel, HiddenMarkovModel]:
    """Remove states while that is worth the likelihood it costs; `Schedule.state_cost`.

    Tried in the order of the expected loss, each after a few EM steps.
    """
    schedule = settings.schedule
    d = generic.dimensions
    # a specific model follows its own data with the share 1/(1 + ζ′) and the generic one otherwise
    free = 1.0 / (1.0 + schedule.holding_final)
    parameters = (d + d * (d + 1) / 2) * (free * len(specifics.means) + 1.0 - free)
    cost = schedule.state_cost * 0.5 * np.log(packed.total) * parameters
    strength, holding = schedule.entropy, schedule.holding_final

    def refined(
        model: HiddenMarkovModel, ones: HiddenMarkovModel
    ) -> tuple[float, HiddenMarkovModel, HiddenMarkovModel]:
        for _ in range(MERGE_STEPS):
            found = expectations(ones[own], packed)
            model, ones = _m_step(
                found, packed, member, model, ones, floor, settings, strength, holding
            )
        return float(expectations(ones[own], packed).log_likelihood.sum()), model, ones

    value, generic, specifics = refined(generic, specifics)
    removed = True
    while removed and generic.states > 2:
        removed = False
        for state in np.argsort(_losses(specifics, packed, own), kind="stable")[:MERGE_TRIES]:
            alive = np.arange(generic.states) != state
            try:
                tried = refined(_bridged(generic, state, alive), _bridged(specifics, state, alive))
            except MotionStyleError:
                continue
            if tried[0] >= value - cost:
                value, generic, specifics = tried
                removed = True
                break
    return generic, specifics


def _losses(specifics: HiddenMarkovModel, packed: Sequences, own: NDArray[np.int64]) -> Array:
    """Return how much log-likelihood each state's frames lose in their next best state, (N,)."""
    log_b = log_emissions(specifics[own], packed)
    gamma = expectations_of(
        specifics.start[own], specifics.transitions[own], log_b, packed.lengths
    ).occupancy
    order = np.sort(log_b, axis=-1)
    best, second = order[..., -1:], order[..., -2:-1]
    other = np.where(log_b >= best, second, best)
    return (gamma * (log_b - other)).sum(axis=(0, 1))


def _bridged(model: HiddenMarkovModel, state: int, alive: NDArray[np.bool_]) -> HiddenMarkovModel:
    """Return the model without a state, whose predecessors lead on to its successors."""
    p = model.transitions
    onward = normalised(p[..., state, :] * alive)
    through = p[..., :, state][..., :, None] * onward[..., None, :]
    return model.with_transitions(p + through).keep(alive)


def _from_occupancy(occupancy: Sequence[Array], packed: Sequences) -> Expectations:
    """Return statistics of given occupancies, transitions from frame to frame included."""
    states = occupancy[0].shape[1]
    padded = np.zeros((*packed.frames.shape[:2], states))
    counts = np.zeros((len(occupancy), states, states))
    for r, one in enumerate(occupancy):
        padded[r, : len(one)] = one
        counts[r] = one[:-1].T @ one[1:]
    return Expectations(np.zeros(len(occupancy)), padded, counts)


def _scaled(strength: float, counts: Array) -> Array:
    """Return Z of each state: when hot in proportion to its evidence (style_machines.md A2.4)."""
    if strength >= 0:
        return np.full(counts.shape, strength)
    return strength * counts / max(float(counts.mean()), 1e-12)


def _m_step(
    found: Expectations,
    packed: Sequences,
    member: Array,
    generic: HiddenMarkovModel,
    specifics: HiddenMarkovModel,
    floor: Array,
    settings: TrainingSettings,
    strength: float,
    holding: float,
) -> tuple[HiddenMarkovModel, HiddenMarkovModel]:
    """Return the generic model of least entropy and specific ones of least cross-entropy to it."""
    each = moments(found.occupancy, packed)
    pooled = each.pooled()
    best = estimate(pooled, packed.centre, floor, generic, 0.0, _scaled(strength, pooled.counts))
    counts = found.transitions.sum(axis=0)
    transitions = entropic_rows(counts, _scaled(strength, counts.sum(axis=1)))
    # a state that nothing leaves (the last frame of a lone sequence) keeps its transitions
    left = counts.sum(axis=1) > 1e-12
    transitions = np.where(left[:, None], transitions, generic.transitions)
    overall = normalised(pooled.counts)
    begun = found.occupancy[:, 0]
    start = normalised(begun.sum(axis=0) + settings.start_prior * overall)
    new = HiddenMarkovModel(start, transitions, best.means, best.covariances)
    if member.shape[1] == 1 and holding <= 0:  # one model for all is its own specific
        return new, repeat(new, 1)
    sums = type(each)(
        *(np.tensordot(member.T, v, 1) for v in (each.counts, each.first, each.second))
    )
    free = estimate(
        sums, packed.centre, floor, new if holding > 0 else specifics, holding * sums.counts
    )
    own_counts = np.tensordot(member.T, found.transitions, 1)
    if holding > 0:
        own = _own_dwell(transitions, own_counts, holding)
        begins = np.broadcast_to(start, specifics.start.shape)
    else:
        own = normalised(own_counts)
        own = np.where(own_counts.sum(axis=2, keepdims=True) > 1e-12, own, specifics.transitions)
        begins = normalised(member.T @ begun + settings.start_prior * normalised(sums.counts))
    return new, HiddenMarkovModel(np.array(begins), own, free.means, free.covariances)


def _own_dwell(transitions: Array, counts: Array, holding: float) -> Array:
    """Return the generic state graph with each model's own self-transitions, (R, N, N).

    The self-transition carries the dwell time: own counts with ζ′ n counts of the generic row.
    """
    out_of = counts.sum(axis=2)
    stay = np.diagonal(transitions)
    stayed = np.diagonal(counts, axis1=1, axis2=2)
    known = out_of > 1e-9
    weight = np.where(known, out_of, 1.0)
    own = np.where(known, (stayed + holding * weight * stay) / (weight * (1.0 + holding)), stay)
    leaves = 1.0 - stay
    can_leave = leaves > 1e-12
    factor = np.where(can_leave, (1.0 - own) / np.where(can_leave, leaves, 1.0), 1.0)
    result = transitions * factor[:, :, None]
    n = np.arange(len(stay))
    result[:, n, n] = np.where(can_leave, own, stay)
    return normalised(result)


def _log_posterior(
    found: Expectations,
    member: Array,
    generic: HiddenMarkovModel,
    specifics: HiddenMarkovModel,
    strength: float,
    holding: float,
) -> float:
    """Return Σ log p(X_r|θ_r) − Z H(θ) − Σ Z′ D(θ•‖θ_r), nat; eq. (1) with annealing."""
    value = float(found.log_likelihood.sum()) - strength * model_entropy(generic)
    if holding > 0:
        counts = member.T @ found.occupancy.sum(axis=1)
        value -= float((holding * counts * divergences(generic, specifics)).sum())
    return value


def model_entropy(model: HiddenMarkovModel) -> float:
    """Return the sum of the entropies of all rows and Gaussians, nat; eqs. (12), (14)."""
    return float(row_entropies(model.transitions).sum() + entropies(model.covariances).sum())


def _trim(
    found: Expectations,
    packed: Sequences,
    own: NDArray[np.int64],
    generic: HiddenMarkovModel,
    specifics: HiddenMarkovModel,
    strength: float,
) -> tuple[HiddenMarkovModel, HiddenMarkovModel]:
    """Extinguish transitions, then states that have become useless; algorithm E2."""
    counts = found.transitions.sum(axis=0)
    gone = trimmed(generic.transitions, counts, strength)
    if gone.any():
        kept = normalised(np.where(gone, 0.0, generic.transitions))
        generic = generic.with_transitions(kept)
        allowed = np.where(gone, 0.0, specifics.transitions)
        specifics = specifics.with_transitions(normalised(allowed))
    entering = generic.transitions.sum(axis=0) - np.diagonal(generic.transitions)
    begins = found.occupancy[:, 0].sum(axis=0)
    frames = found.occupancy.sum(axis=(0, 1))
    useless = ((entering <= 0) & (begins < NEVER_STARTS)) | (frames < LEAST_FRAMES)
    if not useless.any() or useless.all():
        return generic, specifics
    return _without_states(useless, packed, own, generic, specifics, strength)


def _without_states(
    useless: NDArray[np.bool_],
    packed: Sequences,
    own: NDArray[np.int64],
    generic: HiddenMarkovModel,
    specifics: HiddenMarkovModel,
    strength: float,
) -> tuple[HiddenMarkovModel, HiddenMarkovModel]:
    """Remove states one by one, each only if the log-posterior does not fall."""

    def posterior(model: HiddenMarkovModel, ones: HiddenMarkovModel) -> float:
        try:
            total = float(expectations(ones[own], packed).log_likelihood.sum())
        except MotionStyleError:  # the sequences need that state
            return -np.inf
        return total - strength * model_entropy(model)

    best = posterior(generic, specifics)
    alive = np.ones(generic.states, dtype=bool)
    current = generic, specifics
    for state in np.flatnonzero(useless):
        alive[state] = False
        tried = generic.keep(alive), specifics.keep(alive)
        value = posterior(*tried)
        if value >= best:
            best, current = value, tried
        else:
            alive[state] = True
    return current


def with_schedule(settings: TrainingSettings, **changes: object) -> TrainingSettings:
    """Return settings whose schedule differs in some values."""
    return replace(settings, schedule=replace(settings.schedule, **changes))
