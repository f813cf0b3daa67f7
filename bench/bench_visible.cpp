// SPDX-License-Identifier: Apache-2.0
// `fast` with visible sets against float64: settings of the sets, what a cell then sees, and the error.
//
//   GSNAV_BENCH_SCENE=scene.ply GSNAV_BENCH_CAMERAS=cameras.json bench_visible
//       [--sizes 64,128,256] [none] [ROWS,WEIGHT[,MARGIN[,FACE]] ...]
//
// Without the variables, the scene is the embedded flat from its four viewpoints. ROWS, WEIGHT, MARGIN
// and FACE are VisibleSettings::rows, min_weight, margin and face; `none` is a row without sets. By
// default there is a row without sets and one of the default settings.
//
// The reference is the image of Quality::exact in double, of all Gaussians. PSNR and largest error are
// of RGB, and no pixel is left out. The cells are those of the cameras. Their sets are those of
// build_visible_sets from the viewpoints of visible_workload. All settings of one face share the images
// from these viewpoints.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "gsnav/backends/openmp.hpp"
#include "gsnav/scene/basic_renderer.hpp"
#include "gsnav/scene/visible_sets.hpp"
#include "visible_workload.hpp"
#include "workload.hpp"

using namespace gsnav;
using namespace gsnav_bench;

namespace {

/// A row of the table.
struct Row {
  std::string name;
  bool with_sets = false;
  VisibleSettings settings;
  std::vector<detail::SeenOfCell> found;         // [cells]
  std::vector<std::vector<std::uint32_t>> bits;  // [cells]
};

/// The cells that cameras are in.
struct Cells {
  explicit Cells(const std::vector<Camera>& cameras) {
    for (const Camera& c : cameras) keys.push_back(key_of(c));
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  }
  static VisibleSets::Key key_of(const Camera& c) {
    return VisibleSets::key_of(c.position(), VisibleSettings{}.cell).value();
  }
  std::size_t of(const Camera& c) const {
    return static_cast<std::size_t>(std::lower_bound(keys.begin(), keys.end(), key_of(c)) -
                                    keys.begin());
  }
  std::vector<VisibleSets::Key> keys;
};

bool read_row(const char* text, Row& row) {
  row.name = text;
  if (row.name == "none") return true;
  row.with_sets = true;
  VisibleSettings& s = row.settings;
  const int fields = std::sscanf(text, "%d,%lf,%lf,%d", &s.rows, &s.min_weight, &s.margin, &s.face);
  return fields >= 2 && validate(s).ok();
}

/// Adds what one viewpoint sees to the rows of a face, in the cells that it counts for.
void add_viewpoint(std::vector<Row*>& rows, const Cells& cells, const Vec3d& eye,
                   std::span<const float> most, std::size_t chunks) {
  for (Row* row : rows) {
    std::vector<std::size_t> counts_for;
    for (std::size_t c = 0; c < cells.keys.size(); ++c) {
      const detail::CellCube cube(cells.keys[c], row->settings.cell);
      if (cube.distance(eye, eye) <= row->settings.margin) counts_for.push_back(c);
    }
    if (counts_for.empty()) continue;
    for (std::size_t i = 0; i < chunks; ++i) {
      const detail::RowBits seen =
          detail::seen_rows(most, i, row->settings.rows, row->settings.min_weight);
      if (seen == detail::RowBits{}) continue;
      for (const std::size_t c : counts_for) row->found[c].add(i, seen);
    }
  }
}

/// Finds the sets of all rows.
void find_sets(std::vector<Row>& rows, const Cells& cells) {
  const GaussianCloud& cloud = workload().cloud;
  const std::size_t chunks = cloud.view().chunk_count();
  std::map<int, std::vector<Row*>> of_face;
  double margin = 0;
  for (Row& row : rows) {
    if (!row.with_sets) continue;
    row.found.assign(cells.keys.size(), detail::SeenOfCell(chunks));
    of_face[row.settings.face].push_back(&row);
    margin = std::max(margin, row.settings.margin);
  }
  if (of_face.empty()) return;
  OpenMPBackend backend;
  const VisibleWorkload places = visible_workload();
  RowWeightsWorkspace<OpenMPBackend> workspace(backend);
  std::vector<float> most(cloud.size());
  std::size_t used = 0;
  for (std::size_t v = 0; v < places.viewpoints.size(); ++v) {
    const Vec3d eye = inverse(places.placed) * places.viewpoints[v];
    const bool near = std::any_of(cells.keys.begin(), cells.keys.end(), [&](const auto& key) {
      return detail::CellCube(key, VisibleSettings{}.cell).distance(eye, eye) <= margin;
    });
    if (!near) continue;
    ++used;
    for (auto& [face, of] : of_face) {
      const VisibleSettings& s = of[0]->settings;
      std::fill(most.begin(), most.end(), 0.0f);
      for (const Camera& camera :
           detail::cube_cameras(places.viewpoints[v], v, face, s.near_plane, s.near_sigma)) {
        add_row_weights(backend, workspace, cloud.set(places.placed), camera, most).throw_if_error();
      }
      add_viewpoint(of, cells, eye, most, chunks);
    }
  }
  std::printf("%zu cells of the cameras, from %zu of %zu viewpoints\n", cells.keys.size(), used,
              places.viewpoints.size());
  for (Row& row : rows) {
    for (std::size_t c = 0; c < row.found.size(); ++c) {
      const detail::CellCube cube(cells.keys[c], row.settings.cell);
      for (std::size_t i = 0; i < chunks; ++i) {
        const ChunkBounds& b = cloud.chunk_bounds[i];
        if (cube.distance(b.low, b.high) <= row.settings.near_plane)
          row.found[c].add(i, detail::all_rows(cloud.size(), i));
      }
      row.found[c].append_to(row.bits.emplace_back(), row.settings.rows != 0);
    }
  }
}

/// Whether the sets of a row apply to a camera. Those of coarser images do not.
bool applies(const Row& row, const Camera& camera) {
  return !row.with_sets || std::max(camera.fx, camera.fy) <= 0.5 * row.settings.face * (1 + 1e-6);
}

/// Draws all views at one size, and prints the error of each row.
void judge(const std::vector<Row>& rows, const Cells& cells, int size) {
  constexpr double kBound = 6.0 / 255;
  OpenMPBackend backend;
  RenderConfig config;
  config.outputs = kRgb;
  BasicRenderer<double, OpenMPBackend> exact(backend, config);
  config.quality = Quality::fast();
  BasicRenderer<float, OpenMPBackend> fast(backend, config);
  const GaussianCloud& cloud = workload().cloud;
  struct Errors {
    double worst = 1e9, sum = 0, largest = 0;
    std::size_t over = 0;
  };
  std::vector<Errors> errors(rows.size());
  const std::vector<Camera> cameras = sized(size, size);
  for (const Camera& camera : cameras) {
    const std::vector<double> reference = exact.render(cloud.set(), camera).value().rgb;
    for (std::size_t r = 0; r < rows.size(); ++r) {
      if (!applies(rows[r], camera)) continue;
      GaussianSet set = cloud.set();
      if (rows[r].with_sets) {
        const std::vector<std::uint32_t>& bits = rows[r].bits[cells.of(camera)];
        set.selection.seen = {bits.data(), bits.size()};
      }
      const std::vector<float> image = fast.render(set, camera).value().rgb;
      double squares = 0;
      for (std::size_t i = 0; i < image.size(); ++i) {
        const double d = std::abs(static_cast<double>(image[i]) - reference[i]);
        squares += d * d;
        errors[r].largest = std::max(errors[r].largest, d);
        errors[r].over += d > kBound ? 1 : 0;
      }
      const double psnr = -10 * std::log10(std::max(squares / static_cast<double>(image.size()), 1e-30));
      errors[r].worst = std::min(errors[r].worst, psnr);
      errors[r].sum += psnr;
    }
  }
  for (std::size_t r = 0; r < rows.size(); ++r) {
    if (!applies(rows[r], cameras[0])) continue;
    std::printf("%4dx%-4d %-18s worst %5.1f dB, mean %5.1f dB, largest %.4f, %zu values over 6/255\n",
                size, size, rows[r].name.c_str(), errors[r].worst,
                errors[r].sum / static_cast<double>(cameras.size()), errors[r].largest, errors[r].over);
  }
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<int> sizes;
  std::string list = "64,128,256";
  std::vector<Row> rows;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--sizes") == 0 && i + 1 < argc) {
      list = argv[++i];
      continue;
    }
    if (read_row(argv[i], rows.emplace_back())) continue;
    std::fprintf(stderr, "bench_visible: '%s' is not --sizes, none or ROWS,WEIGHT[,MARGIN[,FACE]]\n",
                 argv[i]);
    return 2;
  }
  for (std::size_t at = 0; at < list.size(); at = std::min(list.find(',', at), list.size() - 1) + 1)
    sizes.push_back(std::max(std::atoi(list.c_str() + at), 1));
  if (rows.empty()) {
    rows.resize(2);
    rows[0].name = "none";
    rows[1].name = "default";
    rows[1].with_sets = true;
  }
  const Cells cells(workload().cameras);
  find_sets(rows, cells);
  for (const Row& row : rows) {
    double seen = 0, words = 0;
    for (const detail::SeenOfCell& of : row.found) seen += static_cast<double>(of.count());
    for (const auto& bits : row.bits) words += static_cast<double>(bits.size());
    if (!row.with_sets) continue;
    const double count = static_cast<double>(cells.keys.size());
    std::printf("%-18s a cell sees %.1f %% of the Gaussians; %.1f KB per cell\n", row.name.c_str(),
                100 * seen / (count * static_cast<double>(workload().cloud.size())),
                4e-3 * words / count);
  }
  std::fflush(stdout);
  for (const int size : sizes) judge(rows, cells, size);
  return 0;
}
