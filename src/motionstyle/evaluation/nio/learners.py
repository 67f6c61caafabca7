"""Every learner of a style by name, as jobs call them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from motionstyle.errors import MotionStyleError, near_matches
from motionstyle.nio.inner import Learnt
from motionstyle.nio.learning_problem import LearningProblem
from motionstyle.nio.least_squares import learn_by_least_squares
from motionstyle.nio.ours import learn
from motionstyle.nio.paper import learn_as_paper
from motionstyle.nio.preferences import PreferenceSettings, learn_preferences
from motionstyle.nio.settings import our_settings, paper_settings

LEARNERS = ("ours", "paper", "least_squares", "alpha_only", "no_cone")
NO_CONE_FRICTION = 10.0  # 84° from the normal: a foot may pull along the ground as it likes (E17)


def learn_by_name(
    name: str,
    learning: LearningProblem,
    settings: Mapping[str, Any],
    *,
    schedule: str,
    paper_iterations: int,
    budget: int,
) -> Learnt:
    """Return the style that a learner learns.

    Parameters
    ----------
    settings : of `config/nio.yaml`. schedule : of our stages. paper_iterations : of the paper's
        main loop, where that is fewer. budget : inner solves of least squares.

    Raises
    ------
    MotionStyleError
        If there is no such learner.
    """
    printed = paper_settings(settings)
    printed = replace(printed, iterations=min(printed.iterations, paper_iterations))
    if name == "ours":
        return learn(learning, our_settings(settings, schedule))
    if name == "paper":
        return learn_as_paper(learning, printed)
    if name == "least_squares":
        return learn_by_least_squares(learning, printed, budget)
    if name == "alpha_only":
        part = settings["ours"]
        bounds = {"least": part["least_preference"], "largest": part["largest_preference"]}
        return learn_preferences(learning, PreferenceSettings(rounds=min(12, budget), **bounds))
    if name == "no_cone":
        friction = np.full_like(learning.feet.friction, NO_CONE_FRICTION)
        loose = replace(learning, feet=replace(learning.feet, friction=friction))
        found = learn_as_paper(loose, printed)
        about = {**found.style.about, "recipe": name}
        return Learnt(replace(found.style, about=about), found.rows)
    raise MotionStyleError(
        f"learner {name!r} is not one of {', '.join(LEARNERS)}{near_matches(name, LEARNERS)}"
    )


def checked(learnt: Learnt) -> Learnt:
    """Return a learnt style, having seen that its numbers are finite.

    Raises
    ------
    MotionStyleError
        If they are not.
    """
    if not np.isfinite(learnt.style.vector()).all():
        raise MotionStyleError("learning broke down: θ is not finite; see the log")
    return learnt
