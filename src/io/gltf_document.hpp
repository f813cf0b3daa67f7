// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "gsnav/core/status.hpp"
#include "gsnav/math/mat.hpp"
#include "json.hpp"

namespace gsnav::io::detail {

/// Numbers of an accessor, element after element.
struct GltfNumbers {
  std::vector<double> values;  ///< [count][width]; integers normalised where the file says so
  std::size_t count = 0, width = 0;
  const double* row(std::size_t i) const noexcept { return values.data() + i * width; }
};

/// A glTF 2.0 file (`.gltf` or `.glb`) with its buffers, which are read when they are first asked for: from the
/// `.glb`, from data URIs or from files beside it.
class GltfDocument {
 public:
  /// Errors: file_not_found, invalid_file, unsupported (another version, a required extension that changes
  /// how geometry is stored), out_of_memory.
  static Result<GltfDocument> open(const std::filesystem::path& path);

  const std::string& source() const noexcept { return source_; }
  const Json& json() const noexcept { return json_; }

  /// Entry `index` of the array `name` ("nodes", "meshes", ...); its place in the file, for messages, is
  /// where(name, index). Errors: invalid_file (there is none).
  Result<const Json*> entry(const char* name, std::size_t index) const;
  std::size_t count(const char* name) const;
  std::string where(const char* name, std::size_t index) const;
  /// Member `key` of `object` as an index below count(array). Errors: invalid_file.
  Result<std::size_t> index(const Json& object, const char* key, const char* array, const std::string& at) const;

  /// Reads an accessor whose type is one of `types` ("VEC3 VEC4"): strides, normalised integers, sparse
  /// ones. Errors name the accessor and what is wrong: invalid_file.
  Result<GltfNumbers> read(std::size_t accessor, const std::string& types);
  /// The bytes of a buffer view.
  Result<std::span<const std::byte>> view(std::size_t index);
  /// Bytes of a "uri" member: of a data URI, or of a file beside this one.
  Result<std::vector<std::byte>> uri_bytes(const std::string& uri, const std::string& at) const;

 private:
  Result<std::span<const std::byte>> buffer(std::size_t index);
  Status fill(const Json& accessor, std::size_t view, std::size_t offset, int component, std::size_t width,
              std::size_t count, bool normalized, const std::string& at, double* out);
  Status fill_sparse(const Json& sparse, int component, bool normalized, const std::string& at, GltfNumbers& out);

  std::filesystem::path folder_;
  std::string source_;
  Json json_;
  std::vector<std::byte> binary_;  // of a .glb
  std::map<std::size_t, std::vector<std::byte>> buffers_;
};

/// Translation, rotation and scale of a node, or its matrix.
struct GltfNode {
  Vec3d translation{}, scale{1, 1, 1};
  std::array<double, 4> rotation{0, 0, 0, 1};  ///< x, y, z, w
  bool has_matrix = false;
  Affine3<double> matrix{};

  Affine3<double> local() const;
};

/// All nodes with their parents (-1: none). Errors: invalid_file (a node with two parents or below itself,
/// numbers that are not finite).
struct GltfNodes {
  std::vector<GltfNode> nodes;
  std::vector<std::int64_t> parents;
  std::vector<std::size_t> order;  ///< parents before their children
  std::vector<std::string> names;

  /// Node to scene for each node.
  std::vector<Affine3<double>> globals() const;
};
Result<GltfNodes> read_nodes(const GltfDocument& file);

}  // namespace gsnav::io::detail
