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

/// The values of an accessor where they lie, in memory or in a file; normalised integers become
/// fractions.
class GltfValues {
 public:
  std::size_t size() const noexcept { return count_; }
  std::size_t components() const noexcept { return components_; }
  /// Elements [first, first + n) as [n][components]; `room` is scratch. False where reading failed.
  bool unpack(std::size_t first, std::size_t n, std::vector<std::byte>& room, double* out) const;

 private:
  friend class GltfFile;
  /// Bytes from the first of n elements to the end of the last.
  std::size_t extent(std::size_t n) const noexcept;

  std::size_t count_ = 0, components_ = 1, stride_ = 0;
  int type_ = 0;
  bool normalized_ = false;
  ByteSource bytes_;                             ///< from the first element on
  std::shared_ptr<std::vector<std::byte>> own_;  ///< what they are made of where the accessor is sparse
};

/// Numbers of an accessor, element after element, all finite.
struct GltfNumbers {
  std::vector<double> values;  ///< [count][width]; normalised integers as fractions
  std::size_t count = 0, width = 0;
  const double* row(std::size_t i) const noexcept { return values.data() + i * width; }
};

/// A glTF 2.0 file with its buffers: GLB, or JSON with buffers inside of it or beside it. Buffers stay
/// in their files and are read where they are asked for. Every index, offset and size is checked against
/// the bytes there are.
class GltfFile {
 public:
  /// Errors: file_not_found, invalid_file, unsupported (another version, a required extension that is
  /// not read), out_of_memory.
  static Result<GltfFile> open(const std::filesystem::path& path, const ReadLimits& limits = {});
  /// The same for a GLB's or JSON's bytes, which must outlive it; `folder` has the other buffers.
  static Result<GltfFile> parse(const ByteSource& bytes, const std::string& source,
                                const std::filesystem::path& folder, const ReadLimits& limits);

  const Json& json() const noexcept { return json_; }
  const std::string& source() const noexcept { return source_; }
  const ReadLimits& limits() const noexcept { return limits_; }
  /// Bytes of the file and its buffers: what an importer may multiply by a constant.
  std::size_t size() const noexcept { return size_; }

  /// Length of the array `list` ("nodes", "meshes", ...), 0 where there is none.
  std::size_t count(const char* list) const;
  /// How messages name object `index` of it: "a.glb: nodes[3]".
  std::string where(const char* list, std::size_t index) const;
  /// Object `index` of the array `list`. Error: invalid_file.
  Result<const Json*> item(const char* list, std::size_t index) const;
  /// Member `key` of `object`, which must be there, as an index below count(list). Error: invalid_file.
  Result<std::size_t> index(const Json& object, const char* key, const char* list,
                            const std::string& where) const;

  /// Bytes of a buffer view, in place or read into `room`.
  Result<std::span<const std::byte>> view(std::size_t index, std::vector<std::byte>& room) const;
  /// Bytes of a "uri": of a data URI, or of a file in this one's folder. Errors: invalid_file,
  /// file_not_found.
  Result<std::vector<std::byte>> uri_bytes(const std::string& uri, const std::string& where) const;
  /// Values of an accessor whose type is one of `types` ("VEC3 VEC4"), valid while the file is there.
  /// Errors: invalid_file; unsupported (neither sparse nor with a buffer view).
  Result<GltfValues> values(std::size_t accessor, const std::string& types) const;
  /// The same as numbers. Error besides: invalid_file (one that is not finite).
  Result<GltfNumbers> numbers(std::size_t accessor, const std::string& types) const;
  /// Values of an unsigned integer accessor of one component.
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
  std::vector<std::unique_ptr<RandomFile>> files_;  ///< of open(), and those of buffers
  std::vector<std::vector<std::byte>> own_;         ///< buffers out of base64
  std::vector<ByteSource> buffers_;
  std::size_t size_ = 0;
};

/// Member `key` of an object as an index; `absent` where it is none. Error: invalid_file.
Result<std::size_t> get_index(const Json& object, const char* key, std::size_t absent,
                              const std::string& where);

inline constexpr std::size_t kNoIndex = static_cast<std::size_t>(-1);

}  // namespace gsnav::io::detail
