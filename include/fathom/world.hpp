// The world: bodies, joints, forces, steps, queries and events. This is the interface an application uses.
//
//   fathom::World world({.threads = 4});
//   world.add({.motion = fathom::MotionType::fixed, .shape = fathom::box({50, 50, 0.5f})});
//   const fathom::BodyId crate =
//       world.add({.pose = {.position = {0, 0, 5}}, .shape = fathom::box({0.5f, 0.5f, 0.5f}), .mass = 1});
//   for (int i = 0; i < 600; ++i) world.step();
//   const fathom::Vec3 where = world.pose(crate).position;
//
// A world is used by one thread at a time, except for queries; different worlds are independent. Errors are thrown as
// `fathom::Error` and leave the world as it was.
#pragma once

#include <cstddef>
#include <cstdint>
#include <fathom/body.hpp>
#include <fathom/contact.hpp>
#include <fathom/device_poses.hpp>
#include <fathom/error.hpp>
#include <fathom/export.hpp>
#include <fathom/joint.hpp>
#include <fathom/profile.hpp>
#include <fathom/query.hpp>
#include <fathom/sensor.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Everything of the library.
namespace fathom {

/// How pairs of bodies are found whose boxes overlap.
enum class BroadPhase : std::uint8_t {
  tree,   ///< 8-wide bounding volume hierarchy over Morton-sorted boxes with margins (default)
  sweep,  ///< sweep-and-sort along one axis (dissertation, section 3.3.1)
};

/// How contacts are solved.
enum class Solver : std::uint8_t {
  soft,     ///< substepped soft constraints with relaxation (default)
  impulse,  ///< sequential impulses with a velocity bias (dissertation, equations 3.20–3.23)
};

/// Which contacts are solved at the same time.
enum class Partition : std::uint8_t {
  colours,  ///< a persistent colouring of the contact graph (default)
  cells,    ///< cells of a uniform grid in 2³ groups, batches inside a cell (dissertation, section 3.4)
};

/// How the solver works.
struct SolverSettings {
  Solver method = Solver::soft;  ///< soft constraints or sequential impulses
  bool warm_start = true;        ///< contacts begin with their last impulses; else each substep begins without any
  /// Mechanisms of rigid joints are solved directly by `soft`, else by sweeps as contacts are: several times as fast,
  /// but their joints open by millimetres, and by more under heavy loads (docs/joints.md).
  bool direct_joints = true;
  int substeps = 4;         ///< ≥ 1
  int iterations = 10;      ///< sweeps per substep of `impulse`; `soft` does one, and one relax sweep
  int marking_rounds = 32;  ///< 1 to 255, for `Partition::cells` on a device: the maximum of batches in a cell
  /// Stiffness of contacts, twice that against static bodies; at most 0.15 of the substep rate (36 Hz at 4 substeps and
  /// 1/60 s), which is the default.
  float contact_hertz = 1e6f;
  float contact_damping_ratio = 0.7f;  ///< of contacts; 1 is critical
  float push_out_velocity = 3.0f;      ///< m/s, the maximum that resolves a penetration
  float restitution_threshold = 1.0f;  ///< m/s of approach below which nothing bounces; at least g h, h the substep
  /// m/s; faster bodies are slowed to it. Angular speeds are limited to 16 rad per substep: 3,840 rad/s at 4 substeps
  /// and 1/60 s. `WorldDef::log` is told of the first velocity beyond them that the application asks for.
  float max_linear_speed = 1000.0f;
};

/// Islands of bodies that touch fall asleep together if they rest on something that cannot be pushed or do not move at
/// all; bodies that sink, rise or drift freely never sleep. Contacts and setters wake them, and so do changes of what
/// they rest on: another gravity, a support that moves, is removed or gets another material, a fixed body put into
/// them.
struct SleepSettings {
  bool enabled = true;         ///< whether bodies sleep at all
  float linear_speed = 0.05f;  ///< m/s of the fastest point of a body below which it may fall asleep; round bodies that
                               ///< touch something lose their spin below four times this
  float time = 0.5f;           ///< s that all bodies of an island must have been slow
};

/// What runs the step.
enum class SimulatorKind : std::uint8_t {
  native,  ///< the CPU's cores and vector lanes (default)
  device,  ///< a GPU, or the host running the same kernels; `WorldDef::device` says which
  hybrid,  ///< detection on that device, resolution on the CPU
};

/// What a world is created from.
struct WorldDef {
  SimulatorKind simulator = SimulatorKind::native;  ///< what runs the step
  /// For the device simulator: `auto` (the first GPU, else the host), `host`, `cuda[:index]` or `sycl[:index]`.
  std::string device = "auto";
  /// For the device simulator. 0: reading poses, velocities, events or the profile waits for the last step; steps of
  /// which nothing is read cost nothing more. N > 0: `step` returns while up to N steps are in flight, every step's
  /// results are copied back as it ends, and reading returns those of the newest finished step (events: of all finished
  /// steps). Later steps depend neither on it nor on what is read.
  int ahead = 0;
  /// For the device simulator with `ahead`: false leaves poses and velocities on the device; reading them then waits
  /// for the last step, while the profile is still that of the newest finished one.
  bool copy_results = true;
  Vec3 gravity{0, 0, -9.81f};                           ///< m/s²
  float dt = 1.0f / 60.0f;                              ///< s, the fixed time step
  int threads = 0;                                      ///< 0: as many as the machine has
  BroadPhase broad_phase = BroadPhase::tree;            ///< how pairs are found
  Vec3 sweep_axis{0.8017837f, 0.5345225f, 0.2672612f};  ///< for `sweep`: components ≥ 0, not all 0
  Partition partition = Partition::colours;             ///< which contacts are solved at the same time
  SolverSettings solver{};                              ///< how contacts are solved
  SleepSettings sleep{};                                ///< when bodies sleep
  std::uint32_t max_bodies = 1u << 24;                  ///< `add` refuses more
  /// Called with one line of text that the application should know; never from a step's threads.
  std::function<void(std::string_view)> log{};
};

/// Sets of algorithms (docs/published-algorithms.md).
enum class Preset : std::uint8_t {
  fathom,        ///< the defaults: tree, colours, soft
  dissertation,  ///< that of Pereira (2020): sweep, cells, impulse, its bias without limit, no sleeping; on a device
                 ///< without warm starting and two steps ahead
};
/// Sets in `def` what a preset decides, for the simulator that it names.
FATHOM_API void apply(Preset preset, WorldDef& def);

/// A joint that broke (see `JointDef::break_force`) and is gone; its bodies are awake.
struct JointBreak {
  JointId joint;                ///< its id, which names no joint any more
  BodyId a;                     ///< body A of its definition
  BodyId b;                     ///< body B
  Vec3 force;                   ///< N, on B, mean over the step
  Vec3 torque;                  ///< N·m
  std::uint64_t user_data = 0;  ///< of its definition
  std::uint64_t step = 0;       ///< `World::step_count()` after it
};

/// A body taken out of the simulation because its state was not finite after a step. Its pose is that before the step,
/// its velocity zero. All other bodies are as if it had been taken out before the step. It stays fixed until its
/// velocity or pose is set again.
struct Quarantine {
  BodyId body;             ///< which one
  std::uint64_t step = 0;  ///< `World::step_count()` after it
};

/// A simulated world: its bodies, joints, events and queries. See the head of this file.
class FATHOM_API World {
 public:
  /// Throws `Error{invalid_argument}` on a definition out of range.
  explicit World(const WorldDef& def = {});
  ~World();
  /// Leaves `other` without a world: it may only be destroyed or assigned to.
  World(World&& other) noexcept;
  /// Leaves `other` without a world: it may only be destroyed or assigned to.
  World& operator=(World&& other) noexcept;

  /// What it was created or restored from.
  const WorldDef& definition() const;
  /// What the device simulator runs on ("cuda:0 NVIDIA H100 80GB HBM3"); empty for the native simulator.
  std::string hardware() const;

  // Bodies ------------------------------------------------------------------------------------------------
  /// Throws `invalid_argument` (non-finite, negative or zero values), `capacity`.
  BodyId add(const BodyDef& def);
  /// Adds several at once; returns their ids in the order of `defs`. From a thousand on, and where `defs` jumps about
  /// in space, neighbours get neighbouring indices, which makes steps on several threads faster. Which index a body
  /// gets is a function of `defs` and of the bodies added and removed before. Throws what `add` throws, with "body 17:
  /// …" for defs[17], and then has added none.
  std::vector<BodyId> add_bodies(std::span<const BodyDef> defs);
  /// Allocates memory for `bodies`, so that adding them allocates little.
  void reserve(std::uint32_t bodies);
  /// Sorts bodies for collision detection and queries, which otherwise the next step and the next query do. For after
  /// many have been added: a million fixed boxes take 0.6 s or more. Finds pairs, and calls the filter callback, as
  /// that step would; the step then has the same result. Does nothing where a device finds pairs. Throws `capacity`
  /// where memory runs out.
  void optimize_broad_phase();
  /// Throws `stale_id`. Bodies that rested on it wake; its joints go with it.
  void remove(BodyId id);
  bool contains(BodyId id) const;    ///< whether the body lives
  std::uint32_t body_count() const;  ///< living bodies
  /// All living bodies in ascending order of index; valid until a body is added or removed.
  std::span<const BodyId> bodies() const;

  /// Poses and velocities of all bodies by `BodyId::index`, contiguous, 32 bytes each; slots of removed
  /// bodies hold identity and zero. Valid until the next step or change of the world.
  std::span<const Pose> poses() const;
  std::span<const Velocity> velocities() const;  ///< see `poses`
  /// Poses of the last step without a copy to the host; waits for the step. None where the simulator does not keep them
  /// in memory that a drawing GPU can read (all but CUDA), before the first step, and while changes wait for the next
  /// step: use `poses()` then.
  std::optional<DevicePoses> device_poses() const;

  // All of these throw `stale_id`; setters `invalid_argument` on non-finite values. Setters wake the body.
  const Pose& pose(BodyId id) const;  ///< of its centre of mass
  /// Moves a body at once, without pushing what is between; the rotation is normalised.
  void set_pose(BodyId id, const Pose& pose);
  const Velocity& velocity(BodyId id) const;  ///< m/s and rad/s, world axes
  /// Sets the velocity (m/s, rad/s).
  void set_velocity(BodyId id, Vec3 linear, Vec3 angular);
  /// Moves a kinematic body so that the next step ends with it at exactly this pose. During that step it has the
  /// velocity that takes it there on a straight line, turning the shorter way: contacts see it, it carries what rests
  /// on it, and sleepers on it wake where it moves. Then it stops, unless this is called again. Until the step,
  /// `set_pose`, `set_velocity` and `add_velocity` replace it. Use `set_pose` for a body that is to appear elsewhere
  /// without pushing what is between. Throws `invalid_argument` for bodies that are not kinematic.
  void move_to(BodyId id, const Pose& pose);
  /// Adds to the velocity (m/s, rad/s) without reading it first.
  void add_velocity(BodyId id, Vec3 linear, Vec3 angular);
  MotionType motion(BodyId id) const;                 ///< fixed, kinematic or dynamic
  Shape shape(BodyId id) const;                       ///< cheap to copy
  float mass(BodyId id) const;                        ///< kg; 0 for bodies that forces do not move
  MassProperties mass_properties(BodyId id) const;    ///< mass and inertia; zero for bodies that forces do not move
  Aabb bounds(BodyId id) const;                       ///< m, tight, world
  std::uint64_t user_data(BodyId id) const;           ///< see `BodyDef::user_data`
  void set_user_data(BodyId id, std::uint64_t data);  ///< wakes nothing
  void set_material(BodyId id, const Material& material);  ///< throws what `add` throws on materials
  const Material& material(BodyId id) const;               ///< see `BodyDef::material`
  void set_filter(BodyId id, Filter filter);               ///< ends contacts that it no longer allows
  Filter filter(BodyId id) const;                          ///< see `BodyDef::filter`
  /// Keeps two bodies from colliding, whatever their filters, until `include` or until one of them is removed. Their
  /// contact ends, and both wake. Sensors do not see bodies that they are excluded with. Throws `stale_id`, and
  /// `invalid_argument` where both are one body.
  void exclude(BodyId a, BodyId b);
  /// Reverts `exclude`: their filters and joints decide again.
  void include(BodyId a, BodyId b);
  bool is_excluded(BodyId a, BodyId b) const;  ///< whether `exclude` keeps them apart
  // The next four replace the body under the same id, with its pose, velocity and joints: its contacts end and begin
  // again in the next step, and forces applied since the last one are lost. They throw what `add` throws, and then
  // leave the body as it was.

  /// A body that becomes fixed stands still. One that becomes dynamic has the mass of its shape at 1,000 kg/m³, which
  /// `set_mass` changes. Also throws `invalid_argument` where a joint would hold no dynamic body any more.
  void set_motion(BodyId id, MotionType motion);
  /// Its centre of mass stays where it is. A dynamic body keeps its mass and gets the shape's inertia.
  void set_shape(BodyId id, const Shape& shape);
  /// kg; the inertia (kg·m², body axes) is the shape's where none is given. Throws `invalid_argument` for bodies that
  /// are not dynamic.
  void set_mass(BodyId id, float mass, const std::optional<SymMat3>& inertia = {});
  /// Whether it is a sensor (sensor.hpp).
  void set_sensor(BodyId id, bool sensor);
  bool is_sensor(BodyId id) const;                ///< see `BodyDef::sensor`
  void set_bullet(BodyId id, bool bullet);        ///< see `BodyDef::bullet`; from the next step on
  bool is_bullet(BodyId id) const;                ///< see `BodyDef::bullet`
  void set_pre_solve(BodyId id, bool pre_solve);  ///< see `BodyDef::pre_solve`; throws what `add` throws on it
  bool has_pre_solve(BodyId id) const;            ///< see `BodyDef::pre_solve`
  /// See `BodyDef::custom_filter`. Throws what `add` throws on it. Its contacts end, and begin again where the callback
  /// lets them.
  void set_custom_filter(BodyId id, bool custom_filter);
  bool has_custom_filter(BodyId id) const;                   ///< see `BodyDef::custom_filter`
  void set_gravity_scale(BodyId id, float scale);            ///< factor on the world's gravity
  void set_damping(BodyId id, float linear, float angular);  ///< 1/s, ≥ 0
  bool is_awake(BodyId id) const;                            ///< false while it sleeps
  void wake(BodyId id);                                      ///< wakes its island

  // Joints ------------------------------------------------------------------------------------------------
  /// Joins two bodies and wakes them. Throws `stale_id` where one of them is gone, and `invalid_argument` on values
  /// that are not finite, where both are one body or none of them is dynamic, and in a world with `Partition::cells`,
  /// which the dissertation defines for contacts alone.
  JointId add_joint(const JointDef& def);
  /// Throws `stale_id`. Wakes both bodies.
  void remove_joint(JointId id);
  bool contains(JointId id) const;    ///< whether the joint lives
  std::uint32_t joint_count() const;  ///< living joints
  /// All living joints in ascending order of index; valid until a joint or a body is added or removed.
  std::span<const JointId> joints() const;
  /// What it was created from, rotations normalised. Throws `stale_id`.
  const JointDef& joint(JointId id) const;
  /// Changes its spring (see JointDef) from the next step on; wakes both bodies. Throws `stale_id`, `invalid_argument`.
  void set_joint_spring(JointId id, float hertz, float damping_ratio);
  /// Changes bounds or drive of an axis from the next step on; wakes both bodies. Throws `stale_id`, and
  /// `invalid_argument` as `add_joint`.
  void set_joint_axis(JointId id, JointAxisName name, const JointAxis& axis);
  /// Changes its frames on the two bodies (see JointDef), which may be apart: the joint pulls them together, at 60 m/s
  /// at most. Wakes both bodies. Throws `stale_id`, and `invalid_argument` as `add_joint`.
  void set_joint_frames(JointId id, const Pose& frame_a, const Pose& frame_b);
  /// Moves the target (m, world) of a `target_joint`, or of another joint to a body that is not dynamic: the joint's
  /// anchor on that body. Wakes the other body where the target is not there already. Throws `stale_id`, and
  /// `invalid_argument` where both bodies are dynamic or the target is not finite.
  void set_joint_target(JointId id, Vec3 target);
  /// Changes the force and the torque at which it breaks (see JointDef) from the next step on; wakes both bodies.
  /// Throws `stale_id`, `invalid_argument`.
  void set_joint_break(JointId id, float force, float torque);
  /// Changes every parameter at once from the next step on; ignores the definition's bodies. Wakes both bodies. Throws
  /// `stale_id`, and `invalid_argument` as `add_joint` or where the type or `collide_connected` is another; the joint
  /// is then as it was.
  void change_joint(JointId id, const JointDef& definition);
  /// The joint from `a` to `b` that has this user data; of several the one of the lowest index. Throws `stale_id` where
  /// there is none.
  JointId find_joint(BodyId a, BodyId b, std::uint64_t user_data) const;
  /// Force and torque of the last step; waits for it. Throws `stale_id`.
  JointReaction reaction(JointId id) const;
  /// The current positions of its axes; zeros for a ball joint. Throws `stale_id`.
  JointPositions joint_positions(JointId id) const;

  // Callbacks -----------------------------------------------------------------------------------------------
  // They are called by the thread that calls `step`, one pair after the other, in an order that does not depend on the
  // number of threads. They may read the world but not change, save or query it: that throws `invalid_argument`. What a
  // callback throws, `step` throws when the step is over, the first one; the pair is then as without the callback.
  // `restore` keeps them, snapshots and recordings do not hold them: the same steps follow if their answers do, which
  // should be a function of the world. The native and the hybrid simulator have them.

  /// Before contacts are solved, of bodies with `BodyDef::pre_solve`; see PreSolveContact. An empty one ends it.
  void set_pre_solve_callback(std::function<void(PreSolveContact&)> callback);
  /// Whether two bodies may collide, of which one at least has `BodyDef::custom_filter` and which their filters let.
  /// Asked when their boxes begin to overlap, again when they begin anew or one of them gets another filter, and, as
  /// long as the answer is false, whenever one of them has moved on by the margin of its box. Not asked for queries and
  /// sensors.
  void set_filter_callback(std::function<bool(BodyId a, BodyId b)> callback);

  // Forces act during the next step only; impulses act at once. A force moves the body as symplectic Euler over the
  // whole step does, so a spring or a controller that computes its force once per step is stable up to ω dt < 2
  // (docs/solver.md). Bodies without forces move on exact parabolas. Points, forces and torques are in world axes. All
  // throw `stale_id`, and `invalid_argument` for non-finite values and for bodies that are fixed or kinematic.
  void apply_force(BodyId id, Vec3 force);                     ///< N at the centre of mass
  void apply_force_at(BodyId id, Vec3 force, Vec3 point);      ///< N at a point (m)
  void apply_torque(BodyId id, Vec3 torque);                   ///< N·m
  void apply_impulse(BodyId id, Vec3 impulse);                 ///< N·s at the centre of mass
  void apply_impulse_at(BodyId id, Vec3 impulse, Vec3 point);  ///< N·s at a point (m)
  void apply_angular_impulse(BodyId id, Vec3 impulse);         ///< N·m·s

  // Time --------------------------------------------------------------------------------------------------
  /// Advances by `definition().dt`.
  void step();
  /// Waits until the last step is finished and readable. Only the device simulator with `WorldDef::ahead` needs it.
  void wait() const;
  std::uint64_t step_count() const;  ///< steps made
  double time() const;               ///< s simulated
  /// Changes gravity (m/s²); wakes all sleepers that it acts on.
  void set_gravity(Vec3 gravity);
  /// Moves the origin to `new_origin` (m): subtracts it from every body's position and from the world frames of
  /// couplings, such as a pulley's wheels. Contacts go on; all bodies wake. For worlds that leave the 10 km around
  /// their origin in which single precision is good (docs/howto/floating-origin.md). Throws `invalid_argument` on a
  /// value that is not finite or takes a body out of range.
  void shift_origin(Vec3 new_origin);
  Vec3 gravity() const;  ///< m/s²

  // Results of the last step, valid until the next ----------------------------------------------------------
  // Events name bodies as they were in their step, removed ones too. With `WorldDef::ahead` a list has the events of
  // all steps that finished since it was read before the last `step`, in their order. Reading it again before the next
  // step returns it with later events, and invalidates the earlier span. If nothing reads a list, the oldest events are
  // dropped from a quarter of a million on, and `log` says so.
  const Profile& profile() const;                        ///< times and counts
  std::span<const ContactEvent> contacts_begun() const;  ///< pairs that began to touch
  std::span<const ContactEvent> contacts_ended() const;  ///< pairs that ceased to touch
  std::span<const HitEvent> hits() const;                ///< impacts
  std::span<const Quarantine> quarantined() const;       ///< bodies whose state became non-finite
  /// Joints that broke, by slot within a step. A world with joints that can break waits for each step, whatever
  /// `WorldDef::ahead` says.
  std::span<const JointBreak> joints_broken() const;
  /// Bodies that entered a sensor, by sensor and body within a step.
  std::span<const SensorEvent> sensor_begun() const;
  /// Bodies that left one.
  std::span<const SensorEvent> sensor_ended() const;
  /// Calls `visit` for every body that was in the sensor after the last step, in ascending order of index; those
  /// removed since are left out. Waits for the last step. Throws `stale_id`, and `invalid_argument` for a body that is
  /// no sensor.
  void for_each_in_sensor(BodyId sensor, const std::function<void(BodyId)>& visit) const;
  /// Calls `visit` for every pair that touches in the sense of the events. Waits for the last step.
  void for_each_contact(const std::function<void(const ContactInfo&)>& visit) const;

  /// The same for the pairs of one body, in ascending order of the other's index. Waits for the last step. Throws
  /// `stale_id`.
  void for_each_contact_of(BodyId id, const std::function<void(const ContactInfo&)>& visit) const;

  // Queries -------------------------------------------------------------------------------------------------
  // Queries see bodies as they stand, at once after a change, sleeping ones too; with `WorldDef::ahead` as the newest
  // finished step left them at the first query after the last `step`, change or other reading. They do not change later
  // steps. Several threads may query at once while nothing else is called. They compute in double precision; exact
  // touching counts as a hit. All throw `invalid_argument` on non-finite values, a translation of zero and shapes
  // without size, and `stale_id` where they name a body that is gone (docs/queries.md).

  /// The first hit of the ray; of equally near bodies the one of the lowest index. None where it hits nothing.
  std::optional<CastHit> cast_ray(Vec3 origin, Vec3 translation, const QueryFilter& filter = {}) const;
  /// All hits, one per body where the ray enters it, the nearest first.
  std::vector<CastHit> cast_ray_all(Vec3 origin, Vec3 translation, const QueryFilter& filter = {}) const;
  /// Overwrites hits[i] with `cast_ray` of rays[i]. Throws where the sizes differ.
  void cast_rays(std::span<const Ray> rays, std::span<std::optional<CastHit>> hits,
                 const QueryFilter& filter = {}) const;
  /// The first hit of the shape, moved from `pose` along `translation` (m) without turning. It stops short of it by at
  /// most a millionth of the thinner one's thickness.
  std::optional<CastHit> cast_shape(const Shape& shape, const Pose& pose, Vec3 translation,
                                    const QueryFilter& filter = {}) const;
  /// All hits on the way, as if the others were absent, the nearest first.
  std::vector<CastHit> cast_shape_all(const Shape& shape, const Pose& pose, Vec3 translation,
                                      const QueryFilter& filter = {}) const;
  /// Bodies whose tight bounds overlap the box, ascending.
  std::vector<BodyId> overlap_aabb(const Aabb& box, const QueryFilter& filter = {}) const;
  /// Bodies that the placed shape touches or overlaps, ascending.
  std::vector<BodyId> overlap_shape(const Shape& shape, const Pose& pose, const QueryFilter& filter = {}) const;
  /// The nearest points of the placed shape (a) and a body (b).
  ClosestPoints closest_points(const Shape& shape, const Pose& pose, BodyId body) const;
  /// The nearest points of two bodies.
  ClosestPoints closest_points(BodyId a, BodyId b) const;

  // Snapshots -----------------------------------------------------------------------------------------------
  /// Overwrites `out` with everything that later steps depend on, as bytes with a format version and a checksum, for
  /// little-endian machines. Waits for the steps in flight.
  void save(std::vector<std::byte>& out) const;
  /// Makes this world the saved one: simulator, definition, bodies with their ids, contacts, pending forces, step
  /// count. It then takes the same steps as the saved one, bit for bit. `threads`, `device`, `ahead`, `log` and the
  /// callbacks stay this world's own. Throws `file` for bytes that are truncated, altered or of another version,
  /// `unavailable` where the saved world's device simulator finds no device; the world is then as it was.
  void restore(std::span<const std::byte> bytes);

  /// XXH3 of all living bodies' poses and velocities in ascending order of index. Equal for any number of threads.
  std::uint64_t state_hash() const;

 private:
  std::unique_ptr<class Simulator> simulator_;
};

}  // namespace fathom
