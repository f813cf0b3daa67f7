// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <vector>

#include "file.hpp"
#include "gsnav/detail/io/avatar_scene_file.hpp"
#include "json.hpp"
#include "npz_arrays.hpp"

namespace gsnav::io {
namespace {

namespace fs = std::filesystem;
using detail::Json;
using detail::member;
using detail::must_be;
using detail::shown;

class AvatarSceneReader {
 public:
  AvatarSceneReader(const fs::path& path, const Json& json)
      : folder_(path.parent_path()), source_(path.string()), json_(json) {}

  Result<AvatarScene> run() {
    if (!json_.is_object()) return must_be(source_ + ":", json_, "an object");
    if (Status s = number(json_, "time_max", source_, out_.time_max); !s) return s;
    if (!(out_.time_max >= 0)) return {Errc::invalid_file, source_ + ": 'time_max' is negative"};
    if (const Json* loop = member(json_, "time_loop"); loop != nullptr) {
      if (!loop->is_boolean()) return must_be(source_ + ": 'time_loop'", *loop, "true or false");
      out_.time_loop = loop->get<bool>();
    }
    const Json* list = member(json_, "gaussian_avatars");
    const char* key = list != nullptr ? "gaussian_avatars" : "avatars";
    if (list == nullptr) list = member(json_, "avatars");
    if (list == nullptr) return std::move(out_);
    if (!list->is_array()) return must_be(source_ + ": '" + key + "'", *list, "an array");
    for (std::size_t i = 0; i < list->size(); ++i) {
      const std::string at = source_ + ": " + key + "[" + std::to_string(i) + "]";
      if (Status s = avatar((*list)[i], at); !s) return s;
    }
    return std::move(out_);
  }

 private:
  Status number(const Json& object, const char* key, const std::string& at, double& out) const {
    if (member(object, key) == nullptr) return {};
    const auto v = detail::get_number(object, key, at);
    if (!v) return v.status();
    out = *v;
    return {};
  }

  Result<fs::path> file(const Json& object, const char* key, const std::string& at) const {
    const Json* v = member(object, key);
    if (v == nullptr) return {Errc::invalid_file, at + ": '" + key + "' is missing"};
    if (!v->is_string() || v->get<std::string>().empty()) {
      return must_be(at + ": '" + key + "'", *v, "a path");
    }
    const fs::path p(v->get<std::string>());
    return p.is_absolute() ? p : folder_ / p;
  }

  Status avatar(const Json& a, const std::string& at) {
    if (!a.is_object()) return must_be(at, a, "an object");
    SceneAvatar out;
    if (const Json* name = member(a, "name"); name != nullptr && name->is_string())
      out.name = name->get<std::string>();
    if (member(a, "proxy_urdf") != nullptr)
      return {Errc::unsupported, at + ": 'proxy_urdf' is not read; capsules are in the driver"};
    const auto canonical = file(a, "canonical_gaussians", at);
    if (!canonical) return canonical.status();
    out.canonical = *canonical;
    if (Status s = driver(a, at, out); !s) return s;
    if (Status s = number(a, "scale", at, out.scale); !s) return s;
    if (!(out.scale > 0))
      return {Errc::invalid_file,
              at + ": 'scale' is " + std::to_string(out.scale) + ", must be positive"};
    if (Status s = number(a, "offset_y", at, out.offset_y); !s) return s;
    if (Status s = number(a, "time_begin", at, out.time_begin); !s) return s;
    if (member(a, "time_end") != nullptr) {
      double end = 0.0;
      if (Status s = number(a, "time_end", at, end); !s) return s;
      if (!(end >= out.time_begin))
        return {Errc::invalid_file, at + ": 'time_end' lies before 'time_begin'"};
      out.time_end = end;
    }
    if (Status s = coordinates(a, at, out); !s) return s;
    for (const char* key : {"frame_time", "fps"}) {
      if (member(a, key) != nullptr)
        out_.warnings.push_back(at + ": '" + key + "' is left out: the driver's own rate is played");
    }
    out_.avatars.push_back(std::move(out));
    return {};
  }

  Status driver(const Json& a, const std::string& at, SceneAvatar& out) const {
    const Json* d = member(a, "driver");
    const bool nested = d != nullptr && d->is_object();
    const Json& from = nested ? *d : a;
    const char* key = !nested                                ? "driver"
                      : member(*d, "smpl_params") != nullptr ? "smpl_params"
                                                             : "smpl_parms";
    const auto path = file(from, key, nested ? at + ": driver" : at);
    if (!path) return path.status();
    out.driver = *path;
    if (out.driver.extension() == ".pkl") out.driver.replace_extension(".npz");
    if (nested && member(*d, "trajectory") != nullptr && !member(*d, "trajectory")->is_null()) {
      const auto trajectory = file(*d, "trajectory", at + ": driver");
      if (!trajectory) return trajectory.status();
      out.trajectory = *trajectory;
    }
    return {};
  }

  Status coordinates(const Json& a, const std::string& at, SceneAvatar& out) const {
    if (const Json* system = member(a, "coord_system"); system != nullptr) {
      const std::string name = system->is_string() ? system->get<std::string>() : std::string();
      out.guess_coordinates = false;
      if (name == "opencv" || name == "smpl_opencv" || name == "gaussian_avatar") {
        out.coordinates.linear = {{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}};
      } else if (name != "habitat" && name != "world" && name != "none") {
        return {Errc::invalid_file, at + ": 'coord_system' is " + shown(*system)};
      }
    }
    const Json* matrix = member(a, "coord_transform");
    if (matrix == nullptr) return {};
    out.guess_coordinates = false;
    std::vector<double> v;
    const auto take = [&](const Json& list) {
      for (const Json& x : list) v.push_back(x.is_number() ? x.get<double>() : NAN);
    };
    if (matrix->is_array() && matrix->size() == 4 && (*matrix)[0].is_array()) {
      for (const Json& row : *matrix) take(row);
    } else if (matrix->is_array()) {
      take(*matrix);
    }
    Affine3<double> m;
    if (v.size() == 16) {
      for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) m.linear(i, k) = v[static_cast<std::size_t>(4 * i + k)];
        m.translation[i] = v[static_cast<std::size_t>(4 * i + 3)];
      }
    }
    if (v.size() != 16 || !detail::is_rigid(m))
      return {Errc::invalid_file, at + ": 'coord_transform' is no rigid 4x4 matrix"};
    out.coordinates = m;
    return {};
  }

  fs::path folder_;
  std::string source_;
  const Json& json_;
  AvatarScene out_;
};

}  // namespace

Result<AvatarScene> load_avatar_scene(const fs::path& path) {
  return detail::guarded(path.string(), [&]() -> Result<AvatarScene> {
    const auto json = detail::load_json(path);
    return json ? AvatarSceneReader(path, *json).run() : json.status();
  });
}

}  // namespace gsnav::io
