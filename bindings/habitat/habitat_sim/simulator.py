# SPDX-License-Identifier: Apache-2.0
"""The simulator: agents and sensors in a scene, moved on a NavMesh and drawn by gsnav."""

import dataclasses
import functools
import math
import numbers
import os
import random as _random
import time
from typing import Any

import numpy as np

import gsnav_habitat as _shared
from magnum import Vector3

from . import _draw, _engine
from ._follower import GreedyGeodesicFollower
from ._people import TIME_SETTINGS, Clock, PeoplePart
from .agent import Agent
from .agent.agent import AgentState
from .metadata import MetadataMediator, TemplateManager
from .nav import NavMeshSettings, PathFinder
from .scene import SceneGraph
from .sensor import Sensor, SensorFactory
from .utils.common import quat_from_angle_axis

_STEP = 1.0 / 60.0  # Seconds.
_FIELDS = {"agents", "config", "metadata_mediator", "pathfinder", "random"}
# Names of Habitat-Sim's simulator that scripts may write and gsnav does not serve.
_NOT_WRITTEN = {"active_dataset", "frustum_culling", "gfx_replay_manager", "navmesh_visualization", "renderer",
                "semantic_color_map"}  # fmt: skip


class SimulatorConfiguration(_shared.FullySealed):
    """Settings of a simulator. `gpu_device_id` is CUDA's number of a GPU; -1 is the CPU."""

    def __init__(self) -> None:
        self.scene_id = ""
        self.scene_dataset_config_file = "default"
        self.random_seed = 0
        self.default_agent_id = 0
        self.gpu_device_id = 0
        self.allow_sliding = True
        self.create_renderer = True
        self.requires_textures = True
        self.load_semantic_mesh = False
        self.frustum_culling = True
        self.enable_physics = False
        self.enable_hbao = False
        self.physics_config_file = "./data/default.physics_config.json"
        self.leave_context_with_background_renderer = False
        self.enable_gfx_replay_save = False
        self.navmesh_settings: Any = None
        self.scene_light_setup = ""
        self.override_scene_light_defaults = False
        self.pbr_image_based_lighting = False
        self.use_semantic_textures = False
        self.__dict__.update(TIME_SETTINGS)

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.__dict__ == other.__dict__

    __hash__ = None  # type: ignore[assignment]


@dataclasses.dataclass
class Configuration(_shared.FullySealed):
    """Settings of a simulator and its agents."""

    sim_cfg: Any = None
    agents: Any = None
    metadata_mediator: Any = None
    enable_batch_renderer: bool = False


class Simulator(PeoplePart):
    """Agents in a scene. A simulator can be used in a with statement."""

    def __init__(self, config: Configuration) -> None:
        """Opens the scene, places the agents at random points of the NavMesh, and makes their sensors.

        Raises FileNotFoundError naming the scene, ValueError naming the setting, and NotImplementedError naming what
        gsnav does not serve.
        """
        self.config = config
        self.pathfinder = PathFinder()
        self.agents: list[Agent] = []
        self._stage: Any = None
        self._painter: Any = None
        self._graph = SceneGraph()
        self._world_time = 0.0
        self._previous_step_time = 0.0
        self._step_seconds, self._moved = _STEP, False
        self.metadata_mediator = config.metadata_mediator or MetadataMediator(config.sim_cfg)
        self._open(config)

    def __getattr__(self, name: str) -> Any:
        """Called for names that do not exist. Public ones are not served."""
        if name.startswith("_") or hasattr(type(self), name):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        raise _shared.NotServed(_shared.message(f"habitat_sim.Simulator.{name}"))

    def __setattr__(self, name: str, value: Any) -> None:
        """Refuses public names that do not exist. A subclass can have new names, but not those of Habitat-Sim."""
        if name[0] != "_" and name not in _FIELDS and not hasattr(type(self), name):
            if type(self) is Simulator or name in _NOT_WRITTEN:
                raise _shared.NotServed(_shared.message(f"habitat_sim.Simulator.{name}"))
        object.__setattr__(self, name, value)

    # ---- Life
    def _open(self, config: Configuration) -> None:
        sim_cfg = config.sim_cfg
        if config.enable_batch_renderer:
            raise NotImplementedError(_shared.message("Configuration.enable_batch_renderer"))
        if not config.agents:
            raise RuntimeError("Configuration.agents is empty: a simulator needs an agent")
        for agent in config.agents:
            for spec in agent.sensor_specifications:
                _draw.check(spec, _engine.is_empty(sim_cfg.scene_id))
        default = _engine.integer("SimulatorConfiguration.default_agent_id", sim_cfg.default_agent_id)
        if not 0 <= default < len(config.agents):
            raise ValueError(
                f"SimulatorConfiguration.default_agent_id = {default}: there are {len(config.agents)} agents, from 0"
            )
        if not isinstance(sim_cfg.allow_sliding, (bool, np.bool_)):
            raise TypeError(f"SimulatorConfiguration.allow_sliding = {sim_cfg.allow_sliding!r}: must be a bool")
        navigator = config.agents[default]
        settings = sim_cfg.navmesh_settings
        if settings is None:
            settings = NavMeshSettings()
            settings.agent_radius, settings.agent_height = navigator.radius, navigator.height
        required = sim_cfg.navmesh_settings is not None
        stage = _engine.stage(str(sim_cfg.scene_id), NavMeshSettings._native(settings), required)
        device = _engine.device(_engine.integer("SimulatorConfiguration.gpu_device_id", sim_cfg.gpu_device_id))
        seed, clock = _engine.integer("SimulatorConfiguration.random_seed", sim_cfg.random_seed), Clock(sim_cfg)
        if stage.scene is not None and stage.scene.avatar_count > 0:
            for agent in config.agents:
                _engine.capsule("AgentConfiguration", agent.radius, agent.height)
        graph = SceneGraph()
        agents = [Agent(graph.get_root_node().create_child(), agent) for agent in config.agents]
        # All that can fail is done, so a simulator whose new settings are refused keeps the old ones.
        if stage is not self._stage:
            self.pathfinder._mesh = stage.navmesh
        self._stage, self._painter, self.config = stage, _draw.Painter(stage, device), config
        self._graph, self.agents = graph, agents
        graph.get_root_node()._simulator = self
        self._world_time = 0.0
        self._open_people(clock)
        self.seed(seed)
        for agent_id, made in enumerate(agents):
            made.controls.move_filter_fn = functools.partial(self._filter, agent_id)
        for agent_id in range(len(self.agents)):
            self.initialize_agent(agent_id)

    def reconfigure(self, config: Configuration) -> None:
        """Applies other settings. The scene is opened again only if it is another one."""
        if config != self.config or self._stage is None:
            self._open(config)

    def close(self, destroy: bool = True) -> None:
        """Frees images and renderer. The simulator can be opened again by `reconfigure`."""
        self._painter = None
        self._stage = None
        if destroy:
            self.agents = []

    def _need_open(self, what: str) -> None:
        if self._stage is None:
            raise RuntimeError(f"Simulator: {what}: the simulator is closed; reconfigure opens it again")

    def __enter__(self) -> "Simulator":
        return self

    def __exit__(self, *error: Any) -> None:
        self.close(destroy=True)

    def seed(self, new_seed: int) -> None:
        """Seeds the random points and the simulator's random numbers."""
        new_seed = _engine.integer("Simulator.seed: new_seed", new_seed)
        self.random = _random.Random(new_seed)
        self.pathfinder.seed(new_seed)

    # ---- Agents
    @property
    def _default_agent(self) -> Agent:
        return self.get_agent(self.config.sim_cfg.default_agent_id)

    def get_agent(self, agent_id: int) -> Agent:
        """An agent by its number. Raises IndexError naming a number that no agent has."""
        try:
            return self.agents[agent_id]
        except IndexError:
            raise IndexError(f"Simulator: no agent {agent_id}; there are {len(self.agents)}") from None

    def initialize_agent(self, agent_id: int, initial_state: AgentState | None = None) -> Agent:
        """Places an agent, by default at a random point of the NavMesh with a random heading."""
        agent = self.get_agent(agent_id)
        if initial_state is None:
            initial_state = AgentState()
            if self.pathfinder.is_loaded:
                initial_state.position = np.array(self.pathfinder.get_random_navigable_point())
                initial_state.rotation = quat_from_angle_axis(self.random.uniform(0, 2 * np.pi), [0, 1, 0])
        agent.set_state(initial_state, is_initial=True)
        return agent

    def last_state(self, agent_id: int | None = None) -> AgentState:
        """Pose of an agent."""
        return (self._default_agent if agent_id is None else self.get_agent(agent_id)).get_state()

    def make_greedy_follower(self, agent_id: int | None = None, goal_radius: float | None = None, **keys: Any) -> Any:
        """A GreedyGeodesicFollower for an agent."""
        agent = self._default_agent if agent_id is None else self.get_agent(agent_id)
        made = GreedyGeodesicFollower(self.pathfinder, agent, goal_radius, **keys)
        made._allow_sliding = self.config.sim_cfg.allow_sliding
        return made

    # ---- Steps
    def reset(self, agent_ids: Any = None) -> Any:
        """Puts agents back to their initial states and clocks to 0. Returns the observations of the default
        agent, or, for a list of agents, a dict of observations."""
        for agent in self.agents:
            if agent.initial_state is not None:
                agent.set_state(agent.initial_state)
        self._world_time = 0.0
        self._reset_people()
        return self.get_sensor_observations(self.config.sim_cfg.default_agent_id if agent_ids is None else agent_ids)

    def step(self, action: Any, dt: float = _STEP) -> Any:
        """Performs an action of the default agent, or a dict of actions by agents, and draws.

        The clock advances by `dt` seconds before it draws, or by GSNAV_ACTION_SECONDS. Returns the observations with
        "collided": whether the agent moved less far than it tried to. Raises AssertionError for an unknown action, and
        ValueError for a time or an actuation that is not finite or a negative time. Nothing has changed then.
        """
        single = not isinstance(action, dict)
        default = self.config.sim_cfg.default_agent_id
        actions = {default: action} if single else action
        start = time.time()
        dt = _checked("step", dt)
        for agent_id, a in actions.items():
            self.get_agent(agent_id)._action(a)
        self._step_seconds = _action_seconds() or dt
        collided = {}
        for agent_id, a in actions.items():
            self._begin_people(agent_id)
            self._moved = False
            collided[agent_id] = self.get_agent(agent_id).act(a)
            if not self._moved:
                self._stand_people(self._step_seconds, [agent_id])
        self._advance(self._step_seconds)
        seen = self.get_sensor_observations(list(actions))
        for agent_id, hit in collided.items():
            seen[agent_id]["collided"] = hit
        self._previous_step_time = time.time() - start
        return seen[default] if single else seen

    def step_filter(self, start_pos: Any, end_pos: Any) -> Any:
        """Position that a move of an agent reaches on the NavMesh; `end_pos` without one."""
        if not self.pathfinder.is_loaded:
            return end_pos
        finder = self.pathfinder
        step = finder.try_step if self.config.sim_cfg.allow_sliding else finder.try_step_no_sliding
        return step(start_pos, end_pos)

    def _filter(self, agent_id: int, start_pos: Any, end_pos: Any) -> Any:
        self._moved = True
        reached = self._move_people(agent_id, start_pos, end_pos, self._step_seconds)
        return self.step_filter(start_pos, end_pos) if reached is None else Vector3(*reached)

    def _advance(self, seconds: float) -> None:
        self._world_time += seconds
        self._clock.advance(seconds)

    def step_physics(self, dt: float, scene_id: int = 0) -> None:
        """Advances the clock by `dt` seconds. With GSNAV_ACTION_SECONDS, `step` has done so. Raises ValueError for a
        time that is negative or not finite."""
        dt = _checked("step_physics", dt)
        if _action_seconds() is None:
            self._stand_people(dt, range(len(self.agents)))
            self._advance(dt)

    def step_world(self, dt: float = _STEP) -> float:
        """Advances the clock by `dt` seconds and returns it. Raises ValueError for a time that is negative or not
        finite."""
        self._advance(_checked("step_world", dt))
        return self._world_time

    def get_world_time(self) -> float:
        """Time on the scene's clock, seconds."""
        return self._world_time

    @property
    def previous_step_time(self) -> float:
        """Seconds that the last step took."""
        return self._previous_step_time

    # ---- Sensors
    @property
    def sensors(self) -> dict[str, Sensor]:
        """All sensors by their names."""
        return self._graph.get_root_node().subtree_sensors

    @property
    def _sensors(self) -> dict[str, Sensor]:
        return self._default_agent.sensors

    def _draw(self, sensors: Any) -> dict[str, np.ndarray]:
        self._need_open("the sensors")
        return self._painter.draw(sensors, self._clock.gaussian_time)

    def get_sensor_observations(self, agent_ids: Any = 0) -> Any:
        """Images of an agent's sensors by their names, or, for a list of agents, a dict of them.

        Colour uint8 [height][width][4], depth float32 [height][width] in metres with 0 for no return, semantic uint32
        [height][width]. Row 0 is the top. The arrays are new.
        """
        if isinstance(agent_ids, numbers.Integral):
            return self._draw(list(self.get_agent(agent_ids).sensors.values()))
        return {i: self._draw(list(self.get_agent(i).sensors.values())) for i in agent_ids}

    def render_sensors(self, sensors: Any = None) -> dict[str, np.ndarray]:
        """Images of the given sensors, or of all."""
        return self._draw(list(self.sensors.values()) if sensors is None else list(sensors))

    def create_sensor(self, spec: Any, scene_node: Any = None) -> Sensor:
        """Makes a sensor below a node, by default that of the default agent. Raises ValueError for a used name."""
        _draw.check(spec, self._stage is not None and self._stage.scene is None)
        if spec.uuid in self.sensors:
            raise ValueError(f"SensorSpec.uuid {spec.uuid!r} is used twice")
        node = self._default_agent.scene_node if scene_node is None else scene_node
        return SensorFactory.create_sensors(node, [spec])[spec.uuid]

    def add_sensor(self, sensor_spec: Any, agent_id: int | None = None) -> Sensor:
        """Makes a sensor of an agent."""
        agent = self._default_agent if agent_id is None else self.get_agent(agent_id)
        return self.create_sensor(sensor_spec, agent.scene_node)

    def get_sensor(self, uuid: str) -> Sensor:
        """A sensor by its name. Raises KeyError if there is none."""
        return self.sensors[uuid]

    def remove_sensor(self, uuid: str) -> None:
        """Takes a sensor away. Raises KeyError if there is none."""
        SensorFactory.delete_sensor(self.sensors[uuid])

    # ---- The scene
    @property
    def semantic_scene(self) -> None:
        """None: the scene has no labels."""
        return None

    @property
    def curr_scene_name(self) -> str:
        """Name of the scene."""
        return os.path.splitext(os.path.basename(str(self.config.sim_cfg.scene_id)))[0]

    @property
    def gpu_device(self) -> int:
        """Number of the GPU, or -1 for the CPU."""
        chosen = _engine.device(int(self.config.sim_cfg.gpu_device_id))
        return chosen.index if chosen.kind == _engine.library().DeviceKind.cuda else -1

    def get_active_scene_graph(self) -> SceneGraph:
        """The tree of agents and sensors."""
        return self._graph

    def get_stage_initialization_template(self) -> None:
        """None for an empty scene. Raises NotImplementedError for others."""
        if self._stage is not None and self._stage.scene is not None:
            raise NotImplementedError(_shared.message("habitat_sim.Simulator.get_stage_initialization_template"))

    def get_object_template_manager(self) -> TemplateManager:
        """A manager that has no templates."""
        return self.metadata_mediator.object_template_manager

    def recompute_navmesh(self, pathfinder: PathFinder, navmesh_settings: Any) -> bool:
        """Builds a NavMesh of the scene. Returns False if the scene has no walkable surface.

        Voxels of a scene of Gaussians are at most 0.05 m high. Raises ValueError naming a setting out of range.
        """
        settings = NavMeshSettings._native(navmesh_settings)
        settings.validate()
        if self._stage is None or self._stage.scene is None:
            return False
        gsnav = _engine.library()
        options = gsnav.OpenOptions(navmesh="build", navmesh_settings=settings)
        try:
            pathfinder._mesh = gsnav.open_scene(str(self.config.sim_cfg.scene_id), options).scene.navmesh
        except (gsnav.NothingNavigable, gsnav.InvalidArgument):
            return False
        return True


def _while_open(name: str, call: Any) -> Any:
    @functools.wraps(call)
    def checked(self: Any, *args: Any, **kwargs: Any) -> Any:
        if self._stage is None:
            self._need_open(name)
        return call(self, *args, **kwargs)

    return checked


def _guard(kind: type) -> None:
    """Lets the public methods and properties of a class raise RuntimeError while the simulator is closed."""
    for name, member in list(vars(kind).items()):
        if name[0] == "_" or name in ("close", "reconfigure"):
            continue
        if isinstance(member, property):
            parts = [call and _while_open(name, call) for call in (member.fget, member.fset, member.fdel)]
            setattr(kind, name, property(*parts, doc=member.__doc__))
        elif callable(member):
            setattr(kind, name, _while_open(name, member))


_guard(PeoplePart)
_guard(Simulator)


def _checked(method: str, dt: float) -> float:
    seconds = float(dt)
    if not 0 <= seconds < math.inf:
        raise ValueError(f"Simulator.{method}: dt = {dt}: must be 0 or more seconds, and finite")
    return seconds


def _action_seconds() -> float | None:
    text = os.environ.get("GSNAV_ACTION_SECONDS")
    if not text:
        return None
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0 < seconds < 3600:
        raise ValueError(f"GSNAV_ACTION_SECONDS = {text}: must be in (0, 3600) seconds")
    return seconds
