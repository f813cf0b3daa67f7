// SPDX-License-Identifier: Apache-2.0
#include "gsnav/detail/io/habitat_dataset.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "file.hpp"
#include "habitat_json.hpp"

namespace gsnav::io {
namespace {

namespace fs = std::filesystem;
using detail::Json;
using detail::member;
using detail::must_be;
using detail::shown;
using namespace habitat;

constexpr const char* kStage = ".stage_config.json";
constexpr const char* kScene = ".scene_instance.json";

/// Whether `name` matches a pattern in which `*` stands for any text. Backtracks to the last star only,
/// so the time is bounded.
bool matches(std::string_view pattern, std::string_view name) {
  std::size_t p = 0, n = 0, star = std::string_view::npos, from = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      from = n;
    } else if (p < pattern.size() && pattern[p] == name[n]) {
      ++p, ++n;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++from;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

/// The folders and files that match a path with patterns, sorted. Error: unsupported if there are
/// implausibly many.
Result<std::vector<fs::path>> expanded(const fs::path& folder, const fs::path& pattern) {
  constexpr std::size_t kMost = 100000;
  std::vector<fs::path> found{pattern.is_absolute() ? pattern.root_path() : folder};
  for (const fs::path& part : pattern.is_absolute() ? pattern.relative_path() : pattern) {
    std::vector<fs::path> next;
    for (const fs::path& at : found) {
      if (part.string().find('*') == std::string::npos) {
        if (fs::exists(at / part)) next.push_back(at / part);
        continue;
      }
      if (!fs::is_directory(at)) continue;
      for (const auto& entry : fs::directory_iterator(at)) {
        if (matches(part.string(), entry.path().filename().string())) next.push_back(entry.path());
        if (next.size() > kMost) {
          return {Errc::unsupported, "the pattern '" + pattern.string() + "' stands for over " +
                                         std::to_string(kMost) + " files"};
        }
      }
    }
    found = std::move(next);
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::string name_of(const fs::path& file, std::string_view ending) {
  std::string name = file.filename().string();
  if (name.ends_with(ending)) name.resize(name.size() - ending.size());
  return name;
}

class DatasetReader {
 public:
  explicit DatasetReader(const fs::path& path)
      : folder_(path.has_parent_path() ? path.parent_path() : "."), at_(path.string()), path_(path) {}

  Result<HabitatDataset> run() {
    const auto json = load_object(path_);
    if (!json) return json.status();
    left_out_.add(*json, {"stages", "scene_instances", "navmesh_instances"}, at_);
    std::vector<fs::path> stages, scenes;
    if (Status s = files(*json, "stages", kStage, stages); !s) return s;
    if (Status s = files(*json, "scene_instances", kScene, scenes); !s) return s;
    if (Status s = read_stages(*json, stages); !s) return s;
    if (Status s = read_navmeshes(*json); !s) return s;
    for (const fs::path& file : scenes) {
      if (Status s = read_scene(file); !s) return s;
    }
    if (scenes.empty()) {
      for (const auto& [name, stage] : stages_) {
        HabitatScene scene;
        scene.name = name;
        scene.file = stage.file;
        scene.stage = stage;
        if (const auto found = navmeshes_.find(name); found != navmeshes_.end())
          scene.navmesh = found->second;
        out_.scenes.push_back(std::move(scene));
      }
    }
    std::sort(out_.scenes.begin(), out_.scenes.end(),
              [](const auto& a, const auto& b) { return a.name < b.name; });
    warn_of_outside();
    left_out_.report(out_.warnings);
    return std::move(out_);
  }

 private:
  /// Warns of files outside the dataset's folder, which an absolute path or `..` can name.
  void warn_of_outside() {
    std::error_code error;
    const fs::path root = fs::weakly_canonical(folder_.empty() ? fs::path(".") : folder_, error);
    std::set<fs::path> said;
    for (const HabitatScene& s : out_.scenes) {
      for (const fs::path& file : {s.stage.render_asset, s.stage.collision_asset, s.navmesh}) {
        if (file.empty()) continue;
        const fs::path inside = fs::weakly_canonical(file, error).lexically_relative(root);
        const bool out = inside.empty() || *inside.begin() == "..";
        if (out && said.insert(file).second) {
          out_.warnings.push_back(at_ + ": " + s.name + " uses " + file.string() +
                                  ", outside of the dataset's folder");
        }
      }
    }
  }

  /// The files that match `paths` in a section of the dataset.
  Status files(const Json& json, const char* part, const std::string& ending,
               std::vector<fs::path>& out) {
    const Json* section = member(json, part);
    if (section == nullptr) return {};
    const std::string at = at_ + ": " + part;
    if (!section->is_object()) return must_be(at, *section, "an object");
    left_out_.add(*section, {"paths", "default_attributes"}, at);
    const Json* paths = member(*section, "paths");
    if (paths == nullptr) return {};
    if (!paths->is_object()) return must_be(at + ": 'paths'", *paths, "an object");
    const Json* list = member(*paths, ".json");
    left_out_.add(*paths, {".json"}, at + ": paths");
    if (list == nullptr) return {};
    if (!list->is_array()) return must_be(at + ": paths['.json']", *list, "an array");
    for (const Json& p : *list) {
      if (!p.is_string())
        return {Errc::invalid_file, at + ": paths['.json'] has " + shown(p) + ", must have paths"};
      const auto listed = expanded(folder_, p.get<std::string>());
      if (!listed) return {listed.code(), at + ": " + listed.message()};
      for (const fs::path& found : *listed) {
        if (!fs::is_directory(found)) {
          if (found.filename().string().ends_with(ending)) out.push_back(found);
          continue;
        }
        const auto inside = expanded(found, "*" + ending);
        if (!inside) return {inside.code(), at + ": " + inside.message()};
        out.insert(out.end(), inside->begin(), inside->end());
      }
    }
    return {};
  }

  Status read_stages(const Json& json, const std::vector<fs::path>& files) {
    StageConfig defaults;
    if (const Json* section = member(json, "stages");
        section != nullptr && member(*section, "default_attributes") != nullptr) {
      const std::string at = at_ + ": stages.default_attributes";
      if (Status s =
              read_stage(*member(*section, "default_attributes"), folder_, at, defaults, left_out_);
          !s)
        return s;
    }
    for (const fs::path& file : files) {
      const auto stage = load_object(file);
      if (!stage) return stage.status();
      StageConfig config = defaults;
      config.file = file;
      if (Status s = read_stage(*stage, file.parent_path(), file.string(), config, left_out_); !s)
        return s;
      if (config.render_asset.empty())
        return {Errc::invalid_file, file.string() + ": 'render_asset' is missing"};
      stages_[name_of(file, kStage)] = std::move(config);
    }
    return {};
  }

  Status read_navmeshes(const Json& json) {
    const Json* section = member(json, "navmesh_instances");
    if (section == nullptr) return {};
    if (!section->is_object()) return must_be(at_ + ": 'navmesh_instances'", *section, "an object");
    for (const auto& [name, path] : section->items()) {
      if (!path.is_string()) return must_be(at_ + ": navmesh_instances['" + name + "']", path, "a path");
      navmeshes_[name] = (folder_ / path.get<std::string>()).lexically_normal();
    }
    return {};
  }

  /// The stage with a handle: its name, possibly with folders before and an ending after it.
  const StageConfig* stage(const std::string& handle) const {
    const auto found = stages_.find(name_of(fs::path(handle), kStage));
    return found == stages_.end() ? nullptr : &found->second;
  }

  Status read_scene(const fs::path& file) {
    const auto json = load_object(file);
    if (!json) return json.status();
    const std::string at = file.string();
    HabitatScene scene;
    scene.file = file;
    scene.name = name_of(file, kScene);
    const Json* instance = member(*json, "stage_instance");
    if (instance == nullptr) return {Errc::invalid_file, at + ": 'stage_instance' is missing"};
    const auto handle = text(*instance, "template_name", at + ": stage_instance");
    if (!handle) return handle.status();
    const StageConfig* found = stage(*handle);
    if (found == nullptr) {
      return {Errc::file_not_found,
              at + ": stage_instance.template_name '" + *handle + "': the dataset has no such stage"};
    }
    scene.stage = *found;
    left_out_.add(*instance, {"template_name"}, at + ": stage_instance");

    const auto navmesh = text(*json, "navmesh_instance", at);
    if (!navmesh) return navmesh.status();
    if (!navmesh->empty()) {
      const auto entry = navmeshes_.find(*navmesh);
      scene.navmesh =
          entry != navmeshes_.end() ? entry->second : (file.parent_path() / *navmesh).lexically_normal();
      if (entry == navmeshes_.end() && !fs::exists(scene.navmesh)) {
        return {Errc::file_not_found, at + ": navmesh_instance '" + *navmesh +
                                          "': neither in the dataset's navmesh_instances nor a file"};
      }
    }
    auto avatars = load_avatar_scene(file);
    if (!avatars) return avatars.status();
    for (const std::string& w : avatars->warnings) out_.warnings.push_back(w);
    scene.avatars = std::move(*avatars);
    left_out_.add(
        *json,
        {"stage_instance", "navmesh_instance", "gaussian_avatars", "avatars", "time_max", "time_loop"},
        at);
    out_.scenes.push_back(std::move(scene));
    return {};
  }

  fs::path folder_;
  std::string at_;
  fs::path path_;
  HabitatDataset out_;
  LeftOut left_out_;
  std::map<std::string, StageConfig> stages_;
  std::map<std::string, fs::path> navmeshes_;
};

}  // namespace

const HabitatScene* HabitatDataset::find(const std::string& name) const noexcept {
  const std::string file = fs::path(name).filename().string();
  for (const HabitatScene& s : scenes) {
    if (s.name == name || s.file == fs::path(name) || s.name == file || s.file.filename() == file ||
        s.stage.file.filename() == file || s.stage.render_asset.filename() == file) {
      return &s;
    }
  }
  return nullptr;
}

Result<HabitatDataset> load_habitat_dataset(const fs::path& path) {
  return detail::guarded(path.string(), [&] { return DatasetReader(path).run(); });
}

}  // namespace gsnav::io
