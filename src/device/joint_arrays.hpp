// Joints on the device: constraints made by the application, whereas contacts are made by the narrow phase.
//
// Joints and contacts share colours and layout, so a joint is one more constraint of its bodies. The host gives joints
// their colours when it adds them (device/joint_mirror.hpp); contacts choose among the remaining ones.
#pragma once

#include <cstdint>

#include "device/body_arrays.hpp"
#include "dynamics/generic_joint.hpp"
#include "exec/atomic.hpp"

namespace fathom::device {

/// Marks an entry as a joint's slot in the constraints' list of contacts.
inline constexpr std::uint32_t joint_tag = 0x80000000u;

/// Kinds of joints a world has had. Solvers are compiled for each: none uses registers for absent joints.
enum class JointKinds : std::uint8_t { absent, balls, all };

/// A joint by its World slot. The host writes everything except the impulses. For a generic or distance joint only the
/// first row and the anchors are used; the rest is in `JointArrays::generic` and `generic_impulses`.
struct alignas(16) JointRecord {
  std::uint32_t a = none, b = none;  ///< device indices; a body that cannot be pushed is always A; `none`: unused
  std::uint32_t colour = 0;          ///< below `dynamic_colours`, or `overflow_colour`
  std::uint16_t fixed_a = 0;         ///< 1: A is fixed or kinematic
  std::uint16_t is_generic = 0;      ///< 1: it is not a ball joint
  Vec3 anchor_a;                     ///< m, body axes
  float bias_rate = 0;               ///< of its Softness
  Vec3 anchor_b;
  float mass_scale = 0;
  Vec3 impulse;  ///< N·s on B, of the last substep, for warm starting
  float impulse_scale = 0;
  Vec3 total;             ///< N·s on B, of the last step that solved it
  float max_impulse = 0;  ///< N·s per substep, of a spring; 0 for a rigid joint
  float max_start = 0;    ///< N·s, maximum with which sweeps begin a step
  float compliance = 0;   ///< 1/kg, of a spring
  std::uint32_t unused[2] = {};

  FATHOM_HD bool in_use() const { return a != none; }
};
static_assert(sizeof(JointRecord) == 96);

/// Pairs of bodies that do not collide: an open hash table with linear probing.
struct ApartTable {
  static constexpr std::uint64_t no_pair = ~std::uint64_t{0};

  const std::uint64_t* pairs;
  std::uint32_t mask;   ///< number of slots − 1
  std::uint32_t is_on;  ///< 1: there are joints

  FATHOM_HD static std::uint64_t pair(std::uint32_t a, std::uint32_t b) {
    return a < b ? std::uint64_t{a} << 32 | b : std::uint64_t{b} << 32 | a;
  }
  FATHOM_HD static std::uint32_t home(std::uint64_t pair, std::uint32_t mask) {
    return static_cast<std::uint32_t>(pair * 0x9e3779b97f4a7c15u >> 32) & mask;
  }
  FATHOM_HD bool has(std::uint32_t a, std::uint32_t b) const {
    const std::uint64_t wanted = pair(a, b);
    for (std::uint32_t slot = home(wanted, mask);; slot = (slot + 1) & mask) {
      const std::uint64_t found = pairs[slot];
      if (found == wanted || found == no_pair) return found == wanted;
    }
  }
};

/// State of a generic joint that lasts from sweep to sweep within a step, besides its rows; for a coupling `rate` holds
/// the angles at the start of the step.
struct JointReactions {
  float bounce[axis_count], rate[axis_count];
  Vec3 pulled, pulled_a, pulled_b;
};

/// Parts of the device's joint data, for `Joints`.
enum JointPart : std::uint8_t { joint_records, joint_definitions, joint_impulses };

/// Joints; the parts `written` may be written (access.hpp). Worlds without joints have no memory for them.
template <JointPart... written>
struct Joints {
  template <class T, JointPart part>
  using Of = Array<T, part, written...>;

  Of<JointRecord, joint_records> records;
  // Also by slot; null if there never was a generic or distance joint.
  Of<GenericJoint, joint_definitions> generic;
  Of<GenericImpulse, joint_impulses> generic_impulses;
  Of<JointReactions, joint_impulses> reactions;
  std::uint32_t capacity;
  ApartTable apart;

  template <JointPart... fewer>
  FATHOM_HD operator Joints<fewer...>() const {
    static_assert((is_among<fewer, written...> && ...));
    return __builtin_bit_cast(Joints<fewer...>, *this);
  }
};

using JointArrays = Joints<joint_records, joint_definitions, joint_impulses>;

/// A joint's new record. The device owns its impulses: if the joint is not new, they stay.
struct alignas(16) JointEdit {
  JointRecord record;
  std::uint32_t slot = 0;
  std::uint32_t is_new = 0;  ///< 1: the slot held another joint or none
  std::uint32_t unused[2] = {};
};

/// The new definition of a generic or distance joint, applied after its JointEdit.
struct GenericEdit {
  GenericJoint joint;
  std::uint32_t slot = 0;
  std::uint32_t is_new = 0;
};

/// A slot of the ApartTable.
struct ApartEdit {
  std::uint64_t pair = ApartTable::no_pair;
  std::uint32_t slot = 0, unused = 0;
};

}  // namespace fathom::device
