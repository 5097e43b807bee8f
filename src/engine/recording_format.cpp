#include "engine/recording_format.hpp"

#include <cstring>

#include "world/archive.hpp"
#include "world/joint_archive.hpp"
#include "world/shape_archive.hpp"

namespace fathom::engine {

std::vector<std::byte> to_bytes(const CommandList& list) {
  std::vector<std::byte> bytes;
  ByteWriter write(bytes);
  write(static_cast<std::uint64_t>(list.commands().size()), static_cast<std::uint64_t>(list.definitions().size()),
        static_cast<std::uint64_t>(list.joints().size()));
  for (const Command& c : list.commands()) write(c.kind, c.body, c.a, c.b, c.rotation, c.definition);
  ShapeWriter shapes(write);
  for (const BodyDef& definition : list.definitions()) write_body(write, shapes, definition);
  for (const JointOrder& joint : list.joints()) {
    write(joint.other);
    archive_joint(joint.def, write);
  }
  return bytes;
}

CommandList commands_from(std::span<const std::byte> bytes, const std::string& what) {
  ByteReader in(bytes, what);
  const auto commands = in.read<std::uint64_t>();
  const auto definitions = in.read<std::uint64_t>();
  const auto joints = in.read<std::uint64_t>();
  std::vector<Command> read;
  for (std::uint64_t i = 0; i < commands; ++i) {
    Command c;
    in(c.kind, c.body, c.a, c.b, c.rotation, c.definition);
    in.require(static_cast<int>(c.kind) < command_kind_count);
    in.require(c.kind != CommandKind::add || c.definition < definitions);
    in.require(!is_of_joint(c.kind) || c.definition < joints);
    read.push_back(c);
  }
  ShapeReader shapes(in);
  std::vector<BodyDef> bodies;
  for (std::uint64_t i = 0; i < definitions; ++i) bodies.push_back(read_body(in, shapes));
  std::vector<JointOrder> orders;
  for (std::uint64_t i = 0; i < joints; ++i) {
    const auto other = in.read<BodyHandle>();
    orders.push_back({other, read_joint(in)});
  }
  in.require(in.left() == 0);
  // Definitions are in the order of the commands that use them.
  CommandList list;
  for (const Command& c : read) {
    if (c.kind == CommandKind::add)
      list.add(c.body, bodies[c.definition]);
    else if (is_of_joint(c.kind))
      list.joint(c.kind, c.body, orders[c.definition].other, orders[c.definition].def);
    else
      list.push(c);
  }
  return list;
}

void state_words(const Pose& pose, const Velocity& velocity, std::uint32_t* words) {
  const float values[StateDelta::words_per_slot] = {
      pose.position.x,    pose.position.y,    pose.position.z,   pose.rotation.w,   pose.rotation.x,
      pose.rotation.y,    pose.rotation.z,    velocity.linear.x, velocity.linear.y, velocity.linear.z,
      velocity.angular.x, velocity.angular.y, velocity.angular.z};
  std::memcpy(words, values, sizeof values);
}

const char* word_name(std::size_t word) {
  constexpr const char* names[StateDelta::words_per_slot] = {
      "position.x",         "position.y",         "position.z",        "rotation.w",        "rotation.x",
      "rotation.y",         "rotation.z",         "linear velocity.x", "linear velocity.y", "linear velocity.z",
      "angular velocity.x", "angular velocity.y", "angular velocity.z"};
  return names[word];
}

const std::vector<std::byte>& StateDelta::encode(const World& world) {
  const auto poses = world.poses();
  const auto velocities = world.velocities();
  now_.resize(poses.size() * words_per_slot);
  for (std::size_t slot = 0; slot < poses.size(); ++slot)
    state_words(poses[slot], velocities[slot], now_.data() + slot * words_per_slot);
  words_.resize(now_.size());
  const std::size_t count = now_.size();
  bytes_.resize(count * 4);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t change = now_[i] ^ words_[i];
    for (std::size_t plane = 0; plane < 4; ++plane)
      bytes_[plane * count + i] = static_cast<std::byte>(change >> (8 * plane));
  }
  words_.swap(now_);
  return bytes_;
}

void StateDelta::decode(std::uint32_t slots, std::span<const std::byte> bytes) {
  const std::size_t count = slots * words_per_slot;
  words_.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t plane = 0; plane < 4; ++plane)
      words_[i] ^= static_cast<std::uint32_t>(bytes[plane * count + i]) << (8 * plane);
}

}  // namespace fathom::engine
