#include "scene/scene.hpp"

#include <algorithm>

namespace fathom {
namespace {

std::string describe_body(const Scene& scene, std::size_t body) {
  const auto named = std::find_if(scene.names.begin(), scene.names.end(),
                                  [body](const NamedBody& candidate) { return candidate.body == body; });
  const std::string number = "body " + std::to_string(body);
  return named == scene.names.end() ? number : number + " ('" + named->name + "')";
}

Vec3 random_vector(Random& random, double limit) {
  // One draw a line: the order in which a call's arguments are evaluated is not defined.
  const auto x = static_cast<float>(random.symmetric(limit));
  const auto y = static_cast<float>(random.symmetric(limit));
  const auto z = static_cast<float>(random.symmetric(limit));
  return {x, y, z};
}

}  // namespace

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

SceneInstance::SceneInstance(const Scene& scene, World& world)
    : world_(world), kicker_(scene), stream_(scene.stream), streamed_(streamed_bodies(scene)) {
  world_.reserve(static_cast<std::uint32_t>(scene.bodies.size()));
  try {
    ids_ = world_.add_bodies(scene.bodies);
    return;
  } catch (const Error&) {
    // Added none. One by one tells which body it was, whose name the world does not know.
  }
  for (const BodyDef& body : scene.bodies) {
    try {
      ids_.push_back(world_.add(body));
    } catch (const Error& error) {
      throw Error(error.code(), scene.name + ": " + describe_body(scene, ids_.size()) + ": " + error.what());
    }
  }
}

void SceneInstance::prepare_step() {
  for (const Kicker::Kick& kick : kicker_.due(world_.step_count()))
    world_.add_velocity(ids_[kick.body], kick.linear, kick.angular);
  if (!stream_) return;
  if (const auto body = stream_->due(world_.step_count())) {
    world_.remove(ids_[*body]);
    ids_[*body] = world_.add(streamed_[*body - stream_->first]);
  }
}

}  // namespace fathom
