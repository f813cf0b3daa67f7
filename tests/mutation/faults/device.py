# SPDX-License-Identifier: Apache-2.0
"""Rules that device code alone has, and small ones that everything uses."""
from . import fault

BATCH = "tests/emulated/test_batch_rules.cu"
FUNCTIONS = "tests/math/test_functions.cpp"
ONE = "tests/ops/test_batch_of_one.cpp"
POOL = "tests/ops/test_thread_pool.cpp"
REGIONS = "tests/ops/test_cuda_batch_regions.cpp"
LISTED = "cuda batch regions: rows of few cameras*"
DIVIDED = "cuda batch regions: tiles that warps divide*"
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
    fault("part_reads_the_list_again", "TileReader::resume", "next_ = from.next;", "next_ = 0;", REGIONS, DIVIDED,
          device=True),
    fault("part_without_the_rows_held", "TileReader::resume", "held_ = from.held;", "held_ = 0;", REGIONS, DIVIDED,
          device=True),
    fault("part_given_while_rows_wait", "TileWarp::draw", "last || divides", "last", REGIONS, DIVIDED, device=True),
    fault("part_without_its_medians", "TileWarp::resume", "median_[k] = part.medians[k][lane_];", "", REGIONS, DIVIDED,
          device=True),
    fault("bin_begins_at_the_key", "begin_of_bin", "first_key_of_bin(r_, base_, key)", "key", REGIONS,
          "cuda batch regions: thousands of rows of one key*", device=True),
    fault("parts_of_a_camera_list_the_same_groups", "for_groups", "s_.part.number * kListWarps + ", "", REGIONS, LISTED,
          device=True),
    fault("parts_of_a_camera_share_places", "count_rows_kernel", "place += rows;", "", REGIONS, LISTED, device=True),
    fault("parts_of_a_camera_share_records", "sum_parts", "sum += n;", "", REGIONS, LISTED, device=True),
    fault("set_of_a_frame_listed_once", "place_of", "std::ranges::find(of_camera, at->second) == of_camera.end()",
          "true", ONE, "a set that a frame has twice*"),
    fault("call_without_memory_given_up", "draw_what_fits", "|| count == 1", "|| count != 0", ONE,
          "a call whose cameras memory*"),
    fault("kinds_of_frames_kept", "FrameBatch::render", "calls_ - k.last_call >= kForgotten", "false", ONE,
          "the memory of kinds of frames*"),
    fault("bad_sets_go_to_a_batch", "list_sets", "if (Status s = validate(set); !s) return s;", "", ONE,
          "bad frames get the errors*"),
    fault("errors_lose_their_code", "guarded", "return Status(e.code(), e.what());",
          "return Status(Errc::out_of_memory, e.what());", POOL, PIECES),
    fault("no_memory_is_a_broken_device", "guarded", "return Status(Errc::out_of_memory, name.empty()",
          "return Status(Errc::backend_failure, name.empty()", POOL, PIECES),
]
