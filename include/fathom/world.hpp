// The world: bodies, joints, forces, steps, queries and events. The application's interface to the library.
//
//   fathom::World world({.threads = 4});
//   world.add({.motion = fathom::MotionType::fixed, .shape = fathom::box({50, 50, 0.5f})});
//   const fathom::BodyId crate =
//       world.add({.pose = {.position = {0, 0, 5}}, .shape = fathom::box({0.5f, 0.5f, 0.5f}), .mass = 1});
//   for (int i = 0; i < 600; ++i) world.step();
//   const fathom::Vec3 where = world.pose(crate).position;
//
// One thread at a time may use a world, except for queries; different worlds are independent. Errors are thrown as
// `fathom::Error` and leave the world unchanged.
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

/// The whole library.
namespace fathom {

/// How pairs of bodies with overlapping boxes are found.
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

/// Parameters of the solver.
struct SolverSettings {
  static constexpr int max_substeps = 1000;  ///< of a step

  Solver method = Solver::soft;  ///< soft constraints or sequential impulses
  bool warm_start = true;        ///< contacts start from their last impulses; otherwise from zero in each substep
  /// `soft` solves mechanisms of rigid joints directly. False: by sweeps, like contacts, which is several times as
  /// fast, but joints drift apart by millimetres, and by more under heavy loads (docs/joints.md).
  bool direct_joints = true;
  int substeps = 4;         ///< 1 to `max_substeps`
  int iterations = 10;      ///< sweeps per substep of `impulse`; `soft` makes one, and one relax sweep
  int marking_rounds = 32;  ///< 1 to 255, for `Partition::cells` on a device: the maximum number of batches per cell
  /// Stiffness of contacts, doubled against static bodies; limited to 0.15 of the substep rate (36 Hz at 4 substeps and
  /// 1/60 s), which is the default.
  float contact_hertz = 1e6f;
  float contact_damping_ratio = 0.7f;  ///< of contacts; 1 is critical
  float push_out_velocity = 3.0f;      ///< m/s, the maximum for resolving penetration
  float restitution_threshold = 1.0f;  ///< m/s of approach below which nothing bounces; at least g h, with substep h
  /// m/s; faster bodies are clamped to it. Angular speeds are limited to 16 rad per substep: 3,840 rad/s at 4 substeps
  /// and 1/60 s. `WorldDef::log` reports the first velocity beyond these limits that the application requests.
  float max_linear_speed = 1000.0f;
};

/// Islands of touching bodies fall asleep together if they rest on something that cannot be pushed, or do not move at
/// all; bodies that sink, rise or drift freely never sleep. Contacts, setters and changes to what they rest on wake
/// them: a change of gravity, a support that moves, is removed or gets another material, a fixed body placed into them.
struct SleepSettings {
  bool enabled = true;         ///< whether bodies sleep at all
  float linear_speed = 0.05f;  ///< m/s of the fastest point of a body below which it may fall asleep; round bodies that
                               ///< touch something lose their spin below four times this
  float time = 0.5f;           ///< s for which all bodies of an island must have been slow
};

/// What executes the step.
enum class SimulatorKind : std::uint8_t {
  native,  ///< the CPU's cores and vector lanes (default)
  device,  ///< a GPU, or the host running the same kernels; `WorldDef::device` selects it
  hybrid,  ///< collision detection on that device, solver on the CPU
};

/// The definition of a world.
struct WorldDef {
  static constexpr int max_threads = 1024;  ///< of a world

  SimulatorKind simulator = SimulatorKind::native;  ///< what executes the step
  /// For the device simulator: `auto` (the first GPU, else the host), `host`, `cuda[:index]` or `sycl[:index]`.
  std::string device = "auto";
  /// Device simulator. 0: reading poses, velocities, events or the profile waits for the last step; steps of which
  /// nothing is read cost nothing extra. N > 0: `step` returns while up to N steps are in flight, the results of every
  /// step are copied back as it ends, and reading returns those of the newest finished step (events: of all finished
  /// steps). Later steps depend neither on this nor on what is read.
  int ahead = 0;
  /// Device simulator with `ahead`: false leaves poses and velocities on the device; reading them then waits for the
  /// last step, while the profile is still that of the newest finished one.
  bool copy_results = true;
  Vec3 gravity{0, 0, -9.81f};                           ///< m/s²
  float dt = 1.0f / 60.0f;                              ///< s, the fixed time step
  int threads = 0;                                      ///< up to `max_threads`; 0: all of the machine's
  BroadPhase broad_phase = BroadPhase::tree;            ///< how pairs are found
  Vec3 sweep_axis{0.8017837f, 0.5345225f, 0.2672612f};  ///< for `sweep`: components ≥ 0, not all 0
  Partition partition = Partition::colours;             ///< which contacts are solved at the same time
  SolverSettings solver{};                              ///< how contacts are solved
  SleepSettings sleep{};                                ///< when bodies sleep
  std::uint32_t max_bodies = 1u << 24;                  ///< `add` refuses to exceed it
  /// Called with one line of text for the application; never from a step's threads.
  std::function<void(std::string_view)> log{};
};

/// Sets of algorithms (docs/published-algorithms.md).
enum class Preset : std::uint8_t {
  fathom,        ///< the defaults: tree, colours, soft
  dissertation,  ///< Pereira (2020): sweep, cells, impulse, unlimited bias, no sleeping; on a device without
                 ///< warm starting and two steps ahead
};
/// Sets the fields of `def` that the preset specifies for its simulator.
FATHOM_API void apply(Preset preset, WorldDef& def);

/// A joint that broke (see `JointDef::break_force`) and was removed; its bodies are awake.
struct JointBreak {
  JointId joint;                ///< its id, which is stale
  BodyId a;                     ///< body A of its definition
  BodyId b;                     ///< body B
  Vec3 force;                   ///< N, on B, mean over the step
  Vec3 torque;                  ///< N·m
  std::uint64_t user_data = 0;  ///< from its definition
  std::uint64_t step = 0;       ///< `World::step_count()` after that step
};

/// A body removed from the simulation because its state was not finite after a step. It keeps the pose it had before
/// the step, with zero velocity, and stays fixed until its velocity or pose is set again. All other bodies behave as if
/// it had been removed before the step.
struct Quarantine {
  BodyId body;             ///< which one
  std::uint64_t step = 0;  ///< `World::step_count()` after that step
};

/// A simulated world: its bodies, joints, events and queries. See the top of this file.
class FATHOM_API World {
 public:
  /// Throws `Error{invalid_argument}` if the definition is out of range.
  explicit World(const WorldDef& def = {});
  ~World();
  /// Leaves `other` without a world: it may only be destroyed or assigned to.
  World(World&& other) noexcept;
  /// Leaves `other` without a world: it may only be destroyed or assigned to.
  World& operator=(World&& other) noexcept;

  /// The definition it was created or restored from.
  const WorldDef& definition() const;
  /// What the device simulator runs on ("cuda:0 NVIDIA H100 80GB HBM3"); empty for the native simulator.
  std::string hardware() const;

  // Bodies ------------------------------------------------------------------------------------------------
  /// Throws `invalid_argument` (non-finite, negative or zero values), `capacity`.
  BodyId add(const BodyDef& def);
  /// Adds several bodies; returns their ids in the order of `defs`. If there are a thousand or more in scattered order,
  /// bodies close in space get nearby indices, which makes multi-threaded steps faster. A body's index is a function of
  /// `defs` and of the bodies added and removed before. Throws what `add` throws, prefixed with "body 17: …" for
  /// defs[17], and then adds none.
  std::vector<BodyId> add_bodies(std::span<const BodyDef> defs);
  /// Allocates memory for `bodies` bodies; adding them then allocates little.
  void reserve(std::uint32_t bodies);
  /// Sorts bodies for collision detection and queries, as the next step and the next query otherwise would. For use
  /// after adding many bodies: a million fixed boxes take 0.6 s or more. Finds pairs, and calls the filter callback, as
  /// that step would; the step's result is the same, to the last bit if nothing is changed in between. Does nothing if
  /// a device finds pairs. Throws `capacity` if memory runs out.
  void optimize_broad_phase();
  /// Throws `stale_id`. Bodies that rested on it wake; its joints are removed with it.
  void remove(BodyId id);
  bool contains(BodyId id) const;    ///< whether the body exists
  std::uint32_t body_count() const;  ///< number of bodies
  /// All bodies in ascending order of index; valid until a body is added or removed.
  std::span<const BodyId> bodies() const;

  /// Poses and velocities of all bodies by `BodyId::index`, contiguous, 32 bytes each; slots of removed bodies hold
  /// identity and zero. Valid until the next step or change of the world.
  std::span<const Pose> poses() const;
  std::span<const Velocity> velocities() const;  ///< see `poses`
  /// Poses of the last step without a copy to the host; waits for the step. Empty if the simulator does not keep them
  /// in memory that a rendering GPU can read (only CUDA does), before the first step, and while changes wait for the
  /// next step: use `poses()` then.
  std::optional<DevicePoses> device_poses() const;

  // All of these throw `stale_id`; setters throw `invalid_argument` for non-finite values. Setters wake the body.
  const Pose& pose(BodyId id) const;  ///< of its centre of mass
  /// Teleports a body, without pushing anything in between; the rotation is normalised.
  void set_pose(BodyId id, const Pose& pose);
  const Velocity& velocity(BodyId id) const;  ///< m/s and rad/s, world axes
  /// Sets the velocity (m/s, rad/s).
  void set_velocity(BodyId id, Vec3 linear, Vec3 angular);
  /// Moves a kinematic body to exactly this pose by the end of the next step. During that step it has the velocity that
  /// takes it there in a straight line, turning the shorter way. Contacts see that velocity; it carries bodies that
  /// rest on it and, if it moves, wakes sleeping ones. Then it stops, unless this is called again. Until the step,
  /// `set_pose`, `set_velocity` and `add_velocity` override it. To teleport a body, use `set_pose`. Throws
  /// `invalid_argument` for bodies that are not kinematic.
  void move_to(BodyId id, const Pose& pose);
  /// Adds to the velocity (m/s, rad/s) without reading it first.
  void add_velocity(BodyId id, Vec3 linear, Vec3 angular);
  MotionType motion(BodyId id) const;                 ///< fixed, kinematic or dynamic
  Shape shape(BodyId id) const;                       ///< cheap to copy
  float mass(BodyId id) const;                        ///< kg; 0 for bodies that forces do not move
  MassProperties mass_properties(BodyId id) const;    ///< mass and inertia; zero for bodies that forces do not move
  Aabb bounds(BodyId id) const;                       ///< m, tight, world
  std::uint64_t user_data(BodyId id) const;           ///< see `BodyDef::user_data`
  void set_user_data(BodyId id, std::uint64_t data);  ///< does not wake the body
  void set_material(BodyId id, const Material& material);  ///< throws what `add` throws for materials
  const Material& material(BodyId id) const;               ///< see `BodyDef::material`
  void set_filter(BodyId id, Filter filter);               ///< if it is another one, ends contacts it does not allow
  Filter filter(BodyId id) const;                          ///< see `BodyDef::filter`
  /// Keeps two bodies from colliding, whatever their filters, until `include` or until one of them is removed. Their
  /// contact ends, and both wake. A sensor does not see bodies excluded with it. Throws `stale_id`, and
  /// `invalid_argument` if both are the same body.
  void exclude(BodyId a, BodyId b);
  /// Reverts `exclude`: their filters and joints decide again.
  void include(BodyId a, BodyId b);
  bool is_excluded(BodyId a, BodyId b) const;  ///< whether `exclude` keeps them apart
  // `set_motion`, `set_shape` and `set_sensor` replace the body under the same id, with its pose, velocity and joints:
  // its contacts end and begin again in the next step, and forces applied since the last step are lost. They and
  // `set_mass` throw what `add` throws, and then leave the body unchanged. Setting the motion or mass that a body has
  // already, or the same for `sensor`, changes nothing.

  /// A body that becomes fixed stops. One that becomes dynamic gets the mass of its shape at 1,000 kg/m³; use
  /// `set_mass` to change it. Also throws `invalid_argument` if a joint would be left without a dynamic body.
  void set_motion(BodyId id, MotionType motion);
  /// Its centre of mass stays in place. A dynamic body keeps its mass and gets the shape's inertia.
  void set_shape(BodyId id, const Shape& shape);
  /// Mass (kg) and inertia (kg·m², body axes), which defaults to the shape's. Velocity, contacts and their impulses
  /// stay. Throws `invalid_argument` for bodies that are not dynamic.
  void set_mass(BodyId id, float mass, const std::optional<SymMat3>& inertia = {});
  /// Whether it is a sensor (sensor.hpp).
  void set_sensor(BodyId id, bool sensor);
  bool is_sensor(BodyId id) const;                ///< see `BodyDef::sensor`
  void set_bullet(BodyId id, bool bullet);        ///< see `BodyDef::bullet`; from the next step on
  bool is_bullet(BodyId id) const;                ///< see `BodyDef::bullet`
  void set_pre_solve(BodyId id, bool pre_solve);  ///< see `BodyDef::pre_solve`
  bool has_pre_solve(BodyId id) const;            ///< see `BodyDef::pre_solve`
  /// See `BodyDef::custom_filter`. Its contacts end, and begin again if the callback allows them.
  void set_custom_filter(BodyId id, bool custom_filter);
  bool has_custom_filter(BodyId id) const;                   ///< see `BodyDef::custom_filter`
  void set_gravity_scale(BodyId id, float scale);            ///< factor on the world's gravity
  void set_damping(BodyId id, float linear, float angular);  ///< 1/s, ≥ 0
  bool is_awake(BodyId id) const;                            ///< false while asleep
  void wake(BodyId id);                                      ///< wakes its island

  // Joints ------------------------------------------------------------------------------------------------
  /// Joins two bodies and wakes them. Throws `stale_id` if one of them does not exist, and `invalid_argument` for
  /// values that are not finite, if both are the same body or neither is dynamic, and in a world with
  /// `Partition::cells`, which the dissertation defines for contacts alone.
  JointId add_joint(const JointDef& def);
  /// Throws `stale_id`. Wakes both bodies.
  void remove_joint(JointId id);
  bool contains(JointId id) const;    ///< whether the joint exists
  std::uint32_t joint_count() const;  ///< number of joints
  /// All joints in ascending order of index; valid until a joint or a body is added or removed.
  std::span<const JointId> joints() const;
  /// The definition it was created from, rotations normalised. Throws `stale_id`.
  const JointDef& joint(JointId id) const;
  /// Changes its spring (see JointDef) from the next step on; wakes both bodies. Throws `stale_id`, `invalid_argument`.
  void set_joint_spring(JointId id, float hertz, float damping_ratio);
  /// Changes bounds or drive of an axis from the next step on; wakes both bodies. Throws `stale_id`, and
  /// `invalid_argument` as `add_joint` does.
  void set_joint_axis(JointId id, JointAxisName name, const JointAxis& axis);
  /// Changes its frames on the two bodies (see JointDef). They may be apart: the joint pulls them together, at 60 m/s
  /// at most. Wakes both bodies. Throws `stale_id`, and `invalid_argument` as `add_joint` does.
  void set_joint_frames(JointId id, const Pose& frame_a, const Pose& frame_b);
  /// Moves the target (m, world) of a `target_joint`, or of any other joint to a body that is not dynamic: the joint's
  /// anchor on that body. Wakes the other body if this changes the target. Throws `stale_id`, and `invalid_argument` if
  /// both bodies are dynamic or the target is not finite.
  void set_joint_target(JointId id, Vec3 target);
  /// Changes the force and the torque at which it breaks (see JointDef) from the next step on; wakes both bodies.
  /// Throws `stale_id`, `invalid_argument`.
  void set_joint_break(JointId id, float force, float torque);
  /// Changes all parameters at once from the next step on; ignores the bodies of `definition`. Wakes both bodies.
  /// Throws `stale_id`, and `invalid_argument` as `add_joint` does or if the type or `collide_connected` differs; the
  /// joint is then unchanged.
  void change_joint(JointId id, const JointDef& definition);
  /// The joint from `a` to `b` that has this user data; if several, the one with the lowest index. Throws `stale_id` if
  /// there is none.
  JointId find_joint(BodyId a, BodyId b, std::uint64_t user_data) const;
  /// Force and torque of the last step; waits for it. Throws `stale_id`.
  JointReaction reaction(JointId id) const;
  /// The current positions of its axes; zeros for a ball joint. Throws `stale_id`.
  JointPositions joint_positions(JointId id) const;

  // Callbacks -----------------------------------------------------------------------------------------------
  // The thread that calls `step` calls them, one pair at a time, in an order that does not depend on the number of
  // threads. They may read the world but not change, save or query it: that throws `invalid_argument`. `step` rethrows
  // the first exception of a callback once the step is over; that pair is handled as without a callback. `restore`
  // keeps callbacks; snapshots and recordings do not contain them. Replays are identical only if the callbacks return
  // the same, so what they return should be a function of the world. The native and the hybrid simulator support them.

  /// Called before contacts of bodies with `BodyDef::pre_solve` are solved; see PreSolveContact. An empty function
  /// removes it.
  void set_pre_solve_callback(std::function<void(PreSolveContact&)> callback);
  /// Decides whether two bodies may collide if their filters allow it and at least one has `BodyDef::custom_filter`.
  /// Called whenever their boxes begin to overlap or one of them gets another filter, and, while the result is false,
  /// whenever one of them has moved by the margin of its box. Not called for queries and sensors.
  void set_filter_callback(std::function<bool(BodyId a, BodyId b)> callback);

  // Forces act during the next step only; impulses act at once. A force moves the body as symplectic Euler over the
  // whole step would, so a spring or a controller that computes its force once per step is stable up to ω dt < 2
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
  /// Waits until the last step is finished and readable. Only needed with the device simulator and `WorldDef::ahead`.
  void wait() const;
  std::uint64_t step_count() const;  ///< steps taken
  double time() const;               ///< simulated time (s)
  /// Changes gravity (m/s²); wakes all sleeping bodies that it acts on.
  void set_gravity(Vec3 gravity);
  /// Moves the origin to `new_origin` (m): subtracts it from every body's position and from the world frames of
  /// couplings, such as a pulley's wheels. Contacts persist; all bodies wake. For worlds that leave the 10 km around
  /// their origin where single precision is good enough (docs/howto/floating-origin.md). Throws `invalid_argument` for
  /// a value that is not finite or moves a body out of range.
  void shift_origin(Vec3 new_origin);
  Vec3 gravity() const;  ///< m/s²

  // Results of the last step, valid until the next ----------------------------------------------------------
  // Events name bodies as they were in their step, even if removed since. With `WorldDef::ahead` a list holds, in
  // order, the events of all steps that finished since it was last read before the last `step`. Reading it again before
  // the next step returns it with later events appended, and invalidates the earlier span. If a list is not read, it
  // drops its oldest events beyond a quarter of a million, and `log` says so.
  const Profile& profile() const;                        ///< times and counts
  std::span<const ContactEvent> contacts_begun() const;  ///< pairs that began to touch
  std::span<const ContactEvent> contacts_ended() const;  ///< pairs that stopped touching
  std::span<const HitEvent> hits() const;                ///< impacts
  std::span<const Quarantine> quarantined() const;       ///< bodies whose state became non-finite
  /// Joints that broke, by slot within a step. A world with breakable joints waits for each step regardless of
  /// `WorldDef::ahead`.
  std::span<const JointBreak> joints_broken() const;
  /// Bodies that entered a sensor, by sensor and body within a step.
  std::span<const SensorEvent> sensor_begun() const;
  /// Bodies that left a sensor.
  std::span<const SensorEvent> sensor_ended() const;
  /// Calls `visit` for every body that was in the sensor after the last step and still exists, in ascending order of
  /// index. Waits for the last step. Throws `stale_id`, and `invalid_argument` for a body that is not a sensor.
  void for_each_in_sensor(BodyId sensor, const std::function<void(BodyId)>& visit) const;
  /// Calls `visit` for every pair that touches as events define it. Waits for the last step.
  void for_each_contact(const std::function<void(const ContactInfo&)>& visit) const;

  /// The same for the pairs of one body, in ascending order of the other's index. Waits for the last step. Throws
  /// `stale_id`.
  void for_each_contact_of(BodyId id, const std::function<void(const ContactInfo&)>& visit) const;

  // Queries -------------------------------------------------------------------------------------------------
  // Queries see bodies in their current state, including changes just made and sleeping bodies; with `WorldDef::ahead`,
  // as the newest finished step left them at the first query after the last `step`, change or other reading. They do
  // not affect later steps. Several threads may query at once while nothing else is called. Queries compute in double
  // precision; exact touching counts as a hit. All throw `invalid_argument` for non-finite values, a zero translation
  // and shapes without size, and `stale_id` if they name a body that does not exist (docs/queries.md).

  /// The first hit of the ray, if any; of equally near bodies the one with the lowest index.
  std::optional<CastHit> cast_ray(Vec3 origin, Vec3 translation, const QueryFilter& filter = {}) const;
  /// All hits, one per body at the point where the ray enters it, nearest first.
  std::vector<CastHit> cast_ray_all(Vec3 origin, Vec3 translation, const QueryFilter& filter = {}) const;
  /// Overwrites hits[i] with `cast_ray` of rays[i], on the world's threads or its device; a filter's callback is called
  /// on the caller's thread alone. Throws if the sizes differ.
  void cast_rays(std::span<const Ray> rays, std::span<std::optional<CastHit>> hits,
                 const QueryFilter& filter = {}) const;
  /// The first hit of the shape, moved from `pose` along `translation` (m) without turning. The shape stops short of
  /// the hit by at most a millionth of the thickness of the thinner of the two.
  std::optional<CastHit> cast_shape(const Shape& shape, const Pose& pose, Vec3 translation,
                                    const QueryFilter& filter = {}) const;
  /// All hits along the path, each as if the others were absent, nearest first.
  std::vector<CastHit> cast_shape_all(const Shape& shape, const Pose& pose, Vec3 translation,
                                      const QueryFilter& filter = {}) const;
  /// Overwrites hits[i] with `cast_shape` of casts[i], on the world's threads or its device; a filter's callback is
  /// called on the caller's thread alone. Throws if the sizes differ.
  void cast_shapes(std::span<const ShapeCast> casts, std::span<std::optional<CastHit>> hits,
                   const QueryFilter& filter = {}) const;
  /// Bodies whose tight bounds overlap the box, ascending.
  std::vector<BodyId> overlap_aabb(const Aabb& box, const QueryFilter& filter = {}) const;
  /// Bodies that the placed shape touches or overlaps, ascending.
  std::vector<BodyId> overlap_shape(const Shape& shape, const Pose& pose, const QueryFilter& filter = {}) const;
  /// Overwrites found[i] with `overlap_shape` of shapes[i], as `cast_shapes` does.
  void overlap_shapes(std::span<const ShapeCast> shapes, std::span<std::vector<BodyId>> found,
                      const QueryFilter& filter = {}) const;
  /// The closest points of the placed shape (a) and a body (b).
  ClosestPoints closest_points(const Shape& shape, const Pose& pose, BodyId body) const;
  /// The closest points of two bodies.
  ClosestPoints closest_points(BodyId a, BodyId b) const;

  // Snapshots -----------------------------------------------------------------------------------------------
  /// Overwrites `out` with everything that later steps depend on, as bytes with a format version and a checksum, for
  /// little-endian machines. Waits for the steps in flight.
  void save(std::vector<std::byte>& out) const;
  /// Makes this world the saved one: simulator, definition, bodies with their ids, contacts, pending forces, step
  /// count. Its further steps equal those of the saved one, bit for bit. `threads`, `device`, `ahead`, `log` and the
  /// callbacks remain this world's own. Throws `file` for bytes that are truncated, altered or of another version, and
  /// `unavailable` if the saved world's device simulator finds no device; the world is then unchanged.
  void restore(std::span<const std::byte> bytes);

  /// XXH3 of all bodies' poses and velocities in ascending order of index. The same for any number of threads.
  std::uint64_t state_hash() const;

 private:
  std::unique_ptr<class Simulator> simulator_;
};

}  // namespace fathom
