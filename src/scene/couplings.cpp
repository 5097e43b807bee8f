#include "scene/couplings.hpp"

namespace fathom {
namespace {

Pose placed(const BodyDef& body) {
  Pose pose;
  pose.position = body.pose.position, pose.rotation = normalize(body.pose.rotation);
  return pose;
}

float read_ratio(const TomlTable& table) {
  float ratio = 1;
  table.read("ratio", ratio);
  if (ratio == 0) table.fail(*table.find("ratio"), "'ratio' must not be 0");
  return ratio;
}

JointDef read_gear(const TomlTable& table, const Pose& a, const Pose& b) {
  table.required("ratio", "how often A turns, backwards, for one turn of B");
  if (!table.has("axis_a") || !table.has("axis_b"))
    table.required("axis", "about which both wheels turn, in the world; or write 'axis_a' and 'axis_b'");
  const Vec3 axis = table.has("axis") ? read_direction(table, "axis", {}) : Vec3{1, 0, 0};
  return gear_joint({}, a, read_direction(table, "axis_a", axis), {}, b, read_direction(table, "axis_b", axis),
                    read_ratio(table));
}

JointDef read_rack(const TomlTable& table, const Pose& a, const Pose& b) {
  table.required("axis", "about which the pinion 'a' turns, in the world");
  table.required("direction", "along which the rack 'b' moves, in the world");
  const toml::node& node = table.required("radius", "how far (m) the rack moves for a radian of the pinion");
  float radius = 0;
  table.read("radius", radius);
  if (radius == 0) table.fail(node, "'radius' must not be 0; below 0 the rack moves backwards");
  return rack_joint({}, a, read_direction(table, "axis", {}), {}, b, read_direction(table, "direction", {}), radius);
}

/// The default length of the rope is its length at the start.
JointDef read_pulley(const TomlTable& table, const Pose& a, const Pose& b) {
  Vec3 anchor_a, anchor_b, wheel_a, wheel_b;
  table.required("wheel_a", "the point in the world from which the rope comes to 'a' (m)");
  table.required("wheel_b", "the point in the world from which the rope comes to 'b' (m)");
  table.read("anchor_a", anchor_a), table.read("anchor_b", anchor_b);
  table.read("wheel_a", wheel_a), table.read("wheel_b", wheel_b);
  const float ratio = read_ratio(table);
  float length = distance(transform(a, anchor_a), wheel_a) + ratio * distance(transform(b, anchor_b), wheel_b);
  float lower = 0;
  if (ratio < 0) table.fail(*table.find("ratio"), "a rope's 'ratio' must be greater than 0");
  table.read("length", length, Range::positive);
  table.read("lower", lower, Range::not_negative);
  if (lower > length) table.fail(*table.find("lower"), "'lower' is above the rope's length");
  JointDef def = pulley_joint({}, anchor_a, wheel_a, {}, anchor_b, wheel_b, length, ratio);
  def.axis(JointAxisName::x).lower = lower;
  return def;
}

}  // namespace

void read_coupling(const TomlTable& table, JointWord word, const Scene& scene, SceneJoint& joint) {
  const Pose a = placed(scene.bodies[joint.a]), b = placed(scene.bodies[joint.b]);
  JointDef def = word == JointWord::gear   ? read_gear(table, a, b)
                 : word == JointWord::rack ? read_rack(table, a, b)
                                           : read_pulley(table, a, b);
  def.hertz = joint.def.hertz, def.damping_ratio = joint.def.damping_ratio;
  joint.def = def;
}

}  // namespace fathom
