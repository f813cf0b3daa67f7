// SPDX-License-Identifier: Apache-2.0
// libFuzzer over every reader. GSNAV_FUZZ_READER names the one; tools/fuzz.sh runs them all.
#include <DetourAlloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <new>

#include "caches.hpp"
#include "gsnav/detail/io/avatar_file.hpp"
#include "gsnav/detail/io/avatar_scene_file.hpp"
#include "gsnav/detail/io/cameras_file.hpp"
#include "gsnav/detail/io/episode_file.hpp"
#include "gsnav/detail/io/gltf.hpp"
#include "gsnav/detail/io/habitat_dataset.hpp"
#include "gsnav/detail/io/ksplat.hpp"
#include "gsnav/detail/io/lod_set.hpp"
#include "gsnav/detail/io/mesh_file.hpp"
#include "gsnav/detail/io/motion_file.hpp"
#include "gsnav/detail/io/npz_file.hpp"
#include "gsnav/detail/io/ply.hpp"
#include "gsnav/detail/io/skinned_mesh_file.hpp"
#include "gsnav/detail/io/sog.hpp"
#include "gsnav/detail/io/splat.hpp"
#include "gsnav/detail/io/spz.hpp"
#include "gsnav/detail/io/temporal_file.hpp"
#include "gsnav/detail/nav/navmesh_file.hpp"
#include "gsnav/detail/render/at_time.hpp"
#include "gsnav/detail/render/validate_set.hpp"
#include "gsnav/detail/scene/temporal_edit.hpp"
#include "gsnav/io/image_file.hpp"
#include "io/allocations.hpp"
#include "io/spz_file.hpp"
#include "picture.hpp"
#include "readers.hpp"
#include "webp.hpp"

using namespace gsnav;
using namespace gsnav_fuzz;

namespace {

[[noreturn]] void stop(const std::string& why) {
  std::fprintf(stderr, "fuzz: %s\n", why.c_str());
  std::abort();
}

/// A file in memory, whose path any reader opens; one for each `slot`.
std::filesystem::path file_of(const std::string& content, std::size_t slot = 0) {
  static const int fds[] = {memfd_create("fuzz", 0), memfd_create("fuzz", 0)};
  const int fd = fds[slot];
  if (ftruncate(fd, 0) != 0 ||
      pwrite(fd, content.data(), content.size(), 0) != static_cast<ssize_t>(content.size())) {
    stop("no file in memory");
  }
  return "/proc/self/fd/" + std::to_string(fd);
}

void check(const Result<LoadedCloud>& loaded) {
  if (!loaded) {
    if (loaded.message().empty()) stop("an error without a message");
    return;
  }
  const GaussianCloud& c = loaded->cloud;
  const std::size_t rest = 3 * static_cast<std::size_t>(sh_coefficient_count(c.sh_degree) - 1);
  bool ok =
      loaded->report.kept == c.size() && c.sh0.size() == 3 * c.size() && c.shN.size() == rest * c.size();
  ok = ok && loaded->report.read == loaded->report.kept + loaded->report.dropped();
  for (std::size_t i = 0; i < c.size(); ++i) {
    ok = ok && is_finite(c.mean(i)) && c.opacities[i] >= 1.0f / 255 && c.opacities[i] <= 1 &&
         std::fabs(c.quats[0][i]) <= 1.0001f && c.scales[0][i] >= 0;
  }
  if (!ok) stop("a cloud that does not fit together");
}

void check(const Result<TriangleMesh>& mesh) {
  if (!mesh) return;
  for (const auto& triangle : mesh->triangles) {
    for (const std::uint32_t corner : triangle) {
      if (corner >= mesh->vertices.size()) stop("a triangle without its corner");
    }
  }
}

void read_spz(const std::string& input) {
  // 0 the file, 1 what is in its gzip stream, others version 4 with these 16 bytes and planes in equal
  // parts.
  const char kind = input.empty() ? '\0' : input[0];
  const std::string rest = input.substr(input.empty() ? 0 : 1);
  if (kind == 0) return check(io::parse_spz(bytes_of(rest), "fuzz"));
  if (kind == 1) {
    const std::string packed = gzip(rest);
    return check(io::parse_spz(bytes_of(packed), "fuzz"));
  }
  if (rest.size() < 32) return;
  const std::size_t streams = static_cast<unsigned char>(rest[15]) % 8u;
  std::string toc, packed;
  std::size_t at = 32;
  const std::size_t widths[] = {9, 1, 3, 3, 4};
  const std::size_t count = static_cast<unsigned char>(rest[8]);
  for (std::size_t k = 0; k < streams; ++k) {
    const std::size_t wanted = k < 5 ? widths[k] * count : rest.size();
    const std::string plane = rest.substr(std::min(at, rest.size()), wanted);
    at += plane.size();
    const std::string stream = zstd(plane);
    put(toc, std::uint64_t{stream.size()});
    put(toc, std::uint64_t{plane.size()});
    packed += stream;
  }
  const std::string file = rest.substr(0, 32) + toc + packed;
  check(io::parse_spz(bytes_of(file), "fuzz"));
}

void read_gltf(const std::string& input) {
  // 0 the file, others its JSON in front of a fixed buffer.
  static const std::string binary = gltf_file().binary();
  const std::string rest = input.substr(input.empty() ? 0 : 1);
  const std::string file = input.empty() || input[0] == 0 ? rest : GlbFile::glb(rest, binary);
  check(io::parse_gltf(bytes_of(file), "fuzz", {.keep_axes = false, .spz_compression = true}));
}

void read_surface(const std::string& input) {
  // As above.
  static const std::string binary = surface_file().bytes;
  const std::string rest = input.substr(input.empty() ? 0 : 1);
  const auto path = file_of(input.empty() || input[0] == 0 ? rest : GlbFile::glb(rest, binary));
  check(io::load_gltf_mesh(path));
  (void)io::load_gltf_skin(path);
  const auto scene = io::load_gltf_scene(path);
  if (!scene) return;
  for (const auto& instance : scene->instances) {
    if (instance.part >= scene->parts.size()) stop("an instance without its part");
  }
  for (const TexturedPart& part : scene->parts) {
    check(Result<TriangleMesh>(part.geometry));
    if (part.material.texture >= static_cast<std::int32_t>(scene->textures.size())) {
      stop("a part without its texture");
    }
  }
}

void read_lod_set(const std::string& input) {
  static const TempFolder folder("fuzz_lod");
  static const bool made = [] {
    write_file(folder / "a.sog", zip_of(sog_parts()));
    return true;
  }();
  (void)made;
  write_file(folder / "lod-meta.json", input);
  check(io::load_lod_set(folder.path(), {.level = input.size() % 2 == 0 ? 0 : 1}));
  const auto read = io::load_lod_levels(folder.path());
  if (!read || !*read) return;
  const auto& levels = *read;
  bool ok = validate(levels->cloud.set()).ok() && validate(levels->tree.merged.set()).ok();
  for (const LodBox& p : levels->tree.boxes) {
    const GaussianCloud& of = p.finer == LodBox::kNone ? levels->cloud : levels->tree.merged;
    ok = ok && p.first_chunk + p.chunks <= of.view().chunk_count() && p.rows <= p.chunks * kProjectChunk;
  }
  for (const LodNode& n : levels->tree.nodes) ok = ok && is_finite(n.error) && n.error >= 0;
  if (!ok) stop("levels that do not fit their cloud");
}

void read_npz(const std::string& input) {
  static const Parts parts = avatar_parts();
  const auto path = file_of(zip_of(parts, input));
  const auto npz = io::NpzFile::open(path);
  if (npz) {
    for (const std::string& name : npz->names()) {
      (void)npz->read(name);
      (void)npz->read_text(name);
    }
  }
  (void)io::load_avatar(path);
}

void read_driver(const std::string& input) {
  static const Parts parts = driver_parts();
  static const Skeleton skeleton = [] {
    Skeleton s;
    s.names = {"a", "b", "c"};
    s.parents = {-1, 0, 1};
    s.rest_local.resize(3);
    return s;
  }();
  (void)io::load_driver(file_of(zip_of(parts, input)), skeleton);
}

/// A motion and its body model: the first byte names a part of the motion, then of the model.
void read_smpl_motion(const std::string& input) {
  static const Parts motion = smpl_motion_parts(), model = smpl_model_parts();
  const std::size_t part = input.empty() ? 0 : static_cast<unsigned char>(input[0]);
  const bool of_model = part > motion.size();
  const std::string fixed = zip_of(of_model ? motion : model);
  std::string changed = input;
  if (of_model) changed[0] = static_cast<char>(part - motion.size());
  changed = zip_of(of_model ? model : motion, changed);
  const auto loaded = io::load_smpl_motion(file_of(of_model ? fixed : changed, 0),
                                           file_of(of_model ? changed : fixed, 1));
  if (!loaded) return;
  if (!loaded->skeleton.validate().ok() || !loaded->clip.validate().ok())
    stop("a motion that does not fit its joints");
}

void check(const Result<io::PngImage>& picture) {
  if (!picture) return;
  const auto pixels =
      static_cast<std::size_t>(picture->width) * static_cast<std::size_t>(picture->height);
  if (picture->samples.size() != pixels * static_cast<std::size_t>(picture->channels)) {
    stop("samples that are not the picture's");
  }
}

void read_webp(const std::string& input) {
  const auto picture = io::detail::decode_webp(bytes_of(input), "fuzz", io::detail::WebpUse::picture);
  if (picture && picture->pixels.size() != 4 * picture->width * picture->height)
    stop("pixels that are not the picture's");
}

void check(const Result<io::LoadedTemporalCloud>& loaded) {
  if (!loaded) return check(Result<LoadedCloud>(loaded.status()));
  const TemporalCloud& s = loaded->scene;
  bool ok = s.times.size() == s.size() && s.sigmas.size() == s.size() && validate(s.view()).ok();
  for (std::size_t i = 0; i < s.size(); ++i) ok = ok && is_finite(s.times[i]) && s.sigmas[i] > 0;
  if (!ok) stop("planes that do not fit their cloud");
  check(Result<LoadedCloud>(LoadedCloud{s.cloud, loaded->report}));
  for (const double t : {0.0, 1e6}) (void)cloud_at(s, t);
}

void read_temporal_npz(const std::string& input) {
  static const Parts parts = temporal_parts();
  static const TempFolder folder("fuzz_4dgs");
  write_file(folder / "a.npz", zip_of(parts, input));
  check(io::load_temporal(folder / "a.npz"));
}

/// A dataset in whose first file, scene or stage is the input, by its first byte.
void read_dataset(const std::string& input) {
  static const Parts parts = dataset_parts();
  static const TempFolder folder("fuzz_dataset");
  Parts changed = parts;
  auto it = changed.begin();
  std::advance(it, input.empty() ? 0 : static_cast<unsigned char>(input[0]) % parts.size());
  it->second = input.substr(input.empty() ? 0 : 1);
  for (const auto& [name, content] : changed) write_file(folder / name, content);
  (void)io::load_habitat_dataset(folder / "a.scene_dataset_config.json");
  (void)io::load_stage_config(folder / "a.stage_config.json");
  (void)io::load_avatar_scene(folder / "a.scene_instance.json");
}

/// Skeleton and motion, parted by the first zero.
void read_amc(const std::string& input) {
  static const TempFolder folder("fuzz_amc");
  const std::size_t cut = std::min(input.find('\0'), input.size());
  write_file(folder / "a.asf", input.substr(0, cut));
  write_file(folder / "a.amc", input.substr(std::min(cut + 1, input.size())));
  (void)io::load_amc(folder / "a.asf", folder / "a.amc");
}

/// Rig and weights, parted by the first zero, of a fixed body.
void read_makehuman(const std::string& input) {
  static const TempFolder folder("fuzz_makehuman");
  const std::size_t cut = std::min(input.find('\0'), input.size());
  write_file(folder / "a.obj", "v 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0\ng body\nf 1 2 3 4\n");
  write_file(folder / "a.mhskel", input.substr(0, cut));
  write_file(folder / "w.mhw", input.substr(std::min(cut + 1, input.size())));
  io::MakeHumanOptions options;
  options.skeleton = folder / "a.mhskel";
  (void)io::load_makehuman(folder / "a.obj", options);
}

/// Reading may ask for four times the file, Detour's allocations counted, or 80 bytes a height triangle;
/// questions for more.
void read_navmesh(const std::string& input) {
  reset_largest_allocation();
  const auto mesh = parse_navmesh(bytes_of(input), "fuzz");
  const std::size_t most = largest_allocation();
  if (most > 4 * input.size() + 1024) {  // a line of what is wrong has room
    stop("parsing " + std::to_string(input.size()) + " bytes asked for " + std::to_string(most));
  }
  if (!mesh) return;
  Rng rng(1);
  const NavPoint a = mesh->random_point(rng), b = mesh->random_point(rng);
  if (!is_finite(a.position) || !is_finite(b.position)) stop("a random point that is nowhere");
  (void)mesh->path_between(a, b);
  (void)mesh->snap_point(a.position);
  (void)mesh->walk(a, b.position - a.position, true);
  (void)mesh->distance_to_closest_obstacle(a.position);
}

/// Stops where what was read cannot be.
template <class F>
auto stops(const F& read) {
  return [read](const std::string& input) {
    if (const char* flaw = read(input)) stop(flaw);
  };
}

struct Reader {
  std::function<void(const std::string&)> read;
  std::size_t fixed, multiple;  ///< bytes that one allocation may have: fixed + multiple * the file's
};

constexpr std::size_t kMiB = std::size_t{1} << 20;

const std::map<std::string, Reader> kReaders = {
    {"ply", {[](const std::string& s) { check(io::parse_ply(bytes_of(s), "fuzz")); }, kMiB, 64}},
    {"4dgs_ply",
     {[](const std::string& s) { check(io::parse_temporal_ply(bytes_of(s), "fuzz")); }, kMiB, 64}},
    {"4dgs_npz", {read_temporal_npz, 260 * kMiB, 10000}},
    {"splat", {[](const std::string& s) { check(io::parse_splat(bytes_of(s), "fuzz")); }, kMiB, 4}},
    {"ksplat", {[](const std::string& s) { check(io::parse_ksplat(bytes_of(s), "fuzz")); }, kMiB, 64}},
    {"spz", {read_spz, kMiB, 1000}},
    {"sog",
     {[](const std::string& s) {
        static const Parts parts = sog_parts();
        check(io::load_sog(file_of(zip_of(parts, s))));
      },
      64 * kMiB, 2048}},
    {"visible", {stops(read_visible), kMiB, 64}},
    {"lod", {stops(read_lod), kMiB, 64}},
    {"lod_set", {read_lod_set, 64 * kMiB, 2048}},
    {"gltf", {read_gltf, kMiB, 260}},
    {"surface", {read_surface, 260 * kMiB, 10000}},
    {"obj", {[](const std::string& s) { check(io::load_obj(file_of(s))); }, kMiB, 64}},
    {"mesh_ply", {[](const std::string& s) { check(io::load_ply_mesh(file_of(s))); }, kMiB, 64}},
    {"png", {[](const std::string& s) { check(io::load_png(file_of(s))); }, 64 * kMiB, 10000}},
    {"jpeg",
     {[](const std::string& s) { check(io::detail::decode_jpeg(bytes_of(s), "fuzz")); }, 64 * kMiB,
      10000}},
    {"webp", {read_webp, 64 * kMiB, 10000}},
    {"npy", {[](const std::string& s) { (void)io::load_npy(file_of(s)); }, kMiB, 64}},
    {"npz", {read_npz, 260 * kMiB, 10000}},
    {"driver", {read_driver, 260 * kMiB, 10000}},
    {"smpl_motion", {read_smpl_motion, 260 * kMiB, 10000}},
    {"bvh", {[](const std::string& s) { (void)io::load_bvh(file_of(s)); }, kMiB, 1000}},
    {"cameras", {[](const std::string& s) { (void)io::load_cameras(file_of(s)); }, kMiB, 1000}},
    {"dataset", {read_dataset, kMiB, 1000}},
    {"amc", {read_amc, kMiB, 1000}},
    {"makehuman", {read_makehuman, kMiB, 1000}},
    {"episodes", {[](const std::string& s) { (void)io::load_episodes(file_of(s)); }, kMiB, 20000}},
    {"navmesh", {read_navmesh, 64 * kMiB, 1000}},
};

/// Of GSNAV_FUZZ_READER. Detour's allocations are counted from now on.
const Reader& chosen() {
  dtAllocSetCustom([](std::size_t size, dtAllocHint) { return ::operator new(size, std::nothrow); },
                   [](void* p) { ::operator delete(p); });
  const char* name = std::getenv("GSNAV_FUZZ_READER");
  const auto found = kReaders.find(name == nullptr ? "" : name);
  if (found != kReaders.end()) return found->second;
  stop("GSNAV_FUZZ_READER names no reader");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Reader& reader = chosen();
  const std::string input(reinterpret_cast<const char*>(data), size);
  static bool first = true;  // seeds' parts are made in the first run
  reset_largest_allocation();
  reader.read(input);
  if (!first && largest_allocation() > reader.fixed + reader.multiple * size) {
    stop("an allocation of " + std::to_string(largest_allocation()) + " bytes for " +
         std::to_string(size));
  }
  first = false;
  return 0;
}
