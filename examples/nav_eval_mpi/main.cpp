// SPDX-License-Identifier: Apache-2.0
// An evaluation on several MPI ranks: mpirun -n 4 nav_eval_mpi --episodes 100.
// Each rank plays some of the episodes and writes each to its journal when it ends. The metrics are the
// same for any number of ranks. Run again, with any number of ranks, it plays the missing episodes.
#include <mpi.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "../../tools/common/parse_options.hpp"
#include "../../tools/eval/run.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/core/text.hpp"
#include "gsnav/device/simulator.hpp"

namespace {

using gsnav::Status;

/// Initialises MPI, and finalises it on destruction.
struct Ranks {
  Ranks(int* argc, char*** argv) {
    MPI_Init(argc, argv);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &count);
    MPI_Comm node = MPI_COMM_NULL;
    MPI_Comm_split_type(MPI_COMM_WORLD, MPI_COMM_TYPE_SHARED, rank, MPI_INFO_NULL, &node);
    MPI_Comm_rank(node, &on_node);
    MPI_Comm_free(&node);
  }
  ~Ranks() { MPI_Finalize(); }
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  /// Returns the numbers of rank 0 on all ranks.
  void share(std::vector<unsigned long>& numbers) const {
    unsigned long n = numbers.size();
    MPI_Bcast(&n, 1, MPI_UNSIGNED_LONG, 0, MPI_COMM_WORLD);
    numbers.resize(n);
    MPI_Bcast(numbers.data(), static_cast<int>(n), MPI_UNSIGNED_LONG, 0, MPI_COMM_WORLD);
  }

  /// Returns the texts of all ranks, in rank order, on rank 0.
  std::string gather(const std::string& own) const {
    const int size = static_cast<int>(own.size());
    std::vector<int> sizes(static_cast<std::size_t>(count)), at(static_cast<std::size_t>(count));
    MPI_Gather(&size, 1, MPI_INT, sizes.data(), 1, MPI_INT, 0, MPI_COMM_WORLD);
    for (std::size_t i = 1; i < at.size(); ++i) at[i] = at[i - 1] + sizes[i - 1];
    std::string all(rank == 0 ? static_cast<std::size_t>(at.back() + sizes.back()) : 0, '\0');
    MPI_Gatherv(own.data(), size, MPI_CHAR, all.data(), sizes.data(), at.data(), MPI_CHAR, 0,
                MPI_COMM_WORLD);
    return all;
  }

  int rank = 0, count = 1, on_node = 0;  // on_node: rank among the ranks of this machine
};

using Look = std::function<Status(const gsnav::World&)>;

/// Device of this rank. The ranks of a machine take its GPUs in turn, starting at that of --device.
gsnav::Result<gsnav::Device> device_of(const Ranks& ranks, const gsnav::Device& named) {
  if (named.kind() != gsnav::DeviceKind::cuda) return named;
  const auto gpus = std::ranges::count_if(gsnav::Device::available(),
                                          [](const std::string& d) { return d.starts_with("cuda"); });
  return gsnav::Device::parse("cuda:" + std::to_string((named.index() + ranks.on_node) % gpus));
}

/// Renders the agent's sensors at each step, as a policy that uses images would need. The policies here
/// do not use them, so the metrics do not change.
gsnav::Result<Look> looker(const Ranks& ranks, const gsnav_eval::Options& o,
                           const gsnav_eval::Stage& stage, bool draw) {
  if (!draw) return Look{};
  const auto device = device_of(ranks, o.device);
  if (!device) return device.status();
  auto made = gsnav::Simulator::create(*device, stage.scene, stage.config);
  if (!made) return made.status();
  auto eye = std::make_shared<gsnav::Simulator>(std::move(*made));
  return Look([eye](const gsnav::World& world) {
    if (Status s = eye->set_state(world.state()); !s) return s;
    return eye->observe().status();
  });
}

Status run(const Ranks& ranks, const gsnav_eval::Options& o, bool draw) {
  if (Status s = gsnav::make_output_folder(o.out); !s) return s;
  if (Status s = gsnav_eval::Journal::check_options(o.out, o); !s) return s;
  const auto stage = gsnav_eval::prepare(o);
  if (!stage) return stage.status();
  auto journal = gsnav_eval::Journal::open(o.out, o, *stage, ranks.rank);
  if (!journal) return journal.status();
  for (const std::string& note : journal->notes()) {
    std::fprintf(stderr, "%s\n", gsnav::printable(note).c_str());
  }
  std::vector<unsigned long> missing;
  if (ranks.rank == 0) {
    for (std::size_t i = 0; i < stage->episodes.size(); ++i) {
      if (!journal->records().contains(i)) missing.push_back(i);
    }
  }
  ranks.share(missing);

  auto world = gsnav_eval::make_world(*stage);
  if (!world) return world.status();
  const auto look = looker(ranks, o, *stage, draw);
  if (!look) return look.status();
  std::string lines;
  for (std::size_t k = static_cast<std::size_t>(ranks.rank); k < missing.size();
       k += static_cast<std::size_t>(ranks.count)) {
    auto record = gsnav_eval::play(*world, o, stage->episodes[missing[k]], missing[k], *look);
    if (!record) return record.status();
    lines += gsnav_eval::line_of(*record) + '\n';
    if (Status s = journal->add(std::move(*record)); !s) return s;
  }
  const std::string all = ranks.gather(lines);
  if (ranks.rank != 0) return {};
  std::map<std::size_t, gsnav_eval::Record> records = journal->records();
  for (std::size_t at = 0, end; (end = all.find('\n', at)) != std::string::npos; at = end + 1) {
    auto record = gsnav_eval::record_of(all.substr(at, end - at), "a rank's record", *stage);
    if (!record) return record.status();
    records.insert_or_assign(record->episode, std::move(*record));
  }
  std::vector<gsnav::EpisodeMetrics> metrics;
  for (const auto& [number, record] : records) metrics.push_back(record.metrics);
  const gsnav::MetricsSummary s = gsnav::summarize(metrics);
  std::printf(
      "%zu episodes (%zu played by %d ranks): SR %.17g SPL %.17g SoftSPL %.17g STL %.17g DTG %.17g CR "
      "%.17g PSI %.17g\n",
      s.episodes, missing.size(), ranks.count, s.success_rate, s.spl, s.soft_spl, s.stl,
      s.distance_to_goal, s.collision_rate, s.psi);
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  const Ranks ranks(&argc, &argv);
  gsnav_eval::Options o;
  bool draw = false;
  CLI::App app{"Evaluates a policy on several MPI ranks and writes the journal of gsnav-eval."};
  gsnav_eval::add_world_options(app, o);
  app.add_flag("--draw", draw,
               "draw what the agent sees at each step; the ranks of a machine share its GPUs");
  if (const auto status = gsnav_tools::parse_options(app, argc, argv)) return *status;
  Status s;
  try {
    s = run(ranks, o, draw);
  } catch (const std::exception& e) {
    s = {gsnav::Errc::out_of_memory, e.what()};
  }
  if (s) return 0;
  std::fprintf(stderr, "nav_eval_mpi, rank %d: %s\n", ranks.rank, s.message().c_str());
  MPI_Abort(MPI_COMM_WORLD, 1);  // otherwise the other ranks wait for messages of this one
  return 1;
}
