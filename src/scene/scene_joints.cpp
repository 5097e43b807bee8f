#include "scene/scene_joints.hpp"

#include <charconv>
#include <map>

#include "scene/couplings.hpp"
#include "scene/joint_axes.hpp"
#include "scene/suggest.hpp"
#include "world/validate.hpp"

namespace fathom {
namespace {

/// "plank.7" as "plank." and 7; none if the name does not end in a number.
struct Numbered {
  std::string_view base;
  std::uint64_t number = 0;

  std::string name(std::uint64_t steps) const { return std::string(base) + std::to_string(number + steps); }
};

std::optional<Numbered> numbered(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  if (dot == std::string_view::npos || name.size() - dot > 10) return {};
  Numbered parts{name.substr(0, dot + 1)};
  const char* const end = name.data() + name.size();
  const auto [stop, error] = std::from_chars(name.data() + dot + 1, end, parts.number);
  if (error != std::errc{} || stop != end) return {};
  return parts;
}

/// Reads [[joint]] tables in order.
class JointReader {
 public:
  JointReader(const TomlTable& root, Scene& scene) : root_(root), scene_(scene) {
    for (const NamedBody& named : scene.names) bodies_.emplace(named.name, named.body);
  }

  void read(const toml::table& node) {
    const TomlTable table(node, "[[joint]]", root_.file(),
                          {"type",
                           "a",
                           "b",
                           "point",
                           "anchor_a",
                           "anchor_b",
                           "hertz",
                           "damping_ratio",
                           "axis",
                           "frame_a",
                           "frame_b",
                           "x",
                           "y",
                           "z",
                           "twist",
                           "swing_y",
                           "swing_z",
                           "cone_angle",
                           "motor",
                           "suspension",
                           "steering",
                           "length",
                           "lower",
                           "upper",
                           "drive",
                           "collide_connected",
                           "user_data",
                           "repeat",
                           "axis_a",
                           "axis_b",
                           "ratio",
                           "direction",
                           "radius",
                           "wheel_a",
                           "wheel_b",
                           "break_force",
                           "break_torque",
                           "max_force",
                           "target"});
    SceneJoint joint;
    const JointWord word = read_joint_word(table);
    check_joint_keys(table, word);
    const std::string a = read_body(table, "a", joint.a), b = read_body(table, "b", joint.b);
    check_pair(table, joint);
    read_spring(table, word, joint.def);
    if (is_coupling(word))
      read_coupling(table, word, scene_, joint);
    else
      read_joint_axes(table, word, joint.def);
    read_or_infinite(table, "break_force", joint.def.break_force, unbreakable);
    read_or_infinite(table, "break_torque", joint.def.break_torque, unbreakable);
    if (word == JointWord::target) joint.def.collide_connected = true;
    table.read("collide_connected", joint.def.collide_connected);
    table.read("user_data", joint.def.user_data);
    const WorldFrame frame = is_coupling(word) ? WorldFrame{} : read_frames(table, word, joint);
    scene_.joints.push_back(joint);
    repeat(table, joint, frame, a, b);
  }

  /// Reads a table of [[exclude]].
  std::pair<std::size_t, std::size_t> read_excluded(const toml::table& node) const {
    const TomlTable table(node, "[[exclude]]", root_.file(), {"a", "b"});
    std::pair<std::size_t, std::size_t> pair;
    read_body(table, "a", pair.first);
    const std::string b = read_body(table, "b", pair.second);
    if (pair.first == pair.second)
      table.fail(*table.find("b"), "'" + b + "' is both bodies; exclude two different ones from each other");
    return pair;
  }

 private:
  /// A joint's frame in world axes, as far as the file gives it.
  struct WorldFrame {
    std::optional<Vec3> point;
    std::optional<Quat> rotation;
  };

  /// Finds the body that the key names; returns its name.
  std::string read_body(const TomlTable& table, std::string_view key, std::size_t& body) const {
    const toml::node& node = table.required(key, "the name of a [[body]]");
    std::string name;
    table.read(key, name);
    const auto found = bodies_.find(name);
    if (found == bodies_.end()) fail_unknown(table, node, name);
    body = found->second;
    return name;
  }

  [[noreturn]] void fail_unknown(const TomlTable& table, const toml::node& node, const std::string& name) const {
    if (bodies_.contains(name + ".0")) {
      std::uint64_t count = 1;
      while (bodies_.contains(name + "." + std::to_string(count))) ++count;
      table.fail(node, "'" + name + "' is repeated; this takes single bodies: name one of '" + name + ".0' to '" +
                           name + "." + std::to_string(count - 1) + "'");
    }
    std::vector<std::string_view> known;
    for (const auto& [candidate, body] : bodies_) known.push_back(candidate);
    const std::string_view meant = nearest(name, known);
    table.fail(node, "no [[body]] is named '" + name + "'" +
                         (meant.empty() ? "; give one this name" : "; did you mean '" + std::string(meant) + "'?"));
  }

  void check_pair(const TomlTable& table, const SceneJoint& joint) const {
    const auto dynamic = [&](std::size_t body) { return scene_.bodies[body].motion == MotionType::dynamic; };
    if (joint.a == joint.b)
      table.fail(*table.find("b"), "'a' and 'b' are the same body; a joint holds two different ones together");
    if (!dynamic(joint.a) && !dynamic(joint.b))
      table.fail(*table.find("b"), "neither 'a' nor 'b' is dynamic; a joint can move dynamic bodies alone");
  }

  static void read_spring(const TomlTable& table, JointWord word, JointDef& def) {
    if (word == JointWord::target) table.required("hertz", "the frequency (Hz) of the spring that pulls");
    table.read("hertz", def.hertz, word == JointWord::target ? Range::positive : Range::not_negative);
    table.read("damping_ratio", def.damping_ratio, Range::not_negative);
    if (table.has("damping_ratio") && def.hertz == 0)
      table.fail(*table.find("damping_ratio"), "a rigid joint has no damping ratio; give 'hertz' too, or remove it");
    read_or_infinite(table, "max_force", def.max_force, JointDef{}.max_force);
    if (const char* const fault = joint_force_fault(def)) table.fail(*table.find("max_force"), fault);
  }

  WorldFrame read_frames(const TomlTable& table, JointWord word, SceneJoint& joint) const {
    if (word == JointWord::target) {
      read_target(table, joint);
      return {};
    }
    if (table.has("frame_a") || table.has("frame_b")) {
      read_frame(table, "frame_a", joint.def.frame_a);
      read_frame(table, "frame_b", joint.def.frame_b);
      return {};
    }
    WorldFrame frame{read_anchors(table, word, joint), {}};
    if (joint.def.type == JointType::generic) {
      frame.rotation = read_joint_rotation(table, word);
      joint.turn_to(*frame.rotation, scene_.bodies);
    }
    return frame;
  }

  /// A provides the target, B is held at 'point', which is also the default target.
  void read_target(const TomlTable& table, SceneJoint& joint) const {
    if (scene_.bodies[joint.a].motion == MotionType::dynamic)
      table.fail(*table.find("a"), "the target is held by 'a', which must be static or kinematic");
    table.required("point", "where 'b' is held, in the world at the start (m)");
    Vec3 point;
    table.read("point", point);
    joint.anchor_at(point, scene_.bodies);
    table.read("target", point);
    const Pose& holder = scene_.bodies[joint.a].pose;
    joint.def.frame_a.position = inverse_rotate(normalize(holder.rotation), point - holder.position);
  }

  static void read_frame(const TomlTable& table, std::string_view key, Pose& frame) {
    for (const std::string_view other : {"point", "anchor_a", "anchor_b", "axis"})
      if (const toml::node* node = table.find(other))
        table.fail(*node, "a joint has either frames or '" + std::string(other) + "'; remove one");
    const toml::node& node =
        table.required(key,
                       "write {position = [x, y, z], rotation = [w, x, y, z]}, in body axes from the centre of "
                       "mass (m); x is the joint's axis");
    const TomlTable inner(table.as_table(node, key), std::string(key), table.file(), {"position", "rotation"});
    inner.read("position", frame.position);
    inner.read("rotation", frame.rotation);
  }

  /// Returns the joint's world point, if it is given by one.
  std::optional<Vec3> read_anchors(const TomlTable& table, JointWord word, SceneJoint& joint) const {
    if (!table.has("point")) {
      const std::string remedy = std::string("in body axes, from the centre of mass (m)") +
                                 (word == JointWord::distance ? "" : "; or write 'point', in the world");
      table.required("anchor_a", remedy);
      table.required("anchor_b", remedy);
      table.read("anchor_a", joint.def.frame_a.position);
      table.read("anchor_b", joint.def.frame_b.position);
      return {};
    }
    for (const std::string_view key : {"anchor_a", "anchor_b"})
      if (const toml::node* node = table.find(key))
        table.fail(*node, "a joint has either 'point' or '" + std::string(key) + "'; remove one");
    Vec3 point;
    table.read("point", point);
    joint.anchor_at(point, scene_.bodies);
    return point;
  }

  /// Repeats the joint between bodies with consecutive numbers. A body without a number is in all of the joints, which
  /// then move with the other body.
  void repeat(const TomlTable& table, SceneJoint joint, const WorldFrame& frame, const std::string& first_a,
              const std::string& first_b) {
    int count = 1;
    table.read("repeat", count, 1);
    if (count == 1) return;
    const std::optional<Numbered> a = numbered(first_a), b = numbered(first_b);
    const toml::node& node = *table.find("repeat");
    if (!a && !b) table.fail(node, "'repeat' increases a body's number; name one like 'plank.0' as 'a' or 'b'");
    const auto position = [&] { return scene_.bodies[b ? joint.b : joint.a].pose.position; };
    const Vec3 start = position();
    for (std::uint64_t i = 1; i < static_cast<std::uint64_t>(count); ++i) {
      if (a) joint.a = counted(table, node, a->name(i));
      if (b) joint.b = counted(table, node, b->name(i));
      check_pair(table, joint);
      if (frame.point) joint.anchor_at(*frame.point + (position() - start), scene_.bodies);
      if (frame.rotation) joint.turn_to(*frame.rotation, scene_.bodies);
      scene_.joints.push_back(joint);
    }
  }

  std::size_t counted(const TomlTable& table, const toml::node& node, const std::string& name) const {
    const auto found = bodies_.find(name);
    if (found == bodies_.end()) table.fail(node, "'repeat' comes to '" + name + "', and no [[body]] is named so");
    return found->second;
  }

  const TomlTable& root_;
  Scene& scene_;
  std::map<std::string, std::size_t, std::less<>> bodies_;
};

}  // namespace

void read_excluded(const TomlTable& root, Scene& scene) {
  const toml::node* node = root.find("exclude");
  if (!node) return;
  if (node->is_table()) root.fail(*node, "write [[exclude]] with two brackets: there may be several");
  const JointReader reader(root, scene);
  for (const toml::node& pair : root.as_array(*node, "exclude"))
    scene.excluded.push_back(reader.read_excluded(root.as_table(pair, "exclude")));
}

void read_joints(const TomlTable& root, Scene& scene) {
  const toml::node* node = root.find("joint");
  if (!node) return;
  if (node->is_table()) root.fail(*node, "write [[joint]] with two brackets: there may be several");
  JointReader reader(root, scene);
  for (const toml::node& joint : root.as_array(*node, "joint")) reader.read(root.as_table(joint, "joint"));
  if (!scene.joints.empty() && scene.world.partition == Partition::cells)
    root.fail(*node, "the partition 'cells' is for contacts alone; leave it out of [simulator], or the joints");
}

}  // namespace fathom
