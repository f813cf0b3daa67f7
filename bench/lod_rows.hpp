// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "gsnav/image/camera.hpp"
#include "gsnav/scene/gaussian_cloud.hpp"
#include "gsnav/scene/lod_cut.hpp"
#include "gsnav/scene/visible_sets.hpp"

namespace gsnav_bench {

inline constexpr int kLodPhoto = 4;

/// Content of a row of bench_lod.
enum class LodDraw {
  direct,  ///< every Gaussian, with the asset's own filter
  photo,   ///< every Gaussian, with the photo's filter
  lod,     ///< a cut
  seen,    ///< with the asset's own filter, only Gaussians visible from the camera's cell
};

/// Views, and the image that a photo of each would have: O_photo(kLodPhoto).
struct LodViews {
  std::vector<gsnav::Camera> cameras;   ///< of one size
  std::vector<std::vector<float>> rgb;  ///< [H][W][3] per view
  std::vector<std::vector<float>>
      depths;                  ///< [k H][k W] per view: the median depths of the photo's rays, metres
  std::vector<double> direct;  ///< PSNR of direct rendering, set when its row is drawn
  double direct_ms = 0;
  std::size_t first = 0;  ///< number of the first camera
  bool each = false;      ///< print every view
  /// Pixels of a view.
  std::size_t width() const { return static_cast<std::size_t>(cameras.at(0).width); }
  std::size_t height() const { return static_cast<std::size_t>(cameras.at(0).height); }
  std::size_t pixels() const { return width() * height(); }
};

/// Renders the photos exactly, on all threads.
LodViews lod_views(const gsnav::GaussianCloud& cloud, const std::vector<gsnav::Camera>& cameras);

/// One row of the table. It is filled view by view.
class LodRow {
 public:
  LodRow(LodViews& views, LodDraw draw) : views_(&views), draw_(draw) {}
  /// Adds the next view. Images are [H][W][3] and [H][W] metres (0: no return); `ms` is its time,
  /// milliseconds.
  void add(const std::vector<float>& rgb, const std::vector<float>& median_depth, double ms,
           double visible, double pairs);
  /// Sets the times of a frame with RGB, alpha and median depth, and with median depth alone,
  /// milliseconds.
  void set_other_times(double rgbd_ms, double depth_ms) {
    rgbd_ms_ = rgbd_ms;
    depth_ms_ = depth_ms;
  }
  void print(const char* name, double pixels) const;
  static void print_head();

 private:
  LodViews* views_;
  LodDraw draw_;
  std::size_t count_ = 0, least_view_ = 0, below_ = 0;
  double quality_ = 0, worst_ = 1e9, gain_ = 1e9, ms_ = 0, visible_ = 0, pairs_ = 0;
  double rgbd_ms_ = std::numeric_limits<double>::quiet_NaN(), depth_ms_ = rgbd_ms_;
  std::vector<double> depth_errors_;
};

#if defined(GSNAV_HAS_CUDA)
/// Prints the table's rows for the first GPU, or a line that there is none. The last rows have `cameras`
/// in one call, at least the views: more repeat the views from places some centimetres away.
void lod_rows_on_gpu(LodViews& views, std::size_t cameras, const gsnav::GaussianCloud& cloud,
                     const gsnav::LodTree& tree, const gsnav::VisibleSets& visible,
                     const std::vector<double>& pixels);
#endif

}  // namespace gsnav_bench
