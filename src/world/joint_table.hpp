// Joint data common to all simulators: ids, definitions, and each body's joints.
#pragma once

#include <cstdint>
#include <fathom/joint.hpp>
#include <span>
#include <vector>

#include "dynamics/joint_masses.hpp"
#include "world/body_table.hpp"

namespace fathom {

class ByteReader;
class ByteWriter;

/// A joint as simulators see it: a body that cannot be pushed is always A.
struct JointInfo {
  std::uint32_t a = 0xffffffffu, b = 0xffffffffu;  ///< slots
  Vec3 anchor_a, anchor_b;                         ///< m, body axes
  float swing_rate = 0;                            ///< the larger of the two bodies' (dynamics/ball_joint.hpp)
  JointMasses masses{};                            ///< for springs by frequency
  bool swapped = false;                            ///< A is the definition's B
  bool fixed_a = false;                            ///< A is fixed or kinematic
  JointDef def;
};

/// Slots with generations, like BodyTable's.
class JointTable {
 public:
  /// `def` must have been checked (see `check_joint`).
  JointId add(const JointDef& def, const BodyTable& bodies);
  void remove(std::uint32_t slot);
  /// Sets another definition, with the same bodies and type.
  void change(std::uint32_t slot, const JointDef& def, const BodyTable& bodies);

  bool contains(JointId id) const {
    return id.index < generations_.size() && id.generation == generations_[id.index] && alive(id.index);
  }
  /// The slot of `id`; throws `Error{stale_id}` naming `action` if the joint has been removed.
  std::uint32_t slot(JointId id, const char* action) const;

  bool alive(std::uint32_t slot) const { return generations_[slot] & 1u; }
  JointId id(std::uint32_t slot) const { return {slot, generations_[slot]}; }
  std::uint32_t slot_count() const { return static_cast<std::uint32_t>(generations_.size()); }
  std::uint32_t count() const { return count_; }
  /// How many joints can break.
  std::uint32_t breakable_count() const { return breakable_count_; }
  std::uint32_t coupling_count() const { return coupling_count_; }
  /// Living joints in ascending order of slot.
  std::span<const JointId> living() const;

  JointInfo& operator[](std::uint32_t slot) { return infos_[slot]; }
  const JointInfo& operator[](std::uint32_t slot) const { return infos_[slot]; }

  /// Slots of the body's joints, ascending.
  std::span<const std::uint32_t> of(std::uint32_t body) const {
    return body < of_body_.size() ? std::span<const std::uint32_t>(of_body_[body]) : std::span<const std::uint32_t>();
  }
  /// Whether a joint keeps the two bodies from colliding.
  bool keeps_apart(std::uint32_t body_a, std::uint32_t body_b) const;

  /// Whether the joint's bodies have no other joints except to fixed or kinematic bodies; `ignoring` does not count.
  bool is_alone(std::uint32_t slot, std::uint32_t ignoring = 0xffffffffu) const;

  std::size_t memory_bytes() const;

  void save(ByteWriter& write) const;
  /// Into an empty table. Throws `Error{file}` on impossible content.
  void restore(ByteReader& in, const BodyTable& bodies);

 private:
  void list(std::uint32_t slot);
  void tally(const JointDef& def, int change);

  std::vector<JointInfo> infos_;
  std::vector<std::uint32_t> generations_;  // odd: alive
  std::vector<std::uint32_t> free_slots_;
  std::vector<std::vector<std::uint32_t>> of_body_;  // up to the highest slot that ever had a joint
  std::uint32_t count_ = 0, breakable_count_ = 0, coupling_count_ = 0;
  mutable std::vector<JointId> living_;
  mutable bool living_is_current_ = true;
};

}  // namespace fathom
