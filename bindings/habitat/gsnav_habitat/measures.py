# SPDX-License-Identifier: Apache-2.0
"""Measures of habitat-lab for navigation among people: collision_rate, personal_space_intrusion, human_collision, and
avatar_navigation_reward. Importing the module registers them; habitat_sim does so when habitat-lab opens a scene.

Without people in the scene the first three are 0.
"""

from typing import Any

from habitat.core.embodied_task import Measure
from habitat.core.registry import registry
from habitat.tasks.nav.nav import DistanceToGoal


class _AvatarMeasure(Measure):
    """A field of gsnav.EpisodeMetrics since the begin of the episode."""

    cls_uuid = ""
    _field = ""

    def __init__(self, sim: Any, config: Any, *args: Any, **kwargs: Any) -> None:
        self._sim = sim
        super().__init__()

    def _get_uuid(self, *args: Any, **kwargs: Any) -> str:
        return self.cls_uuid

    def reset_metric(self, *args: Any, **kwargs: Any) -> None:
        self.update_metric()

    def update_metric(self, *args: Any, **kwargs: Any) -> None:
        metrics = self._sim.avatar_metrics()
        self._metric = 0.0 if metrics is None else float(getattr(metrics, self._field))


@registry.register_measure
class CollisionRate(_AvatarMeasure):
    """CR: fraction of the actions in which a person was touched or stopped the agent."""

    cls_uuid, _field = "collision_rate", "collision_rate"


@registry.register_measure
class PersonalSpaceIntrusion(_AvatarMeasure):
    """PSI: mean depth of the agent in people's personal space of 1 m, 0 to 1."""

    cls_uuid, _field = "personal_space_intrusion", "psi"


@registry.register_measure
class HumanCollision(_AvatarMeasure):
    """H-Coll: 1 after a person was touched in the episode, else 0."""

    cls_uuid, _field = "human_collision", "human_collision"


@registry.register_measure
class AvatarNavigationReward(Measure):
    """Progress to the goal in metres, less what gsnav.TaskConfig.avatar_pointnav() takes for coming near people and
    for collisions with them. Habitat's environment adds its slack and success rewards."""

    cls_uuid = "avatar_navigation_reward"

    def __init__(self, sim: Any, config: Any, *args: Any, **kwargs: Any) -> None:
        import gsnav

        self._sim, self._rule = sim, gsnav.step_reward
        self._weights = gsnav.TaskConfig.avatar_pointnav().reward
        self._weights.slack = self._weights.success = 0.0
        self._before = 0.0
        super().__init__()

    def _get_uuid(self, *args: Any, **kwargs: Any) -> str:
        return self.cls_uuid

    def reset_metric(self, episode: Any, task: Any, *args: Any, **kwargs: Any) -> None:
        task.measurements.check_measure_dependencies(self.uuid, [DistanceToGoal.cls_uuid])
        self._before = self._distance(task)
        self._metric = 0.0

    def update_metric(self, episode: Any, task: Any, *args: Any, **kwargs: Any) -> None:
        now = self._distance(task)
        clearance, collided = self._sim.avatar_step()
        self._metric = self._rule(self._weights, self._before, now, False, clearance, collided, False)
        self._before = now

    @staticmethod
    def _distance(task: Any) -> float:
        return float(task.measurements.measures[DistanceToGoal.cls_uuid].get_metric())
