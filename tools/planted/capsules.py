# SPDX-License-Identifier: Apache-2.0
"""Capsules that meet: who deepens an overlap, and how near they come."""
from . import plant

CAPSULE = "include/gsnav/sweep/capsule.hpp"
TEST = "tests/nav/test_sweep_long.cpp"

PLANTS = [
    plant("pushed_agent_unwatched", CAPSULE, "const auto wrong = active && looking && agent_closes && (gap < floor - tolerance);",
          "const auto wrong = nowhere;", TEST, "sweep: long and growing*",
          why="a push by a body would let the agent go on into it until the next look"),
    plant("few_evaluations", CAPSULE, "int max_iterations = sizeof(S) > 4 ? 512 : 64;", "int max_iterations = 64;",
          TEST, "sweep: capsules of kilometres*", why="a sweep that gives up stops an agent in the open"),
    plant("least_gap_of_the_begin", CAPSULE, "time_to(best - tolerance, S(4));", "time_to(best - S(0.2), S(4));",
          TEST, "least gap: *"),
]
