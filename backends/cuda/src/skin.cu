// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <type_traits>
#include <vector>

#include "gsnav/backends/cuda.hpp"
#include "gsnav/backends/cuda/policy.hpp"
#include "search.cuh"

// Skinning of many avatars by one launch, or by two if some have four influences and some eight.

namespace gsnav {

namespace {

using Policy = cuda::policy::Skin;
constexpr unsigned kThreads = Policy::kThreads;
template <int K>
constexpr unsigned kBlocks = K == kInfluences4 ? Policy::kResident4 : Policy::kResident8;
static_assert(sizeof(Affine3<float>) == 3 * sizeof(float4));

/// An avatar, and the first of its pieces of kThreads Gaussians.
struct SkinJob {
  const float* means[3];
  const float* quats[4];
  const std::uint16_t* joint_indices;
  const std::uint16_t* weights;
  const Affine3<float>* joints;
  float* means_out[3];
  float* quats_out[4];
  float* rotations_out[4];  ///< Null if not requested.
  std::uint32_t size, first_piece, joint_count;
  bool aligned;  ///< Indices and weights of a Gaussian are aligned, so that one load reads them.

  __host__ __device__ bool writes_rotations() const { return rotations_out[0] != nullptr; }
};

/// Passed to the kernel by value.
struct SkinLaunch {
  const SkinJob* table;  ///< Null if the jobs are in `few`.
  std::uint32_t count, pieces;
  unsigned copies;  ///< Copies of each joint in shared memory.
  SkinJob few[Policy::kFewJobs];
};
static_assert(sizeof(SkinLaunch) <= 4096 - 64);

/// Reads K numbers, with one load if `from` is aligned.
template <int K>
__device__ void read_numbers(std::uint16_t (&to)[K], const std::uint16_t* from, bool aligned) {
  if (!aligned) {
    for (int k = 0; k < K; ++k) to[k] = from[k];
    return;
  }
  using Words = std::conditional_t<K == 4, uint2, uint4>;
  const Words w = *reinterpret_cast<const Words*>(from);
  const auto split = [&to](int at, unsigned two) {
    to[at] = static_cast<std::uint16_t>(two);
    to[at + 1] = static_cast<std::uint16_t>(two >> 16);
  };
  split(0, w.x);
  split(2, w.y);
  if constexpr (K == 8) {
    split(4, w.z);
    split(6, w.w);
  }
}

template <int K>
__device__ SkinRow<K> read_row(const SkinJob& job, std::uint32_t i) {
  SkinRow<K> row;
  read_numbers(row.joints, job.joint_indices + std::size_t{K} * i, job.aligned);
  read_numbers(row.parts, job.weights + std::size_t{K} * i, job.aligned);
  row.mean = {job.means[0][i], job.means[1][i], job.means[2][i]};
  row.quat = {job.quats[0][i], job.quats[1][i], job.quats[2][i], job.quats[3][i]};
  return row;
}

/// jobs[index], loaded again. Keeping its twenty addresses would take forty registers.
__device__ inline const SkinJob& afresh(const SkinJob* jobs, std::uint32_t index) {
  asm volatile("" : "+r"(index));
  return jobs[index];
}

/// Skins Gaussians [begin, end) of jobs[index].
template <int K, class JointAt>
__device__ void skin_rows(const SkinJob* jobs, std::uint32_t index, std::uint32_t begin,
                          std::uint32_t end, const JointAt& joint_at) {
  for (std::uint32_t i = begin + threadIdx.x; i < end; i += kThreads) {
    const SkinJob& job = afresh(jobs, index);
    const Skinned<float> s = skin_row<float>(read_row<K>(job, i), joint_at, job.writes_rotations());
    store_skinned(afresh(jobs, index), i, s);
  }
}

/// Skins an even share of all pieces per block. Joints of an avatar are kept in shared memory if they
/// fit. `Few`: the jobs were passed with the launch.
template <int K, bool Few>
__global__ void __launch_bounds__(kThreads, kBlocks<K>)
    skin_kernel(const __grid_constant__ SkinLaunch launch) {
  extern __shared__ float4 memory[];
  __shared__ SkinJob kept;  // Current entry of the table.
  const SkinJob* const jobs = Few ? launch.few : launch.table;
  const auto share = [&](unsigned block) {
    return static_cast<std::uint32_t>(std::uint64_t{launch.pieces} * block / gridDim.x);
  };
  std::uint32_t piece = share(blockIdx.x);
  const std::uint32_t end = share(blockIdx.x + 1);
  std::uint32_t at = cuda::last_start(std::uint32_t{0}, launch.count,
                                      [&](std::uint32_t i) { return jobs[i].first_piece <= piece; });
  for (; piece < end; ++at) {
    const SkinJob& job = jobs[at];
    const std::uint32_t after = at + 1 < launch.count ? jobs[at + 1].first_piece : launch.pieces;
    const std::uint32_t last = min(after, end);
    const std::uint32_t first_row = (piece - job.first_piece) * kThreads;
    const std::uint32_t end_row = min((last - job.first_piece) * kThreads, job.size);
    piece = last;
    const unsigned copies = launch.copies;
    const bool fits = job.joint_count * sizeof(Affine3<float>) <= Policy::kMaxShared / copies;
    __syncthreads();  // Wait until all threads have finished the previous avatar.
    if (!Few && threadIdx.x == 0) kept = job;
    if (fits) {
      constexpr unsigned kWords = sizeof(Affine3<float>) / sizeof(float);
      auto* const words = reinterpret_cast<float*>(memory);
      const auto* const from = reinterpret_cast<const float*>(job.joints);
      for (unsigned i = threadIdx.x; i < kWords * job.joint_count; i += kThreads) {
        const float word = from[i];
        float* const to = words + i / kWords * kWords * copies + i % kWords;
        for (unsigned c = 0; c < copies; ++c) to[c * kWords] = word;
      }
    }
    __syncthreads();
    const auto rows = [&](const auto& joint_at) {
      skin_rows<K>(Few ? jobs : &kept, Few ? at : 0, first_row, end_row, joint_at);
    };
    if (!fits) {
      rows([&](std::uint16_t j) -> const Affine3<float>& { return (Few ? job : kept).joints[j]; });
      continue;
    }
    // Shared memory serves eight lanes at a time with 16 bytes each. Every lane has its own copy of the
    // joints, in its own banks, so lanes never wait for each other, whichever joints they need.
    const float4* const own = memory + 3 * (threadIdx.x % copies);
    rows([&](std::uint16_t j) {
      const float4* const quads = own + j * (3 * copies);
      const float4 a = quads[0], b = quads[1], c = quads[2];
      Affine3<float> joint;
      joint.linear.row[0] = {a.x, a.y, a.z};
      joint.linear.row[1] = {a.w, b.x, b.y};
      joint.linear.row[2] = {b.z, b.w, c.x};
      joint.translation = {c.y, c.z, c.w};
      return joint;
    });
  }
}

/// Arrays of an avatar in the form that the kernel takes.
SkinJob job_of(const SkinningArgs<float>& args, std::uint32_t first_piece) {
  SkinJob job{};
  for (int k = 0; k < 3; ++k) {
    job.means[k] = args.means[k].data;
    job.means_out[k] = args.means_out[k].data;
  }
  for (int k = 0; k < 4; ++k) {
    job.quats[k] = args.quats[k].data;
    job.quats_out[k] = args.quats_out[k].data;
    if (args.writes_rotations()) job.rotations_out[k] = args.rotations_out[k].data;
  }
  job.joint_indices = args.joint_indices.data;
  job.weights = args.weights.data;
  job.joints = args.joints.data;
  job.size = static_cast<std::uint32_t>(args.size());
  job.first_piece = first_piece;
  job.joint_count = static_cast<std::uint32_t>(args.joints.size);
  const auto places = reinterpret_cast<std::uintptr_t>(job.joint_indices) |
                      reinterpret_cast<std::uintptr_t>(job.weights);
  job.aligned = places % (sizeof(std::uint16_t) * static_cast<unsigned>(args.influences)) == 0;
  return job;
}

template <int K>
void start(SkinLaunch& launch, std::size_t shared, int multiprocessors, cudaStream_t stream) {
  const unsigned blocks = std::min(launch.pieces, static_cast<unsigned>(multiprocessors) * kBlocks<K>);
  if (launch.table == nullptr) {
    skin_kernel<K, true><<<blocks, kThreads, shared, stream>>>(launch);
  } else {
    skin_kernel<K, false><<<blocks, kThreads, shared, stream>>>(launch);
  }
}

}  // namespace

void CudaBackend::run(stage::SkinAll, std::span<const SkinningArgs<float>> avatars) {
  int multiprocessors = 0;
  std::vector<SkinJob> jobs;
  for (const int influences : {kInfluences4, kInfluences8}) {
    if (!usable()) return;
    SkinLaunch launch{};
    std::size_t most = 0;  // Joints in shared memory.
    jobs.clear();
    for (const SkinningArgs<float>& args : avatars) {
      if (args.size() == 0 || args.influences != influences) continue;
      jobs.push_back(job_of(args, launch.pieces));
      launch.pieces += static_cast<std::uint32_t>((args.size() + kThreads - 1) / kThreads);
      if (args.joints.size * sizeof(Affine3<float>) <= Policy::kMaxShared)
        most = std::max(most, args.joints.size);
    }
    if (jobs.empty()) continue;
    launch.count = static_cast<std::uint32_t>(jobs.size());
    launch.copies = Policy::kMostCopies;
    while (most * sizeof(Affine3<float>) > Policy::kMaxShared / launch.copies) launch.copies /= 2;
    if (jobs.size() <= Policy::kFewJobs) {
      std::copy(jobs.begin(), jobs.end(), launch.few);
    } else {
      auto* const table = static_cast<SkinJob*>(scratch(kSkinJobs, jobs.size() * sizeof(SkinJob)));
      copy(table, jobs.data(), jobs.size() * sizeof(SkinJob), CopyKind::host_to_device);
      launch.table = table;
    }
    note(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device_),
         "cudaDeviceGetAttribute");
    const std::size_t shared = most * launch.copies * sizeof(Affine3<float>);
    if (influences == kInfluences8) {
      start<kInfluences8>(launch, shared, multiprocessors, stream_);
    } else {
      start<kInfluences4>(launch, shared, multiprocessors, stream_);
    }
    note(cudaGetLastError(), "the skinning");
  }
}

}  // namespace gsnav
