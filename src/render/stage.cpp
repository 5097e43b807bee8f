#include "render/stage.hpp"

#include <cmath>

#include "render/joint_marks.hpp"
#include "render/sensor_marks.hpp"

namespace fathom::render {
namespace {

constexpr float settling_time = 0.6f;  // s, for the camera

Aabb between(const Aabb& a, const Aabb& b, float share) {
  return {a.lower + share * (b.lower - a.lower), a.upper + share * (b.upper - a.upper)};
}

}  // namespace

Stage::Stage(const StageSettings& settings)
    : settings_(settings),
      renderer_(settings.renderer),
      target_(settings.width, settings.height, settings.samples, settings.enlargement) {}

Aabb Stage::framed(const World& world, bool smooth) {
  const Aabb now = picture_.moving();
  if (!box_) return now;
  const Aabb wanted = merged(*box_, now);
  const auto dt = static_cast<float>(world.time() - last_time_);
  return smooth ? between(*box_, wanted, 1 - std::exp(-dt / settling_time)) : wanted;
}

const Image& Stage::draw(const World& world, bool smooth) {
  picture_.update(world, renderer_, settings_.colouring, !smooth);
  box_ = framed(world, smooth);
  last_time_ = world.time();
  Aabb shown = *box_;
  const auto ground = picture_.ground_height();
  if (ground && *ground < shown.upper.z) shown.lower.z = *ground;
  const float size = length(shown.upper - shown.lower);
  const float aspect = static_cast<float>(settings_.width) / static_cast<float>(settings_.height);
  const auto time = static_cast<float>(world.time());

  Frame frame;
  frame.camera = camera_on(shown, settings_.azimuth + settings_.turn * time, settings_.elevation, aspect);
  frame.camera.eye = frame.camera.target + (1 / settings_.zoom) * (frame.camera.eye - frame.camera.target);
  frame.look = settings_.look == LookKind::water ? under_water(size, shown.upper.z + 0.5f * size) : daylight(size);
  frame.shadows = shadow_region(grown(picture_.moving(), 1.0f), frame.camera);
  frame.time = time;
  marks_.clear();
  if (settings_.contacts) add_contact_marks(world, marks_);
  if (settings_.joints) {
    add_joint_marks(world, marks_);
    add_reaction_marks(world, marks_);
  }
  frame.marks_on_top = marks_;
  sensor_marks_.clear();
  add_sensor_marks(world, sensor_marks_);
  frame.marks = sensor_marks_;
  renderer_.draw(frame, target_.framebuffer(), target_.width(), target_.height());
  target_.read(image_);
  return image_;
}

void add_contact_marks(const World& world, std::vector<Mark>& marks) {
  world.for_each_contact([&](const ContactInfo& contact) {
    float strongest = 0;
    for (int i = 0; i < contact.point_count; ++i) strongest = max(strongest, contact.points[i].impulse);
    for (int i = 0; i < contact.point_count; ++i) {
      const ContactPointInfo& point = contact.points[i];
      const Colour colour = point.impulse > 0 ? turbo(0.25f + 0.7f * point.impulse / strongest) : Colour{210, 210, 210};
      marks.push_back({point.position, 5, point.position, colour});
      marks.push_back({point.position, 1.5f, point.position + 0.25f * contact.normal, {255, 255, 255, 200}});
    }
  });
}

}  // namespace fathom::render
