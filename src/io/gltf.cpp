// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/io/gltf.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cloud_fill.hpp"
#include "described.hpp"
#include "file.hpp"
#include "gltf_nodes.hpp"
#include "gsnav/detail/io/spz.hpp"
#include "gsnav/detail/math/curves.hpp"
#include "gsnav/detail/scene/edit_cloud.hpp"
#include "report_sum.hpp"

namespace gsnav::io {
namespace {

using detail::GltfFile;
using detail::GltfInstance;
using detail::GltfValues;
using detail::Json;
using detail::member;

constexpr const char* kExtension = "KHR_gaussian_splatting";
constexpr const char* kSpzExtension = "KHR_gaussian_splatting_compression_spz_2";

class SplatReader {
 public:
  SplatReader(const GltfFile& file, const LoadGltfOptions& options) : file_(file), options_(options) {}

  Result<LoadedCloud> run() {
    const auto instances = detail::read_instances(file_);
    if (!instances) return instances.status();
    LoadedCloud out;
    out.report.source = file_.source();
    out.cloud.sort_order = SortOrder::camera_distance;
    for (const GltfInstance& instance : *instances) {
      if (Status s = read_mesh(instance, out); !s) return s;
    }
    if (primitives_ == 0) {
      return {Errc::invalid_file, file_.source() + ": no primitive with " + kExtension};
    }
    return out;
  }

 private:
  Status read_mesh(const GltfInstance& instance, LoadedCloud& out) {
    const auto mesh = file_.item("meshes", instance.mesh);
    if (!mesh) return mesh.status();
    const Json& node = **file_.item("nodes", instance.node);
    const Json* name = member(node, "name");
    const std::string where =
        file_.source() + ": node " + std::to_string(instance.node) +
        (name != nullptr && name->is_string() ? " " + detail::shown(*name) : std::string());
    const Json* primitives = member(**mesh, "primitives");
    if (primitives == nullptr || !primitives->is_array()) {
      return {Errc::invalid_file, where + ": its mesh has no 'primitives'"};
    }
    for (const Json& primitive : *primitives) {
      const Json* extensions = member(primitive, "extensions");
      const Json* splats = extensions == nullptr ? nullptr : member(*extensions, kExtension);
      if (splats == nullptr) continue;
      ++primitives_;
      auto part = read_primitive(primitive, *splats, where);
      if (part) {
        part->cloud.sort_order = SortOrder::camera_distance;
        if (Status s = move(*part, instance.world_from_mesh, where); !s) return s;
        if (primitives_ == 1) out.cloud.filter = part->cloud.filter;
      }
      if (Status s = detail::merge_loaded(out, std::move(part), where); !s) return s;
    }
    return {};
  }

  Status move(LoadedCloud& part, const Affine3<double>& world_from_mesh,
              const std::string& where) const {
    const Similarity axes =
        options_.keep_axes ? Similarity{} : Similarity{{0, 0, 0, 1}, {}, 1};  // half a turn about z
    Similarity world;
    if (detail::as_similarity(world_from_mesh, world)) {
      world = axes * world;
      if (world.rotation.w == 1 && world.translation == Vec3d{} && world.scale == 1) return {};
      transform(part.cloud, world);
    } else {
      const Affine3<double> turn{rotation_matrix(axes.rotation), {}};
      if (Status s = transform(part.cloud, turn * world_from_mesh); !s) {
        return {Errc::unsupported,
                where + ": its transform with those above it cannot be applied to Gaussians: " +
                    s.message() + "; give its 'scale' or 'matrix' three stretches above 0"};
      }
    }
    part.report.bounds = {};
    for (std::size_t i = 0; i < part.cloud.size(); ++i) part.report.bounds.add(part.cloud.mean(i));
    return {};
  }

  Result<LoadedCloud> read_primitive(const Json& primitive, const Json& splats,
                                     const std::string& where) {
    const Json *kernel = member(splats, "kernel"), *space = member(splats, "colorSpace"),
               *sorting = member(splats, "sortingMethod");
    if (kernel == nullptr || space == nullptr) {
      return {Errc::invalid_file, where + ": " + kExtension + " lacks 'kernel' or 'colorSpace'"};
    }
    if (*kernel != "ellipse" || (sorting != nullptr && *sorting != "cameraDistance")) {
      return {Errc::unsupported, where + ": kernel " + detail::shown(*kernel) +
                                     " or its sorting is not read, only 'ellipse' by 'cameraDistance'"};
    }
    const Json* nested = member(splats, "extensions");
    const Json* spz = nested == nullptr ? nullptr : member(*nested, kSpzExtension);
    auto out = spz != nullptr ? read_spz(*spz, where) : read_attributes(primitive, where);
    if (out && *space == "lin_rec709_display") {
      out->cloud.color_space = ColorSpace::linear;
      out->report.warnings.push_back(
          "colours are in linear light (lin_rec709_display), which only .glb can keep");
    } else if (out && *space != "srgb_rec709_display") {
      out->report.warnings.push_back("colours of space " + detail::shown(*space) +
                                     " are read as if they were srgb_rec709_display");
    }
    return out;
  }

  Result<LoadedCloud> read_spz(const Json& spz, const std::string& where) const {
    if (!options_.spz_compression) {
      return {Errc::unsupported, where + ": compressed by " + kSpzExtension +
                                     ", a draft; LoadGltfOptions::spz_compression reads it"};
    }
    const auto view = detail::get_index(spz, "bufferView", detail::kNoIndex, where);
    if (!view) return view.status();
    std::vector<std::byte> scratch;
    const auto bytes = file_.view(*view, scratch);
    if (!bytes) return bytes.status();
    return parse_spz(*bytes, where, {.keep_axes = true});
  }

  /// Reads attribute `name`. The first attribute of a primitive determines the number of rows.
  Status read(const Json& attributes, const std::string& name, const char* type,
              const std::string& where, GltfValues& out) {
    const auto index = detail::get_index(attributes, name.c_str(), detail::kNoIndex, where);
    if (!index) return index.status();
    if (*index == detail::kNoIndex) return {Errc::invalid_file, where + ": no attribute '" + name + "'"};
    const auto values = file_.values(*index, type);
    if (!values) return {values.code(), where + ": attribute '" + name + "': " + values.message()};
    if (name == "POSITION") {
      count_ = values->size();
      total_ += count_;
      // Nodes may share a mesh, so a small file could ask for any number of copies.
      if (total_ > file_.size()) {
        return {Errc::invalid_file, where + ": more Gaussians than the file has bytes"};
      }
    }
    if (values->size() != count_) {
      return {Errc::invalid_file, where + ": attribute '" + name + "' has " +
                                      std::to_string(values->size()) + " elements, POSITION has " +
                                      std::to_string(count_)};
    }
    out = *values;
    return {};
  }

  Result<LoadedCloud> read_attributes(const Json& primitive, const std::string& where) {
    const Json* attributes = member(primitive, "attributes");
    if (attributes == nullptr) return {Errc::invalid_file, where + ": a primitive without 'attributes'"};
    const std::string prefix = std::string(kExtension) + ":";
    GltfValues means, quats, scales, opacities;
    if (Status s = read(*attributes, "POSITION", "VEC3", where, means); !s) return s;
    if (Status s = read(*attributes, prefix + "ROTATION", "VEC4", where, quats); !s) return s;
    if (Status s = read(*attributes, prefix + "SCALE", "VEC3", where, scales); !s) return s;
    if (Status s = read(*attributes, prefix + "OPACITY", "SCALAR", where, opacities); !s) return s;
    int degree = 0;
    const auto sh = [&prefix](int band, int coefficient) {
      return prefix + "SH_DEGREE_" + std::to_string(band) + "_COEF_" + std::to_string(coefficient);
    };
    while (degree < kMaxShDegree && member(*attributes, sh(degree + 1, 0).c_str()) != nullptr) ++degree;
    std::vector<GltfValues> bands;
    for (int band = 0; band <= degree; ++band) {
      for (int k = 0; k <= 2 * band; ++k) {
        bands.emplace_back();
        if (Status s = read(*attributes, sh(band, k), "VEC3", where, bands.back()); !s) return s;
      }
    }
    std::vector<const GltfValues*> planes = {&means, &quats, &scales, &opacities};
    for (const GltfValues& band : bands) planes.push_back(&band);
    std::atomic<std::size_t> negative{0};
    const auto decode = [&](std::size_t first, std::size_t last, detail::CloudSink& sink) -> Status {
      std::vector<std::byte> scratch;
      std::vector<std::vector<double>> block(planes.size());
      for (std::size_t row = first; row < last; row += detail::kRowsAtOnce) {
        const std::size_t n = std::min(detail::kRowsAtOnce, last - row);
        for (std::size_t p = 0; p < planes.size(); ++p) {
          block[p].resize(detail::kRowsAtOnce * planes[p]->components());
          if (!planes[p]->unpack(row, n, scratch, block[p].data())) return detail::reading_failed(where);
        }
        for (std::size_t i = 0; i < n; ++i) add(block, i, sink);
        const double* const s = block[2].data();
        for (std::size_t i = 0; i < n; ++i)
          negative += s[3 * i] < 0 || s[3 * i + 1] < 0 || s[3 * i + 2] < 0 ? 1 : 0;
      }
      return {};
    };
    auto out = detail::fill_cloud(count_, degree, where, decode);
    if (out && negative != 0) {
      out->report.warnings.push_back(
          where + ": SCALE of " + std::to_string(negative) +
          " Gaussians is negative; an ellipsoid has no such side, so the sign is left out");
    }
    return out;
  }

  /// Adds row i of the blocks: means, quaternions (x y z w), scales, opacities and SH coefficients.
  static void add(const std::vector<std::vector<double>>& block, std::size_t i,
                  detail::CloudSink& sink) {
    std::array<float, 45> rest;
    RawGaussian raw;
    raw.shN = rest.data();
    for (std::size_t k = 0; k < 3; ++k) {
      const int axis = static_cast<int>(k);
      raw.mean[axis] = block[0][3 * i + k];
      raw.log_scales[axis] = std::log(std::fabs(block[2][3 * i + k]));
      raw.sh0[k] = static_cast<float>(block[4][3 * i + k]);
      for (std::size_t b = 5; b < block.size(); ++b) {
        rest[3 * (b - 5) + k] = static_cast<float>(block[b][3 * i + k]);
      }
    }
    raw.opacity_logit = logit(block[3][i]);  // NaN outside of [0, 1], so the row is dropped
    const double* q = &block[1][4 * i];
    raw.quat = {q[3], q[0], q[1], q[2]};
    sink.add(raw);
  }

  const GltfFile& file_;
  const LoadGltfOptions& options_;
  std::size_t primitives_ = 0, count_ = 0, total_ = 0;
};

}  // namespace

bool gltf_holds_gaussians(const std::filesystem::path& path) {
  detail::RandomFile file;
  if (!file.open(path)) return false;
  std::array<char, 20> front{};  // start of a GLB: its header and that of its first chunk, the JSON
  std::uint64_t from = 0, size = file.size();
  if (size >= front.size() && file.read(0, std::as_writable_bytes(std::span(front))) &&
      std::memcmp(front.data(), "glTF", 4) == 0) {
    std::uint32_t length = 0;
    std::memcpy(&length, front.data() + 12, sizeof length);
    from = front.size();
    size = std::min<std::uint64_t>(length, size - from);
  }
  std::string json(size, '\0');
  return file.read(from, std::as_writable_bytes(std::span(json))) &&
         json.find(kExtension) != std::string::npos;
}

Result<LoadedCloud> load_gltf(const std::filesystem::path& path, const LoadGltfOptions& options) {
  return detail::guarded(path.string(), [&]() -> Result<LoadedCloud> {
    const auto file = GltfFile::open(path, options.limits);
    if (!file) return file.status();
    return detail::described(SplatReader(*file, options).run(),
                             options.keep_axes ? Vec3d{0, 1, 0} : Vec3d{0, -1, 0});
  });
}

Result<LoadedCloud> parse_gltf(std::span<const std::byte> bytes, std::string source,
                               const LoadGltfOptions& options) {
  return detail::guarded(source, [&]() -> Result<LoadedCloud> {
    const auto file = GltfFile::parse(bytes, source, {}, options.limits);
    if (!file) return file.status();
    return detail::described(SplatReader(*file, options).run(),
                             options.keep_axes ? Vec3d{0, 1, 0} : Vec3d{0, -1, 0});
  });
}

}  // namespace gsnav::io
