#include "viewer/overlays.hpp"

#include <array>
#include <string_view>
#include <utility>

#include "render/joint_marks.hpp"
#include "render/sensor_marks.hpp"
#include "render/world_picture.hpp"
#include "scene/suggest.hpp"

namespace fathom::viewer {
namespace {

using render::Colour;
using render::Mark;

constexpr std::pair<std::string_view, bool OverlayChoice::*> names[] = {
    {"boxes", &OverlayChoice::boxes},         {"points", &OverlayChoice::points},
    {"normals", &OverlayChoice::normals},     {"impulses", &OverlayChoice::impulses},
    {"graph", &OverlayChoice::graph},         {"joints", &OverlayChoice::joints},
    {"reactions", &OverlayChoice::reactions}, {"through", &OverlayChoice::see_through}};
constexpr float normal_length = 0.3f;  // m
constexpr Colour box_colour{250, 220, 90, 200}, normal_colour{255, 255, 255, 220}, impulse_colour{255, 70, 60, 255};
constexpr Colour uncoloured{120, 120, 120, 255};

void add_box(const Aabb& box, std::vector<Mark>& marks) {
  const auto corner = [&box](int i) {
    return Vec3{i & 1 ? box.upper.x : box.lower.x, i & 2 ? box.upper.y : box.lower.y,
                i & 4 ? box.upper.z : box.lower.z};
  };
  for (int a = 0; a < 8; ++a)
    for (int bit = 1; bit < 8; bit *= 2)
      if (!(a & bit)) marks.push_back({corner(a), 1.5f, corner(a | bit), box_colour});
}

/// Metres per N·s: an impulse that carries the body's weight is half a metre long.
float impulse_scale(const World& world, const ContactInfo& contact) {
  const float mass = max(world.mass(contact.a), world.mass(contact.b));
  const float weight = max(length(world.gravity()), 1.0f) * max(mass, 1e-6f);
  return 0.5f / (weight * world.definition().dt);
}

Vec3 drawn_position(const World& world, BodyId id, const ContactInfo& contact) {
  return render::is_ground(world, id) ? contact.points[0].position : world.poses()[id.index].position;
}

}  // namespace

OverlayChoice parse_overlays(const std::string& list) {
  OverlayChoice choice;
  std::string_view rest = list;
  while (!rest.empty()) {
    const std::size_t comma = rest.find(',');
    const std::string_view word = rest.substr(0, comma);
    rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 1);
    bool found = false;
    std::vector<std::string_view> known;
    for (const auto& [name, member] : names) {
      known.push_back(name);
      if (word == name) choice.*member = found = true;
    }
    if (!found) {
      throw Error(ErrorCode::invalid_argument,
                  "there is no overlay '" + std::string(word) + "'" + suggestion(word, known));
    }
  }
  return choice;
}

void add_overlays(const World& world, const OverlayChoice& choice, OverlayMarks& marks) {
  render::add_sensor_marks(world, marks.hidden);
  std::vector<Mark>& shown = choice.see_through ? marks.on_top : marks.hidden;
  if (choice.boxes) {
    for (const BodyId id : world.bodies())
      if (!render::is_ground(world, id)) add_box(world.bounds(id), shown);
  }
  if (choice.joints) render::add_joint_marks(world, shown);
  if (choice.reactions) render::add_reaction_marks(world, shown);
  if (!choice.points && !choice.normals && !choice.impulses && !choice.graph) return;
  world.for_each_contact([&](const ContactInfo& contact) {
    if (contact.point_count == 0) return;
    const Colour colour = contact.colour < 0 ? uncoloured : render::palette(static_cast<std::uint64_t>(contact.colour));
    if (choice.graph)
      shown.push_back(
          {drawn_position(world, contact.a, contact), 3, drawn_position(world, contact.b, contact), colour});
    const float scale = choice.impulses ? impulse_scale(world, contact) : 0;
    for (int i = 0; i < contact.point_count; ++i) {
      const ContactPointInfo& point = contact.points[i];
      if (choice.normals)
        shown.push_back({point.position, 1.5f, point.position + normal_length * contact.normal, normal_colour});
      if (choice.impulses)
        shown.push_back({point.position, 3, point.position + scale * point.impulse * contact.normal, impulse_colour});
      if (choice.points) shown.push_back({point.position, 6, point.position, colour});
    }
  });
}

void add_grip(const World& world, const Session::Grip& grip, OverlayMarks& marks) {
  if (!world.contains(grip.body)) return;
  const Vec3 point = transform(world.pose(grip.body), grip.anchor);
  const Colour colour{255, 190, 60, 255};
  marks.on_top.push_back({point, 3, grip.hand, colour});
  marks.on_top.push_back({point, 9, point, colour});
  marks.on_top.push_back({grip.hand, 12, grip.hand, colour});
}

}  // namespace fathom::viewer
