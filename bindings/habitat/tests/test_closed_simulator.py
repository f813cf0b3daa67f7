# SPDX-License-Identifier: Apache-2.0
"""Closed simulators say that they are closed."""

import inspect

import habitat_sim
import pytest
from habitat_sim.utils.settings import make_cfg

pytest.importorskip("gsnav")
pytest.importorskip("quaternion")


def small(scene):
    return make_cfg({"scene": scene, "width": 8, "height": 8})


ARGUMENTS = {
    "get_agent": [0], "initialize_agent": [0], "seed": [1], "step": ["move_forward"], "step_physics": [0.1],
    "step_filter": [[0, 0, 0], [0, 0, 0]], "create_sensor": [habitat_sim.CameraSensorSpec()], "get_sensor": ["a"],
    "add_sensor": [habitat_sim.CameraSensorSpec()], "remove_sensor": ["a"],
    "recompute_navmesh": [habitat_sim.PathFinder(), habitat_sim.NavMeshSettings()],
    "distance_to_avatar_proxy_capsules": [[0, 0, 0]], "set_navmesh_dynamic_capsules": [[]],
    "is_step_blocked_by_avatar_proxy_capsules": [[0, 0, 0], [0, 0, 0]], "set_gaussian_avatar_visible": [0, False],
}  # fmt: skip


@pytest.mark.parametrize("destroy", [True, False])
def test_each_name_of_a_closed_simulator_says_that_it_is_closed(stage, destroy):
    sim = habitat_sim.Simulator(small(stage))
    sensor, agent = sim.get_sensor("color_sensor"), sim.get_agent(0)
    person = habitat_sim.gaussian_avatar.GaussianAvatar(sim, 0)
    sensor.draw_observation()  # An image that close() must not leave.
    sim.close(destroy)
    sim.close(destroy)
    names = [name for name in dir(habitat_sim.Simulator) if name[0] != "_" and name not in ("close", "reconfigure")]
    assert len(names) > 40
    for name in names:
        with pytest.raises(RuntimeError, match=f"Simulator: {name}: the simulator is closed; reconfigure"):
            if isinstance(inspect.getattr_static(sim, name), property):
                getattr(sim, name)
            else:
                getattr(sim, name)(*ARGUMENTS.get(name, []))
    for call in (sensor.get_observation, person.get_navmesh_capsules, lambda: agent.act("move_forward")):
        with pytest.raises(RuntimeError, match="the simulator is closed"):
            call()
    sim.reconfigure(small(stage))
    assert "color_sensor" in sim.reset()
    sim.close()
