#include "validate/heap_checks.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "scene/heap_bodies.hpp"
#include "scene/quality.hpp"
#include "validate/bodies.hpp"
#include "validate/exact_overlap.hpp"
#include "validate/exact_surface.hpp"

namespace fathom::validate {
namespace {

// In units of the heap's time scale: seconds for bodies of up to a metre.
constexpr double settled_after = 15, asleep_after = 30, judged_without_rest = 10, compared_for = 2;
// More steps than simulators wait before they search for structures again after all were collapsing.
constexpr int steps_restored = 20;
// Bodies that keep more than half their speed in a bounce may keep bouncing for minutes.
constexpr double max_restitution_at_rest = 0.5;

WorldDef definition(const Heap& heap, const Setup& setup, int threads) {
  WorldDef def = heap.scene.world;
  def.simulator = setup.simulator;
  def.device = setup.device;
  def.threads = threads;
  return def;
}

/// Whether bodies move as their velocities say. Compares each displacement with the sum of the body's velocities over
/// half a time unit.
class WaysAndVelocities {
 public:
  WaysAndVelocities(const Heap& heap, const World& world, std::span<const BodyId> ids) : bodies_(ids.size()) {
    steps_ = std::lround(0.5 * heap.time_unit / wide(heap.scene.world.dt));
    for (std::size_t i = 0; i < ids.size(); ++i) {
      bodies_[i].start = to_double(world.pose(ids[i]).position);
      bodies_[i].size = outer_radius(world.shape(ids[i]));
    }
  }

  void add_step(const World& world, std::span<const BodyId> ids, double dt) {
    const bool ends = ++count_ % steps_ == 0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      Body& body = bodies_[i];
      body.told = body.told + dt * to_double(world.velocity(ids[i]).linear);
      if (!ends) continue;
      const Vec3d now = to_double(world.pose(ids[i]).position);
      const double told = length(body.told);
      const bool stays = told > 3 * body.size && length(now - body.start) < 0.1 * told;
      body.stays_for = stays ? body.stays_for + 1 : 0;
      stuck_ = std::max(stuck_, body.stays_for);
      body.start = now;
      body.told = {};
    }
  }

  /// Longest run of intervals in which a body moved less than a tenth of what its velocities said, where these said
  /// more than three times its radius. Thin plates under a load tremble by less.
  int stuck() const { return stuck_; }

 private:
  struct Body {
    Vec3d start, told;
    double size = 0;
    int stays_for = 0;
  };
  std::vector<Body> bodies_;
  long steps_ = 1, count_ = 0;
  int stuck_ = 0;
};

/// A heap in a world, and what is measured while it falls.
class HeapRun {
 public:
  HeapRun(const Heap& heap, const Setup& setup, int threads)
      : heap_(heap),
        world_(definition(heap, setup, threads)),
        instance_(heap.scene, world_),
        ways_(heap, world_, instance_.ids()) {
    for (const BodyId id : instance_.ids()) {
      const bool is_dynamic = world_.motion(id) == MotionType::dynamic;
      mass_.push_back(is_dynamic ? world_.mass_properties(id) : MassProperties{});
      outer_.push_back(outer_radius(world_.shape(id)));
    }
    if (heap.surface) ground_.emplace(*surface().shape.surface);
    over_rim_.resize(instance_.ids().size());
    outside_.resize(instance_.ids().size());
    total_mass_ = 0;
    for (const MassProperties& body : mass_) total_mass_ += wide(body.mass);
  }

  void step() {
    instance_.prepare_step();
    world_.step();
    for (const Quarantine& event : world_.quarantined()) lost_.push_back(event.body.index);
    if (heap_.is_at_rest_in_the_end()) ways_.add_step(world_, instance_.ids(), wide(heap_.scene.world.dt));
  }

  double kinetic_energy() const {
    double sum = 0;
    for (std::size_t i = 0; i < mass_.size(); ++i) {
      if (!is_dynamic(i)) continue;
      const Velocity& v = world_.velocity(id(i));
      const Vec3 spin = inverse_rotate(world_.pose(id(i)).rotation, v.angular);
      const Vec3d linear = to_double(v.linear);
      sum += 0.5 * (wide(mass_[i].mass) * dot(linear, linear) + wide(dot(spin, mass_[i].inertia * spin)));
    }
    return sum;
  }

  /// Above the floor's lowest point (J).
  double potential_energy() const {
    double sum = 0;
    for (std::size_t i = 0; i < mass_.size(); ++i)
      sum += wide(mass_[i].mass) * g * (wide(world_.pose(id(i)).position.z) - wide(heap_.lowest));
    return sum;
  }

  /// Notes the bodies that are beyond a wall, the floor or the surface on it by more than `share` of their outer
  /// radius. Bodies that ever rose over the rim may be anywhere.
  void look_for_bodies_outside(double share) {
    for (std::size_t i = 0; i < mass_.size(); ++i) {
      if (!is_dynamic(i)) continue;
      const Vec3d p = to_double(world_.pose(id(i)).position);
      const double within = share * outer_[i];
      if (p.z + outer_[i] > wide(heap_.rim)) over_rim_[i] = 1;
      const bool is_beside = std::max(std::abs(p.x), std::abs(p.y)) > wide(heap_.half_width) + within;
      if (!over_rim_[i] && (is_beside || height_over_floor(p) < -within)) outside_[i] = 1;
    }
  }

  /// The worst overlap and its limit.
  struct Overlap {
    double depth = 0, limit = 1;  // m
    std::size_t a = 0, b = 0;     // indices in the scene

    double share() const { return depth / limit; }
  };
  Overlap deepest_overlap() const {
    std::vector<std::optional<Solid>> solids;  // none for surfaces
    for (const BodyId body : instance_.ids()) {
      const Shape& shape = world_.shape(body);
      solids.push_back(shape.is_surface() ? std::nullopt
                                          : std::optional<Solid>(std::in_place, shape, world_.pose(body)));
    }
    Overlap worst;
    for (std::size_t i = 0; i < solids.size(); ++i)
      for (std::size_t k = i + 1; k < solids.size(); ++k) {
        if (!is_dynamic(k) || !solids[i] || is_joined(i, k)) continue;
        const double depth = overlap_depth(*solids[i], *solids[k]);
        const double limit = is_dynamic(i) ? std::min(depth_limit(i), depth_limit(k)) : depth_limit(k);
        if (depth / limit > worst.depth / worst.limit) worst = {depth, limit, i, k};
      }
    return worst;
  }

  /// The same for bodies and the surface that they lie on.
  Overlap deepest_in_surface() const {
    std::vector<std::size_t> indices;
    std::vector<Solid> solids;
    for (std::size_t i = 0; i < mass_.size(); ++i)
      if (is_dynamic(i)) {
        indices.push_back(i);
        solids.emplace_back(world_.shape(id(i)), world_.pose(id(i)));
      }
    const std::vector<double> depths =
        depths_in(*surface().shape.surface, world_.pose(id(heap_.surface->body)), solids);
    Overlap worst;
    for (std::size_t k = 0; k < indices.size(); ++k) {
      const double limit = depth_limit(indices[k]);
      if (depths[k] / limit > worst.depth / worst.limit) worst = {depths[k], limit, heap_.surface->body, indices[k]};
    }
    return worst;
  }

  /// The widest gap of a joint, and its limit: `limit_of` the smaller body's outer radius.
  template <class Limit>
  Overlap widest_gap(const Limit& limit_of) const {
    std::vector<Pose> poses;
    for (const BodyId body : instance_.ids()) poses.push_back(world_.pose(body));
    Overlap worst;
    for (const SceneJoint& joint : heap_.scene.joints) {
      const double gap = wide(joint_gap(heap_.scene, joint, poses));
      const double limit = limit_of(std::min(outer_[joint.a], outer_[joint.b]));
      if (gap / limit > worst.depth / worst.limit) worst = {gap, limit, joint.a, joint.b};
    }
    return worst;
  }

  /// How far a joint's angle exceeds its limits (rad).
  double farthest_beyond_limits() const {
    double farthest = 0;
    for (const JointId id : world_.joints()) {
      const JointAxis& twist = world_.joint(id).axis(JointAxisName::twist);
      if (world_.joint(id).type != JointType::generic || twist.mode != AxisMode::limited) continue;
      const double angle = wide(world_.joint_positions(id)[static_cast<std::size_t>(JointAxisName::twist)]);
      farthest = std::max({farthest, wide(twist.lower) - angle, angle - wide(twist.upper)});
    }
    return farthest;
  }

  std::string between(const Overlap& overlap) const {
    const auto mass_of = [&](std::size_t i) { return is_dynamic(i) ? wide(mass_[i].mass) : 0.0; };
    char text[120];
    std::snprintf(text, sizeof text, "; deepest between bodies %zu (%.3g kg) and %zu (%.3g kg)", overlap.a,
                  mass_of(overlap.a), overlap.b, mass_of(overlap.b));
    return text;
  }

  int awake() const {
    int count = 0;
    for (std::size_t i = 0; i < mass_.size(); ++i) count += is_dynamic(i) && world_.is_awake(id(i));
    return count;
  }
  int lost() {
    if (!all_finite(world_)) lost_.push_back(BodyId{}.index);
    std::ranges::sort(lost_);
    lost_.erase(std::unique(lost_.begin(), lost_.end()), lost_.end());
    return static_cast<int>(lost_.size());
  }
  bool has_lost_bodies() const { return !lost_.empty(); }
  int outside() const { return static_cast<int>(std::ranges::count(outside_, 1)); }
  int stuck() const { return ways_.stuck(); }
  int over_rim() const { return static_cast<int>(std::ranges::count(over_rim_, 1)); }
  double total_mass() const { return total_mass_; }
  const World& world() const { return world_; }

 private:
  bool is_joined(std::size_t a, std::size_t b) const {
    return std::ranges::any_of(heap_.scene.joints, [&](const SceneJoint& joint) {
      return (joint.a == a && joint.b == b) || (joint.a == b && joint.b == a);
    });
  }
  bool is_dynamic(std::size_t i) const { return mass_[i].mass > 0; }
  BodyId id(std::size_t i) const { return instance_.ids()[i]; }
  const BodyDef& surface() const { return heap_.scene.bodies[heap_.surface->body]; }

  double height_over_floor(Vec3d p) const {
    if (ground_) {
      if (const auto height = ground_->height_over(world_.pose(id(heap_.surface->body)), p)) return *height;
    }
    const Pose& floor = world_.pose(id(0));
    const Vec3d up = to_double(rotate(floor.rotation, {0, 0, 1}));
    return dot(up, p - to_double(floor.position)) - wide(heap_.floor_half_height);
  }

  /// 2 mm or 2 % of the inner radius. For bodies thinner than 2 cm, 2 mm would be a large part: there it is a fifth of
  /// the inner radius, a tenth of the thickness.
  double depth_limit(std::size_t i) const {
    const Shape& shape = world_.shape(id(i));
    const double inner = shape.type == ShapeType::hull  ? wide(shape.hull->inner_radius())
                         : shape.type == ShapeType::box ? wide(min_component(shape.half_extents))
                                                        : wide(shape.radius);
    return std::max(0.02 * inner, std::min(0.002, 0.2 * inner));
  }

  const Heap& heap_;
  World world_;
  SceneInstance instance_;
  WaysAndVelocities ways_;
  std::vector<MassProperties> mass_;  // by index in the scene; massless unless dynamic
  std::vector<double> outer_;
  std::optional<Ground> ground_;
  std::vector<char> over_rim_, outside_;
  std::vector<std::uint32_t> lost_;
  double total_mass_ = 0;
};

/// A copy of a world, restored from a snapshot, that must continue exactly as the world does.
class RestoredCopy {
 public:
  RestoredCopy(const Heap& heap, const Setup& setup, const World& world) : world_(definition(heap, setup, 2)) {
    std::vector<std::byte> snapshot;
    world.save(snapshot);
    world_.restore(snapshot);
  }

  /// Call after `world` has stepped.
  void step_along(const World& world) {
    if (steps_ == steps_restored) return;
    world_.step();
    ++steps_;
    differs_ = differs_ || world_.state_hash() != world.state_hash();
  }
  bool differs() const { return differs_; }

 private:
  World world_;
  int steps_ = 0;
  bool differs_ = false;
};

int steps_in(const Heap& heap, double units) {
  return static_cast<int>(std::lround(units * heap.time_unit / wide(heap.scene.world.dt)));
}

int hashes_that_differ(const Heap& heap, const Setup& setup, std::uint64_t expected) {
  int differ = 0;
  for (const int threads : {1, 2, 4}) {
    if (threads == setup.threads) continue;
    HeapRun run(heap, setup, threads);
    for (int i = steps_in(heap, compared_for); i > 0; --i) run.step();
    differ += run.world().state_hash() != expected;
  }
  return differ;
}

constexpr const char* known_of_heaps = "some heaps: springs give way, and thin bodies are pressed in by their centre";

/// Of the smaller body's outer radius (m), just as overlaps are judged by the inner radius.
double gap_limit(double outer) { return std::max(0.02 * outer, std::min(0.002, 0.2 * outer)); }

void judge_joints_at_rest(const HeapRun& run, Record& record) {
  const HeapRun::Overlap gap = run.widest_gap(gap_limit);
  record.at_most("widest gap of a joint once settled", gap.depth, gap.limit, "m").known = known_of_heaps;
  if (gap.depth > gap.limit) record.note(run.between(gap));
  record.at_most("beyond a joint's limit once settled", run.farthest_beyond_limits(), 0.05, "rad");
}

}  // namespace

Record judge_heap(const Heap& heap, const Setup& setup) {
  Record record;
  record.note(describe(heap));
  HeapRun run(heap, setup, setup.threads);
  const bool rests = heap.is_at_rest_in_the_end() && heap.largest_restitution <= max_restitution_at_rest;
  const bool keeps_energy = heap.is_at_rest_in_the_end() && !heap.has_restitution;
  const bool sleeps = rests && heap.scene.world.sleep.enabled;
  const int to_settle = steps_in(heap, rests ? settled_after : judged_without_rest);
  const int max_steps = sleeps ? steps_in(heap, asleep_after) : to_settle;
  const int to_compare = steps_in(heap, compared_for);
  constexpr int between_looks = 16;

  const double start_energy = run.potential_energy();
  const bool has_joints = !heap.scene.joints.empty();
  double energy = start_energy, largest_rise = 0, energy_when_settled = 0, widest_gap = 0;
  std::uint64_t hash = 0;
  std::optional<RestoredCopy> copy;
  for (int i = 1; i <= max_steps && !run.has_lost_bodies(); ++i) {
    run.step();
    if (copy) copy->step_along(run.world());
    if (keeps_energy) {
      const double now = run.kinetic_energy() + run.potential_energy();
      largest_rise = std::max(largest_rise, (now - energy) / start_energy);
      energy = now;
    }
    if (i == to_compare) {
      hash = run.world().state_hash();
      if (heap.is_at_rest_in_the_end()) copy.emplace(heap, setup, run.world());
    }
    if (i == to_settle) energy_when_settled = run.kinetic_energy();
    if (i % between_looks == 0) run.look_for_bodies_outside(1);
    if (has_joints && i % between_looks == 0)
      widest_gap = std::max(widest_gap, run.widest_gap([](double outer) { return outer; }).share());
    if (i >= to_settle && run.awake() == 0) break;
  }
  record.at_most("bodies quarantined or not finite", run.lost(), 0);
  if (run.lost() > 0) return record;
  // At rest, no centre may be beyond a surface. A hit may press it there for a moment.
  run.look_for_bodies_outside(rests ? 0 : 1);
  record.at_most("bodies outside the bin or under the floor", run.outside(), 0);
  const double bodies = static_cast<double>(dynamic_body_count(heap.scene));
  record.at_most("bodies thrown over the rim", run.over_rim(), std::floor(0.05 * bodies));
  // A moving floor pushes bodies that are jammed against a wall.
  if (heap.is_at_rest_in_the_end())
    record.at_most("times in a row that a body stayed where it was with a velocity", run.stuck(), 4).known =
        has_joints ? known_of_heaps : "";
  if (keeps_energy) record.at_most("energy gained in a step, of its start", largest_rise, 1e-3).known = known_of_heaps;
  if (rests) {
    record.at_most("kinetic energy at 15 s", energy_when_settled / run.total_mass(), 1e-4, "J/kg").known =
        known_of_heaps;
    const HeapRun::Overlap overlap = run.deepest_overlap();
    record.at_most("deepest overlap once settled", overlap.depth, overlap.limit, "m").known = known_of_heaps;
    if (overlap.depth > overlap.limit) record.note(run.between(overlap));
    if (heap.surface) {
      const HeapRun::Overlap in_surface = run.deepest_in_surface();
      record.at_most("deepest overlap with the surface once settled", in_surface.depth, in_surface.limit, "m").known =
          known_of_heaps;
      if (in_surface.depth > in_surface.limit) record.note(run.between(in_surface));
    }
  }
  if (has_joints)
    record.at_most("widest gap of a joint, of the smaller outer radius", widest_gap, 1).known = known_of_heaps;
  if (has_joints && rests) judge_joints_at_rest(run, record);
  if (sleeps) record.at_most("bodies awake at 30 s", run.awake(), 0).known = known_of_heaps;
  record.at_most("hashes that differ with 1, 2 and 4 threads", hashes_that_differ(heap, setup, hash), 0);
  if (copy) record.at_most("restored copies that continue differently", copy->differs(), 0);
  return record;
}

std::string view_command(const std::string& name, std::uint64_t seed, const Setup& setup) {
  std::string command = "fathom view " + name + " --seed " + std::to_string(seed);
  if (setup.simulator == SimulatorKind::device) command += " --simulator device";
  if (setup.simulator == SimulatorKind::hybrid) command += " --simulator hybrid";
  if (setup.simulator != SimulatorKind::native) command += " --device " + setup.device;
  return command;
}

}  // namespace fathom::validate
