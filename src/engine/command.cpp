#include "engine/command.hpp"

namespace fathom::engine {

void CommandList::append(const CommandList& other) {
  const auto first = static_cast<std::uint32_t>(definitions_.size());
  const auto first_joint = static_cast<std::uint32_t>(joints_.size());
  commands_.reserve(commands_.size() + other.commands_.size());
  for (Command command : other.commands_) {
    if (command.kind == CommandKind::add) command.definition += first;
    if (is_of_joint(command.kind)) command.definition += first_joint;
    commands_.push_back(command);
  }
  definitions_.insert(definitions_.end(), other.definitions_.begin(), other.definitions_.end());
  joints_.insert(joints_.end(), other.joints_.begin(), other.joints_.end());
}

}  // namespace fathom::engine
