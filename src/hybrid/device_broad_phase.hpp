// The native simulator's broad phase on a device.
#pragma once

#include <functional>
#include <vector>

#include "device/detection.hpp"
#include "native/broad_phase.hpp"

namespace fathom::hybrid {

class DeviceBroadPhase final : public native::BroadPhase {
 public:
  /// `meanwhile` runs while the device searches.
  DeviceBroadPhase(device::Detection& detection, std::function<void()> meanwhile)
      : detection_(detection), meanwhile_(std::move(meanwhile)) {}

  /// The slot has a new body, or none.
  void forget(std::uint32_t slot) { emptied_.push_back(slot); }

  std::size_t find(const native::BroadPhaseInput& input, ThreadPool& pool,
                   std::vector<std::vector<native::Pair>>& found) override;

  // By slot: the device does not expose its order.
  void list_neighbours(std::vector<std::uint32_t>& slots) const override;
  std::uint64_t order() const override { return sets_; }

  // The device updates its own boxes.
  void refresh(const native::BroadPhaseInput&, ThreadPool&) override {}
  std::size_t memory_bytes() const override;

  // All device data follows from the bodies: uploads all boxes again.
  void save(ByteWriter&) const override {}
  void restore(ByteReader& in, std::span<const native::BodyBounds> bounds, ThreadPool& pool) override;

 private:
  void collect_updates(const native::BroadPhaseInput& input);

  device::Detection& detection_;
  std::function<void()> meanwhile_;
  std::vector<std::uint32_t> emptied_;
  std::vector<device::BoxUpdate> updates_;
  bool all_boxes_ = false;
  const BodyTable* bodies_ = nullptr;
  std::uint64_t sets_ = 0;  // changes of the set of bodies so far
};

}  // namespace fathom::hybrid
