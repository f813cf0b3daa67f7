// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

/// Tuning constants for a GPU, one struct per stage of a frame. They affect time and memory, but no bit
/// of an image. bench/cuda/NOTES.md lists the values that were measured. `kBlocks` is the number of
/// blocks per multiprocessor in a launch. `kResident` is the number of blocks that must fit on a
/// multiprocessor at once, which limits the registers per thread.
namespace gsnav::cuda::policy {

/// Sizes of tiles, and the choice between the two ways of drawing a batch.
struct Batch {
  static constexpr int kTile = 16, kSmallTile = 8;  ///< Tile width in pixels. The small size is for few
                                                    ///< cameras.
  /// A call has few cameras if an image has at most kFewTiles tiles of 16 pixels, and all images
  /// together have at most kFewTilesEach tiles per multiprocessor. The second limit doubles if a camera
  /// sees kManyGaussians or more, or if an image has at most kSmallImageTiles tiles.
  static constexpr std::uint64_t kFewTiles = 512, kFewTilesEach = 16, kManyGaussians = 2'500'000;
  static constexpr std::uint64_t kSmallImageTiles = 16;
  /// Above this number of tiles per multiprocessor, most lists are short.
  static constexpr std::uint64_t kShortListTiles = 16;
  /// With at least this number of pairs of camera and set, they are prepared on the host's threads.
  static constexpr std::size_t kThreadedInstances = 128;
  /// Number of calls that may be in progress before one is waited for.
  static constexpr int kInFlight = 3;
};

/// First estimates of capacities, and the space reserved for lists.
struct Capacity {
  static constexpr std::uint64_t kGaussiansPerSlot = 4, kLeastSlots = 1u << 16, kMostSlots = 1u << 26;
  static constexpr std::uint32_t kSlotsPerPrecise = 32, kSlotsPerLarge = 32, kSlotsPerSeveral = 16,
                                 kSlotsPerSeveralOfFew = 4, kSlotsPerBeyond = 16, kPairsPerSlot = 2;
  static constexpr std::uint64_t kRoomStep = 32;  ///< The space of a list is a multiple of this number
                                                  ///< of pairs.
  /// Lists get more space if more than one pair in kPairsPerBeyond did not fit in the last call.
  static constexpr std::uint32_t kPairsPerBeyond = 16;
  /// If a capacity is too small for n, it grows to n + n / kGrowth + kLeastGrowth.
  static constexpr std::uint64_t kGrowth = 8, kLeastGrowth = 1024;
  /// Warps that may be on a multiprocessor at once. Each may leave slots of its slab unused.
  static constexpr std::uint64_t kWarps = 64;
  /// Depth records are written if there are at least kHalfPixelsPerDepth / 2 pixels per slot.
  static constexpr std::size_t kHalfPixelsPerDepth = 5;
};

struct Cull {
  static constexpr unsigned kThreads = 256, kBlocks = 8;
};

struct Project {
  static constexpr unsigned kWarps = 4, kResident = 5;
  static constexpr unsigned kPreciseThreads = 128, kPreciseBlocks = 8;
  /// Number of slots that a warp takes at a time. Few cameras provide fewer warps with work, so slabs
  /// are smaller.
  static constexpr std::uint32_t kFewCameras = 8, kSlab = 256, kSlabOfFew = 64;
};

struct Bin {
  static constexpr unsigned kThreads = 128, kBlocks = 16;
  /// With few cameras, a list has 2^kMinDepthBits to 2^kMaxDepthBits depth bins, limited by kCounters.
  /// The bins span 2^kOctaves octaves of depth from the near plane on, or from kNear metres.
  static constexpr int kMinDepthBits = 6, kMaxDepthBits = 9, kOctaves = 3;
  static constexpr std::uint32_t kCounters = 1u << 22;
  static constexpr float kNear = 0.125f;
  /// A part of a list begins at the first bin that starts at least this number of pairs after the
  /// previous part.
  static constexpr std::uint32_t kPartLength = 128;
};

struct Order {
  static constexpr int kThreads = 128, kItems = 4;  ///< Pairs that a thread sorts at a time.
  static constexpr int kBinBits = 7;                ///< A list is partitioned into 2^kBinBits bins.
  static constexpr int kBucketBits = 10;            ///< A batch is scattered into 2^kBucketBits buckets.
  /// A batch with a longer bucket is sorted by rank and key.
  static constexpr std::uint32_t kLongestBucket = 64;
  /// Keys that a warp sorts in registers, with E per lane.
  template <int E>
  static constexpr std::uint32_t kOfWarp = 32u * E;
  static constexpr unsigned kFetched = 8;  ///< Pairs that a thread requests at a time while
                                           ///< partitioning.
  static constexpr int kTieRounds = 12;    ///< Largest number of passes that swap neighbours of equal
                                           ///< depth.
  static constexpr unsigned kPartBlocks = 8, kLongBlocks = 6, kListBlocks = 16;
  static constexpr std::size_t kLentBytes = 12800;  ///< Shared memory for the caller between calls.
};

struct Blend {
  static constexpr int kPixels = 2;             ///< Pixels per thread, one above the other.
  static constexpr std::uint32_t kChunk = 256;  ///< Splats staged at a time.
  /// After this number of listed splats, a warp looks whether all of its pixels are closed.
  static constexpr std::uint32_t kUntilClosed = 16;
#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
  static constexpr int kResident = 4;
#else
  static constexpr int kResident = 7;
#endif
  static constexpr int kResidentWithMesh = 4;
};

/// Blending for few cameras. Half of a block's threads blend, the other half stages.
struct BlendSmall {
  static constexpr int kThreads = 128;
  static constexpr std::uint32_t kOfThread = 2;  ///< Splats that a thread stages at a time.
  static constexpr int kResident = 3;            ///< With four, registers would spill, which is 4 to 8 %
                                                 ///< slower.
};

/// Small images of many cameras, drawn by lists of regions.
struct Regions {
  static constexpr int kRegion = 16, kTile = 8;  ///< Width of a region and of a tile in pixels.
  /// Largest width and height of an image. In larger ones, too many tiles project the same row.
  static constexpr int kSide = 64;
  /// Cameras that see fewer Gaussians each, on average, are drawn by tiles: lists of regions then cost
  /// more than they save.
  static constexpr std::uint64_t kLeastGaussians = 100'000;
  /// Fewer cameras do not keep all multiprocessors busy.
  static constexpr std::size_t kLeastCameras = 128;
  static constexpr std::uint64_t kMostRows = (1u << 20) - (1u << 14);  ///< Largest number per camera.
  static constexpr std::uint32_t kMostPreciseRows = 1u << 13;          ///< Largest number of their
                                                                       ///< records per camera.
  /// Depth bins of all regions of an image, and of one region. They cover kOctaves octaves, of which
  /// kOctavesBelow are nearer than the mean.
  static constexpr std::uint32_t kBins = 20480, kMostBins = 1280, kOctaves = 5, kOctavesBelow = 3;
  static constexpr unsigned kRowThreads = 256, kCullThreads = 256, kCullBlocks = 16;
  static constexpr unsigned kListThreads = 1024, kListResident = 1, kGroupsAtOnce = 4;
  /// A camera is listed in parts if it has more than its share of the groups in view of all: for
  /// kListParts of them per multiprocessor, but up to kMostListParts.
  static constexpr std::uint32_t kListParts = 2, kMostListParts = 4;
  static constexpr unsigned kPlanThreads = 1024;
  static constexpr unsigned kPreciseThreads = 128, kOrderThreads = 256;
  /// A tile is drawn in quarters or halves if its list is longer than this fraction of the rows that a
  /// warp reads on average.
  static constexpr float kQuarters = 0.8f, kHalves = 0.4f;
  static constexpr float kFirst = 2.5f;  ///< Tiles this much longer than kQuarters are drawn first.
  static constexpr unsigned kDrawWarps = 4, kDrawResident = 4;
  /// Between two passes, a warp gives half of its open pixels to an idle one, up to kGives times, if at
  /// least this many pairs of pixels are open and this many rows of its list are left.
  static constexpr std::uint32_t kLeastPairs = 2, kLeastRows = 256;
  static constexpr int kGives = 2;
  static constexpr std::uint32_t kParts = 4096;  ///< Largest number of parts given in a call.
  /// Idle warps look for a part at intervals that double from kLeastSleep to kMostSleep, nanoseconds.
  static constexpr unsigned kLeastSleep = 500, kMostSleep = 4000;
  /// Numbers of rows: the most that a warp holds, those that it collects, and the fewest that it draws.
  static constexpr std::uint32_t kHeld = 256, kTarget = 160, kLeast = 48;
  static constexpr std::uint32_t kStaged = 64;     ///< Splats staged before they are drawn.
  static constexpr std::uint32_t kReadAtOnce = 4;  ///< Batches of 32 rows of a list.
  static constexpr std::uint64_t kGaussiansPerPair = 2, kPairsPerPreciseRow = 16;  ///< First estimates.
};

struct MedianDepth {
  static constexpr unsigned kColumns = 16, kRows = 8;  ///< Pixels per block.
  static constexpr int kResident = 6;
};

struct Mesh {
  static constexpr unsigned kScanThreads = 1024, kDrawThreads = 128, kDrawBlocks = 16;
  static constexpr unsigned kFrameDrawBlocks = 2048;  ///< Upper limit for a frame outside a batch.
  static constexpr int kSmallBox = 8;  ///< One thread draws a triangle of up to kSmallBox^2 pixels.
  static constexpr int kUnit = 32;  ///< Larger triangles are drawn in squares of this width in pixels,
                                    ///< one warp per square.
  static constexpr std::size_t kMostLarge = std::size_t{1} << 24;  ///< Triangles per launch.
  /// Limits for the cameras of a wave together, unless one camera alone exceeds them: 170 MB of
  /// vertices, 130 MB of pixels.
  static constexpr std::size_t kWaveVertices = std::size_t{1} << 22, kWavePixels = std::size_t{1} << 24;
  /// First estimate of the triangles of a wave.
  static constexpr std::uint64_t kLeastTriangles = 1u << 14, kMostTriangles = 1u << 21;
};

struct Skin {
  static constexpr unsigned kThreads = 256;
  static constexpr unsigned kResident4 = 4, kResident8 = 3;  ///< For 4 and 8 influences, limited by
                                                             ///< registers.
  static constexpr std::size_t kMaxShared = 48 * 1024;       ///< Bytes of joints.
  static constexpr unsigned kMostCopies = 8;                 ///< Copies of each joint in shared memory.
  static constexpr std::uint32_t kFewJobs = 20;              ///< Up to this number of jobs, their arrays
                                                             ///< are passed with the launch.
};

/// Stages of a single-camera frame outside a batch (core/stages.hpp).
struct Stages {
  static constexpr unsigned kEachThreads = 128;
  /// Work items that take long, such as chunks, are few. Launches of less than kFewItems have small
  /// blocks, which reach more multiprocessors.
  static constexpr unsigned kFewThreads = 32;
  static constexpr std::size_t kFewItems = 32768;
};

/// Copies to the device from memory that is not pinned.
struct Upload {
  static constexpr std::size_t kMaxBytes = std::size_t{4} << 20;  ///< Size of one copy.
  static constexpr std::size_t kBlocks = 8;
};

/// Conversion of an image to a texture of OpenGL.
struct GlImage {
  static constexpr unsigned kThreads = 128;
};

}  // namespace gsnav::cuda::policy
