// All device memory of a simulator: its growth, and the views that kernels take.
#pragma once

#include <algorithm>
#include <cstdint>

#include "device/contact_arrays.hpp"
#include "device/edits.hpp"
#include "device/grid.hpp"
#include "device/joint_arrays.hpp"
#include "device/mechanism_arrays.hpp"
#include "device/surface_work.hpp"
#include "device/tuning.hpp"
#include "exec/buffer.hpp"

namespace fathom::device {

/// What the application sees of bodies, by slot.
struct SlotResults {
  explicit SlotResults(exec::Memory& memory) : poses(memory), velocities(memory), flags(memory) {}

  void reserve(std::size_t slots) {
    poses.grow(slots);
    velocities.grow(slots);
    flags.grow(slots);
  }

  exec::Buffer<Pose> poses;
  exec::Buffer<Velocity> velocities;
  exec::Buffer<std::uint32_t> flags;
};

/// Buffers of bodies. `reserve` keeps the contents of those that outlive a step.
class BodyMemory {
 public:
  explicit BodyMemory(exec::Memory& memory);

  void reserve(std::size_t bodies);
  /// What only the pairs of bullets need.
  void reserve_for_bullets();
  /// What only seams need.
  void reserve_for_seams();
  /// What only moving surfaces need.
  void reserve_for_traits();
  /// What only compounds need.
  void reserve_for_compounds();
  /// Bodies that fit in every buffer; unchanged if `reserve` throws.
  std::size_t capacity() const { return capacity_; }
  BodyArrays arrays();

  HullArrays hulls;
  const SurfaceView* surfaces = nullptr;

  /// Calls act(buffer) for buffers that outlive a step.
  template <class Act>
  void for_each_lasting(const Act& act) {
    act(slots_), act(constants_), act(tensors_), act(filters_), act(forces_), act(targets_), act(poses_),
        act(velocities_), act(flags_);
    act(slow_time_), act(fat_), act(known_), act(boxes_), act(colours_), act(further_), act(best_), act(touching_),
        act(island_);
    act(island_woken_), act(isolated_in_), act(solver_), act(support_), act(joint_colours_);
  }

 private:
  template <class Act>
  void for_each_passing(const Act& act);

  exec::Buffer<std::uint32_t> slots_;
  exec::Buffer<BodyConstants> constants_;
  exec::Buffer<BodyTensors> tensors_;
  exec::Buffer<FilterMasks> filters_;
  exec::Buffer<Force> forces_;
  exec::Buffer<Pose> targets_;
  exec::Buffer<SurfaceTraits> traits_;
  exec::Buffer<Pose> poses_, child_poses_, before_, ends_;
  exec::Buffer<Velocity> velocities_;
  exec::Buffer<std::uint32_t> flags_;
  exec::Buffer<float> slow_time_;
  exec::Buffer<NotedBox> fat_, known_;
  exec::Buffer<Aabb> boxes_;
  exec::Buffer<std::uint64_t> colours_, further_, joint_colours_, recoloured_, further_recoloured_, best_;
  exec::Buffer<std::uint32_t> touching_, island_, island_woken_, isolated_in_, fast_pair_, fast_, fixed_contact_,
      parent_, island_slow_;
  exec::Buffer<BodySupport> support_;
  exec::Buffer<SupportNode> nodes_;
  exec::Buffer<SupportMove> moves_;
  exec::Buffer<Structure> structures_;
  exec::Buffer<std::uint32_t> by_level_;
  exec::Buffer<SolverQuads> solver_;
  exec::Buffer<BodyMotion> motion_;
  exec::Buffer<WarmStart> warm_;
  exec::Buffer<WorldInertia> inertia_;
  exec::Buffer<SplitBody> split_;
  std::size_t capacity_ = 0;
};

/// Buffers of contacts and constraints.
class ContactMemory {
 public:
  explicit ContactMemory(exec::Memory& memory);

  /// `joints`: constraints in addition to those of manifolds. `bounces`: restitution rows are needed. `extras`: rows
  /// for rolling resistance or moving surfaces are needed.
  void reserve(std::size_t contacts, std::size_t manifolds, std::size_t joints, std::size_t event_lists, bool bounces,
               bool extras);
  /// What only the pairs of bullets need.
  void reserve_for_bullets();
  /// What only seams need.
  void reserve_for_seams();
  /// What only questions to the application need.
  void reserve_for_questions();
  FilterQuestion* filter_questions() { return filter_questions_.data(); }
  ContactQuestion* contact_questions() { return contact_questions_.data(); }
  ContactAnswer* answers() { return answers_.data(); }
  std::uint32_t* refused_contacts() { return refused_contacts_.data(); }
  std::uint64_t* refused() { return refused_.data(); }
  /// What only surfaces need.
  void reserve_for_surfaces(std::uint32_t teams);
  SurfaceWork surface_work() {
    return {team_touches_.data(), static_cast<std::uint32_t>(team_touches_.size()), surface_arrays_.data(),
            pairs_with_surfaces_};
  }
  bool may_bounce() const { return may_bounce_; }
  bool any_extras() const { return any_extras_; }
  std::size_t capacity() const { return capacity_; }
  std::size_t manifold_capacity() const { return manifold_capacity_; }
  std::size_t joint_capacity() const { return joint_capacity_; }
  std::size_t constraint_capacity() const { return manifold_capacity_ + joint_capacity_; }
  ContactArrays contacts();
  ConstraintArrays constraints();

 private:
  exec::Buffer<Contact> contacts_;
  exec::Buffer<ContactManifold> manifolds_;
  exec::Buffer<std::uint32_t> free_;
  exec::Buffer<PairRecord> found_;
  exec::Buffer<FastPair> fast_;
  exec::Buffer<std::uint32_t> next_of_a_;
  exec::Buffer<FixedContact> fixed_contacts_;
  exec::Buffer<Vec3> own_slides_;
  exec::Buffer<FilterQuestion> filter_questions_;
  exec::Buffer<ContactQuestion> contact_questions_;
  exec::Buffer<ContactAnswer> answers_;
  exec::Buffer<std::uint32_t> refused_contacts_;
  exec::Buffer<std::uint64_t> refused_;
  exec::Buffer<TeamTouches> team_touches_;
  exec::Buffer<std::byte> surface_arrays_;
  exec::Buffer<std::uint32_t> to_collide_, free_manifolds_, uncoloured_0_, uncoloured_1_;
  exec::Buffer<PairRecord> begun_, ended_;
  exec::Buffer<HitRecord> hits_;
  exec::Buffer<PairRecord> bodies_;
  exec::Buffer<ConstraintHead> heads_;
  exec::Buffer<std::uint32_t> contact_, manifold_, contacts_of_;
  exec::Buffer<SupportRecord> supports_;
  exec::Buffer<Quad> rows_;
  exec::Buffer<BounceRow> bounces_;
  exec::Buffer<ContactExtras> extras_;
  std::size_t capacity_ = 0, manifold_capacity_ = 0, joint_capacity_ = 0;
  std::uint32_t pairs_with_surfaces_ = 0;  ///< for which `surface_arrays_` have room
  std::uint32_t event_lists_ = 1;
  bool may_bounce_ = false, any_extras_ = false;
};

/// Buffers of joints; empty until the first joint.
class JointMemory {
 public:
  explicit JointMemory(exec::Memory& memory)
      : records_(memory), generic_(memory), generic_impulses_(memory), reactions_(memory), apart_(memory) {}

  /// `generic`: reserve room for generic joints too.
  void reserve(std::size_t joints, std::size_t apart_slots, bool generic);
  std::size_t capacity() const { return records_.size(); }
  std::size_t generic_capacity() const { return generic_impulses_.size(); }
  /// Slots of the ApartTable, which always has the size of the host's.
  std::size_t apart_slots() const { return apart_slots_; }
  std::uint64_t* apart_pairs() { return apart_.data(); }
  JointArrays arrays();

 private:
  exec::Buffer<JointRecord> records_;
  exec::Buffer<GenericJoint> generic_;
  exec::Buffer<GenericImpulse> generic_impulses_;
  exec::Buffer<JointReactions> reactions_;
  exec::Buffer<std::uint64_t> apart_;
  std::size_t apart_slots_ = 0;
};

/// Buffers of mechanisms; empty until the first mechanism.
class MechanismMemory {
 public:
  explicit MechanismMemory(exec::Memory& memory)
      : links_(memory),
        records_(memory),
        levels_(memory),
        of_joint_(memory),
        of_body_(memory),
        pushed_by_(memory),
        parents_(memory),
        contacts_(memory),
        contact_states_(memory),
        states_(memory),
        pushes_(memory),
        generic_(memory),
        closures_(memory) {}

  struct Room {
    std::size_t mechanisms, links, levels, generic, closure_floats, joints;
  };
  /// May discard the contents: everything must be uploaded again.
  void reserve(const Room& room);
  bool has_room_for(const Room& room) const {
    return room.mechanisms <= records_.size() && room.links <= links_.size() && room.levels <= levels_.size() &&
           room.generic <= generic_.size() && room.closure_floats <= closures_.size() &&
           room.joints <= of_joint_.size();
  }
  /// Keeps all contents.
  void reserve_bodies(std::size_t bodies) {
    of_body_.grow(bodies, exec::Contents::keep);
    pushed_by_.grow(bodies);
  }
  bool has_room_for_bodies(std::size_t bodies) const { return bodies <= of_body_.size(); }
  std::size_t capacity() const { return records_.size(); }
  MechanismArrays arrays();

 private:
  exec::Buffer<MechanismLink> links_;
  exec::Buffer<MechanismRecord> records_;
  exec::Buffer<std::uint32_t> levels_, of_joint_, of_body_, pushed_by_, parents_;
  exec::Buffer<LinkContacts> contacts_;
  exec::Buffer<LinkContactStates> contact_states_;
  exec::Buffer<LinkState> states_;
  exec::Buffer<LinkPushes> pushes_;
  exec::Buffer<JointLink> generic_;
  exec::Buffer<float> closures_;
};

/// The grid's table.
class GridMemory {
 public:
  explicit GridMemory(exec::Memory& memory) : heads_(memory), next_(memory), big_(memory) {}

  void reserve(std::size_t bodies);
  std::size_t capacity() const { return capacity_; }
  Grid grid(float base);
  std::uint32_t entries() const { return static_cast<std::uint32_t>(heads_.size()); }

 private:
  exec::Buffer<std::uint32_t> heads_, next_, big_;
  std::size_t capacity_ = 0;
};

}  // namespace fathom::device
