// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/io/mesh_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <string_view>

#include "file.hpp"
#include "gsnav/core/replace_file.hpp"
#include "gsnav/core/text.hpp"

namespace gsnav::io {
namespace {

using detail::in_quotes;

std::string_view take_word(std::string_view& line) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!line.empty() && blank(line.front())) line.remove_prefix(1);
  std::size_t n = 0;
  while (n < line.size() && !blank(line[n])) ++n;
  const std::string_view word = line.substr(0, n);
  line.remove_prefix(n);
  return word;
}

/// Parses the whole of `word` as one number. Returns false if it is anything else.
template <class T>
bool parse(std::string_view word, T& value) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return !word.empty() && error == std::errc{} && end == word.data() + word.size();
}

class ObjParser {
 public:
  explicit ObjParser(const std::string& source) : source_(source) {}

  Result<TriangleMesh> run(std::string_view text) {
    for (std::size_t at = 0; at < text.size();) {
      ++line_number_;
      const std::size_t end = std::min(text.find('\n', at), text.size());
      std::string_view line = text.substr(at, end - at);
      at = end + 1;
      const std::string_view word = take_word(line);
      Status s;
      if (word == "v") s = vertex(line);
      if (word == "f") s = face(line);
      if (!s) return s;
    }
    return std::move(mesh_);
  }

 private:
  Status fail(const std::string& what) const {
    return {Errc::invalid_file, source_ + ": line " + std::to_string(line_number_) + ": " + what};
  }

  Status vertex(std::string_view line) {
    Vec3f v;
    for (int k = 0; k < 3; ++k) {
      const std::string_view word = take_word(line);
      double value = 0;
      if (!parse(word, value) || !std::isfinite(static_cast<float>(value))) {
        return fail(std::string("coordinate ") + "xyz"[k] + " is " + in_quotes(word) +
                    ", no finite number");
      }
      v[k] = static_cast<float>(value);
    }
    mesh_.vertices.push_back(v);  // a weight or a colour may follow; ignore it
    return {};
  }

  Status face(std::string_view line) {
    std::uint32_t first = 0, last = 0;
    int corners = 0;
    for (std::string_view word = take_word(line); !word.empty(); word = take_word(line), ++corners) {
      const std::int64_t count = static_cast<std::int64_t>(mesh_.vertices.size());
      std::int64_t index = 0;
      if (word.front() == '#') break;
      if (!parse(word.substr(0, word.find('/')), index) || index == 0 || index > count ||
          index < -count) {
        return fail("face corner " + in_quotes(word) + ", must be 1 to " + std::to_string(count) +
                    " or -1 to -" + std::to_string(count));
      }
      const auto corner = static_cast<std::uint32_t>(index > 0 ? index - 1 : count + index);
      if (corners == 0) first = corner;
      if (corners >= 2) mesh_.triangles.push_back({first, last, corner});
      last = corner;
    }
    if (corners < 3) return fail("a face of " + std::to_string(corners) + " corners, must be 3 or more");
    return {};
  }

  const std::string& source_;
  TriangleMesh mesh_;
  std::size_t line_number_ = 0;
};

}  // namespace

Result<TriangleMesh> load_obj(const std::filesystem::path& path) {
  const std::string source = path.string();
  return detail::with_file(path, [&](const auto& file) { return ObjParser(source).run(file.text()); });
}

namespace {

std::string extension_of(const std::filesystem::path& path) {
  return lower_case(path.extension().string());
}

bool is_gltf(const std::string& extension) { return extension == ".glb" || extension == ".gltf"; }

}  // namespace

Status save_obj(const std::filesystem::path& path, std::span<const Vec3d> vertices,
                std::span<const std::array<std::uint32_t, 3>> triangles) {
  const auto refuse = [&](const char* what, std::size_t index, const char* why) -> Status {
    return {Errc::invalid_argument, path.string() + ": " + what + " " + std::to_string(index) + why};
  };
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (!is_finite(vertices[i])) return refuse("vertex", i, " is not finite");
  }
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (const std::uint32_t v : triangles[i]) {
      if (v >= vertices.size()) return refuse("triangle", i, " names a vertex that there is not");
    }
  }
  return replace_file(path, [&](OutputFile& file) {
    // to_chars writes the shortest text that is read back as the same float32, in every locale.
    char line[128];
    for (const Vec3d& v : vertices) {
      char* at = line;
      *at++ = 'v';
      for (int k = 0; k < 3; ++k) {
        *at++ = ' ';
        at = std::to_chars(at, std::end(line), static_cast<float>(v[k])).ptr;
      }
      *at++ = '\n';
      file.write(line, static_cast<std::size_t>(at - line));
    }
    for (const std::array<std::uint32_t, 3>& t : triangles) {
      char* at = line;
      *at++ = 'f';
      for (const std::uint32_t v : t) {
        *at++ = ' ';
        at = std::to_chars(at, std::end(line), std::uint64_t{v} + 1).ptr;
      }
      *at++ = '\n';
      file.write(line, static_cast<std::size_t>(at - line));
    }
  });
}

Result<TriangleMesh> load_mesh(const std::filesystem::path& path, const ReadLimits& limits) {
  const std::string extension = extension_of(path);
  if (extension == ".obj") return load_obj(path);
  if (extension == ".ply") return load_ply_mesh(path);
  if (is_gltf(extension)) return load_gltf_mesh(path, limits);
  return {Errc::unsupported,
          path.string() + ": not a mesh that is read here: .obj, .ply, .glb or .gltf"};
}

Result<TexturedScene> load_textured_scene(const std::filesystem::path& path, const ReadLimits& limits) {
  if (is_gltf(extension_of(path))) return load_gltf_scene(path, limits);
  auto mesh = load_mesh(path, limits);
  if (!mesh) return mesh.status();
  TexturedScene out;
  out.parts.emplace_back().geometry = std::move(*mesh);
  out.instances.emplace_back();
  return out;
}

}  // namespace gsnav::io
