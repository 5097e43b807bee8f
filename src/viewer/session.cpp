#include "viewer/session.hpp"

#include <algorithm>

namespace fathom::viewer {
namespace {

constexpr std::size_t history_length = 240;
constexpr std::size_t max_past = 8;
constexpr std::ptrdiff_t max_worlds = 2;  // kept as whole worlds
constexpr float spring_hertz = 4.0f;
constexpr float spin_damping = 5.0f;      // 1/s
constexpr float strongest_pull = 500.0f;  // m/s², times the body's mass
constexpr float reach = 1000.0f;          // m

}  // namespace

Session::Session(SceneMaker make, Choice choice) : make_(std::move(make)) { choose(choice); }

void Session::choose(const Choice& choice) {
  auto scene = std::make_unique<Scene>(make_(choice));
  auto world = std::make_unique<World>(scene->world);
  auto instance = std::make_unique<SceneInstance>(*scene, *world);
  if (world_) {
    release();
    keep({choice_, std::move(scene_), std::move(world_), std::move(instance_), {}, {}});
  }
  history_.clear();
  choice_ = choice;
  instance_ = std::move(instance);
  world_ = std::move(world);
  scene_ = std::move(scene);
  ++generation_;
}

void Session::keep(Past past) {
  past_.push_back(std::move(past));
  const auto is_world = [](const Past& p) { return p.world != nullptr; };
  while (past_.size() > max_past || std::ranges::count_if(past_, is_world) > max_worlds) past_.pop_front();
}

void Session::remember() {
  Past past{choice_, {}, {}, std::make_unique<SceneInstance>(*instance_), {}, {}};
  if (grip_) past.holder = grip_->holder;
  world_->save(past.snapshot);
  keep(std::move(past));
}

bool Session::undo() {
  if (past_.empty()) return false;
  release();
  Past past = std::move(past_.back());
  past_.pop_back();
  if (past.world) {
    world_ = std::move(past.world);
    scene_ = std::move(past.scene);
    choice_ = past.choice;
    ++generation_;
  } else {
    world_->restore(past.snapshot);
    if (past.holder && world_->contains(*past.holder)) world_->remove(*past.holder);
  }
  instance_ = std::move(past.instance);
  history_.clear();
  return true;
}

void Session::step() {
  instance_->prepare_step();
  pull();
  world_->step();
  history_.push_back(world_->profile().times);
  if (history_.size() > history_length) history_.pop_front();
}

bool Session::grab(Vec3 origin, Vec3 direction) {
  release();
  const auto hit = world_->cast_ray(origin, reach * direction);
  if (!hit || world_->motion(hit->body) != MotionType::dynamic) return false;
  remember();
  grip_ = {hit->body, inverse_transform(world_->pose(hit->body), hit->point), hit->point, {}, {}};
  if (world_->definition().partition == Partition::colours) join(hit->point);
  return true;
}

void Session::join(Vec3 point) {
  BodyDef holder;
  holder.motion = MotionType::fixed;
  holder.shape = sphere(0.01f);
  holder.filter = {0, 0};
  holder.pose.position = point;
  grip_->holder = world_->add(holder);
  grip_->joint = world_->add_joint(target_joint(grip_->holder, holder.pose, grip_->body, grip_->anchor, point,
                                                spring_hertz, 1, strongest_pull * world_->mass(grip_->body)));
}

void Session::release() {
  if (grip_ && world_->contains(grip_->holder)) world_->remove(grip_->holder);  // its joint goes with it
  grip_.reset();
}

void Session::drag(Vec3 origin, Vec3 direction, Vec3 view_direction) {
  if (!grip_) return;
  const float depth = dot(grip_->hand - origin, view_direction), along = dot(direction, view_direction);
  if (along > 1e-3f) grip_->hand = origin + (depth / along) * direction;
}

void Session::pull() {
  if (!grip_) return;
  if (!world_->contains(grip_->body)) return release();
  if (world_->contains(grip_->joint))
    world_->set_joint_target(grip_->joint, grip_->hand);
  else
    pull_by_force();
  // A held body does not spin.
  const float inertia = max_component(world_->mass_properties(grip_->body).principal_moments);
  world_->apply_torque(grip_->body, (-spin_damping * inertia) * world_->velocity(grip_->body).angular);
}

void Session::pull_by_force() {
  const Pose& pose = world_->pose(grip_->body);
  const Velocity& velocity = world_->velocity(grip_->body);
  const Vec3 point = transform(pose, grip_->anchor);
  const Vec3 speed = velocity.linear + cross(velocity.angular, point - pose.position);
  const float omega = 2 * pi * spring_hertz;
  Vec3 acceleration = (omega * omega) * (grip_->hand - point) - (2 * omega) * speed;
  const float size = length(acceleration);
  if (size > strongest_pull) acceleration = (strongest_pull / size) * acceleration;
  world_->apply_force_at(grip_->body, world_->mass(grip_->body) * acceleration, point);
}

BodyId Session::shoot(Vec3 from, Vec3 direction) {
  remember();
  BodyDef box;
  box.shape = fathom::box({0.25f, 0.25f, 0.25f});
  box.mass = 10.0f;
  box.pose.position = from + direction;
  box.velocity.linear = 25.0f * direction;
  return world_->add(box);
}

}  // namespace fathom::viewer
