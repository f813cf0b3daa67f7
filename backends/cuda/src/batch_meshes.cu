// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "batch_state.cuh"
#include "gsnav/backends/cuda/device.cuh"

// Meshes of a batch: a layer of depth and colour per camera, over which Gaussians are blended. The host
// knows which instances each camera may see. The number of triangles that this makes stays on the
// device, like counts of splats.

namespace gsnav {

namespace {

using Policy = cuda::policy::Mesh;

std::uint32_t chunks_of(std::size_t n) {
  return static_cast<std::uint32_t>((n + kMeshChunk - 1) / kMeshChunk);
}

/// Converts an image to 8 bits.
struct BytesOfImage {
  const float* from;
  std::uint8_t* to;
  GSNAV_HD void operator()(std::size_t i) const noexcept { to[i] = to_byte(from[i]); }
};

}  // namespace

/// Lists what each camera sees, in waves of cameras. `most_triangles` is the largest number of a wave.
Status CudaBatchRenderer::State::list_meshes(std::span<const BatchCamera> cameras,
                                             std::uint64_t& most_triangles) {
  const std::size_t pixels = image_pixels();
  cuda::Flight& flight = flights[calls % cuda::policy::Batch::kInFlight];
  meshes.placements.clear();
  meshes.places.clear();
  meshes.chunk_begins.clear();
  std::uint64_t triangles = 0;
  for (std::uint32_t c = 0; c < cameras.size(); ++c) {
    const MeshFrame& frame = cameras[c].meshes;
    if (Status s = detail::validate(frame.instances, cameras[c].camera, frame.light); !s) {
      return {s.code(), "CudaBatchRenderer: cameras[" + std::to_string(c) + "].meshes: " + s.message()};
    }
    const MeshCamera lens = MeshCamera::of(cameras[c].camera);
    const std::size_t first = meshes.placements.size();
    std::size_t vertices = 0;
    std::uint64_t of_camera = 0;
    for (const MeshInstance& instance : frame.instances) {
      flight.mesh_triangles += instance.mesh.triangle_count();
      MeshPlacement& p = meshes.placements.emplace_back();
      if (!detail::place_mesh(instance, cameras[c].camera, lens, false, p)) {
        meshes.placements.pop_back();
        continue;
      }
      vertices += p.mesh.vertices.size;
      of_camera += p.mesh.triangle_count();
    }
    if (meshes.waves.empty() || meshes.waves.back().vertices + vertices > Policy::kWaveVertices ||
        (meshes.waves.back().cameras + 1) * pixels > Policy::kWavePixels) {
      meshes.waves.push_back({c, static_cast<std::uint32_t>(first),
                              static_cast<std::uint32_t>(meshes.chunk_begins.size()), 0, 0, 0, 0, 0});
      meshes.chunk_begins.push_back(0);
      triangles = 0;
    }
    cuda::MeshWaveSize& wave = meshes.waves.back();
    for (std::size_t p = first; p < meshes.placements.size(); ++p) {
      meshes.places.push_back({wave.vertex_chunks, wave.triangle_chunks, wave.cameras});
      meshes.placements[p].first_vertex = wave.vertices;
      wave.vertices += meshes.placements[p].mesh.vertices.size;
      wave.vertex_chunks += chunks_of(meshes.placements[p].mesh.vertices.size);
      wave.triangle_chunks += chunks_of(meshes.placements[p].mesh.triangle_count());
      ++wave.placements;
    }
    ++wave.cameras;
    meshes.chunk_begins.push_back(wave.triangle_chunks);
    triangles += of_camera;
    most_triangles = std::max(most_triangles, triangles);
  }
  return {};
}

/// Copies lists, cameras and lights into the call's pinned memory.
void CudaBatchRenderer::State::write_mesh_inputs(std::span<const BatchCamera> cameras) {
  cuda::Flight& flight = flights[calls % cuda::policy::Batch::kInFlight];
  cuda::Layout layout;
  meshes.at_placements = layout.add<MeshPlacement>(meshes.placements.size());
  meshes.at_places = layout.add<cuda::MeshPlace>(meshes.places.size());
  meshes.at_cameras = layout.add<MeshCamera>(cameras.size());
  meshes.at_lights = layout.add<MeshShadeArgs<float>>(cameras.size());
  meshes.at_chunk_begins = layout.add<std::uint32_t>(meshes.chunk_begins.size());
  meshes.input_bytes = layout.bytes();
  flight.mesh_inputs.reserve(layout.bytes());
  const auto put = [&]<class T>(std::size_t at, const std::vector<T>& from) {
    std::copy(from.begin(), from.end(), reinterpret_cast<T*>(flight.mesh_inputs.data + at));
  };
  put(meshes.at_placements, meshes.placements);
  put(meshes.at_places, meshes.places);
  put(meshes.at_chunk_begins, meshes.chunk_begins);
  auto* const lenses = reinterpret_cast<MeshCamera*>(flight.mesh_inputs.data + meshes.at_cameras);
  auto* const lights =
      reinterpret_cast<MeshShadeArgs<float>*>(flight.mesh_inputs.data + meshes.at_lights);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    lenses[c] = MeshCamera::of(cameras[c].camera);
    lights[c] = {};
    detail::set_light(lights[c], cameras[c].meshes.light);
  }
}

Status CudaBatchRenderer::State::place_meshes(std::span<const BatchCamera> cameras) {
  cuda::Flight& flight = flights[calls % cuda::policy::Batch::kInFlight];
  flight.mesh_triangles = 0;
  meshes.waves.clear();
  meshes.layer = {};
  meshes.hard_depth = {};
  flight.has_meshes = std::any_of(cameras.begin(), cameras.end(),
                                  [](const BatchCamera& c) { return !c.meshes.instances.empty(); });
  if (!flight.has_meshes) return {};
  std::uint64_t most_triangles = 0;
  if (Status s = list_meshes(cameras, most_triangles); !s) return s;
  write_mesh_inputs(cameras);

  const std::size_t pixels = call_pixels();
  const bool color = raster.images.rgb != nullptr || rgb8 != nullptr;
  meshes.depth.resize_discard(pixels);
  meshes.color.resize_discard(color ? 3 * pixels : 0);
  meshes.layer = {meshes.depth.data(), color ? meshes.color.data() : nullptr, {}};
  if (config.composite == Composite::hard_depth) {
    separate_gaussians();
  } else {
    raster.mesh = meshes.layer;
  }
  if (triangle_capacity == 0) {  // An estimate, as for slots.
    triangle_capacity = static_cast<std::uint32_t>(
        std::clamp<std::uint64_t>(most_triangles / 2, Policy::kLeastTriangles, Policy::kMostTriangles));
  }
  return {};
}

void CudaBatchRenderer::State::separate_gaussians() {
  const std::size_t pixels = call_pixels();
  FrameImages<float>& alone = raster.images;
  meshes.hard_depth = {alone, nullptr, nullptr, meshes.layer, raster.background};
  meshes.hard_depth_bytes = std::exchange(rgb8, nullptr);
  const bool missing_color = meshes.hard_depth_bytes != nullptr && alone.rgb == nullptr;
  meshes.gaussians.resize_discard((missing_color ? 5 : 2) * pixels);
  alone = images_before_mesh(alone, meshes.gaussians.data(), pixels);
  if (missing_color) alone.rgb = meshes.gaussians.data() + 2 * pixels;
  meshes.hard_depth.images.rgb = alone.rgb;
  meshes.hard_depth.alpha = alone.alpha;
  meshes.hard_depth.expected = alone.expected_depth;
  raster.background = {};
  raster.rules = blend_rules<float>(config, alone);
}

void CudaBatchRenderer::State::composite_hard_depth() {
  const std::size_t pixels = call_pixels();
  backend.parallel_for(pixels, meshes.hard_depth);
  if (meshes.hard_depth_bytes != nullptr) {
    backend.parallel_for(3 * pixels,
                         BytesOfImage{meshes.hard_depth.images.rgb, meshes.hard_depth_bytes});
  }
}

void CudaBatchRenderer::State::size_layers() {
  std::size_t vertices = 0, chunks = 0, cameras = 0;
  for (const cuda::MeshWaveSize& w : meshes.waves) {
    vertices = std::max(vertices, w.vertices);
    chunks = std::max<std::size_t>(chunks, w.triangle_chunks);
    cameras = std::max<std::size_t>(cameras, w.cameras);
  }
  const std::size_t pixels = image_pixels();
  meshes.inputs.resize_discard(meshes.input_bytes);
  meshes.vertices.resize_discard(vertices);
  meshes.counts.resize_discard(chunks);
  meshes.offsets.resize_discard(chunks);
  meshes.camera_begins.resize_discard(cameras);
  meshes.triangles.resize_discard(triangle_capacity);
  meshes.pixels.resize_discard(cameras * pixels);
  meshes.large.resize_discard(cuda::large_bytes(triangle_capacity) / sizeof(unsigned long long) + 1);
  meshes.counters.resize_discard(1);
}

void CudaBatchRenderer::State::enqueue_layers(const cuda::Flight& flight) {
  const cudaStream_t stream = backend.stream();
  const int width = args.grid.width, height = args.grid.height;
  const std::size_t pixels = image_pixels();
  const auto there = [&]<class T>(const T*, std::size_t at, std::size_t first) {
    return reinterpret_cast<const T*>(meshes.inputs.data() + at) + first;
  };
  cudaMemcpyAsync(meshes.inputs.data(), flight.mesh_inputs.data, meshes.input_bytes,
                  cudaMemcpyHostToDevice, stream);
  backend.fill(meshes.counters.data(), 0, sizeof(cuda::MeshCounters));
  for (const cuda::MeshWaveSize& w : meshes.waves) {
    MeshSetupArgs<float> setup;
    setup.placements = {
        there(static_cast<MeshPlacement*>(nullptr), meshes.at_placements, w.first_placement),
        w.placements};
    setup.vertices = meshes.vertices.view();
    setup.counts = meshes.counts.view();
    setup.offsets = meshes.offsets.view();
    setup.triangles = meshes.triangles.view();
    cuda::MeshWave wave;
    wave.places = there(static_cast<cuda::MeshPlace*>(nullptr), meshes.at_places, w.first_placement);
    wave.cameras = there(static_cast<MeshCamera*>(nullptr), meshes.at_cameras, w.first_camera);
    wave.lights = there(static_cast<MeshShadeArgs<float>*>(nullptr), meshes.at_lights, w.first_camera);
    wave.chunk_begins =
        there(static_cast<std::uint32_t*>(nullptr), meshes.at_chunk_begins, w.first_begin);
    wave.placements = w.placements;
    wave.camera_count = w.cameras;
    wave.vertex_chunks = w.vertex_chunks;
    wave.triangle_chunks = w.triangle_chunks;
    wave.capacity = triangle_capacity;
    wave.camera_begins = meshes.camera_begins.data();
    wave.counters = meshes.counters.data();
    wave.pixels = meshes.pixels.data();
    wave.large = meshes.large.data();
    wave.depth = meshes.depth.data() + w.first_camera * pixels;
    wave.color =
        meshes.layer.color == nullptr ? nullptr : meshes.color.data() + 3 * w.first_camera * pixels;
    cuda::launch_mesh_wave(setup, width, height, wave, multiprocessors, stream);
  }
  if (meshes.layer.color != nullptr && config.blend_space == ColorSpace::linear) {
    backend.parallel_for(meshes.color.size(), DecodeImage<float>{meshes.color.data()});
  }
  backend.copy(flight.mesh_counters, meshes.counters.data(), sizeof(cuda::MeshCounters),
               CopyKind::device_to_host);
}

}  // namespace gsnav
