// What the [[joint]] tables of scene files say of a joint's type and axes.
#pragma once

#include <fathom/joint.hpp>

#include "scene/toml_reader.hpp"

namespace fathom {

/// A type as files name it: all but ball and distance are generic joints whose axes are set beforehand, or couplings.
enum class JointWord : std::uint8_t {
  ball,
  fixed,
  revolute,
  prismatic,
  universal,
  wheel,
  distance,
  generic,
  gear,
  rack,
  pulley,
  target
};
inline bool is_coupling(JointWord word) { return word >= JointWord::gear && word <= JointWord::pulley; }

JointWord read_joint_word(const TomlTable& table);
/// Fails at the first key that joints of this type do not have.
void check_joint_keys(const TomlTable& table, JointWord word);
/// Sets the type and the axes: what the word stands for, and what the table says besides.
void read_joint_axes(const TomlTable& table, JointWord word, JointDef& def);
/// Where the frames' axes point in the world at the start: x along 'axis', and z along a suspension.
Quat read_joint_rotation(const TomlTable& table, JointWord word);
/// A number that may be `inf`, which is then `most`.
void read_or_infinite(const TomlTable& table, std::string_view key, float& value, float most);
/// The vector of a key that must have a length, as a unit vector; `otherwise` where the key is missing.
Vec3 read_direction(const TomlTable& table, std::string_view key, Vec3 otherwise);

}  // namespace fathom
