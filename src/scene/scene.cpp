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

SceneInstance::SceneInstance(const Scene& scene, World& world)
    : scene_(scene), world_(world), random_(scene.kicks ? scene.kicks->seed : 0) {
  world_.reserve(static_cast<std::uint32_t>(scene.bodies.size()));
  ids_.reserve(scene.bodies.size());
  for (const BodyDef& body : scene.bodies) {
    try {
      ids_.push_back(world_.add(body));
    } catch (const Error& error) {
      throw Error(error.code(), scene.name + ": " + describe_body(scene, ids_.size()) + ": " + error.what());
    }
  }
}

void SceneInstance::prepare_step() {
  if (!scene_.kicks) return;
  if (world_.step_count() % static_cast<std::uint64_t>(scene_.kicks->interval) == 0) kick();
}

void SceneInstance::kick() {
  for (std::size_t i = 0; i < ids_.size(); ++i) {
    if (scene_.bodies[i].motion != MotionType::dynamic) continue;
    const Vec3 linear = random_vector(random_, static_cast<double>(scene_.kicks->linear));
    const Vec3 angular = random_vector(random_, static_cast<double>(scene_.kicks->angular));
    world_.add_velocity(ids_[i], linear, angular);
  }
}

}  // namespace fathom
