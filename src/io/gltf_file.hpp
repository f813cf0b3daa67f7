// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "file.hpp"
#include "gsnav/core/status.hpp"
#include "gsnav/math/mat.hpp"
#include "json.hpp"

namespace gsnav::io::detail {

/// Where a mesh of a glTF stands.
struct GltfInstance {
  std::size_t node = 0, mesh = 0;
  Affine3<double> world_from_mesh;
};

/// The values of an accessor where they lie; normalised integers become fractions.
class GltfValues {
 public:
  std::size_t size() const noexcept { return count_; }
  /// Component k of element i.
  double at(std::size_t i, std::size_t k) const noexcept;

 private:
  friend class GltfFile;
  std::size_t count_ = 0, components_ = 1, stride_ = 0;
  int type_ = 0;
  bool normalized_ = false;
  const std::byte* data_ = nullptr;
};

/// A glTF 2.0 file with its buffers: GLB, or JSON with buffers inside of it or beside it. Every index,
/// offset and size is checked against the bytes there are.
class GltfFile {
 public:
  static Result<GltfFile> open(const std::filesystem::path& path);
  /// The same for a GLB's or JSON's bytes, which must outlive it; `folder` has the other buffers.
  static Result<GltfFile> parse(std::span<const std::byte> bytes, const std::string& source,
                                const std::filesystem::path& folder);

  const Json& json() const noexcept { return json_; }
  const std::string& source() const noexcept { return source_; }
  /// Bytes of the file and its buffers: what an importer may multiply by a constant.
  std::size_t size() const noexcept { return size_; }

  /// Object `index` of the array `list`. Error: invalid_file.
  Result<const Json*> item(const char* list, std::size_t index) const;
  /// Bytes of a buffer view.
  Result<std::span<const std::byte>> view(std::size_t index) const;
  /// Values of an accessor with so many components, valid while the file is there.
  /// Errors: invalid_file; unsupported (sparse accessors, or one without a buffer view).
  Result<GltfValues> values(std::size_t accessor, std::size_t components) const;
  /// Values of an unsigned integer accessor of one component.
  Result<std::vector<std::uint32_t>> indices(std::size_t accessor) const;
  /// All meshes of the scene that the file shows first, or of all nodes where it has no scene.
  Result<std::vector<GltfInstance>> instances() const;

 private:
  Status fail(const std::string& what) const { return {Errc::invalid_file, source_ + ": " + what}; }
  Status read_chunks(std::span<const std::byte> bytes, std::span<const std::byte>& binary);
  Status read_buffers(std::span<const std::byte> binary, const std::filesystem::path& folder);
  Result<GltfValues> accessor(std::size_t index) const;
  Result<Affine3<double>> local_transform(const Json& node, const std::string& where) const;

  std::string source_;
  Json json_;
  FileBytes file_;                           ///< of open()
  std::vector<std::vector<std::byte>> own_;  ///< buffers out of other files or base64
  std::vector<std::span<const std::byte>> buffers_;
  std::size_t size_ = 0;
};

/// Member `key` of an object as an index; `absent` where it is none. Error: invalid_file.
Result<std::size_t> get_index(const Json& object, const char* key, std::size_t absent,
                              const std::string& where);

inline constexpr std::size_t kNoIndex = static_cast<std::size_t>(-1);

}  // namespace gsnav::io::detail
