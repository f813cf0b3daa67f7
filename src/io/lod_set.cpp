// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/io/lod_set.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "described.hpp"
#include "file.hpp"
#include "gsnav/detail/core/pool_backend.hpp"
#include "gsnav/detail/io/sog.hpp"
#include "gsnav/detail/scene/lod_levels.hpp"
#include "json.hpp"
#include "report_sum.hpp"
#include "sog_rows.hpp"
#include "threads.hpp"
#include "zip.hpp"

namespace gsnav::io {
namespace {

using detail::Json;
using detail::RowRange;

constexpr std::int64_t kMostLevels = 64, kMostRows = std::int64_t{16383} * 16383;

/// Rows of a file that a node names for a level.
struct FileRows {
  std::size_t file = 0;
  RowRange range;
  bool operator==(const FileRows&) const = default;
};

/// Rows of a node in a file.
struct NodeRows {
  RowRange range;
  std::uint32_t node = 0;
};

class LodReader {
 public:
  LodReader(std::filesystem::path meta, const LoadLodOptions& options)
      : path_(std::move(meta)), source_(path_.string()), options_(options) {}

  Result<LoadedCloud> run() {
    std::vector<std::uint32_t> nodes;
    if (Status s = read(false); !s) return s;
    auto out = load(0, nodes);
    if (out) out->report.source = source_;
    return out;
  }

  Result<std::optional<LoadedLodSet>> run_levels() {
    if (Status s = read(true); !s) return s;
    LoadedLodSet out;
    std::vector<LodLevel> levels;
    std::uint64_t dropped = 0;
    for (std::size_t k = 0; k < steps_.size(); ++k) {
      LodLevel level;
      auto loaded = load(k, level.boxes);
      if (!loaded) return loaded.status();
      if (k == 0) {
        out.report = loaded->report;
      } else {
        dropped += loaded->report.dropped();
      }
      level.cloud = std::move(loaded->cloud);
      levels.push_back(std::move(level));
    }
    if (dropped != 0) {
      out.report.warnings.push_back(std::to_string(dropped) +
                                    " rows of coarser levels are not drawn: transparent or not finite");
    }
    if (!gsnav::detail::fills_chunks(levels, nodes_ + 1)) return std::optional<LoadedLodSet>();
    PoolBackend backend(threads_for(levels[0].cloud.size()) == 1 ? 1 : detail::io_threads());
    auto joined = join_levels(backend, std::move(levels), nodes_ + 1);
    if (!joined) return Status(joined.code(), source_ + ": " + joined.message());
    out.cloud = std::move(joined->cloud);
    out.tree = std::move(joined->tree);
    describe(out.cloud, out.report, {0, -1, 0});
    return std::optional<LoadedLodSet>(std::move(out));
  }

 private:
  /// Rows of one step. Step k has the rows that are drawn k levels above the finest available one.
  using Step = std::vector<std::vector<NodeRows>>;  ///< [files]

  /// Reads the set; with `coarser` all of its levels.
  Status read(bool coarser) {
    coarser_ = coarser;
    const auto json = detail::load_json(path_, &options_.limits);
    if (!json) return json.status();
    if (Status s = read_header(*json); !s) return s;
    if (Status s = walk(*json); !s) return s;
    if (Status s = check_overlaps(); !s) return s;
    return read_environment(*json);
  }

  Status fail(const std::string& what) const { return {Errc::invalid_file, source_ + ": " + what}; }
  std::filesystem::path place(const std::string& name) const { return path_.parent_path() / name; }

  Status read_header(const Json& json) {
    const auto levels = detail::get_integer(json, "lodLevels", 1, kMostLevels, source_);
    if (!levels) return levels.status();
    levels_ = static_cast<int>(*levels);
    if (options_.level < 0 || options_.level >= levels_) {
      return {Errc::invalid_argument, source_ + ": level " + std::to_string(options_.level) +
                                          " is asked for, the set has 0 to " +
                                          std::to_string(levels_ - 1)};
    }
    const Json* names = detail::member(json, "filenames");
    if (names == nullptr || !names->is_array()) return fail("'filenames' is missing or no array");
    for (const Json& name : *names) {
      if (!name.is_string() || !detail::is_safe_name(name.get<std::string>())) {
        return fail("'filenames' has " + detail::shown(name) + ", must be files below this folder");
      }
      files_.push_back(name.get<std::string>());
      std::error_code ignored;
      there_.push_back(std::filesystem::exists(place(files_.back()), ignored));
    }
    steps_.emplace_back(files_.size());
    return {};
  }

  /// Visits all nodes, without recursion, so that a deep tree needs no stack.
  Status walk(const Json& json) {
    const Json* root = detail::member(json, "tree");
    if (root == nullptr) return fail("'tree' is missing");
    std::vector<const Json*> open = {root};
    while (!open.empty()) {
      const Json& node = *open.back();
      open.pop_back();
      if (!node.is_object()) return fail("a node of the tree is " + detail::shown(node));
      if (const Json* lods = detail::member(node, "lods"); lods != nullptr) {
        if (Status s = choose(*lods); !s) return s;
      }
      const Json* children = detail::member(node, "children");
      if (children == nullptr || children->is_null()) continue;
      if (!children->is_array()) return fail("'children' is " + detail::shown(*children));
      for (auto child = children->rbegin(); child != children->rend(); ++child) open.push_back(&*child);
    }
    return {};
  }

  Status choose(const Json& lods) {
    if (!lods.is_object()) return fail("'lods' is " + detail::shown(lods) + ", must be an object");
    const std::string where = source_ + ": node " + std::to_string(nodes_);
    std::map<int, FileRows> there;
    std::string missing;
    for (int level = 0; level < levels_; ++level) {
      const Json* entry = detail::member(lods, std::to_string(level).c_str());
      if (entry == nullptr) continue;
      const std::string at = where + ": level " + std::to_string(level);
      const auto most = static_cast<std::int64_t>(files_.size()) - 1;
      const auto file = detail::get_integer(*entry, "file", 0, most, at);
      const auto first = detail::get_integer(*entry, "offset", 0, kMostRows, at);
      const auto count = detail::get_integer(*entry, "count", 0, kMostRows, at);
      for (const Status& s : {file.status(), first.status(), count.status()}) {
        if (!s) return s;
      }
      const auto index = static_cast<std::size_t>(*file);
      if (there_[index]) {
        there[level] = {index, {static_cast<std::uint64_t>(*first), static_cast<std::uint64_t>(*count)}};
      } else if (missing.empty()) {
        missing = place(files_[index]).string();
      }
    }
    ++nodes_;
    // No entry for the level: nothing of the node is left at that level.
    if (detail::member(lods, std::to_string(options_.level).c_str()) == nullptr) return {};
    if (there.empty()) {
      return {Errc::file_not_found, where + ": no file of any level is there, for instance " + missing};
    }
    auto chosen = there.lower_bound(options_.level);
    if (chosen == there.end()) --chosen;
    if (chosen->first != options_.level) ++instead_[chosen->first];
    const auto node = static_cast<std::uint32_t>(nodes_ - 1);
    steps_[0][chosen->second.file].push_back({chosen->second.range, node});
    std::size_t step = 0;
    for (auto next = std::next(chosen); coarser_ && next != there.end(); ++next) {
      const FileRows& rows = next->second;
      if (rows.range.count == 0 || rows == chosen->second)
        continue;  // nothing is left at this level, or it is not coarser
      if (++step == steps_.size()) steps_.emplace_back(files_.size());
      steps_[step][rows.file].push_back({rows.range, node});
      chosen = next;
    }
    return {};
  }

  /// Nodes that share rows would let a small set ask for any number of Gaussians.
  Status check_overlaps() {
    for (std::size_t f = 0; f < files_.size(); ++f) {
      std::vector<RowRange> ranges;
      for (Step& step : steps_) {
        std::sort(step[f].begin(), step[f].end(),
                  [](const NodeRows& a, const NodeRows& b) { return a.range.first < b.range.first; });
        for (const NodeRows& r : step[f]) ranges.push_back(r.range);
      }
      std::sort(ranges.begin(), ranges.end(),
                [](const RowRange& a, const RowRange& b) { return a.first < b.first; });
      for (std::size_t k = 1; k < ranges.size(); ++k) {
        if (ranges[k - 1].first + ranges[k - 1].count > ranges[k].first) {
          return fail("two nodes share rows of " + files_[f] + " from " +
                      std::to_string(ranges[k].first));
        }
      }
    }
    return {};
  }

  Status read_environment(const Json& json) {
    const Json* environment = detail::member(json, "environment");
    if (!options_.environment || environment == nullptr || environment->is_null()) return {};
    if (!environment->is_string() || !detail::is_safe_name(environment->get<std::string>())) {
      return fail("'environment' is " + detail::shown(*environment) +
                  ", must be a file below this folder");
    }
    environment_ = place(environment->get<std::string>());
    return {};
  }

  /// Loads the rows of a step by file, and the node of each row. The first step also has the
  /// environment, as a node after all others.
  Result<LoadedCloud> load(std::size_t step, std::vector<std::uint32_t>& nodes) const {
    LoadedCloud out;
    out.report.source = source_;
    for (const auto& [level, count] : instead_) {
      out.report.warnings.push_back("level " + std::to_string(options_.level) + " of " +
                                    std::to_string(count) + " of " + std::to_string(nodes_) +
                                    " nodes is not there: level " + std::to_string(level) + " is read");
    }
    for (std::size_t f = 0; f < files_.size(); ++f) {
      const std::vector<NodeRows>& rows = steps_[step][f];
      if (rows.empty()) continue;
      std::vector<RowRange> ranges;
      for (const NodeRows& r : rows) ranges.push_back(r.range);
      std::vector<std::uint8_t> kept;
      auto part = detail::load_sog_rows(place(files_[f]), ranges, &kept);
      if (Status s = detail::merge_loaded(out, std::move(part), place(files_[f]).string()); !s) return s;
      std::size_t at = 0;
      for (const NodeRows& r : rows) {
        for (std::uint64_t k = 0; k < r.range.count; ++k) {
          if (kept[at++] != 0) nodes.push_back(r.node);
        }
      }
    }
    if (step != 0 || environment_.empty()) return out;
    std::error_code ignored;
    if (!std::filesystem::exists(environment_, ignored)) {
      out.report.warnings.push_back("the environment " + environment_.string() + " is not there");
      return out;
    }
    if (Status s = detail::merge_loaded(out, load_sog(environment_), environment_.string()); !s)
      return s;
    nodes.resize(out.cloud.size(), static_cast<std::uint32_t>(nodes_));
    return out;
  }

  std::filesystem::path path_;
  std::string source_;
  const LoadLodOptions& options_;
  int levels_ = 0;
  std::size_t nodes_ = 0;
  std::vector<std::string> files_;
  std::vector<bool> there_;
  std::filesystem::path environment_;
  bool coarser_ = false;
  std::vector<Step> steps_;
  std::map<int, std::size_t> instead_;  ///< by level: number of nodes read at another level than the
                                        ///< requested one
};

/// The description of a set that is named by it or by its folder.
std::filesystem::path file_of(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored) ? path / "lod-meta.json" : path;
}

}  // namespace

Result<LoadedCloud> load_lod_set(const std::filesystem::path& path, const LoadLodOptions& options) {
  return detail::guarded(path.string(),
                         [&] { return detail::described(LodReader(file_of(path), options).run()); });
}

Result<std::optional<LoadedLodSet>> load_lod_levels(const std::filesystem::path& path,
                                                    const LoadLodOptions& options) {
  return detail::guarded(path.string(), [&] { return LodReader(file_of(path), options).run_levels(); });
}

}  // namespace gsnav::io
