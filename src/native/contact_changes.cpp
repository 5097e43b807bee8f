// What the narrow phase found is taken over here, in the order of contacts: ends and beginnings of touch, with the
// events and colours they bring. Whatever depends on that order is done by one thread.
#include <algorithm>

#include "dynamics/manifold_update.hpp"
#include "native/native_simulator.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

constexpr std::size_t ahead = 8, far_ahead = 16;  // contacts that are fetched before their turn
constexpr std::size_t least_manifolds = 8;        // worth another thread

}  // namespace

void NativeSimulator::take_over_changes() {
  profile.counts.recycled = 0;
  parted_.clear();
  for (const ChunkOfChanges& chunk : chunks_of_changes_) {
    profile.counts.recycled += chunk.recycled;
    make_room(parted_, parted_.size() + chunk.parted.size());
    parted_.insert(parted_.end(), chunk.parted.begin(), chunk.parted.end());
  }
  end_contacts();
  begin_contacts();
}

void NativeSimulator::end_contacts() {
  for (std::size_t i = 0; i < parted_.size(); ++i) {
    if (i + far_ahead < parted_.size()) graph_.prefetch(parted_[i + far_ahead].contact);
    if (i + ahead < parted_.size()) graph_.prefetch_neighbours(parted_[i + ahead].contact);
    if (parted_[i].gone)
      drop_contact(parted_[i].contact, ended_);
    else
      end_touching(parted_[i].contact);
  }
}

void NativeSimulator::begin_contacts() {
  std::size_t count = 0;
  for (const ChunkOfChanges& chunk : chunks_of_changes_) {
    count += chunk.begun.size();
    for (const NewManifold& fresh : chunk.begun) begin_touching(fresh);
  }
  if (count == 0) return;
  const std::size_t chunks = chunks_of_changes_.size();
  pool_.for_each_part(chunks, std::max<std::size_t>(1, chunks * least_manifolds / count),
                      [&](std::size_t begin, std::size_t end) {
                        for (std::size_t i = begin; i < end; ++i)
                          for (NewManifold& fresh : chunks_of_changes_[i].begun) first_manifold(fresh);
                      });
  for (const ChunkOfChanges& chunk : chunks_of_changes_)
    for (const NewManifold& fresh : chunk.begun)
      if (fresh.meeting_speed > def.solver.restitution_threshold) hits_.push_back(hit(graph_[fresh.contact]));
}

void NativeSimulator::begin_touching(const NewManifold& fresh) {
  const std::uint32_t index = fresh.contact;
  graph_.begin(index);
  const Contact& c = graph_[index];
  for (const std::uint32_t slot : {c.a, c.b})
    if (!(state_.flags[slot] & (awake | isolated)) && bodies[slot].motion == MotionType::dynamic) {
      islands_.wake(slot);
      active_is_current_ = false;
    }
  if (c.colour == no_colour) graph_.colour(index);
  in_contact_is_current_ = false;
  begun_.push_back(event(c));
}

void NativeSimulator::first_manifold(NewManifold& fresh) {
  const Contact& c = graph_[fresh.contact];
  ContactManifold& manifold = graph_.manifold(c);
  manifold = {};
  graph_.mix_materials(c);
  set_manifold(manifold, fresh.manifold, fresh.b_in_a);
  fresh.meeting_speed = hit(c).approach_speed;
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

/// Where and how fast the bodies meet.
HitEvent NativeSimulator::hit(const Contact& c) const {
  const ContactManifold& m = graph_.manifold(c);
  const Pose &pa = state_.poses[c.a], &pb = state_.poses[c.b];
  const Velocity &va = state_.velocities[c.a], &vb = state_.velocities[c.b];
  const Vec3 normal = rotate(pa.rotation, m.normal);
  float fastest = 0;
  Vec3 where;
  for (int i = 0; i < m.point_count(); ++i) {
    const Vec3 arm_a = rotate(pa.rotation, m.points[i].anchor_a), arm_b = rotate(pb.rotation, m.points[i].anchor_b);
    const Vec3 speed = (vb.linear + cross(vb.angular, arm_b)) - (va.linear + cross(va.angular, arm_a));
    if (-dot(speed, normal) > fastest) fastest = -dot(speed, normal), where = pa.position + arm_a;
  }
  const ContactEvent ids = event(c);
  return {ids.a, ids.b, where, c.b < c.a ? -normal : normal, fastest};
}

}  // namespace fathom::native
