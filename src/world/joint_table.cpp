#include "world/joint_table.hpp"

#include <algorithm>
#include <fathom/error.hpp>
#include <string>

#include "dynamics/ball_joint.hpp"
#include "world/archive.hpp"
#include "world/growth.hpp"
#include "world/joint_archive.hpp"
#include "world/validate.hpp"

namespace fathom {

namespace {

JointInfo make_info(const JointDef& def, const BodyTable& bodies) {
  JointInfo info{};
  info.def = def;
  info.swapped = bodies[def.b.index].motion != MotionType::dynamic;
  info.a = info.swapped ? def.b.index : def.a.index;
  info.b = info.swapped ? def.a.index : def.b.index;
  info.anchor_a = info.swapped ? def.frame_b.position : def.frame_a.position;
  info.anchor_b = info.swapped ? def.frame_a.position : def.frame_b.position;
  info.fixed_a = bodies[info.a].motion != MotionType::dynamic;
  info.swing_rate = max(swing_rate(info.anchor_a, bodies[info.a].inverse_inertia),
                        swing_rate(info.anchor_b, bodies[info.b].inverse_inertia));
  const auto mass = [&](const Pose& frame, BodyId id) {
    return JointedMass{frame, bodies[id.index].inverse_mass, bodies[id.index].inverse_inertia};
  };
  info.masses = joint_masses_of(def, mass(def.frame_a, def.a), mass(def.frame_b, def.b));
  return info;
}

/// Restored rotations are already normalised and must keep their bits.
JointDef normalised(JointDef def) {
  def.frame_a.rotation = normalize(def.frame_a.rotation);
  def.frame_b.rotation = normalize(def.frame_b.rotation);
  if (def.type != JointType::coupling) return def;
  for (CouplingEnd* end : {&def.coupled_a, &def.coupled_b}) end->from.rotation = normalize(end->from.rotation);
  return def;
}
bool is_normalised(Quat q) { return abs(dot(q, q) - 1) < 1e-5f; }

bool is_valid(const JointDef& def) {
  try {
    check_joint(def);
  } catch (const Error&) {
    return false;
  }
  return true;
}

}  // namespace

JointId JointTable::add(const JointDef& def, const BodyTable& bodies) {
  std::uint32_t slot = slot_count();
  if (free_slots_.empty()) {
    make_room(infos_, infos_.size() + 1);
    infos_.emplace_back();
    generations_.push_back(0);
  } else {
    slot = free_slots_.back();
    free_slots_.pop_back();
  }
  infos_[slot] = make_info(normalised(def), bodies);
  ++generations_[slot];
  ++count_;
  tally(def, 1);
  list(slot);
  living_is_current_ = false;
  return id(slot);
}

void JointTable::change(std::uint32_t slot, const JointDef& def, const BodyTable& bodies) {
  tally(infos_[slot].def, -1);
  infos_[slot] = make_info(normalised(def), bodies);
  tally(def, 1);
}

void JointTable::tally(const JointDef& def, int change) {
  if (def.can_break()) breakable_count_ += static_cast<std::uint32_t>(change);
  if (def.type == JointType::coupling) coupling_count_ += static_cast<std::uint32_t>(change);
}

void JointTable::list(std::uint32_t slot) {
  for (const std::uint32_t body : {infos_[slot].a, infos_[slot].b}) {
    if (body >= of_body_.size()) of_body_.resize(body + 1);
    std::vector<std::uint32_t>& joints = of_body_[body];
    joints.insert(std::lower_bound(joints.begin(), joints.end(), slot), slot);
  }
}

void JointTable::remove(std::uint32_t slot) {
  for (const std::uint32_t body : {infos_[slot].a, infos_[slot].b}) std::erase(of_body_[body], slot);
  tally(infos_[slot].def, -1);
  infos_[slot] = {};
  ++generations_[slot];
  free_slots_.push_back(slot);
  --count_;
  living_is_current_ = false;
}

std::uint32_t JointTable::slot(JointId id, const char* action) const {
  if (contains(id)) return id.index;
  const bool existed = id.index < generations_.size() && id.generation <= generations_[id.index];
  throw Error(ErrorCode::stale_id,
              std::string(action) + ": joint {index " + std::to_string(id.index) + ", generation " +
                  std::to_string(id.generation) + "} " +
                  (existed ? "was removed, by itself or with one of its bodies" : "never existed in this world") +
                  "; ask World::contains before using an id that may be gone");
}

std::span<const JointId> JointTable::living() const {
  if (!living_is_current_) {
    living_.clear();
    for (std::uint32_t slot = 0; slot < slot_count(); ++slot)
      if (alive(slot)) living_.push_back(id(slot));
    living_is_current_ = true;
  }
  return living_;
}

bool JointTable::keeps_apart(std::uint32_t body_a, std::uint32_t body_b) const {
  return std::ranges::any_of(of(body_a), [&](std::uint32_t slot) {
    const JointInfo& joint = infos_[slot];
    return !joint.def.collide_connected && (joint.a == body_b || joint.b == body_b);
  });
}

bool JointTable::is_alone(std::uint32_t slot, std::uint32_t ignoring) const {
  const auto counts = [&](std::uint32_t other) {
    const JointInfo& joint = infos_[other];
    return other != slot && other != ignoring && (!joint.fixed_a || joint.def.type == JointType::coupling);
  };
  const JointInfo& joint = infos_[slot];
  return std::ranges::none_of(of(joint.b), counts) && (joint.fixed_a || std::ranges::none_of(of(joint.a), counts));
}

std::size_t JointTable::memory_bytes() const {
  std::size_t bytes = infos_.capacity() * sizeof(JointInfo) +
                      (generations_.capacity() + free_slots_.capacity()) * sizeof(std::uint32_t) +
                      of_body_.capacity() * sizeof(of_body_[0]) + living_.capacity() * sizeof(JointId);
  for (const std::vector<std::uint32_t>& joints : of_body_) bytes += joints.capacity() * sizeof(std::uint32_t);
  return bytes;
}

// Saves all of a definition but the bodies' generations, which follow from the body table.
void JointTable::save(ByteWriter& write) const {
  write(generations_, free_slots_);
  for (const JointId joint : living()) {
    const JointDef& def = infos_[joint.index].def;
    write(def.a.index, def.b.index);
    archive_joint(def, write);
  }
}

void JointTable::restore(ByteReader& in, const BodyTable& bodies) {
  in(generations_, free_slots_);
  infos_.assign(generations_.size(), {});
  living_is_current_ = false;
  for (std::uint32_t slot = 0; slot < slot_count(); ++slot) count_ += alive(slot);
  in.require(count_ + free_slots_.size() == slot_count());
  for (const std::uint32_t slot : free_slots_) in.require(slot < slot_count() && !alive(slot));
  for (const JointId joint : living()) {
    std::uint32_t a = 0, b = 0;
    in(a, b);
    JointDef def = read_joint(in);
    def.a.index = a, def.b.index = b;
    in.require(a != b && is_normalised(def.frame_a.rotation) && is_normalised(def.frame_b.rotation) &&
               is_normalised(def.coupled_a.from.rotation) && is_normalised(def.coupled_b.from.rotation));
    for (BodyId* body : {&def.a, &def.b}) {
      in.require(body->index < bodies.slot_count() && bodies.alive(body->index));
      *body = bodies.id(body->index);
    }
    in.require(is_valid(def));
    infos_[joint.index] = make_info(def, bodies);
    in.require(bodies[infos_[joint.index].b].motion == MotionType::dynamic);
    tally(def, 1);
    list(joint.index);
  }
}

}  // namespace fathom
