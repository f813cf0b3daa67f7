// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

/// The numbers that tune gsnav for a GPU, a struct for each stage of a frame. They change time and
/// memory, but no bit of an image. bench/cuda/NOTES.md has the values that were tried. `kBlocks` is the
/// number of blocks that a launch has per multiprocessor. `kResident` is the number that must fit on a
/// multiprocessor at once, which limits the registers of a thread.
namespace gsnav::cuda::policy {

/// Sizes of tiles, and which of the two ways a batch is drawn by.
struct Batch {
  static constexpr int kTile = 16, kSmallTile = 8;  ///< pixels a side; small where cameras are few
  /// A call has "few cameras" where an image has at most kFewTiles tiles of 16 pixels, and all images
  /// together at most kFewTilesEach per multiprocessor. Twice as many are allowed where a camera sees
  /// kManyGaussians or more.
  static constexpr std::uint64_t kFewTiles = 512, kFewTilesEach = 16, kManyGaussians = 2'500'000;
  /// In images of more tiles for each multiprocessor lists are short for the most part.
  static constexpr std::uint64_t kShortListTiles = 16;
  /// Calls that may be under way before one is waited for.
  static constexpr int kInFlight = 3;
};

/// First guesses of capacities, and how much room lists have.
struct Capacity {
  static constexpr std::uint64_t kGaussiansPerSlot = 4, kLeastSlots = 1u << 16, kMostSlots = 1u << 26;
  static constexpr std::uint32_t kSlotsPerHard = 32, kSlotsPerLarge = 32, kSlotsPerSeveral = 16,
                                 kSlotsPerSeveralOfFew = 4, kSlotsPerBeyond = 16, kPairsPerSlot = 2;
  static constexpr std::uint64_t kRoomStep = 32;  ///< a list's room is a multiple of so many pairs
  /// Lists get more room after a call in which more than one pair in kPairsPerBeyond did not fit.
  static constexpr std::uint32_t kPairsPerBeyond = 16;
  /// Depth records are written where there are at least kHalfPixelsPerDepth / 2 pixels per slot.
  static constexpr std::size_t kHalfPixelsPerDepth = 5;
};

struct Cull {
  static constexpr unsigned kThreads = 256, kBlocks = 8;
};

struct Project {
  static constexpr unsigned kWarps = 4, kResident = 5;
  static constexpr unsigned kHardThreads = 128, kHardBlocks = 8;
  /// Slots that a warp takes at a time: few cameras leave few to share them.
  static constexpr std::uint32_t kFewCameras = 8, kSlab = 256, kSlabOfFew = 64;
};

struct Bin {
  static constexpr unsigned kThreads = 128, kBlocks = 16;
  /// Where cameras are few, a list has 2^kMinDepthBits to 2^kMaxDepthBits bins of depth, as many as so
  /// many counters allow; 2^kOctaves octaves of depth from the near plane on, or from kNear metres.
  static constexpr int kMinDepthBits = 6, kMaxDepthBits = 9, kOctaves = 3;
  static constexpr std::uint32_t kCounters = 1u << 22;
  static constexpr float kNear = 0.125f;
  /// A part of a list begins with the first bin that begins so many pairs after the last.
  static constexpr std::uint32_t kPartLength = 128;
};

struct Order {
  static constexpr int kThreads = 128, kItems = 4;  ///< pairs a thread puts in order at a time
  static constexpr int kBinBits = 7;                ///< 2^kBinBits bins partition a list
  static constexpr int kBucketBits = 10;            ///< a batch is scattered into 2^kBucketBits buckets
  /// A batch with a longer bucket is sorted by rank and key.
  static constexpr std::uint32_t kLongestBucket = 64;
  static constexpr unsigned kFetched = 8;  ///< pairs that a thread of a partition asks for at a time
  static constexpr int kTieRounds = 8;     ///< neighbours of equal depth change places so often
  static constexpr unsigned kPartBlocks = 8, kLongBlocks = 6, kListBlocks = 16;
};

struct Blend {
  static constexpr int kPixels = 2;             ///< of a thread, one above the other
  static constexpr std::uint32_t kChunk = 256;  ///< splats that are staged at a time
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
  static constexpr int kResident = 4;
#else
  static constexpr int kResident = 7;
#endif
  static constexpr int kResidentWithMesh = 4;
};

/// Blending of few cameras: half of a block's threads draw, the other half stages.
struct BlendSmall {
  static constexpr int kThreads = 128;
  static constexpr std::uint32_t kOfThread = 2;  ///< splats that a thread stages at a time
  static constexpr int kResident = 3;            ///< four would spill registers: 4 to 8 % slower
};

struct MedianDepth {
  static constexpr unsigned kColumns = 16, kRows = 8;  ///< pixels of a block
  static constexpr int kResident = 6;
};

struct Mesh {
  static constexpr unsigned kScanThreads = 1024, kDrawThreads = 128, kDrawBlocks = 16;
  static constexpr unsigned kFrameDrawBlocks = 2048;  ///< at most, where a frame is no batch
  static constexpr int kSmallBox =
      8;                            ///< a thread draws triangles of up to kSmallBox^2 pixels by itself
  static constexpr int kUnit = 32;  ///< larger ones are drawn in squares of so many pixels, a warp each
  static constexpr std::size_t kMostLarge = std::size_t{1} << 24;  ///< triangles a launch
  /// What cameras of a wave may take together, where one alone does not take more: 170 MB of vertices,
  /// 130 of pixels.
  static constexpr std::size_t kWaveVertices = std::size_t{1} << 22, kWavePixels = std::size_t{1} << 24;
  /// First guess of a wave's triangles.
  static constexpr std::uint64_t kLeastTriangles = 1u << 14, kMostTriangles = 1u << 21;
};

struct Skin {
  static constexpr unsigned kThreads = 256;
  static constexpr unsigned kResident4 = 4, kResident8 = 3;  ///< by influences: what registers allow
  static constexpr std::size_t kMaxShared = 48 * 1024;       ///< bytes of joints
  static constexpr unsigned kMostCopies = 8;                 ///< of each joint in shared memory
  static constexpr std::uint32_t kFewJobs = 20;              ///< whose arrays go with the launch
};

/// Stages of a frame of one camera that a batch does not draw (core/stages.hpp).
struct Stages {
  static constexpr unsigned kEachThreads = 128;
  static constexpr int kProjectThreads = 128;
  static constexpr int kBlendChunk = 64;  ///< splats that are staged at a time
};

/// Copies to the device from memory that is not pinned.
struct Upload {
  static constexpr std::size_t kMaxBytes = std::size_t{1} << 20;  ///< of one copy
  static constexpr std::size_t kBlocks = 8;
};

}  // namespace gsnav::cuda::policy
