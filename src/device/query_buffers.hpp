// What many queries at once take to a device and bring back. Made for the first call, kept for the next.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "device/asked_shapes.hpp"
#include "device/overlap_shapes.hpp"
#include "device/staged_array.hpp"
#include "exec/device.hpp"

namespace fathom::device {

/// Rays or moving shapes on their way to the device, or hits on their way back.
template <exec::Device D, class Asked>
struct CastBatch {
  explicit CastBatch(D& device) : asked(device), hits(device), hits_read(device, 0), done(device) {}

  void reserve(D& device, std::size_t size) {
    asked.image(size);
    hits.grow(size);
    if (hits_read.size() < size) hits_read = exec::PinnedBuffer<BodyHit>(device, size);
  }

  StagedArray<Asked> asked;
  exec::Buffer<BodyHit> hits;
  exec::PinnedBuffer<BodyHit> hits_read;
  typename D::Event done;  ///< the hits have arrived
};

/// Two, so that the host passes on the hits of one while the device works on the other.
template <exec::Device D, class Asked>
using CastBatches = std::array<CastBatch<D, Asked>, 2>;

/// Placed shapes on their way to the device, or overlaps on their way back.
struct OverlapBatch {
  explicit OverlapBatch(exec::Memory& device)
      : shapes(device), found(device), found_read(device, 0), count(device, 1), count_read(device, 1) {}

  /// Passes on the first `found` overlaps read, which are those of shapes first … first + size − 1.
  void pass_on(std::size_t first, std::size_t size, std::size_t found, const TakeTouched& take);

  StagedArray<AskedShape> shapes;
  exec::Buffer<Overlap> found;
  exec::PinnedBuffer<Overlap> found_read;
  exec::Buffer<std::uint32_t> count;
  exec::PinnedBuffer<std::uint32_t> count_read;
  std::vector<std::uint32_t> slots;   ///< by shape
  std::vector<std::uint32_t> begins;  ///< of each shape's slots
};

template <exec::Device D>
struct QueryBuffers {
  explicit QueryBuffers(D& device)
      : ignored(device),
        rays{CastBatch<D, Ray>(device), CastBatch<D, Ray>(device)},
        shapes{CastBatch<D, AskedShape>(device), CastBatch<D, AskedShape>(device)},
        corners(device),
        overlaps(device) {}

  StagedArray<std::uint32_t> ignored;  ///< slots
  CastBatches<D, Ray> rays;
  CastBatches<D, AskedShape> shapes;
  AskedCorners corner_list;
  StagedArray<Vec3> corners;
  OverlapBatch overlaps;
};

}  // namespace fathom::device
