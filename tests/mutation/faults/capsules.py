# SPDX-License-Identifier: Apache-2.0
"""Capsules that meet: who deepens an overlap, and how near they come."""
from . import fault

TEST = "tests/nav/test_sweep_long.cpp"

FAULTS = [
    fault("pushed_agent_unwatched", "sweep_steps",
          "const auto wrong = active && looking && agent_closes && (gap < floor - tolerance);",
          "const auto wrong = nowhere;", TEST, "sweep: long and growing*",
          why="a push by a body would let the agent go on into it until the next look"),
    fault("few_evaluations", "SweepRules", "int max_iterations = sizeof(S) > 4 ? 512 : 64;", "int max_iterations = 64;",
          TEST, "sweep: capsules of kilometres*", why="a sweep that gives up stops an agent in the open"),
    fault("least_gap_of_the_begin", "next", "time_to(best - tolerance, S(4));", "time_to(best - S(0.2), S(4));",
          TEST, "least gap: *"),
]
