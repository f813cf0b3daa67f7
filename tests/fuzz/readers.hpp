// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "io/avatar_npz.hpp"
#include "io/glb_file.hpp"
#include "io/sog_file.hpp"
#include "support/files.hpp"
#include "zip.hpp"

// What both the fuzzer and the maker of its seeds know: how an input becomes a file. Checksums and
// compression would keep mutations from the parsers behind them, so that inputs of packed formats begin
// with a byte that says what the rest is: 0 the file itself, k the content of its part k - 1, the others
// being as the tests build them.

namespace gsnav_fuzz {

using namespace gsnav_test;

/// Parts of a zip archive by name.
using Parts = std::map<std::string, std::string>;

inline Parts sog_parts() {
  SogFile file(2);
  file.make_files();
  return file.files;
}

/// The entries of the npz that tests make of these arrays.
inline Parts npz_parts(const TestArrays& arrays) {
  TempFolder folder("fuzz_parts");
  write_npz(folder / "a.npz", arrays);
  const std::string text = read_file(folder / "a.npz");
  const auto zip = gsnav::io::detail::ZipReader::open(bytes_of(text), "a.npz").value();
  Parts out;
  for (const std::string& name : zip.names()) {
    const auto content = zip.read(name).value();
    out[name].assign(reinterpret_cast<const char*>(content.data()), content.size());
  }
  return out;
}

inline Parts avatar_parts() { return npz_parts(avatar_arrays(3, 24)); }

inline Parts driver_parts() {
  TestArrays arrays;
  arrays["joint_mats"] = identities(6);
  arrays["joint_mats"].shape = {2, 3, 4, 4};
  arrays["joint_mats_fps"] = {{1}, {30}};
  return npz_parts(arrays);
}

inline std::string zip_of(const Parts& parts) {
  std::vector<ZipFileEntry> entries;
  for (const auto& [name, content] : parts) entries.push_back({name, content, false});
  return make_zip(entries);
}

/// The archive that an input stands for.
inline std::string zip_of(const Parts& parts, const std::string& input) {
  if (input.empty() || input[0] == '\0') return input.substr(input.empty() ? 0 : 1);
  Parts changed = parts;
  const std::size_t part = (static_cast<unsigned char>(input[0]) - 1u) % parts.size();
  auto it = changed.begin();
  std::advance(it, static_cast<std::ptrdiff_t>(part));
  it->second = input.substr(1);
  return zip_of(changed);
}

/// Buffer of the glTF seeds.
inline GlbFile gltf_file() {
  GlbFile file;
  file.degree = 1;
  file.rows = random_rows(3, 9, 2);
  return file;
}

}  // namespace gsnav_fuzz
