# SPDX-License-Identifier: Apache-2.0
"""Rules that device code alone has, and small ones that everything uses."""
from . import fault

BATCH = "tests/emulated/test_batch_rules.cu"
FUNCTIONS = "tests/math/test_functions.cpp"
POOL = "tests/ops/test_thread_pool.cpp"
PIECES = "what pieces throw or return becomes one Status*"
BYTE = "return static_cast<std::uint8_t>(static_cast<int>(whole) + (scaled - whole >= S(0.5) ? 1 : 0));"

FAULTS = [
    fault("search_stops_early", "last_start", "high - low > 1", "high - low > 2", BATCH, "last_start*"),
    fault("search_for_the_first", "last_start", "(starts(mid) ? low : high) = mid;",
          "(starts(mid) ? high : low) = mid;", BATCH, "last_start*"),
    fault("rank_of_the_source", "rank_of", "args.rank_of(source - args.first_rank)",
          "args.rank_of(source)", BATCH, "the rank of a slot*"),
    fault("first_row_of_a_set_to_the_set_before", "instance_of", "args.first_rank <= source",
          "args.first_rank < source", BATCH, "the rank of a slot*"),
    fault("byte_by_adding_a_half", "to_byte", BYTE,
          "return static_cast<std::uint8_t>(static_cast<int>(scaled + S(0.5)));", FUNCTIONS, "a byte is the nearest*",
          why="the sum rounds"),
    fault("byte_truncated", "to_byte", BYTE, "return static_cast<std::uint8_t>(static_cast<int>(whole));", FUNCTIONS,
          "a byte is the nearest*"),
    fault("byte_truncated_on_a_gpu", "to_byte", BYTE, "return static_cast<std::uint8_t>(static_cast<int>(whole));",
          "tests/ops/test_cuda_batch.cpp", "cuda batch: an empty view*", device=True),
    fault("errors_lose_their_code", "guarded", "return Status(e.code(), e.what());",
          "return Status(Errc::out_of_memory, e.what());", POOL, PIECES),
    fault("no_memory_is_a_broken_device", "guarded", "return Status(Errc::out_of_memory, name.empty()",
          "return Status(Errc::backend_failure, name.empty()", POOL, PIECES),
]
