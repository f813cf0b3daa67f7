// SPDX-License-Identifier: Apache-2.0
#include "file.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/io/image_file.hpp"
#include "npy_format.hpp"

namespace gsnav::io {
namespace {

template <class T>
Status save(const std::filesystem::path& path, std::span<const T> values,
            std::span<const std::size_t> shape) {
  return detail::guarded(path.string(), [&]() -> Status {
    const auto header =
        detail::npy_header(sizeof(T) == 4 ? "<f4" : "<f8", shape, values.size(), path.string());
    if (!header) return header.status();
    return replace_file(path, [&](OutputFile& out) {
      out.write(header->data(), header->size());
      out.write(values.data(), values.size_bytes());
    });
  });
}

}  // namespace

Status save_npy(const std::filesystem::path& path, std::span<const float> values,
                std::span<const std::size_t> shape) {
  return save(path, values, shape);
}

Status save_npy(const std::filesystem::path& path, std::span<const double> values,
                std::span<const std::size_t> shape) {
  return save(path, values, shape);
}

Result<NpyArray> load_npy(const std::filesystem::path& path) {
  return detail::with_file(
      path, [&](const auto& file) { return detail::parse_npy(file.span(), path.string()); });
}

}  // namespace gsnav::io
