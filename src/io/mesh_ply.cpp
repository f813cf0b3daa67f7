// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include "file.hpp"
#include "gsnav/detail/io/mesh_file.hpp"
#include "ply_body.hpp"

namespace gsnav::io {
namespace {

using detail::kPlyBlock;
using detail::PlyBody;
using detail::PlyElement;
using detail::PlyProperty;

class PlyMeshReader {
 public:
  PlyMeshReader(std::span<const std::byte> bytes, const detail::PlyHeader& header,
                const std::string& source)
      : header_(header), source_(source), body_(bytes, header) {}

  Result<TriangleMesh> run() {
    for (const PlyElement& e : header_.elements) {
      Status s;
      if (e.name == "vertex") {
        s = vertices(e);
      } else if (e.name == "face") {
        s = faces(e);
      } else if (const std::uint64_t rows = body_.skip(e); rows != e.count) {
        s = detail::ply_rows_missing(source_, e, rows);
      }
      if (!s) return s;
    }
    if (!has_vertices_ || !has_faces_) return fail("a mesh needs the elements 'vertex' and 'face'");
    return std::move(mesh_);
  }

 private:
  Status fail(const std::string& what) const { return {Errc::invalid_file, source_ + ": " + what}; }

  Status vertices(const PlyElement& e) {
    has_vertices_ = true;
    std::vector<const PlyProperty*> axes;
    for (const char* name : {"x", "y", "z"}) {
      axes.push_back(e.find(name));
      if (axes.back() == nullptr || axes.back()->is_list) {
        return fail(std::string("element 'vertex' has no property '") + name + "'");
      }
    }
    if (e.has_list) return {Errc::unsupported, source_ + ": element 'vertex' has a list property"};
    if (const std::uint64_t rows = body_.available(e); rows < e.count) {
      return detail::ply_rows_missing(source_, e, rows);
    }
    const std::size_t count = static_cast<std::size_t>(e.count);
    mesh_.vertices.reserve(count);
    std::vector<double> block(3 * kPlyBlock);
    for (std::size_t row = 0; row < count; row += kPlyBlock) {
      const std::size_t n = std::min(kPlyBlock, count - row);
      const std::size_t there = body_.read(e, axes, n, block.data());
      if (there != n) return detail::ply_rows_missing(source_, e, row + there);
      for (std::size_t i = 0; i < n; ++i) {
        Vec3f v;
        for (std::size_t k = 0; k < 3; ++k) {
          const float value = static_cast<float>(block[k * kPlyBlock + i]);
          if (!std::isfinite(value)) {
            return fail("vertex " + std::to_string(row + i) + ": " + "xyz"[k] + " is no finite number");
          }
          v[static_cast<int>(k)] = value;
        }
        mesh_.vertices.push_back(v);
      }
    }
    return {};
  }

  Status faces(const PlyElement& e) {
    has_faces_ = true;
    if (!has_vertices_) return fail("element 'face' comes before element 'vertex'");
    const PlyProperty* list = e.find("vertex_indices");
    if (list == nullptr) list = e.find("vertex_index");
    if (list == nullptr || !list->is_list) return fail("element 'face' has no list 'vertex_indices'");
    std::vector<double> corners;
    for (std::uint64_t row = 0; row < e.count; ++row) {
      if (!body_.read_list(e, *list, corners)) return detail::ply_rows_missing(source_, e, row);
      const std::string where = "face " + std::to_string(row);
      if (corners.size() < 3) {
        return fail(where + " has " + std::to_string(corners.size()) + " corners, must be 3 or more");
      }
      for (const double c : corners) {
        if (!(c >= 0 && c < static_cast<double>(mesh_.vertices.size())) || c != std::floor(c)) {
          return fail(where + ": a corner outside of the " + std::to_string(mesh_.vertices.size()) +
                      " vertices");
        }
      }
      const auto corner = [&](std::size_t k) { return static_cast<std::uint32_t>(corners[k]); };
      for (std::size_t k = 2; k < corners.size(); ++k) {
        mesh_.triangles.push_back({corner(0), corner(k - 1), corner(k)});
      }
    }
    return {};
  }

  const detail::PlyHeader& header_;
  const std::string& source_;
  PlyBody body_;
  TriangleMesh mesh_;
  bool has_vertices_ = false, has_faces_ = false;
};

}  // namespace

Result<TriangleMesh> load_ply_mesh(const std::filesystem::path& path) {
  const std::string source = path.string();
  return detail::with_file(path, [&](const auto& file) -> Result<TriangleMesh> {
    const auto header = detail::parse_ply_header(file.span(), source);
    return header ? PlyMeshReader(file.span(), *header, source).run() : header.status();
  });
}

}  // namespace gsnav::io
