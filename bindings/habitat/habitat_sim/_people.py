# SPDX-License-Identifier: Apache-2.0
"""People of a scene: the part of a simulator that has the names of Habitat-GS, and metrics of agents among people."""

import math
import numbers
import sys
from typing import Any

import numpy as np

from . import _engine

_FARTHEST = 1e9  # Metres.

# Settings of the scene's clock with their defaults. Times in seconds.
TIME_SETTINGS = {
    "gaussian_time": 0.0,
    "gaussian_auto_play": True,
    "gaussian_time_min": 0.0,
    "gaussian_time_max": 0.0,
    "gaussian_time_step": 0.0,
    "gaussian_time_loop": True,
}


def _triple(point: Any) -> list[float]:
    return [float(x) for x in point]


class Clock:
    """Time of moving Gaussians in seconds: from `gaussian_time_min` to `gaussian_time_max`, if that is larger.

    At the end it starts again if `gaussian_time_loop` is set, and else it stays there.
    """

    def __init__(self, settings: Any) -> None:
        for name, default in TIME_SETTINGS.items():
            value = type(default)(getattr(settings, name, default))
            if not math.isfinite(value):
                raise ValueError(f"SimulatorConfiguration.{name} = {value}: must be finite")
            setattr(self, name, value)
        self.gaussian_time = self.within(self.gaussian_time)

    def within(self, time: float) -> float:
        """A time as the clock shows it."""
        low, high = self.gaussian_time_min, self.gaussian_time_max
        if high <= low:
            return time
        if self.gaussian_time_loop:
            return low + (time - low) % (high - low)
        return min(max(time, low), high)

    def advance(self, seconds: float) -> None:
        """Lets time pass if `gaussian_auto_play` is set."""
        if self.gaussian_auto_play:
            self.gaussian_time = self.within(self.gaussian_time + seconds)


class PeoplePart:
    """Base of the simulator: clock, queries and metrics of agents among people. Lengths in metres."""

    _clock: Clock
    _trackers: dict[int, Any]
    config: Any
    pathfinder: Any
    agents: Any
    _stage: Any
    _painter: Any
    _capsules: list[list[float]]

    def _open_people(self, clock: Clock) -> None:
        self._clock = clock
        self._trackers = {}
        self._hidden: set[int] = set()
        self.clear_navmesh_dynamic_capsules()
        if "habitat.core.registry" in sys.modules and "habitat.tasks.nav.nav" in sys.modules:
            # Registers measures. Worker processes import nothing else of this distribution, so it is done here.
            from gsnav_habitat import measures  # noqa: F401

    def _tracker(self, agent_id: int) -> Any:
        """The agent's tracker on the present NavMesh, or None without a NavMesh or without people and capsules."""
        scene, mesh = (None, None) if self._stage is None else (self._stage.scene, self.pathfinder._mesh)
        if mesh is None or not (self._capsules or (scene is not None and scene.avatar_count)):
            return None
        found = self._trackers.get(agent_id)
        if found is None or found[0] is not mesh:
            gsnav, body = _engine.library(), self.agents[agent_id].agent_config
            radius, height = _engine.capsule("AgentConfiguration", body.radius, body.height)
            made = gsnav.AvatarTracker(gsnav.SimulatorScene(scene, mesh), radius, height)
            made.set_capsules(self._capsules)
            found = self._trackers[agent_id] = (mesh, made)
        return found[1]

    def _tracker_for(self, method: str, radius: float, height: float) -> Any:
        """The default agent's tracker, for a query of a body of these sizes."""
        default = self.config.sim_cfg.default_agent_id
        tracker = self._tracker(default)
        if tracker is not None:
            body = self.agents[default].agent_config
            sizes = radius if radius > 0 else body.radius, height if height > 0 else body.height
            _engine.capsule(f"Simulator.{method}", *sizes)
        return tracker

    def _begin_people(self, agent_id: int) -> None:
        tracker = self._tracker(agent_id)
        if tracker is not None:
            tracker.begin_action()

    def _move_people(self, agent_id: int, start: Any, end: Any, seconds: float) -> Any:
        """Position that a move among people reaches while `seconds` pass; None in a scene without people."""
        tracker = self._tracker(agent_id)
        if tracker is None:
            return None
        now = self._clock.gaussian_time
        later = now + (seconds if self._clock.gaussian_auto_play else 0.0)
        start, end = _triple(start), _triple(end)
        connected = self.pathfinder._connected(start, end)
        at = tracker.move(start, end if connected else start, now, later, bool(self.config.sim_cfg.allow_sliding))
        return at if connected else start  # As PathFinder.try_step.

    def _stand_people(self, seconds: float, agent_ids: Any) -> None:
        for agent_id in agent_ids:
            if self._tracker(agent_id) is not None:
                at = self.agents[agent_id].state.position
                self._move_people(agent_id, at, at, seconds)

    def _reset_people(self) -> None:
        self._clock.gaussian_time = self._clock.within(0.0)
        for _, tracker in self._trackers.values():
            tracker.reset()

    # ---- What measures of habitat-lab read
    def avatar_metrics(self, agent_id: int = 0) -> Any:
        """gsnav.EpisodeMetrics of an agent since the last reset; those of a goal are 0. None without people."""
        tracker = self._tracker(agent_id)
        return None if tracker is None else tracker.metrics()

    def avatar_step(self, agent_id: int = 0) -> tuple[float, bool]:
        """Smallest distance to a person in the last action, and whether a person was touched or stopped it."""
        tracker = self._tracker(agent_id)
        return (math.inf, False) if tracker is None else (tracker.action_clearance, tracker.action_collided)

    # ---- Names of Habitat-GS
    def distance_to_avatar_proxy_capsules(
        self, agent_base_pos: Any, agent_radius: float = -1.0, agent_height: float = -1.0
    ) -> float:
        """Distance from the surface of an agent at a position to the nearest person, negative in overlap, infinite
        without people. A size that is not positive is that of the default agent. Raises ValueError naming a number
        that is beyond 1e9 or not finite, and for a body wider than it is high."""
        _check_length("distance_to_avatar_proxy_capsules", agent_base_pos=agent_base_pos, agent_radius=agent_radius,
                      agent_height=agent_height)  # fmt: skip
        tracker = self._tracker_for("distance_to_avatar_proxy_capsules", agent_radius, agent_height)
        if tracker is None:
            return math.inf
        return tracker.distance(_triple(agent_base_pos), self._clock.gaussian_time, agent_radius, agent_height)

    def is_step_blocked_by_avatar_proxy_capsules(
        self, start: Any, end: Any, allow_sliding: bool = True, agent_radius: float = -1.0,
        agent_height: float = -1.0, block_eps: float = 1e-5,
    ) -> bool:  # fmt: skip
        """Whether a person, standing as now, would stop or deflect a move. The contact is exact: `block_eps` has no
        effect. Raises the errors of distance_to_avatar_proxy_capsules."""
        _check_length("is_step_blocked_by_avatar_proxy_capsules", start=start, end=end, agent_radius=agent_radius,
                      agent_height=agent_height, block_eps=block_eps)  # fmt: skip
        tracker = self._tracker_for("is_step_blocked_by_avatar_proxy_capsules", agent_radius, agent_height)
        if tracker is None:
            return False
        return tracker.blocked(
            _triple(start), _triple(end), self._clock.gaussian_time, allow_sliding, agent_radius, agent_height
        )

    def set_navmesh_dynamic_capsules(self, capsules: Any) -> None:
        """Puts capsules in the way of agents, next to the people of the scene.

        `capsules`: numbers [N][7], rows of x0, y0, z0, x1, y1, z1, radius in metres. They replace those of the last
        call, stand still, and count as one person in measures. Steps of the PathFinder stop at them too. Raises
        ValueError for another shape, a value that is beyond 1e9 or not finite, or a negative radius.
        """
        rows = np.asarray(capsules, dtype=np.float64)
        if rows.size == 0:
            rows = rows.reshape(0, 7)
        if rows.ndim != 2 or rows.shape[1] != 7:
            raise ValueError(f"set_navmesh_dynamic_capsules: shape {rows.shape}: must be (n, 7)")
        if not (np.abs(rows) <= _FARTHEST).all() or (rows[:, 6] < 0).any():
            raise ValueError("set_navmesh_dynamic_capsules: values must be within 1e9 m, and radii 0 or more")
        self._capsules = rows.tolist()
        for _, tracker in self._trackers.values():
            tracker.set_capsules(self._capsules)
        self.pathfinder._set_capsules(self._capsules)

    def clear_navmesh_dynamic_capsules(self) -> None:
        """Takes the capsules of set_navmesh_dynamic_capsules away."""
        self.set_navmesh_dynamic_capsules([])

    def set_gaussian_avatar_visible(self, avatar_id: int, visible: bool) -> bool:
        """Draws a person, or leaves it out of images. It stops agents and counts in measures either way. Returns
        False for a number that no person has. Raises TypeError unless the number is an integer."""
        if isinstance(avatar_id, (bool, np.bool_)) or not isinstance(avatar_id, numbers.Integral):
            raise TypeError(f"set_gaussian_avatar_visible: avatar_id = {avatar_id!r}: must be an integer")
        ids = self.get_gaussian_avatar_ids()
        if avatar_id not in ids:
            return False
        (self._hidden.discard if visible else self._hidden.add)(avatar_id)
        self._painter = self._painter.of(self._stage.showing([i for i in ids if i not in self._hidden]))
        return True

    def get_gaussian_avatar_ids(self) -> list[int]:
        """Numbers of the people."""
        scene = None if self._stage is None else self._stage.scene
        return [] if scene is None else list(range(scene.avatar_count))

    @property
    def gaussian_duration(self) -> float:
        """Seconds from gaussian_time_min to gaussian_time_max."""
        return max(0.0, self._clock.gaussian_time_max - self._clock.gaussian_time_min)

    @property
    def gaussian_interval(self) -> tuple[float, float]:
        """gaussian_time_min and gaussian_time_max, seconds."""
        return self._clock.gaussian_time_min, self._clock.gaussian_time_max


def _check_length(method: str, **values: Any) -> None:
    for name, value in values.items():
        if not (np.abs(np.asarray(value, dtype=np.float64)) <= _FARTHEST).all():
            raise ValueError(f"Simulator.{method}: {name} = {value}: must be finite and within 1e9 m")


def _setting(name: str) -> property:
    def read(self: Any) -> Any:
        return getattr(self._clock, name)

    def write(self: Any, value: Any) -> None:
        value = type(TIME_SETTINGS[name])(value)
        if not math.isfinite(value):
            raise ValueError(f"Simulator.{name} = {value}: must be finite")
        setattr(self._clock, name, self._clock.within(value) if name == "gaussian_time" else value)

    return property(read, write, doc=f"{name} of the scene's clock. gaussian_time_step has no effect.")


for _name in TIME_SETTINGS:
    setattr(PeoplePart, _name, _setting(_name))
