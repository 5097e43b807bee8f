// The world: bodies, joints, forces, steps, queries and events. This is the interface an application uses.
//
//   fathom::World world({.threads = 4});
//   world.add({.motion = fathom::MotionType::fixed, .shape = fathom::box({50, 50, 0.5f})});
//   fathom::BodyId crate = world.add({.pose = {.position = {0, 0, 5}}, .shape = fathom::box({0.5f, 0.5f, 0.5f}), .mass
//   = 1}); for (int i = 0; i < 600; ++i) world.step(); fathom::Vec3 where = world.pose(crate).position;
//
// A world is used by one thread at a time, but for queries; different worlds are independent. Errors are thrown as
// `fathom::Error` and leave the world as it was.
#pragma once

#include <cstddef>
#include <cstdint>
#include <fathom/body.hpp>
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

namespace fathom {

enum class BroadPhase : std::uint8_t {
  tree,   ///< 8-wide bounding volume hierarchy over Morton-sorted boxes with margins (default)
  sweep,  ///< sweep-and-sort along one axis (dissertation, section 3.3.1)
};

enum class Solver : std::uint8_t {
  soft,     ///< substepped soft constraints with relaxation (default)
  impulse,  ///< sequential impulses with a velocity bias (dissertation, equations 3.20–3.23)
};

enum class Partition : std::uint8_t {
  colours,  ///< a persistent colouring of the contact graph (default)
  cells,    ///< cells of a uniform grid in 2³ groups, batches inside a cell (dissertation, section 3.4)
};

struct SolverSettings {
  Solver method = Solver::soft;
  bool warm_start = true;   ///< contacts begin with their last impulses; else each substep begins without any
  int substeps = 4;         ///< ≥ 1
  int iterations = 10;      ///< sweeps a substep of `impulse`; `soft` does one and one relax sweep
  int marking_rounds = 32;  ///< 1 to 255, for `Partition::cells` on a device: as many batches a cell can have
  /// Stiffness of contacts, twice that against static bodies; at most 0.15 of the substep rate (36 Hz at 4 substeps and
  /// 1/60 s), which is the default.
  float contact_hertz = 1e6f;
  float contact_damping_ratio = 0.7f;  ///< docs/solver.md compares some
  float push_out_velocity = 3.0f;      ///< m/s at most to resolve a penetration
  float restitution_threshold = 1.0f;  ///< m/s of approach below which nothing bounces; at least g h, h a substep
  /// m/s; faster bodies are slowed to it. Angular speeds are limited to 16 rad a substep: 3,840 rad/s at 4 substeps and
  /// 1/60 s. `WorldDef::log` is told of the first velocity beyond them that the application asks for.
  float max_linear_speed = 1000.0f;
};

/// Islands of bodies that touch fall asleep together, where they rest on something that cannot be pushed or do not move
/// at all; what sinks, rises or drifts freely never does. Contacts and setters wake them, and what changes below them:
/// another gravity, a support that moves, goes or gets another material, something fixed that is put into them.
struct SleepSettings {
  bool enabled = true;
  float linear_speed = 0.05f;  ///< m/s of the fastest point of a body below which it may fall asleep; round bodies that
                               ///< touch something lose their spin below four times this
  float time = 0.5f;           ///< s that all bodies of an island must have been slow
};

enum class SimulatorKind : std::uint8_t {
  native,  ///< the CPU's cores and vector lanes (default)
  device,  ///< a GPU, or the host running the same kernels; `WorldDef::device` says which
  hybrid,  ///< detection on that device, resolution on the CPU
};

/// What a world is created from.
struct WorldDef {
  SimulatorKind simulator = SimulatorKind::native;
  /// For the device simulator: `auto` (the first GPU, else the host), `host`, `cuda[:index]` or `sycl[:index]`.
  std::string device = "auto";
  /// For the device simulator: 0 means that reading poses, velocities, events or the profile waits for the last step,
  /// and costs nothing where nobody reads. N > 0 means that `step` returns while up to N steps are still under way,
  /// every step's results are copied back as it ends, and reading gives those of the newest finished one; events those
  /// of all that have finished. Later steps do not depend on it, nor on what is read.
  int ahead = 0;
  /// For the device simulator with `ahead`: false leaves poses and velocities on the device; reading them then waits
  /// for the last step, while the profile is still that of the newest finished one.
  bool copy_results = true;
  Vec3 gravity{0, 0, -9.81f};
  float dt = 1.0f / 60.0f;  ///< s, the fixed time step
  int threads = 0;          ///< 0: as many as the machine has
  BroadPhase broad_phase = BroadPhase::tree;
  Vec3 sweep_axis{0.8017837f, 0.5345225f, 0.2672612f};  ///< for `sweep`: components ≥ 0, not all 0
  Partition partition = Partition::colours;             ///< which contacts are solved at the same time
  SolverSettings solver{};
  SleepSettings sleep{};
  std::uint32_t max_bodies = 1u << 24;  ///< `add` refuses more
  /// Called with one line of text for what the application should know; never from inside a step's threads.
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

/// Two bodies, in ascending order of index, that began or ceased to touch in a step. They touch from the step on in
/// which their contact carries an impulse, or that they begin nearer to each other than 1 mm (of small ones less, by
/// halves, down to a hundredth of the smaller one's bounding radius), and until a step in which it carries none and
/// that they begin farther apart than twice that. Falling asleep and waking change nothing of it.
struct ContactEvent {
  BodyId a, b;
  std::uint64_t step = 0;  ///< `World::step_count()` after it
};
/// Two bodies that met faster than `SolverSettings::restitution_threshold`: a point of their contact approached faster
/// as the step began, and the contact stopped it or threw it back, whether they touched elsewhere already (a post that
/// falls over) or not. Each such impact is told once, by its fastest point.
struct HitEvent {
  BodyId a, b;
  Vec3 point;            ///< m, world, where they met
  Vec3 normal;           ///< unit, from a to b
  float approach_speed;  ///< m/s, as the step began
  std::uint32_t reserved = 0;
  std::uint64_t step = 0;  ///< `World::step_count()` after it
};

/// A joint that broke (see `JointDef::break_force`) and is gone; its bodies are awake.
struct JointBreak {
  JointId joint;
  BodyId a, b;  ///< those of its definition
  Vec3 force;   ///< N, on B, mean over the step
  Vec3 torque;  ///< N·m
  std::uint64_t user_data = 0;
  std::uint64_t step = 0;  ///< `World::step_count()` after it
};

/// One contact point as solved in the last step.
struct ContactPointInfo {
  Vec3 position;     ///< m, world
  float separation;  ///< m, negative where the bodies overlap
  float impulse;     ///< N·s along the normal over the step; divided by dt the mean force (see ContactInfo)
};
/// The points' impulses sum to what the contact gave over the step; how they share it is that of the last substep.
struct ContactInfo {
  BodyId a, b;
  Vec3 normal;  ///< unit, from a to b
  int point_count = 0;
  ContactPointInfo points[4];
  int colour = -1;  ///< of the constraint graph; −1 where the pair has none (asleep, or solved one by one)
  std::uint32_t child_a = 0, child_b = 0;  ///< of compounds, see `Compound::children`
};

/// A body taken out of the simulation because its state was not finite after a step; its pose is that
/// before the step, its velocity zero. All others are as if it had been taken out before the step. It stays fixed until
/// its velocity or pose is set again.
struct Quarantine {
  BodyId body;
  std::uint64_t step = 0;
};

/// Everything between the bodies and the application. See the head of this file.
class FATHOM_API World {
 public:
  /// Throws `Error{invalid_argument}` on a definition out of range.
  explicit World(const WorldDef& def = {});
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  const WorldDef& definition() const;
  /// What the device simulator runs on ("cuda:0 NVIDIA H100 80GB HBM3"); empty for the native simulator.
  std::string hardware() const;

  // Bodies ------------------------------------------------------------------------------------------------
  /// Throws `invalid_argument` (non-finite, negative or zero values), `capacity`.
  BodyId add(const BodyDef& def);
  /// Adds several at once; returns their ids in the order of `defs`. From a thousand on, and where `defs` goes to and
  /// fro in space, neighbours get neighbouring indices, which makes steps on several threads faster. Which index a body
  /// gets is a function of `defs` and of the bodies added and removed before. Throws what `add` throws, saying "body
  /// 17: …" of defs[17], and has then added none.
  std::vector<BodyId> add_bodies(std::span<const BodyDef> defs);
  /// Makes room for `bodies` so that adding them allocates little.
  void reserve(std::uint32_t bodies);
  /// Throws `stale_id`. Bodies that rested on it wake; its joints go with it.
  void remove(BodyId id);
  bool contains(BodyId id) const;
  std::uint32_t body_count() const;
  /// All living bodies in ascending order of index; valid until a body is added or removed.
  std::span<const BodyId> bodies() const;

  /// Poses and velocities of all bodies by `BodyId::index`, contiguous, 32 bytes each; slots of removed
  /// bodies hold identity and zero. Valid until the next step or change of the world.
  std::span<const Pose> poses() const;
  std::span<const Velocity> velocities() const;
  /// Poses of the last step, which this waits for, without a copy to the host. None where the simulator keeps them in
  /// no memory that a drawing GPU reads (all but CUDA), before the first step, and while changes wait for the next
  /// step: `poses()` then serves.
  std::optional<DevicePoses> device_poses() const;

  // All of these throw `stale_id`; setters `invalid_argument` on non-finite values. Setters wake the body.
  const Pose& pose(BodyId id) const;
  void set_pose(BodyId id, const Pose& pose);
  const Velocity& velocity(BodyId id) const;
  void set_velocity(BodyId id, Vec3 linear, Vec3 angular);
  /// Moves a kinematic body so that the next step ends with it at exactly this pose. During that step it has the
  /// velocity that takes it there on a straight line, turning the shorter way: contacts see it, what rests on the body
  /// is carried along, and sleepers on it wake where it moves. Then it stops, unless this is called again; until the
  /// step, set_pose, set_velocity and add_velocity take its place. A body that is to appear elsewhere without pushing
  /// what is between has set_pose. Throws `invalid_argument` for bodies that are not kinematic.
  void move_to(BodyId id, const Pose& pose);
  /// Adds to the velocity (m/s, rad/s), without a need to read it first.
  void add_velocity(BodyId id, Vec3 linear, Vec3 angular);
  MotionType motion(BodyId id) const;
  Shape shape(BodyId id) const;
  float mass(BodyId id) const;  ///< kg; 0 for bodies that forces do not move
  MassProperties mass_properties(BodyId id) const;
  Aabb bounds(BodyId id) const;  ///< m, tight, world
  std::uint64_t user_data(BodyId id) const;
  void set_user_data(BodyId id, std::uint64_t data);
  void set_material(BodyId id, const Material& material);
  const Material& material(BodyId id) const;
  void set_filter(BodyId id, Filter filter);
  Filter filter(BodyId id) const;
  /// Keeps two bodies from colliding, whatever their filters, until `include` or the end of one of them: what touches
  /// ends, and both wake. Sensors do not see bodies that they are excluded with. Throws `stale_id`, and
  /// `invalid_argument` where both are one body.
  void exclude(BodyId a, BodyId b);
  /// Takes that back; their filters and joints decide again.
  void include(BodyId a, BodyId b);
  bool is_excluded(BodyId a, BodyId b) const;
  // The next four begin the body anew, under the same id, with its pose, velocity and joints: what it touches ends and
  // begins again in the next step, and forces applied since the last one are gone. They throw what `add` throws, and
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
  bool is_sensor(BodyId id) const;
  void set_gravity_scale(BodyId id, float scale);
  void set_damping(BodyId id, float linear, float angular);
  bool is_awake(BodyId id) const;
  void wake(BodyId id);

  // Joints ------------------------------------------------------------------------------------------------
  /// Joins two bodies and wakes them. Throws `stale_id` where one of them is gone, and `invalid_argument` on values
  /// that are not finite, where both are one body or none of them is dynamic, and in a world with `Partition::cells`,
  /// which the dissertation defines for contacts alone.
  JointId add_joint(const JointDef& def);
  /// Throws `stale_id`. Wakes both bodies.
  void remove_joint(JointId id);
  bool contains(JointId id) const;
  std::uint32_t joint_count() const;
  /// All living joints in ascending order of index; valid until a joint or a body is added or removed.
  std::span<const JointId> joints() const;
  /// What it was created from, rotations normalised. Throws `stale_id`.
  const JointDef& joint(JointId id) const;
  /// Another spring (see JointDef), from the next step on; wakes both bodies. Throws `stale_id`, `invalid_argument`.
  void set_joint_spring(JointId id, float hertz, float damping_ratio);
  /// Other bounds or another drive of an axis, from the next step on; wakes both bodies. Throws `stale_id`, and
  /// `invalid_argument` as `add_joint`.
  void set_joint_axis(JointId id, JointAxisName name, const JointAxis& axis);
  /// Other frames on the two bodies (see JointDef), which may be apart: the joint pulls them together, at 60 m/s at
  /// most. Wakes both bodies. Throws `stale_id`, and `invalid_argument` as `add_joint`.
  void set_joint_frames(JointId id, const Pose& frame_a, const Pose& frame_b);
  /// Moves the target (m, world) of a `target_joint`, or of another joint to a body that is not dynamic: the joint's
  /// anchor on that body. Wakes the other body where the target is not there already. Throws `stale_id`, and
  /// `invalid_argument` where both bodies are dynamic or the target is not finite.
  void set_joint_target(JointId id, Vec3 target);
  /// Another force and torque at which it breaks (see JointDef), from the next step on; wakes both bodies. Throws
  /// `stale_id`, `invalid_argument`.
  void set_joint_break(JointId id, float force, float torque);
  /// Every parameter at once, from the next step on; the definition's bodies are not read. Wakes both bodies. Throws
  /// `stale_id`, and `invalid_argument` as `add_joint` or where the type or `collide_connected` is another; the joint
  /// is then as it was.
  void change_joint(JointId id, const JointDef& definition);
  /// The joint from `a` to `b` that has this user data; of several the one of the lowest index. Throws `stale_id` where
  /// there is none.
  JointId find_joint(BodyId a, BodyId b, std::uint64_t user_data) const;
  /// Of the last step; waits for it. Throws `stale_id`.
  JointReaction reaction(JointId id) const;
  /// Where its axes stand now; of a ball joint zeros. Throws `stale_id`.
  JointPositions joint_positions(JointId id) const;

  // Forces act during the next step only; impulses at once. What a force changes of the velocity moves the body as
  // symplectic Euler over the whole step does, so a spring or a controller that computes its force once a step is
  // stable up to ω dt < 2 (docs/solver.md); bodies without forces fly on exact parabolas. Points, forces and torques
  // are in world axes. All throw `stale_id`, and `invalid_argument` for values that are not finite and for bodies that
  // are fixed or kinematic.
  void apply_force(BodyId id, Vec3 force);                 ///< N at the centre of mass
  void apply_force_at(BodyId id, Vec3 force, Vec3 point);  ///< N at a point (m)
  void apply_torque(BodyId id, Vec3 torque);               ///< N·m
  void apply_impulse(BodyId id, Vec3 impulse);             ///< N·s at the centre of mass
  void apply_impulse_at(BodyId id, Vec3 impulse, Vec3 point);
  void apply_angular_impulse(BodyId id, Vec3 impulse);  ///< N·m·s

  // Time --------------------------------------------------------------------------------------------------
  /// Advances by `definition().dt`.
  void step();
  /// Waits until the last step is the one that is read. Only the device simulator with `WorldDef::ahead` needs it.
  void wait() const;
  std::uint64_t step_count() const;
  double time() const;  ///< s simulated
  /// Another gravity wakes all sleepers that it acts on.
  void set_gravity(Vec3 gravity);
  /// Moves the origin to `new_origin` (m): takes it from every body's position. What touches goes on touching; all
  /// bodies wake. For worlds that leave the 10 km round their origin where single precision is good
  /// (docs/validation.md). Throws `invalid_argument` on a value that is not finite or takes a body out of range.
  void shift_origin(Vec3 new_origin);
  Vec3 gravity() const;

  // Results of the last step, valid until the next ----------------------------------------------------------
  // Events name bodies as they were in their step, removed ones too. With `WorldDef::ahead` a list tells of all steps
  // that finished since it was read before the last `step`, in their order; reading it again before the next returns it
  // with what has come since, and ends the earlier span. Of events that nobody reads the oldest are dropped from a
  // quarter of a million of a list on, which `log` is told.
  const Profile& profile() const;
  std::span<const ContactEvent> contacts_begun() const;
  std::span<const ContactEvent> contacts_ended() const;
  std::span<const HitEvent> hits() const;
  std::span<const Quarantine> quarantined() const;
  /// By slot within a step. A world that has joints that can break waits for each step, whatever `WorldDef::ahead`.
  std::span<const JointBreak> joints_broken() const;
  /// By sensor and body within a step.
  std::span<const SensorEvent> sensor_begun() const;
  std::span<const SensorEvent> sensor_ended() const;
  /// Calls `visit` for every body that was in the sensor after the last step, in ascending order of index; those
  /// removed since are left out. Waits for the last step. Throws `stale_id`, and `invalid_argument` for a body that is
  /// no sensor.
  void for_each_in_sensor(BodyId sensor, const std::function<void(BodyId)>& visit) const;
  /// Calls `visit` for every pair that touches by its events. Waits for the last step.
  void for_each_contact(const std::function<void(const ContactInfo&)>& visit) const;

  /// The same for the pairs of one body, in ascending order of the other's index. Waits for the last step. Throws
  /// `stale_id`.
  void for_each_contact_of(BodyId id, const std::function<void(const ContactInfo&)>& visit) const;

  // Queries -------------------------------------------------------------------------------------------------
  // Of bodies as they stand: at once after a change, asleep ones too; with `WorldDef::ahead` as the newest finished
  // step left them when they were first asked for after the last `step`, change or other reading. They change nothing
  // of later steps. Several threads may ask at once, while nobody calls anything else. Computed in double precision;
  // what touches exactly counts as met. All throw `invalid_argument` on values that are not finite, a translation that
  // is zero and shapes without size, and `stale_id` where a body that they name is gone (docs/queries.md).

  /// What the ray meets first: of equally near bodies the one with the least index. None where it meets nothing.
  std::optional<CastHit> cast_ray(Vec3 origin, Vec3 translation, const QueryFilter& filter = {}) const;
  /// All that it meets, once each where it enters them, the nearest first.
  std::vector<CastHit> cast_ray_all(Vec3 origin, Vec3 translation, const QueryFilter& filter = {}) const;
  /// Overwrites hits[i] with what `cast_ray` answers of rays[i]. Throws where there are not as many of each.
  void cast_rays(std::span<const Ray> rays, std::span<std::optional<CastHit>> hits,
                 const QueryFilter& filter = {}) const;
  /// What the shape, moved from `pose` along `translation` (m) without turning, touches first. It stops short of it by
  /// at most a millionth of the thinner one's thickness.
  std::optional<CastHit> cast_shape(const Shape& shape, const Pose& pose, Vec3 translation,
                                    const QueryFilter& filter = {}) const;
  /// All that it touches on the way, as if the others were not there, the nearest first.
  std::vector<CastHit> cast_shape_all(const Shape& shape, const Pose& pose, Vec3 translation,
                                      const QueryFilter& filter = {}) const;
  /// Bodies whose tight bounds overlap the box, ascending.
  std::vector<BodyId> overlap_aabb(const Aabb& box, const QueryFilter& filter = {}) const;
  /// Bodies that the placed shape touches or overlaps, ascending.
  std::vector<BodyId> overlap_shape(const Shape& shape, const Pose& pose, const QueryFilter& filter = {}) const;
  /// Of the placed shape (a) and a body (b), or of two bodies.
  ClosestPoints closest_points(const Shape& shape, const Pose& pose, BodyId body) const;
  ClosestPoints closest_points(BodyId a, BodyId b) const;

  // Snapshots -----------------------------------------------------------------------------------------------
  /// Overwrites `out` with everything that later steps depend on, as bytes with a format version and a checksum, for
  /// little-endian machines. Waits for the steps under way.
  void save(std::vector<std::byte>& out) const;
  /// Makes this world the saved one: simulator, definition, bodies with their ids, contacts, pending forces, step
  /// count. It then takes the same steps as the saved one, bit for bit. `threads`, `device`, `ahead` and `log` stay
  /// this world's own. Throws `file` for bytes that are truncated, altered or of another version, `unavailable` where
  /// the saved world's device simulator finds no device; the world is then as it was.
  void restore(std::span<const std::byte> bytes);

  /// XXH3 of all living bodies' poses and velocities in ascending order of index. Equal for any number of threads.
  std::uint64_t state_hash() const;

 private:
  std::unique_ptr<class Simulator> simulator_;
};

}  // namespace fathom
