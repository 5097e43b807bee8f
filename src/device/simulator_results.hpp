// Results of a finished step of the device simulator: events, contacts, queries.
#pragma once

#include <algorithm>
#include <bit>
#include <map>
#include <tuple>

#include "check/check.hpp"
#include "device/device_simulator.hpp"

namespace fathom::device {

template <exec::Device D>
template <class T>
std::vector<T> DeviceSimulator<D>::download(const T* from, std::size_t count) {
  exec::PinnedBuffer<T> staging(device_, count);
  if (count > 0) {
    device_.copy_to_host(staging.data(), from, count);
    device_.wait();
  }
  return {staging.begin(), staging.end()};
}

template <exec::Device D>
template <class T>
std::span<const T> DeviceSimulator<D>::fetch(exec::PinnedBuffer<T>& staging, const T* from, std::size_t count) {
  if (staging.size() < count) staging = exec::PinnedBuffer<T>(device_, count + count / 4);
  if (count > 0) device_.copy_to_host(staging.data(), from, count);
  device_.wait();
  return {staging.data(), count};
}

template <exec::Device D>
void DeviceSimulator<D>::reserve_events(StepBuffers& buffers, std::size_t room) {
  const auto reserve = [&](auto& buffer) {
    if (buffer.size() < room) buffer = std::decay_t<decltype(buffer)>(device_, room);
  };
  reserve(buffers.begun), reserve(buffers.ended), reserve(buffers.hits);
}

template <exec::Device D>
CopyEvents DeviceSimulator<D>::copy_of_events(StepBuffers& buffers, std::uint64_t number) {
  return {.contacts = contact_memory_.contacts(),
          .step = static_cast<std::uint32_t>(number),
          .begun_count = 0,
          .ended_count = 0,
          .hit_count = 0,
          .room = static_cast<std::uint32_t>(buffers.begun.size()),
          .begun = buffers.begun.data(),
          .ended = buffers.ended.data(),
          .hits = buffers.hits.data()};
}

template <exec::Device D>
void DeviceSimulator<D>::clear_events() {
  begun_.clear(), ended_.clear(), hits_.clear(), quarantined_.clear();
}

template <exec::Device D>
void DeviceSimulator<D>::fetch_events() const {
  events_are_read_ = true;
  look();
  if (events_are_current_) return;
  if (def.ahead == 0 && newest_.step > 0) self().collect_events(newest_.step, newest_);
  self().events_are_current_ = true;
}

// Lists are in any order; the application gets them sorted by index. Lists copied with their step are already on the
// host, unless they exceed the room there.
template <exec::Device D>
void DeviceSimulator<D>::collect_events(std::uint64_t number, const Report& report) {
  const std::uint32_t most = std::max({report.begun, report.ended, report.hits});
  if (most == 0 && report.quarantined == 0) return;
  StepBuffers& buffers = buffers_of(number);
  if (most > 0 && (buffers.events_of != number || most > buffers.begun.size())) {
    reserve_events(buffers, std::max<std::size_t>(first_events, most + most / 2));
    CopyEvents copy = copy_of_events(buffers, number);
    copy.begun_count = report.begun, copy.ended_count = report.ended, copy.hit_count = report.hits;
    device_.parallel_for(most, copy);
    device_.wait();
    buffers.events_of = number;
  }
  // Bodies added since may have no memory yet.
  const std::size_t stepped = std::min<std::size_t>(indices_.size(), body_memory_.capacity());
  const auto isolated_in = download(body_memory_.arrays().isolated_in, report.quarantined ? stepped : 0);

  const auto id_of = [&](std::uint32_t index) {
    const BodyId* const former = indices_.former(index, number);
    return former ? *former : bodies.id(indices_.slot(index));
  };
  const auto named = [&](std::uint32_t i, std::uint32_t j) {
    const BodyId a = id_of(i), b = id_of(j);
    return a.index < b.index ? ContactEvent{a, b, number} : ContactEvent{b, a, number};
  };
  std::vector<ContactEvent> begun, ended;
  std::vector<HitEvent> hits;
  std::vector<Quarantine> quarantined;
  std::vector<PairRecord> pairs_begun(buffers.begun.begin(), buffers.begun.begin() + report.begun);
  std::vector<PairRecord> pairs_ended(buffers.ended.begin(), buffers.ended.begin() + report.ended);
  if (has_parts()) merge_parts(pairs_begun, pairs_ended);
  begun.reserve(pairs_begun.size()), ended.reserve(pairs_ended.size()), hits.reserve(report.hits);
  for (const PairRecord pair : pairs_begun) begun.push_back(named(pair.a, pair.b));
  for (const PairRecord pair : pairs_ended) ended.push_back(named(pair.a, pair.b));
  for (std::uint32_t k = 0; k < report.hits; ++k) {
    const HitRecord& hit = buffers.hits[k];
    const ContactEvent ids = named(hit.a, hit.b);
    const bool swapped = ids.a != id_of(hit.a);
    hits.push_back({ids.a, ids.b, hit.point, swapped ? -hit.normal : hit.normal, hit.speed, 0, number});
  }
  for (std::uint32_t index = 0; index < isolated_in.size(); ++index)
    if (isolated_in[index] == report.step) quarantined.push_back({id_of(index), number});
  const auto before = [](const auto& x, const auto& y) {
    return x.a.index != y.a.index ? x.a.index < y.a.index : x.b.index < y.b.index;
  };
  std::ranges::sort(begun, before);
  std::ranges::sort(ended, before);
  std::ranges::sort(hits, [&](const HitEvent& x, const HitEvent& y) {
    if (before(x, y) || before(y, x)) return before(x, y);
    const auto key = [](const HitEvent& hit) {
      return std::tuple(hit.approach_speed, hit.point.x, hit.point.y, hit.point.z);
    };
    return key(x) < key(y);  // several parts of two bodies may hit at once
  });
  std::ranges::sort(quarantined, {}, [](const Quarantine& q) { return q.body.index; });
  const std::size_t dropped = begun_.add(begun) + ended_.add(ended) + hits_.add(hits) + quarantined_.add(quarantined);
  if (dropped > 0 && def.log && !std::exchange(told_of_dropped_events_, true))
    def.log("step " + std::to_string(number) + ": nobody has read events for so long that the oldest are dropped");
}

/// Bodies touch as long as any of their parts does: leaves the pairs of which that changes.
template <exec::Device D>
void DeviceSimulator<D>::merge_parts(std::vector<PairRecord>& begun, std::vector<PairRecord>& ended) {
  std::map<std::uint64_t, std::int64_t> changes;  // of the number of touching parts
  const auto count = [&](std::vector<PairRecord>& records, int change) {
    std::erase_if(records, [&](const PairRecord& pair) {
      if (pair.a & part_tag) changes[std::uint64_t{pair.a & ~part_tag} << 32 | pair.b] += change;
      return pair.a & part_tag;
    });
  };
  count(begun, 1), count(ended, -1);
  for (const auto& [pair, change] : changes) {
    const auto known = touching_parts_.find(pair);
    const std::uint32_t before = known != touching_parts_.end() ? known->second : 0;
    FATHOM_ASSERT(before + change >= 0);
    const auto now = static_cast<std::uint32_t>(before + change);
    if ((before > 0) != (now > 0))
      (now > 0 ? begun : ended).push_back({static_cast<std::uint32_t>(pair >> 32), static_cast<std::uint32_t>(pair)});
    if (now > 0)
      touching_parts_[pair] = now;
    else
      touching_parts_.erase(pair);
  }
}

template <exec::Device D>
std::span<const ContactEvent> DeviceSimulator<D>::contacts_begun() const {
  fetch_events();
  return begun_.read();
}
template <exec::Device D>
std::span<const ContactEvent> DeviceSimulator<D>::contacts_ended() const {
  fetch_events();
  return ended_.read();
}
template <exec::Device D>
std::span<const HitEvent> DeviceSimulator<D>::hits() const {
  fetch_events();
  return hits_.read();
}
template <exec::Device D>
std::span<const Quarantine> DeviceSimulator<D>::quarantined() const {
  fetch_events();
  return quarantined_.read();
}

template <exec::Device D>
void DeviceSimulator<D>::for_each_contact(const std::function<void(const ContactInfo&)>& visit) const {
  retire_all();
  fetch_bodies();
  const ContactArrays arrays = self().contact_memory_.contacts();
  const std::span<const Contact> contacts = self().fetch(contacts_read_, arrays.contacts, newest_.contacts);
  std::size_t last = 0;
  for (const Contact& c : contacts)
    if (c.in_use() && c.touching()) last = std::max<std::size_t>(last, c.manifold + 1);
  const std::span<const ContactManifold> manifolds = self().fetch(manifolds_read_, arrays.manifolds, last);
  // Sorted by slots and children, with small entries.
  struct Entry {
    std::uint64_t slots;
    std::uint32_t children, contact;
  };
  std::vector<Entry> order;
  order.reserve(newest_.constraints);
  for (std::uint32_t k = 0; k < contacts.size(); ++k) {
    const Contact& c = contacts[k];
    if (!c.in_use() || !c.in_touch()) continue;
    const std::uint32_t slot_a = indices_.slot(c.a), slot_b = indices_.slot(c.b);
    if (slot_a == none || slot_b == none) continue;
    const std::uint32_t children = slot_a < slot_b ? c.children : std::rotl(c.children, 16);
    order.push_back({std::uint64_t{std::min(slot_a, slot_b)} << 32 | std::max(slot_a, slot_b), children, k});
  }
  std::ranges::sort(order, [](const Entry& x, const Entry& y) {
    return x.slots != y.slots ? x.slots < y.slots : x.children < y.children;
  });
  std::vector<ContactInfo> infos;
  infos.reserve(order.size());
  for (const Entry& entry : order) {
    const Contact& c = contacts[entry.contact];
    const std::uint32_t slot_a = indices_.slot(c.a), slot_b = indices_.slot(c.b);
    const ContactManifold& m = manifolds[c.manifold];
    const Pose &pa = poses_[slot_a], &pb = poses_[slot_b];
    BodyId a = bodies.id(slot_a), b = bodies.id(slot_b);
    const Vec3 normal = rotate(pa.rotation, m.normal);
    const bool swapped = slot_b < slot_a;
    if (swapped) std::swap(a, b);
    ContactInfo info{a, b, swapped ? -normal : normal, m.point_count(), {}};
    info.child_a = c.is_patch() ? c.patch_material() : c.child_a(), info.child_b = c.child_b();
    if (swapped) std::swap(info.child_a, info.child_b);
    if ((c.bits & colour_bits) < overflow_colour) info.colour = static_cast<int>(c.bits & colour_bits);
    for (int p = 0; p < info.point_count; ++p) {
      const Vec3 on_a = transform(pa, m.points[p].anchor_a), on_b = transform(pb, m.points[p].anchor_b);
      info.points[p] = {0.5f * (on_a + on_b), dot(on_b - on_a, normal), m.step_impulse_of(p)};
    }
    infos.push_back(info);
  }
  for (const ContactInfo& info : infos) visit(info);
}

template <exec::Device D>
std::span<const Pose> DeviceSimulator<D>::refresh_queries() {
  upload_shapes();  // for rays; first, because waiting for steps outdates queries
  fetch_bodies();
  tree_.refresh(bodies, {poses_.data(), bodies.slot_count()});
  query_memory_.note_poses();
  return {poses_.data(), bodies.slot_count()};
}

}  // namespace fathom::device
