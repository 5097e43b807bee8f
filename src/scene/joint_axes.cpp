#include "scene/joint_axes.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "world/validate.hpp"

namespace fathom {
namespace {

constexpr std::array<std::pair<std::string_view, JointWord>, 12> words{{{"ball", JointWord::ball},
                                                                        {"fixed", JointWord::fixed},
                                                                        {"revolute", JointWord::revolute},
                                                                        {"prismatic", JointWord::prismatic},
                                                                        {"universal", JointWord::universal},
                                                                        {"wheel", JointWord::wheel},
                                                                        {"distance", JointWord::distance},
                                                                        {"generic", JointWord::generic},
                                                                        {"gear", JointWord::gear},
                                                                        {"rack", JointWord::rack},
                                                                        {"pulley", JointWord::pulley},
                                                                        {"target", JointWord::target}}};
constexpr std::array<std::pair<std::string_view, AxisMode>, 3> modes{
    {{"free", AxisMode::free}, {"limited", AxisMode::limited}, {"locked", AxisMode::locked}}};
constexpr std::array<std::string_view, joint_axis_count> axis_keys{"x", "y", "z", "twist", "swing_y", "swing_z"};

/// Other engines' names of joints.
constexpr std::array<std::pair<std::string_view, std::string_view>, 6> other_names{{{"hinge", "revolute"},
                                                                                    {"slider", "prismatic"},
                                                                                    {"weld", "fixed"},
                                                                                    {"spherical", "ball"},
                                                                                    {"hooke", "universal"},
                                                                                    {"d6", "generic"}}};

/// Which joint types have a key; all types have the keys that are not listed.
struct KeyUse {
  std::string_view key;
  unsigned types = 0;  ///< a bit for each JointWord
};
constexpr unsigned bit(JointWord word) { return 1u << static_cast<unsigned>(word); }
constexpr unsigned gear = bit(JointWord::gear), rack = bit(JointWord::rack), pulley = bit(JointWord::pulley);
constexpr unsigned target = bit(JointWord::target);
constexpr unsigned not_generic = bit(JointWord::ball) | bit(JointWord::distance), generic = 0xffu & ~not_generic;
constexpr unsigned driven = bit(JointWord::revolute) | bit(JointWord::prismatic) | bit(JointWord::wheel);
constexpr KeyUse key_uses[] = {
    {"axis", generic | gear | rack},
    {"anchor_a", 0xffu | pulley},
    {"anchor_b", 0xffu | pulley},
    {"axis_a", gear},
    {"axis_b", gear},
    {"ratio", gear | pulley},
    {"direction", rack},
    {"radius", rack},
    {"wheel_a", pulley},
    {"wheel_b", pulley},
    {"repeat", 0xffu},
    {"frame_a", generic},
    {"frame_b", generic},
    {"x", generic},
    {"y", generic},
    {"z", generic},
    {"twist", generic},
    {"swing_y", generic},
    {"swing_z", generic},
    {"cone_angle", generic},
    {"motor", driven},
    {"suspension", bit(JointWord::wheel)},
    {"steering", bit(JointWord::wheel)},
    {"point", (0xffu & ~bit(JointWord::distance)) | target},
    {"target", target},
    {"max_force", bit(JointWord::ball) | target},
    {"length", bit(JointWord::distance) | pulley},
    {"lower", bit(JointWord::distance) | pulley},
    {"upper", bit(JointWord::distance)},
    {"drive", bit(JointWord::distance)},
};

std::string_view text_of(JointWord word) { return words[static_cast<std::size_t>(word)].first; }

TomlTable inner(const TomlTable& outer, const toml::node& node, std::string_view key,
                std::initializer_list<std::string_view> known) {
  return {outer.as_table(node, key), std::string(key), outer.file(), known};
}

/// The largest distance of an axis from 0, and its unit.
struct Reach {
  float most = 3e38f;
  std::string_view unit = "m";
};
Reach reach_of(std::size_t axis) {
  if (axis < static_cast<std::size_t>(JointAxisName::twist)) return {};
  return {axis == static_cast<std::size_t>(JointAxisName::twist) ? pi : 0.5f * pi, "rad"};
}

void check_bounds(const TomlTable& table, const toml::node& at, std::string_view what, const JointAxis& axis,
                  Reach reach) {
  if (axis.lower > axis.upper) table.fail(at, std::string(what) + ": the upper bound is below the lower one");
  if (axis.lower < -reach.most || axis.upper > reach.most)
    table.fail(at, std::string(what) + ": bounds of this angle must lie within " +
                       (reach.most > 2 ? "-3.1415926 and 3.1415926" : "-1.5707963 and 1.5707963") + " rad");
}

/// Reads 'lower' and 'upper' of a table, both or none; with them the axis is limited.
void read_bounds(const TomlTable& table, std::string_view what, JointAxis& axis, Reach reach) {
  if (!table.has("lower") && !table.has("upper")) return;
  for (const std::string_view key : {"lower", "upper"})
    table.required(key, "an axis ends on both sides (" + std::string(reach.unit) + ")");
  axis.mode = AxisMode::limited;
  table.read("lower", axis.lower);
  table.read("upper", axis.upper);
  check_bounds(table, *table.find("upper"), what, axis, reach);
}

void check_can_move(const TomlTable& table, const toml::node& at, std::string_view what, const JointAxis& axis) {
  if (axis.is_locked())
    table.fail(at, std::string(what) + " is locked and cannot be driven; give it mode = \"free\", or bounds apart");
}

void read_frequency(const TomlTable& table, JointDrive& drive) {
  for (const std::string_view key : {"stiffness", "damping"})
    if (const toml::node* node = table.find(key))
      table.fail(*node, "a drive has either 'hertz' or '" + std::string(key) + "'; remove one");
  drive.by_frequency = true;
  drive.damping = 1;
  table.read("hertz", drive.stiffness, Range::positive);
  table.read("damping_ratio", drive.damping, Range::not_negative);
}

JointDrive read_drive(const TomlTable& outer, const toml::node& node) {
  const TomlTable table = inner(
      outer, node, "drive", {"position", "velocity", "stiffness", "damping", "max_force", "hertz", "damping_ratio"});
  JointDrive drive;
  table.read("position", drive.position);
  table.read("velocity", drive.velocity);
  read_or_infinite(table, "max_force", drive.max_force, JointDrive{}.max_force);
  if (const toml::node* ratio = table.find("damping_ratio"); ratio && !table.has("hertz"))
    table.fail(*ratio, "'damping_ratio' goes with 'hertz'; give it too, or 'stiffness' and 'damping' in SI units");
  if (table.has("hertz")) {
    read_frequency(table, drive);
  } else {
    table.read("stiffness", drive.stiffness, Range::not_negative);
    read_or_infinite(table, "damping", drive.damping, rigid_damping);
  }
  if (!drive.is_on()) table.fail(node, "a drive needs 'stiffness', 'damping' or 'hertz' greater than 0");
  if (const toml::node* position = table.find("position"); position && drive.stiffness == 0)
    table.fail(*position, "a drive without stiffness goes to no position; give 'stiffness' or 'hertz'");
  if (const toml::node* velocity = table.find("velocity"); velocity && drive.damping == 0)
    table.fail(*velocity, "a drive without damping keeps no velocity; give 'damping'");
  return drive;
}

/// Reads an axis's restitution and armature.
void read_reactions(const TomlTable& table, JointAxis& axis) {
  table.read("restitution", axis.restitution, Range::not_negative);
  table.read("armature", axis.armature, Range::not_negative);
  if (const char* const fault = restitution_fault(axis)) table.fail(*table.find("restitution"), fault);
  if (const char* const fault = armature_fault(axis)) table.fail(*table.find("armature"), fault);
}

void read_axis(const TomlTable& joint, std::size_t index, JointAxis& axis) {
  const std::string_view key = axis_keys[index];
  const toml::node* node = joint.find(key);
  if (!node) return;
  const TomlTable table = inner(joint, *node, key, {"mode", "lower", "upper", "drive", "restitution", "armature"});
  table.read_choice<AxisMode>("mode", axis.mode, modes);
  const toml::node *mode = table.find("mode"), *drive = table.find("drive");
  const bool has_bounds = table.has("lower") || table.has("upper");
  if (mode && has_bounds && axis.mode != AxisMode::limited)
    table.fail(*mode, "an axis with bounds is limited; remove 'mode', or the bounds");
  if (mode && !has_bounds && axis.mode == AxisMode::limited)
    table.fail(*mode, "a limited axis needs 'lower' and 'upper' (" + std::string(reach_of(index).unit) + ")");
  read_bounds(table, key, axis, reach_of(index));
  read_reactions(table, axis);
  if (!drive) return;
  check_can_move(table, *drive, key, axis);
  axis.drive = read_drive(table, *drive);
}

/// A wheel's suspension: z yields, and the swing about z steers.
void read_suspension(const TomlTable& joint, JointDef& def) {
  const toml::node& node =
      joint.required("suspension", "write suspension = {axis = [0, 0, 1], hertz = 6, damping_ratio = 0.7}");
  const TomlTable table = inner(joint, node, "suspension", {"axis", "hertz", "damping_ratio", "lower", "upper"});
  table.required("hertz", "its frequency (Hz)");
  float hertz = 0, damping_ratio = 0.7f;
  table.read("hertz", hertz, Range::positive);
  table.read("damping_ratio", damping_ratio, Range::not_negative);
  JointAxis& travel = def.axis(JointAxisName::z);
  travel.mode = AxisMode::free;
  travel.spring(hertz, damping_ratio);
  read_bounds(table, "suspension", travel, {});
  const toml::node* steering = joint.find("steering");
  if (!steering) return;
  const std::vector<float> bounds = joint.numbers(*steering, "steering", 2, 2);
  JointAxis& swing = def.axis(JointAxisName::swing_z);
  check_bounds(joint, *steering, "steering", swing.limit(bounds[0], bounds[1]),
               reach_of(static_cast<std::size_t>(JointAxisName::swing_z)));
}

void read_motor(const TomlTable& joint, JointWord word, JointDef& def) {
  const toml::node* node = joint.find("motor");
  if (!node) return;
  const std::size_t index =
      static_cast<std::size_t>(word == JointWord::prismatic ? JointAxisName::x : JointAxisName::twist);
  const std::string_view key = axis_keys[index];
  if (joint.has(key) && def.axes[index].drive.is_on())
    joint.fail(*node, "'" + std::string(key) + "' has a drive already; remove it, or 'motor'");
  check_can_move(joint, *node, key, def.axes[index]);
  const TomlTable table = inner(joint, *node, "motor", {"velocity", "max_force"});
  table.required("velocity", index == 0 ? "its speed (m/s)" : "its speed (rad/s)");
  JointDrive drive{.damping = rigid_damping};
  table.read("velocity", drive.velocity);
  read_or_infinite(table, "max_force", drive.max_force, JointDrive{}.max_force);
  def.axes[index].drive = drive;
}

/// The two swings are free within a cone.
void read_cone(const TomlTable& joint, JointWord word, JointDef& def) {
  const toml::node* node = joint.find("cone_angle");
  if (!node) return;
  joint.read("cone_angle", def.cone_angle, Range::positive);
  if (!(def.cone_angle < pi)) joint.fail(*node, "'cone_angle' must be below 3.1415926 rad");
  for (const JointAxisName name : {JointAxisName::swing_y, JointAxisName::swing_z}) {
    const std::string_view key = axis_keys[static_cast<std::size_t>(name)];
    if (const toml::node* swing = joint.find(key))
      joint.fail(*swing, "a joint has either a 'cone_angle' or '" + std::string(key) + "'; remove one");
    if (def.axis(name).mode != AxisMode::free)
      joint.fail(*node, "a " + std::string(text_of(word)) +
                            " joint swings about no cone; write type = \"generic\" and lock the other axes");
  }
}

void read_distance(const TomlTable& joint, JointDef& def) {
  JointAxis& axis = def.axis(JointAxisName::x);
  const toml::node *length = joint.find("length"), *lower = joint.find("lower"), *upper = joint.find("upper");
  if (length && (lower || upper))
    joint.fail(*length, "a distance joint has either 'length' or 'lower' and 'upper'; remove one");
  if (lower && !upper) joint.fail(*lower, "'lower' needs 'upper', the longest distance (m)");
  joint.read("lower", axis.lower, Range::not_negative);
  joint.read("upper", axis.upper, Range::not_negative);
  joint.read("length", axis.upper, Range::not_negative);
  if (length) axis.lower = axis.upper;
  if (length || upper) axis.mode = AxisMode::limited;
  if (upper) check_bounds(joint, *upper, "distance", axis, {});
  const toml::node* drive = joint.find("drive");
  if (!length && !upper && !drive) joint.fail("a distance joint needs 'length', 'upper' or 'drive'");
  if (!drive) return;
  check_can_move(joint, *drive, "the distance", axis);
  axis.drive = read_drive(joint, *drive);
}

JointDef generic_of(JointWord word) {
  switch (word) {
    case JointWord::fixed:
      return fixed_joint({}, {}, {}, {});
    case JointWord::revolute:
    case JointWord::wheel:
      return revolute_joint({}, {}, {}, {});
    case JointWord::prismatic:
      return prismatic_joint({}, {}, {}, {});
    case JointWord::universal:
      return universal_joint({}, {}, {}, {});
    default:
      return generic_joint({}, {}, {}, {});
  }
}

/// The shortest rotation from the x axis to a unit vector; half a turn is about z.
Quat shortest_turn_to(Vec3 v) {
  const float off = v.y * v.y + v.z * v.z;
  if (v.x < 0 && off < 1e-20f) return {0, 0, 0, 1};
  return normalize(Quat{v.x < 0 ? off / (1 - v.x) : 1 + v.x, 0, -v.z, v.y});
}

/// The rotation that takes the x and z axes to two perpendicular unit vectors.
Quat rotation_to(Vec3 x, Vec3 z) {
  const Vec3 y = cross(z, x);
  // Four times the squares of w, x, y, z; divides by the largest.
  const std::array<float, 4> squares{1 + x.x + y.y + z.z, 1 + x.x - y.y - z.z, 1 - x.x + y.y - z.z,
                                     1 - x.x - y.y + z.z};
  switch (std::max_element(squares.begin(), squares.end()) - squares.begin()) {
    case 0:
      return normalize(Quat{squares[0], y.z - z.y, z.x - x.z, x.y - y.x});
    case 1:
      return normalize(Quat{y.z - z.y, squares[1], x.y + y.x, z.x + x.z});
    case 2:
      return normalize(Quat{z.x - x.z, x.y + y.x, squares[2], y.z + z.y});
    default:
      return normalize(Quat{x.y - y.x, z.x + x.z, y.z + z.y, squares[3]});
  }
}

}  // namespace

void read_or_infinite(const TomlTable& table, std::string_view key, float& value, float most) {
  const toml::node* node = table.find(key);
  if (node && node->value<double>() == std::numeric_limits<double>::infinity())
    value = most;
  else
    table.read(key, value, Range::not_negative);
}

Vec3 read_direction(const TomlTable& table, std::string_view key, Vec3 otherwise) {
  table.read(key, otherwise);
  if (const char* const fault = joint_parts::direction_fault(otherwise))
    table.fail(*table.find(key), "'" + std::string(key) + "' " + fault);
  return normalize(otherwise);
}

JointWord read_joint_word(const TomlTable& table) {
  JointWord word = JointWord::ball;
  table.required("type",
                 "write type = \"ball\", \"fixed\", \"revolute\", \"prismatic\", \"universal\", \"wheel\", "
                 "\"distance\", \"generic\", \"gear\", \"rack\", \"pulley\" or \"target\"");
  for (const auto& [other, ours] : other_names)
    if (table.find("type")->value<std::string_view>() == other)
      table.fail(*table.find("type"),
                 "there is no joint of type '" + std::string(other) + "'; take \"" + std::string(ours) + "\"");
  table.read_choice<JointWord>("type", word, words);
  return word;
}

void check_joint_keys(const TomlTable& table, JointWord word) {
  for (const KeyUse& use : key_uses) {
    if ((use.types & bit(word)) || !table.has(use.key)) continue;
    std::string types;
    for (const auto& [name, other] : words)
      if (use.types & bit(other)) types += (types.empty() ? "" : ", ") + std::string(name);
    table.fail(*table.find(use.key), "a " + std::string(text_of(word)) + " joint has no '" + std::string(use.key) +
                                         "'; remove it, or choose another type (" + types + ")");
  }
}

void read_joint_axes(const TomlTable& table, JointWord word, JointDef& def) {
  if (word == JointWord::ball || word == JointWord::target) return;
  const JointDef preset = generic_of(word);
  def.type = word == JointWord::distance ? JointType::distance : JointType::generic;
  def.axes = preset.axes;
  if (word == JointWord::distance) return read_distance(table, def);
  if (word == JointWord::wheel) read_suspension(table, def);
  for (std::size_t i = 0; i < joint_axis_count; ++i) read_axis(table, i, def.axes[i]);
  read_motor(table, word, def);
  read_cone(table, word, def);
}

Quat read_joint_rotation(const TomlTable& table, JointWord word) {
  if (word != JointWord::fixed && word != JointWord::generic)
    table.required("axis", "where it points in the world, [x, y, z]; or write 'frame_a' and 'frame_b'");
  const Vec3 x = read_direction(table, "axis", {1, 0, 0});
  if (word != JointWord::wheel) return shortest_turn_to(x);
  const toml::node& node = *table.find("suspension");
  const TomlTable suspension = inner(table, node, "suspension", {"axis", "hertz", "damping_ratio", "lower", "upper"});
  const Vec3 z = read_direction(suspension, "axis", {0, 0, 1});
  if (!(abs(dot(x, z)) < 1e-3f))
    table.fail(node, "the suspension's axis must be at right angles to the wheel's 'axis'");
  return rotation_to(x, normalize(z - dot(x, z) * x));
}

}  // namespace fathom
