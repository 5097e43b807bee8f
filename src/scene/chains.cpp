// An environment of mechanisms: swinging chains with loads heavier than their links.
#include <algorithm>
#include <cmath>

#include "scene/environments.hpp"
#include "scene/scene_parts.hpp"

namespace fathom {
namespace {

constexpr std::int64_t links = 20;
constexpr double link_length = 0.25;                       // m, from joint to joint
constexpr float link_mass = 1, load_mass = 20;             // kg
constexpr float load_radius = 0.2f;                        // m
constexpr double chain_reach = links * link_length + 0.4;  // m, from its post to the end of a chain
constexpr double row_spacing = 1;                          // m, between chains of a row

BodyDef link() {
  BodyDef body;
  body.shape = capsule(0.04f, static_cast<float>(0.5 * link_length) - 0.04f);
  body.mass = link_mass;
  body.pose.rotation = {0.70710678f, 0, 0.70710678f, 0};  // its axis, z, along x
  return body;
}

/// A horizontal chain from its post towards +x, with as many links before its load as `bodies` allow.
void add_chain(Scene& scene, Vec3 from, std::int64_t bodies) {
  const auto half = static_cast<float>(0.5 * link_length);
  const auto hang = [&](BodyDef body, float x, Vec3 on_before, Vec3 on_it) {
    body.pose.position = {from.x + x, from.y, from.z};
    scene.bodies.push_back(body);
    const std::size_t index = scene.bodies.size() - 1;
    scene.joints.push_back({index - 1, index, ball_joint({}, {}, on_before, on_it)});
  };
  BodyDef post;
  post.motion = MotionType::fixed;
  post.shape = sphere(0.05f);
  post.pose.position = from;
  scene.bodies.push_back(post);
  const std::int64_t count = std::min(links, bodies - 1);
  for (std::int64_t i = 0; i < count; ++i)
    hang(link(), static_cast<float>((static_cast<double>(i) + 0.5) * link_length), {0, 0, i > 0 ? half : 0.0f},
         {0, 0, -half});
  BodyDef load;
  load.shape = sphere(load_radius);
  load.mass = load_mass;
  hang(load, static_cast<float>(static_cast<double>(count) * link_length) + load_radius,
       {0, 0, count > 0 ? half : 0.0f}, {-load_radius, 0, 0});
}

}  // namespace

Scene chains(std::int64_t bodies) {
  constexpr std::int64_t each = links + 1;
  check_size("chains", "bodies", bodies, max_environment_bodies / 2);
  const std::int64_t count = (bodies + each - 1) / each;
  const auto rows = std::max<std::int64_t>(1, static_cast<std::int64_t>(std::sqrt(static_cast<double>(count) / 10)));
  const std::int64_t in_row = (count + rows - 1) / rows;
  Scene scene = empty_scene("chains", bodies + count);
  for (std::int64_t i = 0; i < count; ++i) {
    const double x = 2.2 * chain_reach * (static_cast<double>(i / in_row) - 0.5 * static_cast<double>(rows - 1));
    const double y = row_spacing * (static_cast<double>(i % in_row) - 0.5 * static_cast<double>(in_row - 1));
    add_chain(scene, {static_cast<float>(x), static_cast<float>(y), static_cast<float>(chain_reach + 1)},
              std::min(each, bodies - i * each));
  }
  return scene;
}

}  // namespace fathom
