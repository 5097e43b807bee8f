#include "scene/scene.hpp"

#include <algorithm>

#include "scene/scene_parts.hpp"

namespace fathom {
namespace {

std::string describe_body(const Scene& scene, std::size_t body) {
  const auto named = std::find_if(scene.names.begin(), scene.names.end(),
                                  [body](const NamedBody& candidate) { return candidate.body == body; });
  const std::string number = "body " + std::to_string(body);
  return named == scene.names.end() ? number : number + " ('" + named->name + "')";
}

Vec3 random_vector(Random& random, double limit) {
  // One draw per line: the evaluation order of arguments is unspecified.
  const auto x = static_cast<float>(random.symmetric(limit));
  const auto y = static_cast<float>(random.symmetric(limit));
  const auto z = static_cast<float>(random.symmetric(limit));
  return {x, y, z};
}

}  // namespace

void SceneJoint::anchor_at(Vec3 point, std::span<const BodyDef> bodies) {
  const auto in_body = [point](const Pose& pose) {
    return inverse_rotate(normalize(pose.rotation), point - pose.position);
  };
  def.frame_a.position = in_body(bodies[a].pose);
  def.frame_b.position = in_body(bodies[b].pose);
}

void SceneJoint::turn_to(Quat rotation, std::span<const BodyDef> bodies) {
  const auto in_body = [rotation](const Pose& pose) { return conjugate(normalize(pose.rotation)) * rotation; };
  def.frame_a.rotation = in_body(bodies[a].pose);
  def.frame_b.rotation = in_body(bodies[b].pose);
}

std::size_t dynamic_body_count(const Scene& scene) {
  return static_cast<std::size_t>(std::count_if(scene.bodies.begin(), scene.bodies.end(), [](const BodyDef& body) {
    return body.motion == MotionType::dynamic;
  }));
}

std::optional<std::size_t> Stream::due(std::uint64_t steps) const {
  const auto every = static_cast<std::uint64_t>(interval);
  if (sources.empty() || steps == 0 || steps % every != 0) return {};
  return first + static_cast<std::size_t>(steps / every - 1) % sources.size();
}

std::vector<BodyDef> streamed_bodies(const Scene& scene) {
  std::vector<BodyDef> bodies;
  if (!scene.stream) return bodies;
  for (std::size_t i = 0; i < scene.stream->sources.size(); ++i) {
    bodies.push_back(scene.bodies[scene.stream->first + i]);
    bodies.back().pose = scene.stream->sources[i];
  }
  return bodies;
}

Kicker::Kicker(const Scene& scene) : kicks_(scene.kicks), random_(scene.kicks ? scene.kicks->seed : 0) {
  for (std::size_t i = 0; i < scene.bodies.size(); ++i)
    if (scene.bodies[i].motion == MotionType::dynamic) dynamic_bodies_.push_back(i);
}

std::span<const Kicker::Kick> Kicker::due(std::uint64_t steps) {
  due_.clear();
  if (!kicks_ || steps % static_cast<std::uint64_t>(kicks_->interval) != 0) return due_;
  for (const std::size_t body : dynamic_bodies_) {
    const Vec3 linear = random_vector(random_, static_cast<double>(kicks_->linear));
    const Vec3 angular = random_vector(random_, static_cast<double>(kicks_->angular));
    due_.push_back({body, linear, angular});
  }
  return due_;
}

Pose Orbit::at(const Pose& start, double time) const {
  const double turns = speed * time;
  const Direction whole(turns), half(0.5 * turns);
  const Vec3 from = start.position - centre;
  // Rodrigues' formula.
  const Vec3 along = dot(axis, from) * axis, out = from - along, aside = cross(axis, from);
  Pose pose = start;
  pose.position =
      mul_add(mul_add(centre + along, static_cast<float>(whole.x), out), static_cast<float>(whole.y), aside);
  if (!is_rigid) return pose;
  const Vec3 imaginary = static_cast<float>(half.y) * axis;
  pose.rotation = Quat{static_cast<float>(half.x), imaginary.x, imaginary.y, imaginary.z} * start.rotation;
  return pose;
}

Orbiter::Orbiter(const Scene& scene) : orbit_(*scene.orbit), dt_(static_cast<double>(scene.world.dt)) {
  for (std::size_t i = 0; i < orbit_.count; ++i) starts_.push_back(scene.bodies[orbit_.first + i].pose);
}

std::span<const Orbiter::Target> Orbiter::due(std::uint64_t steps) {
  due_.clear();
  const double now = static_cast<double>(steps) * dt_;
  const auto per_second = static_cast<float>(1 / dt_);
  const auto turning = orbit_.is_rigid ? static_cast<float>(6.283185307179586477 * orbit_.speed) * orbit_.axis : Vec3{};
  for (std::size_t i = 0; i < starts_.size(); ++i) {
    const Pose from = orbit_.at(starts_[i], now), to = orbit_.at(starts_[i], now + dt_);
    due_.push_back({orbit_.first + i, to, {per_second * (to.position - from.position), 0, turning, 0}});
  }
  return due_;
}

SceneInstance::SceneInstance(const Scene& scene, World& world)
    : world_(world), kicker_(scene), stream_(scene.stream), streamed_(streamed_bodies(scene)) {
  if (scene.orbit) orbiter_.emplace(scene);
  add_bodies(scene);
  add_joints(scene);
  for (const auto& [a, b] : scene.excluded) world_.exclude(ids_[a], ids_[b]);
  world_.optimize_broad_phase();
}

void SceneInstance::add_bodies(const Scene& scene) {
  world_.reserve(static_cast<std::uint32_t>(scene.bodies.size()));
  try {
    ids_ = world_.add_bodies(scene.bodies);
    return;
  } catch (const Error&) {
    // None were added. Adding them one by one tells which body failed; the world does not know its name.
  }
  for (const BodyDef& body : scene.bodies) {
    try {
      ids_.push_back(world_.add(body));
    } catch (const Error& error) {
      throw Error(error.code(), scene.name + ": " + describe_body(scene, ids_.size()) + ": " + error.what());
    }
  }
}

void SceneInstance::add_joints(const Scene& scene) {
  for (std::size_t i = 0; i < scene.joints.size(); ++i) {
    const SceneJoint& joint = scene.joints[i];
    JointDef def = joint.def;
    def.a = ids_[joint.a], def.b = ids_[joint.b];
    try {
      world_.add_joint(def);
    } catch (const Error& error) {
      throw Error(error.code(), scene.name + ": joint " + std::to_string(i) + " between " +
                                    describe_body(scene, joint.a) + " and " + describe_body(scene, joint.b) + ": " +
                                    error.what());
    }
  }
}

void SceneInstance::prepare_step() {
  for (const Kicker::Kick& kick : kicker_.due(world_.step_count()))
    world_.add_velocity(ids_[kick.body], kick.linear, kick.angular);
  if (orbiter_)
    for (const Orbiter::Target& target : orbiter_->due(world_.step_count()))
      world_.move_to(ids_[target.body], target.pose);
  if (!stream_) return;
  if (const auto body = stream_->due(world_.step_count())) {
    world_.remove(ids_[*body]);
    ids_[*body] = world_.add(streamed_[*body - stream_->first]);
  }
}

}  // namespace fathom
