# SPDX-License-Identifier: Apache-2.0
"""What an episode among people is measured by."""
from . import plant

METRICS = "include/gsnav/sim/metrics.hpp"
TEST = "tests/sim/test_metrics.cpp"

PLANTS = [
    plant("stopped_is_touched", METRICS, "m_.human_collision || r.avatar_contact;",
          "m_.human_collision || r.avatar_contact || r.capsule_blocked;",
          TEST, "H-Coll counts episodes*", why="a move that the filter stopped touched nobody"),
    plant("compliance_by_pairs", METRICS, "compliant = compliant && keeps_personal_space(d);",
          "compliant = keeps_personal_space(d);", TEST, "personal space compliance*",
          why="who comes last decides"),
    plant("compliance_between_centres", METRICS, "kCompliantGap = 0.45;", "kCompliantGap = 1.0;",
          TEST, "personal space compliance*", why="distances are between surfaces"),
]
