// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "file.hpp"
#include "gsnav/core/status.hpp"
#include "json.hpp"

namespace gsnav::io::detail {

/// The values of an accessor, read from memory or a file on demand. Normalised integers become
/// fractions.
class GltfValues {
 public:
  std::size_t size() const noexcept { return count_; }
  std::size_t components() const noexcept { return components_; }
  /// Reads elements [first, first + n) as [n][components]; `scratch` is memory to work in. Returns false
  /// if reading failed.
  bool unpack(std::size_t first, std::size_t n, std::vector<std::byte>& scratch, double* out) const;

 private:
  friend class GltfFile;
  /// Bytes from the start of the first of n elements to the end of the last.
  std::size_t extent(std::size_t n) const noexcept;

  std::size_t count_ = 0, components_ = 1, stride_ = 0;
  int type_ = 0;
  bool normalized_ = false;
  ByteSource bytes_;                             ///< Bytes from the first element on.
  std::shared_ptr<std::vector<std::byte>> own_;  ///< The storage of a sparse accessor's values, else
                                                 ///< null.
};

/// The values of an accessor in memory, all finite.
struct GltfNumbers {
  std::vector<double> values;  ///< [count][width]; normalised integers as fractions.
  std::size_t count = 0, width = 0;
  const double* row(std::size_t i) const noexcept { return values.data() + i * width; }
};

/// A glTF 2.0 file with its buffers: GLB, or JSON with buffers inside or next to it. Buffers stay in
/// their files and are read on demand. Every index, offset and size is checked against the data.
class GltfFile {
 public:
  /// Opens a file. Errors: file_not_found, invalid_file, unsupported (another version, or a required
  /// extension that is not read), out_of_memory.
  static Result<GltfFile> open(const std::filesystem::path& path, const ReadLimits& limits = {});
  /// Opens the bytes of a GLB or JSON, which must outlive this object. Other buffers are files in
  /// `folder`.
  static Result<GltfFile> parse(const ByteSource& bytes, const std::string& source,
                                const std::filesystem::path& folder, const ReadLimits& limits);

  const Json& json() const noexcept { return json_; }
  const std::string& source() const noexcept { return source_; }
  const ReadLimits& limits() const noexcept { return limits_; }
  /// Bytes of the file and its buffers. The memory of an importer may be a constant times this.
  std::size_t size() const noexcept { return size_; }

  /// Length of the array `list` ("nodes", "meshes", ...); 0 if there is none.
  std::size_t count(const char* list) const;
  /// How messages name entry `index` of a list: "a.glb: nodes[3]".
  std::string where(const char* list, std::size_t index) const;
  /// Entry `index` of the array `list`. Error: invalid_file.
  Result<const Json*> item(const char* list, std::size_t index) const;
  /// Member `key` of `object`, which must exist, as an index below count(list). Error: invalid_file.
  Result<std::size_t> index(const Json& object, const char* key, const char* list,
                            const std::string& where) const;

  /// Bytes of a buffer view, in place or read into `scratch`.
  Result<std::span<const std::byte>> view(std::size_t index, std::vector<std::byte>& scratch) const;
  /// Bytes of a "uri": a data URI, or a file in this file's folder. Errors: invalid_file,
  /// file_not_found.
  Result<std::vector<std::byte>> uri_bytes(const std::string& uri, const std::string& where) const;
  /// Values of an accessor whose type is one of `types` ("VEC3 VEC4"). Valid while this object lives.
  /// Errors: invalid_file; unsupported (an accessor that has no buffer view and is not sparse).
  Result<GltfValues> values(std::size_t accessor, const std::string& types) const;
  /// Values of an accessor as numbers. Errors: those of values; invalid_file (a number that is not
  /// finite).
  Result<GltfNumbers> numbers(std::size_t accessor, const std::string& types) const;
  /// Values of an accessor of unsigned integers with one component.
  Result<std::vector<std::uint32_t>> indices(std::size_t accessor) const;

 private:
  Status fail(const std::string& what) const { return {Errc::invalid_file, source_ + ": " + what}; }
  Status read_chunks(const ByteSource& bytes, ByteSource& binary);
  Status check_asset() const;
  Status read_buffers(const ByteSource& binary);
  Result<ByteSource> external_buffer(const std::string& uri, const std::string& where);
  Result<std::filesystem::path> beside(const std::string& uri, const std::string& where) const;
  Result<ByteSource> find_view(std::size_t index) const;
  Status locate(const Json& part, const std::string& where, GltfValues& values) const;
  Status apply_sparse(const Json& sparse, const std::string& where, GltfValues& values) const;

  ReadLimits limits_;
  std::filesystem::path folder_;
  std::string source_;
  Json json_;
  std::vector<std::unique_ptr<RandomFile>> files_;  ///< Files of open(), and of buffers.
  std::vector<std::vector<std::byte>> own_;         ///< Buffers decoded from base64.
  std::vector<ByteSource> buffers_;
  std::size_t size_ = 0;
};

/// Member `key` of an object as an index, or `absent` if there is none. Error: invalid_file.
Result<std::size_t> get_index(const Json& object, const char* key, std::size_t absent,
                              const std::string& where);

inline constexpr std::size_t kNoIndex = static_cast<std::size_t>(-1);

}  // namespace gsnav::io::detail
