// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include "gsnav/backends/cuda.hpp"

// Skinning of many avatars by one launch.

namespace gsnav {

namespace {

constexpr unsigned kThreads = 256, kRowsPerBlock = 4 * kThreads;
constexpr std::size_t kMaxShared = 48 * 1024;
static_assert(sizeof(Affine3<float>) == 3 * sizeof(float4));

/// An avatar and the first of its blocks.
struct SkinJob {
  SkinningArgs<float> args;
  std::uint32_t first_block;
};

/// A block kRowsPerBlock Gaussians of one avatar, with its joints in shared memory where they fit.
__global__ void __launch_bounds__(kThreads) skin_kernel(const SkinJob* jobs, std::uint32_t count, std::size_t room) {
  extern __shared__ __align__(16) unsigned char memory[];
  std::uint32_t low = 0, high = count;
  while (high - low > 1) {
    const std::uint32_t mid = (low + high) / 2;
    if (jobs[mid].first_block <= blockIdx.x) {
      low = mid;
    } else {
      high = mid;
    }
  }
  const SkinningArgs<float> args = jobs[low].args;
  const std::size_t begin = std::size_t{blockIdx.x - jobs[low].first_block} * kRowsPerBlock + threadIdx.x;
  const std::size_t end = begin + kRowsPerBlock < args.size() ? begin + kRowsPerBlock : args.size();
  const auto rows = [&](const auto& joint_at) {
    if (args.influences == kInfluences8) {
      for (std::size_t i = begin; i < end; i += kThreads) skin_row<kInfluences8>(args, i, joint_at);
    } else {
      for (std::size_t i = begin; i < end; i += kThreads) skin_row<kInfluences4>(args, i, joint_at);
    }
  };
  const std::size_t bytes = args.joints.size * sizeof(Affine3<float>);
  if (bytes > room) return rows([&](std::uint16_t j) -> const Affine3<float>& { return args.joints[j]; });
  auto* const words = reinterpret_cast<float*>(memory);
  const auto* const from = reinterpret_cast<const float*>(args.joints.data);
  for (std::size_t i = threadIdx.x; i < bytes / sizeof(float); i += kThreads) words[i] = from[i];
  __syncthreads();
  // By 16 bytes: lanes have joints of their own, and would wait for each other's banks four times as often.
  const auto* const quads = reinterpret_cast<const float4*>(memory);
  rows([&](std::uint16_t j) {
    const float4 a = quads[3 * j], b = quads[3 * j + 1], c = quads[3 * j + 2];
    Affine3<float> joint;
    joint.linear.row[0] = {a.x, a.y, a.z};
    joint.linear.row[1] = {a.w, b.x, b.y};
    joint.linear.row[2] = {b.z, b.w, c.x};
    joint.translation = {c.y, c.z, c.w};
    return joint;
  });
}

}  // namespace

void CudaBackend::skin_all(std::span<const SkinningArgs<float>> avatars) {
  if (!usable()) return;
  std::vector<SkinJob> jobs;
  std::size_t blocks = 0, shared = 0;
  for (const SkinningArgs<float>& args : avatars) {
    if (args.size() == 0) continue;
    jobs.push_back({args, static_cast<std::uint32_t>(blocks)});
    blocks += (args.size() + kRowsPerBlock - 1) / kRowsPerBlock;
    const std::size_t bytes = args.joints.size * sizeof(Affine3<float>);
    if (bytes <= kMaxShared && bytes > shared) shared = bytes;
  }
  if (jobs.empty()) return;
  auto* const table = static_cast<SkinJob*>(scratch(kSkinJobs, jobs.size() * sizeof(SkinJob)));
  copy(table, jobs.data(), jobs.size() * sizeof(SkinJob), CopyKind::host_to_device);
  skin_kernel<<<static_cast<unsigned>(blocks), kThreads, shared, stream_>>>(
      table, static_cast<std::uint32_t>(jobs.size()), shared);
  note(cudaGetLastError(), "the skinning");
}

}  // namespace gsnav
