// What the narrow phase found is taken over here, in the order of contacts: ends and beginnings of touch, with the
// events and colours they bring. Whatever depends on that order is done by one thread.
#include <algorithm>

#include "dynamics/hit.hpp"
#include "dynamics/manifold_update.hpp"
#include "dynamics/overlap.hpp"
#include "dynamics/softness.hpp"
#include "native/native_simulator.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

constexpr std::size_t ahead = 8, far_ahead = 16;  // contacts that are fetched before their turn
constexpr std::size_t manifold_grain = 12;

}  // namespace

void NativeSimulator::take_over_changes() {
  profile.counts.recycled = 0;
  parted_.clear();
  std::size_t begun = 0;
  for (const ChunkCounts counts : chunk_counts_) begun += counts.begun;
  give_back_room(fresh_, begun);
  give_back_room(meetings_, begun);
  make_room(fresh_, begun);
  for (std::size_t i = 0; i < chunk_counts_.size(); ++i) {
    const ChunkCounts counts = chunk_counts_[i];
    profile.counts.recycled += counts.recycled;
    if (counts.parted != 0) {
      const std::vector<PartedContact>& parted = chunks_of_changes_[i].parted;
      make_room(parted_, parted_.size() + parted.size());
      parted_.insert(parted_.end(), parted.begin(), parted.end());
    }
    if (counts.begun != 0) {
      for (const NewManifold& fresh : chunks_of_changes_[i].begun) fresh_.push_back(&fresh);
    }
  }
  end_contacts();
  begin_contacts();
}

void NativeSimulator::end_contacts() {
  graph_.remove(parted_, pool_, [&] {
    for (std::size_t i = 0; i < parted_.size(); ++i) {
      if (i + far_ahead < parted_.size()) graph_.prefetch(parted_[i + far_ahead].contact);
      if (i + ahead < parted_.size() && graph_[parted_[i + ahead].contact].touching())
        graph_.prefetch_bodies(parted_[i + ahead].contact);
      if (graph_[parted_[i].contact].touching()) end_touching(parted_[i].contact);
    }
  });
}

void NativeSimulator::begin_contacts() {
  const std::size_t count = fresh_.size();
  graph_.make_manifolds(count);
  grow_to(meetings_, count);
  const auto fetch_ahead = [&](std::size_t i) {
    if (i + 2 * far_ahead < count) __builtin_prefetch(fresh_[i + 2 * far_ahead]);
    if (i + far_ahead < count) graph_.prefetch(fresh_[i + far_ahead]->contact);
    if (i + ahead < count) graph_.prefetch_bodies(fresh_[i + ahead]->contact);
  };
  // An island that wakes up has those of its contacts coloured that touch by then.
  const bool wakes_any = def.sleep.enabled && std::any_of(fresh_.begin(), fresh_.end(), [&](const NewManifold* fresh) {
                           return is_asleep(graph_[fresh->contact].a) || is_asleep(graph_[fresh->contact].b);
                         });
  if (wakes_any)
    for (std::size_t i = 0; i < count; ++i) {
      fetch_ahead(i);
      graph_.begin(i, fresh_[i]->contact);
      begin_touching(fresh_[i]->contact);
    }
  // Colours are one thread's work, which the others need not wait for.
  const auto colour = [&] {
    if (wakes_any) return;
    for (std::size_t i = 0; i < count; ++i) {
      fetch_ahead(i);
      begin_touching(fresh_[i]->contact);
    }
  };
  pool_.for_each_chunk_beside(colour, count, manifold_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!wakes_any) graph_.begin(i, fresh_[i]->contact);
      meetings_[i] = first_manifold(*fresh_[i]);
    }
  });
  for (const HitEvent& meeting : meetings_)
    if (meeting.approach_speed > def.solver.restitution_threshold) hits_.push_back(meeting);
}

bool NativeSimulator::is_asleep(std::uint32_t slot) const {
  return !(state_.flags[slot] & (awake | isolated)) && bodies[slot].motion == MotionType::dynamic;
}

void NativeSimulator::begin_touching(std::uint32_t index) {
  const Contact& c = graph_[index];
  for (const std::uint32_t slot : {c.a, c.b})
    if (is_asleep(slot)) {
      islands_.wake(slot);
      active_is_current_ = false;
    }
  if (c.colour == no_colour) graph_.colour(index);
  in_contact_is_current_ = false;
  begun_.push_back(event(c));
}

HitEvent NativeSimulator::first_manifold(const NewManifold& fresh) {
  Contact& c = graph_[fresh.contact];
  const auto thickness = [&](std::uint32_t slot) {
    const BodyInfo& info = bodies[slot];
    const Geometry& shape = info.geometry;
    return half_thickness(shape.type, shape.half_extents, shape.radius, info.radius);
  };
  ContactManifold& manifold = graph_.manifold(c);
  manifold = {};
  graph_.mix_materials(c);
  const float overlap = first_overlap(fresh.manifold, manifold.restitution, thickness(c.a), thickness(c.b),
                                      contact_sag(def) * length(def.gravity));
  c.recycle_distance = overlap > 0 ? -overlap : recycle_distance(bodies[c.a], bodies[c.b]);
  set_manifold(manifold, fresh.manifold, fresh.b_in_a);
  return hit(c);
}

void NativeSimulator::end_touching(std::uint32_t index) {
  if (graph_[index].colour != no_colour) graph_.uncolour(index);
  in_contact_is_current_ = false;
  ended_.push_back(event(graph_[index]));
  graph_.end(index);
}

void NativeSimulator::drop_contact(std::uint32_t index, std::vector<ContactEvent>& ended) {
  if (graph_[index].touching()) {
    ended.push_back(event(graph_[index]));
    in_contact_is_current_ = false;
  }
  graph_.remove(index);
}

ContactEvent NativeSimulator::event(const Contact& c) const {
  return {bodies.id(std::min(c.a, c.b)), bodies.id(std::max(c.a, c.b))};
}

HitEvent NativeSimulator::hit(const Contact& c) const {
  const Hit hit = fastest_hit(graph_.manifold(c), state_.poses[c.a], state_.poses[c.b], state_.velocities[c.a],
                              state_.velocities[c.b]);
  const ContactEvent ids = event(c);
  return {ids.a, ids.b, hit.point, c.b < c.a ? -hit.normal : hit.normal, hit.speed};
}

}  // namespace fathom::native
