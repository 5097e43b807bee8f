// The game's requests to the simulation: a list of commands, executed in order before a step. Nothing else changes the
// simulation, so it can run on its own thread, and a run can be recorded and replayed.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>
#include <fathom/joint.hpp>
#include <vector>

#include "check/check.hpp"

namespace fathom::engine {

/// A body as the game knows it. Valid from the request on; the simulation may add the body later. Reused indices get a
/// new generation.
struct BodyHandle {
  std::uint32_t index = 0xffffffffu;
  std::uint32_t generation = 0;

  friend bool operator==(BodyHandle, BodyHandle) = default;
};

enum class CommandKind : std::uint8_t {
  add,                ///< body `definition` of the list
  remove,             ///<
  set_pose,           ///< a: position, rotation
  set_velocity,       ///< a: linear, b: angular
  add_velocity,       ///< a: linear, b: angular, added to the current velocity
  force,              ///< a: N
  force_at,           ///< a: N, b: point
  torque,             ///< a: N·m
  impulse,            ///< a: N·s
  impulse_at,         ///< a: N·s, b: point
  angular_impulse,    ///< a: N·m·s
  wake,               ///<
  set_gravity,        ///< a: m/s², of the world
  set_gravity_scale,  ///< a.x
  set_damping,        ///< a.x: linear, a.y: angular
  set_material,       ///< a.x: friction, a.y: restitution, a.z: rolling resistance, b: surface velocity
  move_to,            ///< a: position, rotation
  join,               ///< joint `definition` of the list, from `body` to its other body
  change_joint,       ///< sets the joint identified by `body`, the other body and the user data to joint `definition`
  unjoin,             ///< removes that joint
  exclude,            ///< `body` and the other body of joint `definition`, which is otherwise ignored
  include,            ///< the same
};
inline constexpr int command_kind_count = static_cast<int>(CommandKind::include) + 1;
/// Whether a command's `definition` is an index into the list's joints.
inline constexpr bool is_of_joint(CommandKind kind) {
  return kind >= CommandKind::join && kind <= CommandKind::include;
}

/// The kind determines what the fields mean; units and axes are those of the `fathom::World` function of the same name.
struct Command {
  CommandKind kind = CommandKind::wake;
  BodyHandle body;
  Vec3 a, b;
  Quat rotation;
  std::uint32_t definition = 0;
};

/// A joint to another body; the definition's own bodies are ignored.
struct JointOrder {
  BodyHandle other;
  JointDef def;
};

class CommandList {
 public:
  void add(BodyHandle body, const BodyDef& definition) {
    push({CommandKind::add, body, {}, {}, {}, static_cast<std::uint32_t>(definitions_.size())});
    definitions_.push_back(definition);
  }
  /// `kind`: join or a later one.
  void joint(CommandKind kind, BodyHandle a, BodyHandle b, const JointDef& definition) {
    FATHOM_ASSERT(is_of_joint(kind));
    push({kind, a, {}, {}, {}, static_cast<std::uint32_t>(joints_.size())});
    joints_.push_back({b, definition});
  }
  void push(const Command& command) { commands_.push_back(command); }
  void append(const CommandList& other);
  void clear() { commands_.clear(), definitions_.clear(), joints_.clear(); }
  bool empty() const { return commands_.empty(); }

  const std::vector<Command>& commands() const { return commands_; }
  const std::vector<BodyDef>& definitions() const { return definitions_; }
  const std::vector<JointOrder>& joints() const { return joints_; }

 private:
  std::vector<Command> commands_;
  std::vector<BodyDef> definitions_;
  std::vector<JointOrder> joints_;
};

}  // namespace fathom::engine
