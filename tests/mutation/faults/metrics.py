# SPDX-License-Identifier: Apache-2.0
"""What an episode among people is measured by."""
from . import fault

TEST = "tests/sim/test_metrics.cpp"

FAULTS = [
    fault("stopped_is_touched", "add", "m_.human_collision || r.avatar_contact;",
          "m_.human_collision || r.avatar_contact || r.capsule_blocked;",
          TEST, "H-Coll counts episodes*", why="a move that the filter stopped touched nobody"),
    fault("compliance_by_pairs", "compliant", "compliant = compliant && keeps_personal_space(d);",
          "compliant = keeps_personal_space(d);", TEST, "personal space compliance*",
          why="who comes last decides"),
    fault("compliance_between_centres", "kCompliantGap", "kCompliantGap = 0.45;", "kCompliantGap = 1.0;",
          TEST, "personal space compliance*", why="distances are between surfaces"),
]
