// What a simulator must offer to be a World's engine. Arguments have been checked by World.
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
  bool told_of_limits = false;  ///< `def.log` was, that velocities are cut

  // Bodies by slot. `body_added` comes after the table has it, `body_removed` before it is taken out.
  virtual void reserve(std::uint32_t count) = 0;
  virtual void optimize_broad_phase() {}
  virtual void body_added(std::uint32_t slot, const Pose& pose, const Velocity& velocity) = 0;
  virtual void body_removed(std::uint32_t slot) = 0;
  virtual void set_pose(std::uint32_t slot, const Pose& pose) = 0;
  virtual void set_velocity(std::uint32_t slot, const Velocity& velocity) = 0;
  virtual void add_velocity(std::uint32_t slot, const Velocity& change);
  /// Of a kinematic body: see World::move_to.
  virtual void move_to(std::uint32_t slot, const Pose& pose) = 0;
  /// Linear and angular impulse (N·s, N·m·s) about the centre of mass. Throws where the result is not finite and known.
  virtual void add_impulse(std::uint32_t slot, const Velocity& impulse);
  // Setters wake the body; what changes for those that it touches wakes them. A body that was isolated because its
  // state was not finite is freed by setters of its own alone, not by what happens to others.

  /// The body's material, filter, damping or gravity scale was changed in the table.
  virtual void material_changed(std::uint32_t slot) = 0;
  virtual void filter_changed(std::uint32_t slot) = 0;
  virtual void info_changed(std::uint32_t slot) = 0;
  /// Wakes all that gravity acts on.
  virtual void gravity_changed() = 0;
  virtual void wake(std::uint32_t slot) = 0;
  virtual bool is_awake(std::uint32_t slot) const = 0;
  /// Force (N) and torque (N·m) about the centre of mass for the next step; they add up.
  virtual void apply(std::uint32_t slot, Vec3 force, Vec3 torque) = 0;

  // Joints by slot. `joint_added` comes after the table has it, `joint_removed` before it is taken out; a body's joints
  // are removed before the body is. All wake both bodies.
  virtual void joint_added(std::uint32_t slot) = 0;
  virtual void joint_removed(std::uint32_t slot) = 0;
  /// Its definition is another one, of the same type and bodies.
  virtual void joint_changed(std::uint32_t slot) = 0;
  /// N·s and N·m·s on B of the JointInfo at its anchor, in world axes, over the last step.
  virtual JointReaction joint_impulse(std::uint32_t slot) const = 0;
  /// N and N·m on the definition's B, of a simulator that has been synchronised.
  JointReaction reaction(std::uint32_t slot) const;

  // Excluded pairs by slot, when `excluded` says so. Both wake both bodies.
  virtual void pair_excluded(std::uint32_t a, std::uint32_t b) = 0;
  virtual void pair_included(std::uint32_t a, std::uint32_t b) = 0;

  virtual std::span<const Pose> poses() const = 0;
  virtual std::span<const Velocity> velocities() const = 0;
  virtual Aabb bounds(std::uint32_t slot) const = 0;
  /// See World::device_poses.
  virtual std::optional<DevicePoses> device_poses() const { return {}; }

  /// What the device simulator runs on; empty for the native one.
  virtual std::string hardware() const { return {}; }

  virtual void step() = 0;
  /// Whether events of steps are collected until they are read.
  bool collects_events() const { return def.ahead > 0 && def.simulator == SimulatorKind::device; }
  /// After a step: removes the joints whose reaction was too large, and tells of them.
  void break_joints();
  /// Returns when the newest step asked for is the one that is read.
  virtual void synchronise() const {}
  /// Of the step that is read.
  virtual const Profile& current_profile() const { return profile; }

  /// The simulator's part of a snapshot: all that `def`, `bodies`, `joints` and `steps` do not say. `restore` is called
  /// on a new simulator whose `def`, `bodies`, `joints` and `steps` are those of the saved one; it may leave it
  /// unusable when it throws.
  virtual void save(ByteWriter& write) const = 0;
  virtual void restore(ByteReader& in) = 0;

  virtual std::span<const ContactEvent> contacts_begun() const = 0;
  virtual std::span<const ContactEvent> contacts_ended() const = 0;
  virtual std::span<const HitEvent> hits() const = 0;
  virtual std::span<const Quarantine> quarantined() const = 0;
  virtual void for_each_contact(const std::function<void(const ContactInfo&)>& visit) const = 0;
  /// Of one body, in any order.
  virtual void for_each_contact_of(std::uint32_t slot, const std::function<void(const ContactInfo&)>& visit);

  // Queries. Any number of threads may ask at once while nobody changes or steps the world.
  /// Brings up to date what queries see; returns the poses by slot. They stay what they are until the world is changed,
  /// stepped, or read otherwise.
  std::span<const Pose> prepare_queries() const;
  /// Bodies whose boxes the moving one meets, about in that order. After `prepare_queries`.
  virtual void visit_bodies(const MovingBox& box, BodyVisitor& visitor) const = 0;

 protected:
  /// Poses or the set of bodies have changed.
  void outdate_queries() { queries_are_current_.store(false, std::memory_order_relaxed); }

 private:
  /// Brings the tree up to date; returns the poses that it belongs to.
  virtual std::span<const Pose> refresh_queries() = 0;

  mutable std::mutex refreshing_;
  mutable std::atomic<bool> queries_are_current_ = false;
  mutable std::span<const Pose> queried_poses_;
};

/// The one that `def.simulator` names.
std::unique_ptr<Simulator> make_simulator(const WorldDef& def);
std::unique_ptr<Simulator> make_native_simulator(const WorldDef& def);
/// The next two throw `Error{unavailable}` where the device that `def.device` names is not there.
std::unique_ptr<Simulator> make_device_simulator(const WorldDef& def);
std::unique_ptr<Simulator> make_hybrid_simulator(const WorldDef& def);

}  // namespace fathom
