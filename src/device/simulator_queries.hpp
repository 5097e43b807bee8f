// Many queries at once on the device; included by the source file of each back end that instantiates them.
#pragma once

#include <algorithm>

#include "check/check.hpp"
#include "device/cast_rays.hpp"
#include "device/cast_shapes.hpp"
#include "device/device_simulator.hpp"
#include "device/overlap_shapes.hpp"
#include "device/tuning.hpp"

namespace fathom::device {

/// Whether there are so many that the device is faster; `ask` then has it answer them, for one thread at a time.
template <exec::Device D>
template <class Ask>
bool DeviceSimulator<D>::answers(std::size_t count, const Ask& ask) {
  if (count < min_device_queries) return false;
  const std::lock_guard lock(querying_);
  if (std::exchange(is_querying_, true)) device_.wait();  // the last call failed halfway
  ask();
  is_querying_ = false;
  return true;
}

template <exec::Device D>
bool DeviceSimulator<D>::cast_rays(const ManyRays& many, const TakeHits& take) const {
  return self().answers(many.asked.size(), [&] { self().cast_rays_now(many, take); });
}
template <exec::Device D>
bool DeviceSimulator<D>::cast_shapes(const ManyShapes& many, const TakeHits& take) const {
  return self().answers(many.asked.size(), [&] { self().cast_shapes_now(many, take); });
}
template <exec::Device D>
bool DeviceSimulator<D>::overlap_shapes(const ManyShapes& many, const TakeTouched& take) const {
  return self().answers(many.asked.size(), [&] { self().overlap_shapes_now(many, take); });
}

/// Brings what queries meet up to date on the device, and the slots that they ignore.
template <exec::Device D>
QueryView DeviceSimulator<D>::upload_scene(const QuerySight& sight, std::span<const std::uint32_t> ignored) {
  FATHOM_ASSERT(hull_memory_.is_current() && surface_memory_.is_current());
  if (!query_buffers_) query_buffers_ = std::make_unique<QueryBuffers<D>>(device_);
  query_memory_.upload(device_, bodies, tree_.bodies(), {poses_.data(), bodies.slot_count()}, hull_memory_,
                       surface_memory_);
  query_buffers_->ignored.upload(device_, ignored);
  return {sight, query_buffers_->ignored.data(), static_cast<std::uint32_t>(ignored.size())};
}

/// Brings the corners of the shapes' hulls to the device.
template <exec::Device D>
const Vec3* DeviceSimulator<D>::upload_corners(std::span<const ShapeCast> shapes) {
  query_buffers_->corner_list.list(shapes);
  query_buffers_->corners.upload(device_, query_buffers_->corner_list.corners());
  return query_buffers_->corners.data();
}

template <exec::Device D>
void DeviceSimulator<D>::cast_rays_now(const ManyRays& many, const TakeHits& take) {
  const QueryView view = upload_scene(many.sight, many.ignored);
  const auto write = [&](std::span<const Ray> rays, Ray* to) { std::ranges::copy(rays, to); };
  const auto kernel = [&](const Ray* rays, BodyHit* hits) { return CastRays{query_memory_.scene(), view, rays, hits}; };
  cast_in_batches(query_buffers_->rays, many.asked, write, kernel, take);
}

template <exec::Device D>
void DeviceSimulator<D>::cast_shapes_now(const ManyShapes& many, const TakeHits& take) {
  const QueryView view = upload_scene(many.sight, many.ignored);
  const Vec3* const corners = upload_corners(many.asked);
  const auto write = [&](std::span<const ShapeCast> shapes, AskedShape* to) {
    query_buffers_->corner_list.write(shapes, to);
  };
  const auto kernel = [&](const AskedShape* shapes, BodyHit* hits) {
    return CastShapes{query_memory_.scene(), view, shapes, corners, hits};
  };
  cast_in_batches(query_buffers_->shapes, many.asked, write, kernel, take);
}

/// While the device works on one batch, the host passes on the hits of the one before. `write(queries, to)` says what
/// the device gets, `kernel(asked, hits)` casts it.
template <exec::Device D>
template <class Query, class Asked, class Write, class Kernel>
void DeviceSimulator<D>::cast_in_batches(CastBatches<D, Asked>& batches, std::span<const Query> queries,
                                         const Write& write, const Kernel& kernel, const TakeHits& take) {
  const std::size_t count = (queries.size() + max_queries_of_batch - 1) / max_queries_of_batch;
  const auto batch_of = [&](std::size_t k) -> CastBatch<D, Asked>& { return batches[k % batches.size()]; };
  const auto queries_of = [&](std::size_t k) {
    const std::size_t first = k * max_queries_of_batch;
    return queries.subspan(first, std::min(max_queries_of_batch, queries.size() - first));
  };
  const auto pass_on = [&](std::size_t k) {
    batch_of(k).done.wait();
    take(k * max_queries_of_batch, {batch_of(k).hits_read.data(), queries_of(k).size()});
  };
  // Buffers must not go while copies are under way: all are made before.
  for (std::size_t k = 0; k < std::min(count, batches.size()); ++k) batch_of(k).reserve(device_, queries_of(k).size());
  for (std::size_t k = 0; k < count; ++k) {
    if (k >= batches.size()) pass_on(k - batches.size());
    CastBatch<D, Asked>& batch = batch_of(k);
    const std::size_t size = queries_of(k).size();
    write(queries_of(k), batch.asked.image(size));
    batch.asked.upload(device_, size);
    device_.parallel_for(static_cast<std::uint32_t>(size), kernel(batch.asked.data(), batch.hits.data()));
    device_.copy_to_host_aside(batch.hits_read.data(), batch.hits.data(), size);
    device_.mark_aside(batch.done);
  }
  for (std::size_t k = count - std::min(count, batches.size()); k < count; ++k) pass_on(k);
}

/// While the device works on one batch, the host passes on the overlaps of the one before.
template <exec::Device D>
void DeviceSimulator<D>::overlap_shapes_now(const ManyShapes& many, const TakeTouched& take) {
  const QueryView view = upload_scene(many.sight, many.ignored);
  const Vec3* const corners = upload_corners(many.asked);
  OverlapBatch& batch = query_buffers_->overlaps;
  const auto ask = [&](std::size_t size) {
    device_.zero(batch.count.data(), 1);
    device_.parallel_for(static_cast<std::uint32_t>(size),
                         OverlapShapes{query_memory_.scene(), view, batch.shapes.data(), corners, batch.found.data(),
                                       static_cast<std::uint32_t>(batch.found.size()), batch.count.data()});
    device_.copy_to_host(batch.count_read.data(), batch.count.data(), 1);
  };
  std::size_t at_once = max_queries_of_batch;
  const auto begin = [&](std::size_t first) {
    const std::size_t size = std::min(at_once, many.asked.size() - first);
    batch.found.grow(std::min(max_overlaps_of_batch, first_overlaps_per_query * size));
    query_buffers_->corner_list.write(many.asked.subspan(first, size), batch.shapes.image(size));
    batch.shapes.upload(device_, size);
    ask(size);
    return size;
  };
  // One shape touches no more than all bodies.
  const std::size_t most = std::max(max_overlaps_of_batch, std::size_t{bodies.slot_count()});
  // Waits for a batch of that size; returns the size of the part that there was room for.
  const auto finish = [&](std::size_t size) {
    for (device_.wait(); batch.count_read[0] > batch.found.size(); device_.wait()) {
      if (batch.found.size() < most)
        batch.found.grow(std::min(most, 4 * batch.found.size()));
      else
        at_once = size = (size + 1) / 2;
      ask(size);
    }
    const std::size_t found = batch.count_read[0];
    if (batch.found_read.size() < found) batch.found_read = exec::PinnedBuffer<Overlap>(device_, found + found / 2);
    device_.copy_to_host(batch.found_read.data(), batch.found.data(), found);
    device_.wait();
    return size;
  };
  for (std::size_t first = 0, size = begin(0); size > 0;) {
    const std::size_t done = finish(size), found = batch.count_read[0];
    size = first + done < many.asked.size() ? begin(first + done) : 0;
    batch.pass_on(first, done, found, take);
    first += done;
  }
}

}  // namespace fathom::device
