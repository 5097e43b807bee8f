// Many rays at once on the device.
#pragma once

#include <algorithm>

#include "check/check.hpp"
#include "device/device_simulator.hpp"
#include "device/tuning.hpp"

namespace fathom::device {

template <exec::Device D>
bool DeviceSimulator<D>::cast_rays(const ManyRays& many, const TakeHits& take) const {
  if (many.rays.size() < min_device_rays) return false;
  const std::lock_guard lock(casting_);
  self().cast_rays_now(many, take);
  return true;
}

/// Casts the rays in batches. While the device works on one, the host passes on the hits of the one before.
template <exec::Device D>
void DeviceSimulator<D>::cast_rays_now(const ManyRays& many, const TakeHits& take) {
  FATHOM_ASSERT(hull_memory_.is_current() && surface_memory_.is_current());
  ray_memory_.upload(device_, bodies, tree_.bodies(), {poses_.data(), bodies.slot_count()}, hull_memory_,
                     surface_memory_);
  const std::size_t batches = (many.rays.size() + max_rays_of_batch - 1) / max_rays_of_batch;
  const auto batch_of = [&](std::size_t k) -> RayBatch& { return ray_batches_[k % ray_batches_.size()]; };
  const auto rays_of = [&](std::size_t k) {
    const std::size_t first = k * max_rays_of_batch;
    return many.rays.subspan(first, std::min(max_rays_of_batch, many.rays.size() - first));
  };
  const auto pass_on = [&](std::size_t k) {
    batch_of(k).done.wait();
    take(k * max_rays_of_batch, {batch_of(k).hits_read.data(), rays_of(k).size()});
  };
  ignored_by_rays_.image(many.ignored.size());
  for (std::size_t k = 0; k < std::min(batches, ray_batches_.size()); ++k)
    batch_of(k).reserve(device_, rays_of(k).size());
  // From here on no memory is allocated: buffers must not go while copies are under way.
  ignored_by_rays_.upload(device_, many.ignored);
  for (std::size_t k = 0; k < batches; ++k) {
    if (k >= ray_batches_.size()) pass_on(k - ray_batches_.size());
    RayBatch& batch = batch_of(k);
    const std::span<const Ray> rays = rays_of(k);
    batch.rays.upload(device_, rays);
    device_.parallel_for(
        static_cast<std::uint32_t>(rays.size()),
        CastRays{ray_memory_.scene(), many.sight, ignored_by_rays_.data(),
                 static_cast<std::uint32_t>(many.ignored.size()), batch.rays.data(), batch.hits.data()});
    device_.copy_to_host_aside(batch.hits_read.data(), batch.hits.data(), rays.size());
    device_.mark_aside(batch.done);
  }
  for (std::size_t k = batches - std::min(batches, ray_batches_.size()); k < batches; ++k) pass_on(k);
}

}  // namespace fathom::device
