// What the device simulator answers of a finished step: events, contacts, queries.
#pragma once

#include <algorithm>

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
BodyId DeviceSimulator<D>::id_of(std::uint32_t index) const {
  const auto former = former_ids_.find(index);
  return former != former_ids_.end() ? former->second : bodies.id(slot_of_[index]);
}

template <exec::Device D>
ContactEvent DeviceSimulator<D>::event(PairRecord pair) const {
  const BodyId a = id_of(pair.a), b = id_of(pair.b);
  return a.index < b.index ? ContactEvent{a, b} : ContactEvent{b, a};
}

template <exec::Device D>
void DeviceSimulator<D>::fetch_events() const {
  look();
  if (!events_are_current_) self().fetch_events_now();
}

// Lists come in any order; the application gets them by index.
template <exec::Device D>
void DeviceSimulator<D>::fetch_events_now() {
  begun_.clear();
  ended_.clear();
  hits_.clear();
  quarantined_.clear();
  if (newest_.step == 0) {
    events_are_current_ = true;
    return;
  }
  const ContactArrays arrays = contact_memory_.contacts();
  const auto before = [](const auto& x, const auto& y) {
    return x.a.index != y.a.index ? x.a.index < y.a.index : x.b.index < y.b.index;
  };
  const auto for_each = [&](const auto* lists, std::uint32_t count, const auto& act) {
    // Lists of several steps take turns.
    const std::size_t first = arrays.event(newest_.step, 0);
    const auto all = download(lists + first, count == 0 ? 0 : arrays.event(newest_.step, count - 1) + 1 - first);
    for (std::size_t i = 0; i < all.size(); i += arrays.event_lists) act(all[i]);
  };
  for_each(arrays.begun, newest_.begun, [&](const PairRecord& pair) { begun_.push_back(event(pair)); });
  for_each(arrays.ended, newest_.ended, [&](const PairRecord& pair) { ended_.push_back(event(pair)); });
  for_each(arrays.hits, newest_.hits, [&](const HitRecord& hit) {
    const ContactEvent ids = event({hit.a, hit.b});
    const bool swapped = ids.a != id_of(hit.a);
    hits_.push_back({ids.a, ids.b, hit.point, swapped ? -hit.normal : hit.normal, hit.speed});
  });
  std::sort(begun_.begin(), begun_.end(), before);
  std::sort(ended_.begin(), ended_.end(), before);
  std::sort(hits_.begin(), hits_.end(), before);
  const auto isolated_in = download(body_memory_.arrays().isolated_in, newest_.quarantined ? slot_of_.size() : 0);
  for (std::uint32_t index = 0; index < isolated_in.size(); ++index)
    if (isolated_in[index] == newest_.step) quarantined_.push_back({id_of(index), newest_.step});
  std::sort(quarantined_.begin(), quarantined_.end(),
            [](const Quarantine& x, const Quarantine& y) { return x.body.index < y.body.index; });
  events_are_current_ = true;
}

template <exec::Device D>
std::span<const ContactEvent> DeviceSimulator<D>::contacts_begun() const {
  fetch_events();
  return begun_;
}
template <exec::Device D>
std::span<const ContactEvent> DeviceSimulator<D>::contacts_ended() const {
  fetch_events();
  return ended_;
}
template <exec::Device D>
std::span<const HitEvent> DeviceSimulator<D>::hits() const {
  fetch_events();
  return hits_;
}
template <exec::Device D>
std::span<const Quarantine> DeviceSimulator<D>::quarantined() const {
  fetch_events();
  return quarantined_;
}

template <exec::Device D>
void DeviceSimulator<D>::for_each_contact(const std::function<void(const ContactInfo&)>& visit) const {
  fetch_bodies();
  const ContactArrays arrays = self().contact_memory_.contacts();
  const auto contacts = self().download(arrays.contacts, newest_.contacts);
  std::size_t last = 0;
  for (const Contact& c : contacts)
    if (c.in_use() && c.touching()) last = std::max<std::size_t>(last, c.manifold + 1);
  const auto manifolds = self().download(arrays.manifolds, last);
  std::vector<ContactInfo> infos;
  for (const Contact& c : contacts) {
    if (!c.in_use() || !c.touching() || slot_of_[c.a] == none || slot_of_[c.b] == none) continue;
    const ContactManifold& m = manifolds[c.manifold];
    const Pose &pa = poses_[slot_of_[c.a]], &pb = poses_[slot_of_[c.b]];
    const ContactEvent ids = event({c.a, c.b});
    const Vec3 normal = rotate(pa.rotation, m.normal);
    ContactInfo info{ids.a, ids.b, ids.a.index == slot_of_[c.a] ? normal : -normal, m.point_count(), {}};
    if ((c.bits & colour_bits) < overflow_colour) info.colour = static_cast<int>(c.bits & colour_bits);
    for (int p = 0; p < info.point_count; ++p) {
      const Vec3 on_a = transform(pa, m.points[p].anchor_a), on_b = transform(pb, m.points[p].anchor_b);
      info.points[p] = {0.5f * (on_a + on_b), dot(on_b - on_a, normal), m.step_impulse_of(p)};
    }
    infos.push_back(info);
  }
  std::sort(infos.begin(), infos.end(), [](const ContactInfo& x, const ContactInfo& y) {
    return x.a.index != y.a.index ? x.a.index < y.a.index : x.b.index < y.b.index;
  });
  for (const ContactInfo& info : infos) visit(info);
}

// Queries look at every body's bounds on the host: they are rare beside steps, and the mirror is there.
template <exec::Device D>
std::optional<RayHit> DeviceSimulator<D>::ray_cast(Vec3 origin, Vec3 translation, std::uint32_t mask) const {
  fetch_bodies();
  const Aabb around{min(origin, origin + translation), max(origin, origin + translation)};
  std::optional<RayHit> nearest;
  for (const BodyId id : bodies.living()) {
    const BodyInfo& info = bodies[id.index];
    if ((info.filter.category & mask) == 0 || !overlaps(grown(bounds(id.index), 1e-3f * info.radius), around)) continue;
    const auto hit = fathom::ray_cast(info.geometry, poses_[id.index], origin, translation);
    if (!hit || (nearest && nearest->fraction <= hit->fraction)) continue;
    nearest = RayHit{id, hit->fraction, mul_add(origin, hit->fraction, translation), hit->normal};
  }
  return nearest;
}

template <exec::Device D>
void DeviceSimulator<D>::overlap(const Aabb& box, std::uint32_t mask, std::vector<std::uint32_t>& slots) const {
  fetch_bodies();
  for (const BodyId id : bodies.living())
    if (bodies[id.index].filter.category & mask && overlaps(bounds(id.index), box)) slots.push_back(id.index);
}

}  // namespace fathom::device
