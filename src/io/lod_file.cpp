// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/io/lod_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "cache_file.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/detail/core/pool_backend.hpp"
#include "gsnav/detail/scene/lod_build.hpp"
#include "gsnav/detail/scene/spatial_order.hpp"

namespace gsnav::io {
namespace {

namespace fs = std::filesystem;
using detail::invalid_file;

/// Version of the result of build_lod: increase it with every change.
constexpr std::uint32_t kVersion = 2;

/// Start of the file. The arrays of for_each_array follow.
struct Header {
  detail::CacheFront front;
  std::uint64_t checksum;  ///< Checksum of the arrays.
};
static_assert(sizeof(Header) == 40);

/// A node without a struct's padding.
struct FileNode {
  double low[3], high[3];
  float error, scale_max, opacity_max, grain;
};
static_assert(sizeof(FileNode) == 64);

Hasher hash_of(const GaussianCloud& cloud, const LodSettings& settings) {
  Hasher h;
  h.value(kVersion);
  h.value(settings.sh_degree);
  h.value(settings.neighbours);
  hash_cloud(h, cloud);
  return h;
}

detail::CacheFront front_of(const GaussianCloud& cloud, const LodSettings& settings) {
  return {"GSNAVLOD", kVersion, sizeof(Header), hash_of(cloud, settings)};
}

/// Calls f for the arrays of a tree, in the order of the file.
template <class Tree, class F>
void for_each_array(Tree& tree, std::vector<FileNode>& nodes, const F& f) {
  f(nodes);
  auto& m = tree.merged;
  for (auto& p : m.means) f(p);
  for (auto& p : m.quats) f(p);
  for (auto& p : m.scales) f(p);
  f(m.opacities);
  f(m.sh0);
  f(m.shN);
  f(m.origin_ids);
}

/// Checks the values that kernels and LodCut rely on.
Status check(const fs::path& path, const GaussianCloud& m, const std::vector<FileNode>& nodes,
             std::size_t origins) {
  const auto finite = [](const std::vector<float>& v) {
    for (const float x : v) {
      if (!std::isfinite(x)) return false;
    }
    return true;
  };
  for (const auto& p : m.means) {
    if (!finite(p)) return invalid_file(path, "a mean that is not finite");
  }
  for (std::size_t i = 0; i < m.size(); ++i) {
    double length = 0;
    for (const auto& p : m.quats) length += static_cast<double>(p[i]) * static_cast<double>(p[i]);
    const auto row = [&path, i](const std::string& what) {
      return invalid_file(path, "row " + std::to_string(i) + ": " + what);
    };
    if (!(std::abs(length - 1) < 1e-4)) return row("a quaternion that is not of unit length");
    for (const auto& p : m.scales) {
      if (!(p[i] >= 0 && std::isfinite(p[i]))) return row("a scale out of range");
    }
    if (!(m.opacities[i] >= 0 && m.opacities[i] <= 1)) {
      return row("opacity " + std::to_string(m.opacities[i]) + ", must be in [0, 1]");
    }
  }
  if (!finite(m.sh0) || !finite(m.shN))
    return invalid_file(path, "an SH coefficient that is not finite");
  for (const std::uint32_t id : m.origin_ids) {
    if (id >= origins)
      return invalid_file(path, "origin " + std::to_string(id) + " of " + std::to_string(origins));
  }
  for (const FileNode& n : nodes) {
    bool good = n.error >= 0 && std::isfinite(n.error) && n.grain >= 0 && std::isfinite(n.grain) &&
                n.scale_max >= 0 && std::isfinite(n.scale_max);
    for (int k = 0; k < 3; ++k) {
      good = good && std::isfinite(n.low[k]) && std::isfinite(n.high[k]) && n.low[k] <= n.high[k];
    }
    if (!good) return invalid_file(path, "a node whose error or bounds cannot be");
  }
  return {};
}

std::uint64_t checksum(const LodTree& tree, const std::vector<FileNode>& nodes) {
  Hasher h;
  for_each_array(tree, const_cast<std::vector<FileNode>&>(nodes), [&h](const auto& v) { h.array(v); });
  return h.low();
}

}  // namespace

Status save_lod(const fs::path& path, const LodTree& tree, const GaussianCloud& cloud,
                const LodSettings& settings) {
  return detail::guarded(path.string(), [&]() -> Status {
    std::vector<FileNode> nodes(tree.nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const LodNode& n = tree.nodes[i];
      for (int k = 0; k < 3; ++k) {
        nodes[i].low[k] = n.reach.low[k];
        nodes[i].high[k] = n.reach.high[k];
      }
      nodes[i].error = n.error;
      nodes[i].scale_max = n.reach.scale_max;
      nodes[i].opacity_max = n.reach.opacity_max;
      nodes[i].grain = n.grain;
    }
    const Header header{front_of(cloud, settings), checksum(tree, nodes)};
    return replace_file(path, [&](OutputFile& file) {
      file.write(&header, sizeof header);
      for_each_array(tree, nodes,
                     [&file](const auto& v) { file.write(v.data(), v.size() * sizeof(v[0])); });
    });
  });
}

Result<LodTree> load_lod(const fs::path& path, const GaussianCloud& cloud, const LodSettings& settings) {
  return detail::guarded(path.string(), [&]() -> Result<LodTree> {
    detail::RandomFile file;
    Header header{};
    const detail::CacheFront front = front_of(cloud, settings);
    if (Status s = open_cache(path, front, "level-of-detail file", file, header); !s) return s;
    LodTree tree;
    if (cloud.size() != 0 && cloud.chunk_bounds.size() != cloud.view().chunk_count()) {
      return Status(Errc::invalid_argument, path.string() + ": the cloud is not in spatial order");
    }
    gsnav::detail::shape_lod(tree, cloud, settings);
    std::vector<FileNode> nodes(tree.nodes.size());
    std::uint64_t wanted = sizeof header;
    for_each_array(tree, nodes, [&wanted](const auto& v) { wanted += v.size() * sizeof(v[0]); });
    if (file.size() != wanted) {
      return invalid_file(path, "has " + std::to_string(file.size()) + " bytes where " +
                                    std::to_string(wanted) + " are needed");
    }
    detail::ArrayReader read(file, sizeof header);
    for_each_array(tree, nodes, [&read](auto& v) { read(v); });
    if (!read.whole()) return detail::reading_failed(path.string());
    if (header.checksum != checksum(tree, nodes))
      return invalid_file(path, "its checksum is another: damaged");
    if (Status s = check(path, tree.merged, nodes, std::max<std::size_t>(cloud.origins.size(), 1)); !s)
      return s;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      LodNode& n = tree.nodes[i];
      for (int k = 0; k < 3; ++k) {
        n.reach.low[k] = nodes[i].low[k];
        n.reach.high[k] = nodes[i].high[k];
      }
      n.error = nodes[i].error;
      n.grain = nodes[i].grain;
      n.reach.scale_max = nodes[i].scale_max;
      n.reach.opacity_max = nodes[i].opacity_max;
    }
    PoolBackend pool(threads_for(tree.merged.size()));
    tree.merged.chunk_bounds = chunk_bounds_of(pool, tree.merged);
    return tree;
  });
}

fs::path lod_path(const std::string& spec, const GaussianCloud& cloud, const LodSettings& settings) {
  return detail::path_beside(spec) + "." + hash_of(cloud, settings).hex().substr(0, 16) + ".lod";
}

Status save_lod(const fs::path& path, const LodTree& tree, const GaussianCloud& cloud) {
  return save_lod(path, tree, cloud, LodSettings{});
}

Result<LodTree> load_lod(const fs::path& path, const GaussianCloud& cloud) {
  return load_lod(path, cloud, LodSettings{});
}

fs::path lod_path(const std::string& spec, const GaussianCloud& cloud) {
  return lod_path(spec, cloud, LodSettings{});
}

}  // namespace gsnav::io
