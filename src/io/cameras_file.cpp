// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/io/cameras_file.hpp"

#include <cmath>

#include "file.hpp"
#include "gsnav/core/replace_file.hpp"
#include "json.hpp"

namespace gsnav::io {
namespace {

using detail::Json;

constexpr std::int64_t kLargestSide = 65536;
constexpr double kRotationTolerance = 1e-3;

Result<Mat3<double>> rotation_of(const Json& object, const std::string& where) {
  const Json* rows = detail::member(object, "rotation");
  if (rows == nullptr) return {Errc::invalid_file, where + ": 'rotation' is missing"};
  if (!rows->is_array() || rows->size() != 3) {
    return {Errc::invalid_file, where + ": 'rotation' must be 3 rows of 3 numbers"};
  }
  Mat3<double> m;
  for (int i = 0; i < 3; ++i) {
    const std::string name = "rotation[" + std::to_string(i) + "]";
    const Json row = {{name, (*rows)[static_cast<std::size_t>(i)]}};
    const auto values = detail::get_numbers(row, name.c_str(), 3, where);
    if (!values) return values.status();
    for (int j = 0; j < 3; ++j) m(i, j) = (*values)[static_cast<std::size_t>(j)];
  }
  if (!(determinant(m) > 0 && distance_from_orthogonal(m) <= kRotationTolerance)) {
    return {Errc::invalid_file, where +
                                    ": 'rotation' is no rotation (its rows must be orthonormal within "
                                    "1e-3 and right-handed)"};
  }
  return m;
}

Result<Camera> camera_of(const Json& object, const std::string& where) {
  if (!object.is_object()) return {Errc::invalid_file, where + ": is " + detail::shown(object)};
  const auto width = detail::get_integer(object, "width", 1, kLargestSide, where);
  if (!width) return width.status();
  const auto height = detail::get_integer(object, "height", 1, kLargestSide, where);
  if (!height) return height.status();
  double focal[2];
  for (int k = 0; k < 2; ++k) {
    const char* name = k == 0 ? "fx" : "fy";
    const auto value = detail::get_number(object, name, where);
    if (!value) return value.status();
    if (!(*value > 0)) {
      return {Errc::invalid_file,
              where + ": '" + name + "' is " + std::to_string(*value) + ", must be positive"};
    }
    focal[k] = *value;
  }
  Vec3d position;
  if (Status s = detail::get_vector(object, "position", where, position); !s) return s;
  const auto rotation = rotation_of(object, where);
  if (!rotation) return rotation.status();
  Camera c{.fx = focal[0],
           .fy = focal[1],
           .width = static_cast<int>(*width),
           .height = static_cast<int>(*height)};
  c.viewmat = rigid_inverse(Affine3<double>{*rotation, position});
  return c;
}

}  // namespace

Result<std::vector<Camera>> load_cameras(const std::filesystem::path& path, int width, int height) {
  const std::string source = path.string();
  if (width < 0 || height < 0 || (width > 0) != (height > 0) || width > kLargestSide ||
      height > kLargestSide) {
    return {Errc::invalid_argument, "load_cameras: the size " + std::to_string(width) + " x " +
                                        std::to_string(height) + " must be 0 x 0 or from 1 to 65536"};
  }
  return detail::guarded(source, [&]() -> Result<std::vector<Camera>> {
    const auto json = detail::load_json(path);
    if (!json) return json.status();
    if (!json->is_array()) {
      return {Errc::invalid_file, source + ": must be an array of cameras, is " + json->type_name()};
    }
    std::vector<Camera> cameras;
    for (std::size_t i = 0; i < json->size(); ++i) {
      auto camera = camera_of((*json)[i], source + ": camera " + std::to_string(i));
      if (!camera) return camera.status();
      Camera c = *camera;
      if (width > 0) {
        const double scale = static_cast<double>(width) / c.width;
        c.fx *= scale;
        c.fy *= scale;
        c.width = width;
        c.height = height;
      }
      c.cx = 0.5 * c.width;
      c.cy = 0.5 * c.height;
      c.near_plane = 0.2;
      cameras.push_back(c);
    }
    return cameras;
  });
}

Status save_cameras(const std::filesystem::path& path, std::span<const Camera> cameras) {
  return detail::guarded(path.string(), [&]() -> Status {
    nlohmann::ordered_json out = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const Camera& c = cameras[i];
      if (c.cx != 0.5 * c.width || c.cy != 0.5 * c.height) {
        return {Errc::unsupported, path.string() + ": camera " + std::to_string(i) +
                                       ": cameras.json has no place for an off-centre principal point"};
      }
      const Affine3<double> world = rigid_inverse(c.viewmat);
      nlohmann::ordered_json one;
      one["id"] = i;
      one["img_name"] = "view_" + std::to_string(i);
      one["width"] = c.width;
      one["height"] = c.height;
      const Vec3d& p = world.translation;
      one["position"] = {p.x, p.y, p.z};
      for (const Vec3d& row : world.linear.row) one["rotation"].push_back({row.x, row.y, row.z});
      one["fx"] = c.fx;
      one["fy"] = c.fy;
      out.push_back(std::move(one));
    }
    return replace_file(path, out.dump(1) + "\n");
  });
}

}  // namespace gsnav::io
