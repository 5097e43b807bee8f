// The interface of a World's simulator. World has checked all arguments.
#pragma once

#include <atomic>
#include <fathom/world.hpp>
#include <memory>
#include <mutex>

#include "world/body_table.hpp"
#include "world/body_visitor.hpp"
#include "world/callbacks.hpp"
#include "world/event_list.hpp"
#include "world/excluded_pairs.hpp"
#include "world/joint_table.hpp"
#include "world/many_queries.hpp"
#include "world/sensors.hpp"

namespace fathom {

class ByteReader;
class ByteWriter;

class Simulator {
 public:
  explicit Simulator(const WorldDef& definition) : def(definition) {}
  virtual ~Simulator() = default;
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  WorldDef def;
  BodyTable bodies;
  JointTable joints;
  ExcludedPairs excluded;
  std::uint64_t steps = 0;
  Profile profile;
  EventList<JointBreak> broken;
  Sensors sensors;
  Callbacks callbacks;
  bool told_of_limits = false;  ///< `def.log` has reported that velocities are limited

  // Bodies by slot. `body_added` comes after the table adds a body, `body_removed` before the table removes it.
  virtual void reserve(std::uint32_t count) = 0;
  virtual void optimize_broad_phase() {}
  virtual void body_added(std::uint32_t slot, const Pose& pose, const Velocity& velocity) = 0;
  virtual void body_removed(std::uint32_t slot) = 0;
  virtual void set_pose(std::uint32_t slot, const Pose& pose) = 0;
  virtual void set_velocity(std::uint32_t slot, const Velocity& velocity) = 0;
  virtual void add_velocity(std::uint32_t slot, const Velocity& change);
  /// For a kinematic body: see World::move_to.
  virtual void move_to(std::uint32_t slot, const Pose& pose) = 0;
  /// Linear and angular impulse (N·s, N·m·s) about the centre of mass. Throws if the result is known and not finite.
  virtual void add_impulse(std::uint32_t slot, const Velocity& impulse);
  // Setters wake the body; changes that affect touching bodies wake those as well. Only its own setters, not changes to
  // other bodies, free a body that was isolated for a non-finite state.

  /// The body's material, filter, damping or gravity scale, or its mass or inertia, has changed in the table.
  virtual void material_changed(std::uint32_t slot) = 0;
  virtual void filter_changed(std::uint32_t slot) = 0;
  virtual void info_changed(std::uint32_t slot) = 0;
  virtual void mass_changed(std::uint32_t slot) = 0;
  /// A callback was set or emptied.
  virtual void callbacks_changed() {}
  /// Wakes all bodies that gravity acts on.
  virtual void gravity_changed() = 0;
  virtual void wake(std::uint32_t slot) = 0;
  virtual bool is_awake(std::uint32_t slot) const = 0;
  /// Adds a force (N) and a torque (N·m) about the centre of mass for the next step.
  virtual void apply(std::uint32_t slot, Vec3 force, Vec3 torque) = 0;

  // Joints by slot. `joint_added` comes after the table adds a joint, `joint_removed` before the table removes it; a
  // body's joints are removed before the body. All wake both bodies.
  virtual void joint_added(std::uint32_t slot) = 0;
  virtual void joint_removed(std::uint32_t slot) = 0;
  /// The joint has a new definition, of the same type and bodies.
  virtual void joint_changed(std::uint32_t slot) = 0;
  /// N·s and N·m·s on B of the JointInfo at its anchor, in world axes, over the last step.
  virtual JointReaction joint_impulse(std::uint32_t slot) const = 0;
  /// N and N·m on the definition's B; the simulator must have been synchronised.
  JointReaction reaction(std::uint32_t slot) const;

  // Excluded pairs by slot, after `excluded` has changed. Both calls wake both bodies.
  virtual void pair_excluded(std::uint32_t a, std::uint32_t b) = 0;
  virtual void pair_included(std::uint32_t a, std::uint32_t b) = 0;

  virtual std::span<const Pose> poses() const = 0;
  virtual std::span<const Velocity> velocities() const = 0;
  virtual Aabb bounds(std::uint32_t slot) const = 0;
  /// See World::device_poses.
  virtual std::optional<DevicePoses> device_poses() const { return {}; }

  /// Name of the device simulator's hardware; empty for the native one.
  virtual std::string hardware() const { return {}; }

  virtual void step() = 0;
  /// Whether step events are collected until they are read.
  bool collects_events() const { return def.ahead > 0 && def.simulator == SimulatorKind::device; }
  /// After a step: removes and reports joints whose reaction exceeds their limits.
  void break_joints();
  /// Waits until readers see the newest requested step.
  virtual void synchronise() const {}
  /// Profile of the step that readers see.
  virtual const Profile& current_profile() const { return profile; }

  /// The simulator's part of a snapshot: all that does not follow from `def`, `bodies`, `joints` and `steps`. `restore`
  /// is called on a new simulator with the saved one's `def`, `bodies`, `joints` and `steps`; if it throws, the
  /// simulator may be unusable.
  virtual void save(ByteWriter& write) const = 0;
  virtual void restore(ByteReader& in) = 0;

  virtual std::span<const ContactEvent> contacts_begun() const = 0;
  virtual std::span<const ContactEvent> contacts_ended() const = 0;
  virtual std::span<const HitEvent> hits() const = 0;
  virtual std::span<const Quarantine> quarantined() const = 0;
  virtual void for_each_contact(const std::function<void(const ContactInfo&)>& visit) const = 0;
  /// Contacts of one body, in any order.
  virtual void for_each_contact_of(std::uint32_t slot, const std::function<void(const ContactInfo&)>& visit);

  // Queries. Any number of threads may query at once while nothing changes or steps the world.
  /// Updates the data that queries read; returns the poses by slot. They stay valid until the world is changed,
  /// stepped, or otherwise read.
  std::span<const Pose> prepare_queries() const;
  /// Visits bodies whose boxes the moving box hits, roughly in the order of the hits. Call `prepare_queries` first.
  virtual void visit_bodies(const MovingBox& box, BodyVisitor& visitor) const = 0;
  // The next three answer all queries if that is faster than one by one; else they return false. They call `take` on
  // the caller's thread until it has had the answers to all. Call `prepare_queries` first.
  virtual bool cast_rays(const ManyRays&, const TakeHits&) const { return false; }
  virtual bool cast_shapes(const ManyShapes&, const TakeHits&) const { return false; }
  virtual bool overlap_shapes(const ManyShapes&, const TakeTouched&) const { return false; }
  /// Calls run(begin, end) for parts of [0, count) that do not depend on each other, on any number of threads.
  virtual void divide_query(std::size_t count, const std::function<void(std::size_t, std::size_t)>& run) const {
    run(0, count);
  }

 protected:
  /// Poses or the set of bodies have changed.
  void outdate_queries() { queries_are_current_.store(false, std::memory_order_relaxed); }

 private:
  /// Updates the tree; returns the poses that it was built for.
  virtual std::span<const Pose> refresh_queries() = 0;

  mutable std::mutex refreshing_;
  mutable std::atomic<bool> queries_are_current_ = false;
  mutable std::span<const Pose> queried_poses_;
};

/// Creates the simulator that `def.simulator` names.
std::unique_ptr<Simulator> make_simulator(const WorldDef& def);
std::unique_ptr<Simulator> make_native_simulator(const WorldDef& def);
/// The next two throw `Error{unavailable}` if there is no device named `def.device`.
std::unique_ptr<Simulator> make_device_simulator(const WorldDef& def);
std::unique_ptr<Simulator> make_hybrid_simulator(const WorldDef& def);

}  // namespace fathom
