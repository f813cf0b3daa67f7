// SPDX-License-Identifier: Apache-2.0
#include <utility>
#include <variant>

#include "file.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/detail/io/npz_file.hpp"
#include "npy_format.hpp"
#include "zip.hpp"
#include "zip_writer.hpp"

namespace gsnav::io {
namespace {

// Constant poses and weights that are mostly zero compress by more than the factor of 100 that is enough
// for images and text.
constexpr std::uint64_t kSlack = std::uint64_t{256} << 20;
constexpr std::string_view kSuffix = ".npy";

/// An entry as the bytes of an .npy file.
Result<std::string> npy_bytes(const NpzEntry& entry, const std::string& name) {
  return std::visit(
      [&](const auto& values) -> Result<std::string> {
        using Values = std::decay_t<decltype(values)>;
        if constexpr (std::is_same_v<Values, std::string>) {
          // NumPy has no strings of length 0
          const std::string text = values.empty() ? std::string(1, '\0') : values;
          auto header = detail::npy_header("|S" + std::to_string(text.size()), {}, 1, name);
          if (!header) return header;
          return *header + text;
        } else {
          using T = std::remove_cv_t<typename Values::element_type>;
          const char* descr = std::is_same_v<T, float>    ? "<f4"
                              : std::is_same_v<T, double> ? "<f8"
                                                          : "<i8";
          auto header = detail::npy_header(descr, entry.shape, values.size(), name);
          if (!header) return header;
          std::string out = std::move(*header);
          if (!values.empty())
            out.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
          return out;
        }
      },
      entry.values);
}

}  // namespace

struct NpzFile::Impl {
  detail::FileBytes file;
  std::string source;
  detail::ZipReader zip;

  Result<std::vector<std::byte>> bytes(const std::string& name) const {
    const std::string entry = name + std::string(kSuffix);
    if (!zip.contains(entry)) return {Errc::invalid_file, source + ": there is no array '" + name + "'"};
    return zip.read(entry, kSlack);
  }
};

Result<NpzFile> NpzFile::open(const std::filesystem::path& path) {
  return detail::guarded(path.string(), [&]() -> Result<NpzFile> {
    auto file = detail::read_file(path);
    if (!file) return file.status();
    auto impl = std::make_shared<Impl>();
    impl->file = std::move(*file);
    impl->source = path.string();
    auto zip = detail::ZipReader::open(impl->file.span(), impl->source);
    if (!zip) return zip.status();
    impl->zip = std::move(*zip);
    NpzFile out;
    out.impl_ = std::move(impl);
    return out;
  });
}

const std::string& NpzFile::source() const noexcept { return impl_->source; }

std::vector<std::string> NpzFile::names() const {
  std::vector<std::string> out;
  for (const std::string& name : impl_->zip.names()) {
    if (name.ends_with(kSuffix)) out.push_back(name.substr(0, name.size() - kSuffix.size()));
  }
  return out;
}

bool NpzFile::contains(const std::string& name) const {
  return impl_->zip.contains(name + std::string(kSuffix));
}

Result<NpyArray> NpzFile::read(const std::string& name) const {
  const std::string what = impl_->source + ": " + name;
  return detail::guarded(what, [&]() -> Result<NpyArray> {
    const auto bytes = impl_->bytes(name);
    if (!bytes) return bytes.status();
    return detail::parse_npy(*bytes, what);
  });
}

Result<std::string> NpzFile::read_text(const std::string& name) const {
  const std::string what = impl_->source + ": " + name;
  return detail::guarded(what, [&]() -> Result<std::string> {
    const auto bytes = impl_->bytes(name);
    if (!bytes) return bytes.status();
    const auto layout = detail::parse_npy_header(*bytes, what);
    if (!layout) return layout.status();
    const bool wide = layout->descr.starts_with("<U");
    const std::size_t held = bytes->size() - layout->values_at, unit = wide ? 4 : 1;
    if (!wide && !layout->descr.starts_with("|S")) {
      return {Errc::invalid_file, what + ": type " + detail::in_quotes(layout->descr) + " is no text"};
    }
    const auto count = detail::npy_count(layout->shape);
    if (!count || *count != 1 || std::to_string(held / unit) != layout->descr.substr(2) ||
        held % unit != 0) {
      return {Errc::invalid_file, what + ": " + layout->dictionary + " is not one text of " +
                                      std::to_string(held) + " bytes"};
    }
    std::string text;
    for (std::size_t i = 0; i < held; i += unit) {
      const std::byte* p = bytes->data() + layout->values_at + i;
      const std::uint32_t c =
          wide ? detail::load_le<std::uint32_t>(p) : detail::load_le<std::uint8_t>(p);
      text += c < 128 ? static_cast<char>(c) : '?';
    }
    text.resize(text.find_last_not_of('\0') + 1);  // padding
    return text;
  });
}

Status save_npz(const std::filesystem::path& path, std::span<const NpzEntry> entries, bool deflated) {
  return detail::guarded(path.string(), [&]() -> Status {
    detail::ZipWriter zip(path.string());
    for (const NpzEntry& entry : entries) {
      const auto bytes = npy_bytes(entry, path.string() + ": " + entry.name);
      if (!bytes) return bytes.status();
      if (Status s = zip.add(entry.name + std::string(kSuffix), *bytes, deflated); !s) return s;
    }
    const std::string directory = zip.finish();
    return replace_file(path, [&](OutputFile& out) {
      out.write(zip.entries());
      out.write(directory);
    });
  });
}

}  // namespace gsnav::io
