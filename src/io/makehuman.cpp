// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "file.hpp"
#include "gsnav/detail/io/skinned_mesh_file.hpp"
#include "gsnav/detail/math/curves.hpp"
#include "json.hpp"
#include "text_lines.hpp"

namespace gsnav::io {
namespace {

namespace fs = std::filesystem;
using detail::in_quotes;
using detail::Json;
using detail::member;
using detail::shown;
using detail::TextLines;

/// All vertices of the file, in its units, and the faces of one group.
struct BaseMesh {
  std::vector<Vec3d> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

Result<BaseMesh> read_base(const fs::path& path, const std::string& group) {
  const std::string source = path.string();
  const auto file = detail::read_file(path);
  if (!file) return file.status();
  BaseMesh out;
  TextLines lines(file->text(), source);
  bool wanted = group.empty();
  while (lines.next()) {
    if (lines.word(0) == "v") {
      Vec3d v;
      for (int k = 0; k < 3; ++k) {
        if (Status s = lines.number(static_cast<std::size_t>(k) + 1, v[k]); !s) return s;
      }
      out.vertices.push_back(v);
    } else if (lines.word(0) == "g") {
      wanted = group.empty() || lines.word(1) == group;
    } else if (lines.word(0) == "f" && wanted) {
      std::vector<std::uint32_t> corners;
      for (std::size_t k = 1; k < lines.words().size(); ++k) {
        const std::string_view word = lines.word(k);
        double index = 0;
        if (!TextLines::parse(word.substr(0, word.find('/')), index) || index != std::floor(index) ||
            !(index >= 1) || index > static_cast<double>(out.vertices.size())) {
          return lines.bad("face corner " + in_quotes(word) + ", must be 1 to " +
                           std::to_string(out.vertices.size()));
        }
        corners.push_back(static_cast<std::uint32_t>(index) - 1);
      }
      if (corners.size() < 3)
        return lines.bad("a face of " + std::to_string(corners.size()) + " corners");
      for (std::size_t k = 2; k < corners.size(); ++k)
        out.triangles.push_back({corners[0], corners[k - 1], corners[k]});
    }
  }
  if (out.triangles.empty())
    return {Errc::invalid_file, source + ": there are no faces in the group " + in_quotes(group)};
  return out;
}

/// Adds `amount` times the offsets of a target to the vertices.
Status apply_target(const fs::path& path, double amount, BaseMesh& mesh) {
  const std::string source = path.string();
  if (!std::isfinite(amount))
    return {Errc::invalid_argument, source + ": MakeHumanOptions.targets: the amount is not finite"};
  const auto file = detail::read_file(path);
  if (!file) return file.status();
  TextLines lines(file->text(), source);
  while (lines.next()) {
    double v[4];
    for (std::size_t k = 0; k < 4; ++k) {
      if (Status s = lines.number(k, v[k]); !s) return s;
    }
    if (!(v[0] >= 0 && v[0] < static_cast<double>(mesh.vertices.size())) || v[0] != std::floor(v[0])) {
      return lines.bad("vertex " + in_quotes(lines.word(0)) + " of " +
                       std::to_string(mesh.vertices.size()));
    }
    mesh.vertices[static_cast<std::size_t>(v[0])] += Vec3d{v[1], v[2], v[3]} * amount;
  }
  return {};
}

/// Makes a skeleton from the bones of a `.mhskel`. A joint is at the mean of its bone's head vertices in
/// `mesh`.
Status read_skeleton(const Json& json, const std::string& source, const BaseMesh& mesh, Skeleton& out) {
  const auto bad = [&](const std::string& what) {
    return Status(Errc::invalid_file, source + ": " + what);
  };
  constexpr std::size_t kMostBones = 4096;
  const Json *bones = member(json, "bones"), *joints = member(json, "joints");
  if (bones == nullptr || joints == nullptr || !bones->is_object() || bones->empty() ||
      bones->size() > kMostBones) {
    return bad("there are no 'bones' and 'joints'");
  }
  std::map<std::string, Vec3d> heads;
  std::map<std::string, std::vector<std::string>> children;
  for (const auto& [name, bone] : bones->items()) {
    // The empty name stands for the parent of roots.
    if (name.empty()) return bad("a bone has no name");
    const Json *parent = member(bone, "parent"), *head = member(bone, "head");
    if (head == nullptr || !head->is_string()) return bad("bone " + in_quotes(name) + " has no 'head'");
    const Json* vertices = member(*joints, head->get<std::string>().c_str());
    if (vertices == nullptr || !vertices->is_array() || vertices->empty()) {
      return bad("bone " + in_quotes(name) + ": there is no joint " + shown(*head));
    }
    Vec3d sum{};
    for (const Json& v : *vertices) {
      const double i = v.is_number() ? v.get<double>() : -1.0;
      if (!(i >= 0 && i < static_cast<double>(mesh.vertices.size())) || i != std::floor(i)) {
        return bad("joint " + shown(*head) + " names vertex " + shown(v) + " of " +
                   std::to_string(mesh.vertices.size()));
      }
      sum += mesh.vertices[static_cast<std::size_t>(i)];
    }
    heads[name] = sum * (1.0 / static_cast<double>(vertices->size()));
    const std::string above =
        parent != nullptr && parent->is_string() ? parent->get<std::string>() : std::string();
    if (!above.empty() && !bones->contains(above))
      return bad("bone " + in_quotes(name) + " has the parent " + in_quotes(above) +
                 ", which is no bone");
    children[above].push_back(name);
  }
  std::vector<std::pair<std::string, std::int32_t>> open;
  for (const std::string& root : children[""]) open.emplace_back(root, -1);
  for (std::size_t at = 0; at < open.size(); ++at) {
    const auto [name, parent] = open[at];
    out.names.push_back(name);
    out.parents.push_back(parent);
    const Vec3d above = parent < 0 ? Vec3d{} : heads[open[static_cast<std::size_t>(parent)].first];
    out.rest_local.push_back({Mat3d::identity(), heads[name] - above});
    for (const std::string& child : children[name])
      open.emplace_back(child, static_cast<std::int32_t>(at));
  }
  if (open.size() != bones->size()) return bad("a bone is its own ancestor");
  return out.validate();
}

class WeightReader {
 public:
  WeightReader(const std::string& source, std::size_t vertices, const Skeleton& skeleton)
      : source_(source), skeleton_(skeleton), rows_(vertices) {}

  Status read(const Json& json) {
    const Json* all = member(json, "weights");
    if (all == nullptr || !all->is_object())
      return {Errc::invalid_file, source_ + ": there are no 'weights'"};
    for (const auto& [bone, list] : all->items()) {
      const int joint = skeleton_.find(bone);
      const std::string at = source_ + ": bone " + in_quotes(bone);
      if (joint < 0) return {Errc::invalid_file, at + " is not in the skeleton"};
      if (!list.is_array()) return {Errc::invalid_file, at + " has no list of weights"};
      for (const Json& pair : list) {
        const bool two =
            pair.is_array() && pair.size() == 2 && pair[0].is_number() && pair[1].is_number();
        const double v = two ? pair[0].get<double>() : -1, w = two ? pair[1].get<double>() : -1;
        if (!(v >= 0 && v < static_cast<double>(rows_.size())) || v != std::floor(v) || !(w >= 0) ||
            !std::isfinite(w)) {
          return {Errc::invalid_file,
                  at + ": " + pair.dump().substr(0, 60) + " is no vertex with a weight"};
        }
        if (w > 0) rows_[static_cast<std::size_t>(v)].emplace_back(static_cast<std::uint16_t>(joint), w);
      }
    }
    return {};
  }

  /// Sets the weights of the vertices `used`, divided by their sums. `places` are the positions of all
  /// vertices.
  Status finish(const std::vector<std::uint32_t>& used, const std::vector<Vec3d>& places,
                SkinnedMesh& mesh, SkinnedMeshReport& report) {
    std::vector<std::uint32_t> weighted;
    for (const std::uint32_t v : used) {
      if (!rows_[v].empty()) weighted.push_back(v);
    }
    if (weighted.empty())
      return {Errc::invalid_file, source_ + ": no vertex of the surface has a weight"};
    std::vector<const Row*> rows;
    for (const std::uint32_t v : used) {
      std::uint32_t from = v;
      if (rows_[v].empty()) {
        ++report.without_weights;
        double best = std::numeric_limits<double>::max();
        for (const std::uint32_t other : weighted) {
          const Vec3d d = places[other] - places[v];
          if (dot(d, d) < best) best = dot(d, d), from = other;
        }
      } else {
        double sum = 0.0;
        for (const auto& influence : rows_[v]) sum += influence.second;
        report.unequal_weights += std::fabs(sum - 1.0) > 1e-3 ? 1 : 0;
        report.least_weight_sum = std::min(report.least_weight_sum, sum);
        report.greatest_weight_sum = std::max(report.greatest_weight_sum, sum);
      }
      rows.push_back(&rows_[from]);
      mesh.influences = std::max(mesh.influences, rows_[from].size());
    }
    for (const Row* row : rows) {
      double sum = 0.0;
      for (const auto& influence : *row) sum += influence.second;
      for (std::size_t k = 0; k < mesh.influences; ++k) {
        mesh.joint_indices.push_back(k < row->size() ? (*row)[k].first : row->front().first);
        mesh.weights.push_back(k < row->size() ? static_cast<float>((*row)[k].second / sum) : 0.0f);
      }
    }
    return {};
  }

 private:
  using Row = std::vector<std::pair<std::uint16_t, double>>;
  const std::string& source_;
  const Skeleton& skeleton_;
  std::vector<Row> rows_;
};

Result<LoadedSkinnedMesh> load(const fs::path& path, const MakeHumanOptions& options) {
  if (!(options.scale > 0) || !std::isfinite(options.scale)) {
    return {Errc::invalid_argument, path.string() + ": MakeHumanOptions.scale must be positive"};
  }
  for (int k = 0; k < 3; ++k) {
    if (!(options.color[k] >= 0 && options.color[k] <= 1)) {
      return {Errc::invalid_argument, path.string() + ": MakeHumanOptions.color must be in [0, 1]"};
    }
  }
  auto base = read_base(path, options.group);
  if (!base) return base.status();
  for (const auto& [target, amount] : options.targets) {
    if (Status s = apply_target(target, amount, *base); !s) return s;
  }
  // Turn the body to face -Z, convert to metres, and put it on the floor.
  std::vector<std::uint32_t> used, place(base->vertices.size(), 0xffffffffu);
  double low = std::numeric_limits<double>::max();
  for (const auto& t : base->triangles) {
    for (const std::uint32_t v : t) {
      if (place[v] != 0xffffffffu) continue;
      place[v] = static_cast<std::uint32_t>(used.size());
      used.push_back(v);
      low = std::min(low, base->vertices[v].y);
    }
  }
  for (Vec3d& v : base->vertices) v = Vec3d{-v.x, v.y - low, -v.z} * options.scale;

  LoadedSkinnedMesh out;
  SkinnedMesh& mesh = out.mesh;
  mesh.name = path.stem().string();
  const auto bones = detail::load_json(options.skeleton, &options.limits);
  if (!bones) return bones.status();
  const std::string source = options.skeleton.string();
  if (Status s = read_skeleton(*bones, source, *base, mesh.skeleton); !s)
    return {Errc::invalid_file, s.message()};
  fs::path weights_path = options.weights;
  if (weights_path.empty()) {
    const Json* name = member(*bones, "weights_file");
    if (name == nullptr || !name->is_string())
      return {Errc::invalid_file, source + ": no 'weights_file', and MakeHumanOptions.weights is empty"};
    weights_path = options.skeleton.parent_path() / fs::path(name->get<std::string>()).filename();
  }
  const auto weights = detail::load_json(weights_path, &options.limits);
  if (!weights) return weights.status();
  const std::string weights_source = weights_path.string();
  WeightReader reader(weights_source, base->vertices.size(), mesh.skeleton);
  if (Status s = reader.read(*weights); !s) return s;
  if (Status s = reader.finish(used, base->vertices, mesh, out.report); !s) return s;
  for (const std::uint32_t v : used) mesh.positions.push_back(base->vertices[v]);
  for (const auto& t : base->triangles)
    mesh.triangles.push_back({place[t[0]], place[t[1]], place[t[2]]});
  mesh.materials.push_back({{linear_from_srgb(options.color.x), linear_from_srgb(options.color.y),
                             linear_from_srgb(options.color.z)},
                            0.0,
                            -1});
  out.pose = mesh.skeleton.rest_pose();
  SkinnedMeshReport& report = out.report;
  report.vertices = mesh.positions.size();
  report.triangles = mesh.triangles.size();
  if (report.unequal_weights != 0) {
    report.warnings.push_back("the weights of " + std::to_string(report.unequal_weights) +
                              " vertices do not sum to 1; they were divided by their sums");
  }
  if (report.without_weights != 0) {
    report.warnings.push_back(std::to_string(report.without_weights) +
                              " vertices without weights take those of the nearest");
  }
  if (Status s = mesh.validate(); !s) return detail::invalid_file(path, s.message());
  return out;
}

}  // namespace

Result<LoadedSkinnedMesh> load_makehuman(const fs::path& path, const MakeHumanOptions& options) {
  return detail::guarded(path.string(), [&] { return load(path, options); });
}

}  // namespace gsnav::io
