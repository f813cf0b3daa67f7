// SPDX-License-Identifier: Apache-2.0
// Which backend has which stage in a form of its own, as the compiler sees it, beside the table of
// docs/concepts/frame.md.
#include <doctest/doctest.h>

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <span>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

#include "gsnav/core/stages.hpp"
#include "gsnav/detail/sweep/capsule_batch.hpp"
#include "gsnav/skin/skin.hpp"
#include "ops/backends.hpp"
#if defined(GSNAV_HAS_CUDA)
#include "gsnav/backends/cuda.hpp"
#endif

using namespace gsnav;

namespace {

struct Row {
  std::string name;
  std::vector<std::string> cells;
};

/// Backends in the order of the page's columns; void: not in this build.
template <class... B>
struct Backends {
  template <class Stage, class... Args>
  static Row row(const char* name) {
    return {std::string("`") + name + "`", {cell<B, Stage, Args...>()...}};
  }
  static Row sort() { return {"member `sort_pairs`", {sort_cell<B>()...}}; }

 private:
  template <class T, class Stage, class... Args>
  static std::string cell() {
    if constexpr (std::is_void_v<T>)
      return "";
    else
      return RunsStage<T, Stage, Args...> ? "own" : "generic";
  }
  template <class T>
  static std::string sort_cell() {
    if constexpr (std::is_void_v<T>)
      return "";
    else
      return requires(T & b, std::uint32_t * p) { b.sort_pairs(p, p, p, p, std::size_t{1}, 32); }
    ? "own" : "generic";
  }
};

#if defined(_OPENMP)
using OpenMP = OpenMPBackend;
#else
using OpenMP = void;
#endif
#if defined(GSNAV_HAS_CUDA)
using Cuda = CudaBackend;
#else
using Cuda = void;
#endif

std::vector<Row> stage_table() {
  using T = Backends<SerialBackend, OpenMP, Cuda>;
  using Number = std::size_t;
  using Viewed = ViewedSet<float>;
  using Projected = ProjectOutputs<float>;
  using Bins = BinArgs<float>;
  using Hides = MeshCull<float>;
  return {
      T::row<stage::Project, Viewed, Projected>("Project"),
      T::row<stage::Project, Viewed, Projected, View<const std::uint32_t>>("Project, some chunks"),
      T::sort(),
      T::row<stage::CountTiles, Bins, NoCull>("CountTiles"),
      T::row<stage::CountTiles, Bins, Hides>("CountTiles, with meshes"),
      T::row<stage::ScatterTiles, Bins, NoCull>("ScatterTiles"),
      T::row<stage::ScatterTiles, Bins, Hides>("ScatterTiles, with meshes"),
      T::row<stage::Blend, RasterArgs<float>>("Blend"),
      T::row<stage::BlendWithMeshes, RasterArgs<float>>("BlendWithMeshes"),
      T::row<stage::RasterizeMesh, MeshRasterArgs<float>>("RasterizeMesh"),
      T::row<stage::Each, Number, CountTileIntersections<float>>("Each of CountTileIntersections"),
      T::row<stage::Each, Number, ScatterTileIntersections<float>>("Each of ScatterTileIntersections"),
      T::row<stage::Each, Number, ProjectMeshVertices<float>>("Each of ProjectMeshVertices"),
      T::row<stage::Each, Number, CountMeshTriangles<float>>("Each of CountMeshTriangles"),
      T::row<stage::Each, Number, ScanMeshTriangles<float>>("Each of ScanMeshTriangles"),
      T::row<stage::Each, Number, WriteMeshTriangles<float>>("Each of WriteMeshTriangles"),
      T::row<stage::Each, Number, RasterizeMeshTile<float>>("Each of RasterizeMeshTile"),
      T::row<stage::Each, Number, ShadeMeshRow<float>>("Each of ShadeMeshRow"),
      T::row<stage::Skin, SkinningArgs<float>>("Skin"),
      T::row<stage::SkinAll, std::span<const SkinningArgs<float>>>("SkinAll"),
      T::row<stage::CapsuleGaps, CapsuleGapArgs<float>>("CapsuleGaps"),
      T::row<stage::SweepCapsules, SweepArgs<float>>("SweepCapsules"),
  };
}

/// The cells of a line "| a | b |".
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream in(line);
  std::string cell;
  std::getline(in, cell, '|');
  while (std::getline(in, cell, '|')) {
    const auto first = cell.find_first_not_of(' '), last = cell.find_last_not_of(' ');
    if (first != std::string::npos) cells.push_back(cell.substr(first, last - first + 1));
  }
  return cells;
}

/// The page's rows below "| stage | serial | OpenMP | CUDA |".
std::vector<Row> page_table() {
  std::ifstream page(GSNAV_STAGE_PAGE);
  REQUIRE(page);
  std::vector<Row> rows;
  std::string line;
  while (std::getline(page, line) && cells_of(line) != cells_of("| stage | serial | OpenMP | CUDA |")) {
  }
  std::getline(page, line);  // the rule below
  while (std::getline(page, line) && line.starts_with("|")) {
    auto cells = cells_of(line);
    REQUIRE(cells.size() == 4);
    rows.push_back({cells[0], {cells.begin() + 1, cells.end()}});
  }
  return rows;
}

}  // namespace

TEST_CASE("the page of a frame says which backend has which stage in a form of its own") {
  const std::vector<Row> truth = stage_table(), page = page_table();
  std::string table;
  for (const Row& row : truth) {
    table += "| " + row.name + " |";
    for (const std::string& c : row.cells) table += (c.empty() ? " not built" : " " + c) + " |";
    table += "\n";
  }
  std::printf("%s", table.c_str());
  REQUIRE(page.size() == truth.size());
  for (std::size_t r = 0; r < truth.size(); ++r) {
    CHECK(page[r].name == truth[r].name);
    for (std::size_t c = 0; c < truth[r].cells.size(); ++c) {
      CAPTURE(truth[r].name);
      if (!truth[r].cells[c].empty()) CHECK(page[r].cells[c] == truth[r].cells[c]);
    }
  }
}
