// A joint's type and axes in the [[joint]] tables of scene files.
#pragma once

#include <fathom/joint.hpp>

#include "scene/toml_reader.hpp"

namespace fathom {

/// A type as files name it: all but ball and distance are couplings or generic joints with preset axes.
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
/// Fails at the first key that this type of joint does not have.
void check_joint_keys(const TomlTable& table, JointWord word);
/// Sets the type and its axes: the type's presets, then the table's keys.
void read_joint_axes(const TomlTable& table, JointWord word, JointDef& def);
/// World orientation of the joint frames at the start: x along 'axis', z along a suspension.
Quat read_joint_rotation(const TomlTable& table, JointWord word);
/// A number or `inf`, which becomes `most`.
void read_or_infinite(const TomlTable& table, std::string_view key, float& value, float most);
/// The key's vector, normalised; it must not be zero. `otherwise` if the key is missing.
Vec3 read_direction(const TomlTable& table, std::string_view key, Vec3 otherwise);

}  // namespace fathom
